"""A machine tool with actuators in LinuxCNC: motors in place of joints, limits of both; headers from the contract."""

from __future__ import annotations

import ctypes
import math
import shutil
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from kinegen.backends.controllers.machine_tool import mill_for
from kinegen.errors import KinegenError
from kinegen.io.load import load, loads
from kinegen.model.robot import Robot
from tests.controllers.cone import motors, trunnion
from tests.controllers.modules import Module, Numbers, write_linuxcnc
from tests.controllers.packages import file_of

pytestmark = pytest.mark.controllers

NAME = "coupled_mill"
HOME = (0.0, 0.0, 400.0, 0.0, 0.0)
BOX = np.array([(-200, 200), (-150, 150), (50, 600), (-30, 120), (-300, 300)], dtype=float)


@cache
def mill() -> Robot:
    return load(file_of(NAME))


def samples(count: int = 30) -> Numbers:
    low, high = BOX.T
    return np.asarray(low + (high - low) * np.random.default_rng(5).random((count, 5)))


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_linuxcnc(tmp_path_factory.mktemp(NAME), mill(), solved=False)


@pytest.fixture
def folder(package: Path, tmp_path: Path) -> Path:
    """A copy of the package, so that each test has a module of its own."""
    return Path(shutil.copytree(package, tmp_path / NAME))


@pytest.fixture
def module(folder: Path) -> Module:
    return Module(folder)


def compared(module: Module, tool: float = 37.5) -> None:
    """Motors are those of the joints that were written out, in both kinematics."""
    module.set("tool-offset.z", tool)
    begin = trunnion(np.zeros(5))[:3, 3]
    for each in samples():
        pose, world = trunnion(each), module.world(motors(each))
        np.testing.assert_allclose(world[:3], pose[:3, 3] - tool * pose[:3, 2] - begin + [0, 0, tool], atol=1e-9)
        np.testing.assert_allclose(world[[3, 5]], each[3:], atol=1e-9)
        np.testing.assert_allclose(module.joints(world, motors(each + 0.1)), motors(each), atol=1e-6)
        assert module.library.kinematicsSwitch(1) == 0
        words = module.world(motors(each))
        np.testing.assert_allclose(words[[0, 1, 2, 3, 5]], each, atol=1e-9)
        np.testing.assert_array_equal(words[[4, 6, 7, 8]], 0.0)
        np.testing.assert_allclose(module.joints(words, motors(each + 0.1)), motors(each), atol=1e-6)
        assert module.library.kinematicsSwitch(0) == 0


def test_joints_of_linuxcnc_are_the_motors_in_both_kinematics(module: Module) -> None:
    compared(module)


@pytest.mark.parametrize(
    "change",
    [
        ("q[0] = world->a", "q[0] = world->c"),
        ("world->c = q[1]", "world->c = q[0]"),
        ("joint[i] = within[i] * machine[i]", "joint[i] = within[i]"),
        ("coupled_mill_actuators_to_joints(motors, params, q)", "for (int i = 0; i < MOTORS; i++) q[i] = motors[i]"),
    ],
    ids=["word", "joint", "unit", "motors"],
)
def test_an_altered_module_is_noticed(change: tuple[str, str], folder: Path) -> None:
    with pytest.raises(AssertionError):
        compared(Module(folder, change, ["-Wno-unused-parameter"]))


@pytest.mark.parametrize("kind", [0, 1])
@pytest.mark.parametrize(
    ("there", "place", "sign"),
    [
        ([400, -90, 300, 10, 20], 0, 1),  # the stroke of X, which no motor knows
        ([-400, 90, 300, 10, 20], 0, -1),
        ([300, 200, 300, 10, 20], 0, 1),  # the motor of the belt at 500 mm
        ([300, 200, 300, 10, 20], 1, 1),
        ([-300, -200, 300, 10, 20], 1, -1),
        ([0, 0, 800, 10, 20], 2, 1),
        ([0, 0, 0, 10, 20], 2, -1),
        ([0, 0, 300, 120, 20], 3, 1),
        ([0, 0, 300, -30, 20], 3, -1),
        ([0, 0, 300, 0, 360], 4, 1),
    ],
)
def test_limits_of_joints_and_of_motors_are_met_exactly_and_not_passed(
    there: list[float], place: int, sign: int, kind: int, module: Module
) -> None:
    """A target that rounding alone puts outside leads to the limit; a thousandth of a unit beyond is refused."""
    joints = np.array(there, dtype=float)
    module.library.kinematicsSwitch(kind)
    world = module.world(motors(joints))
    found = module.joints(world, motors(joints))
    np.testing.assert_allclose(found, motors(joints), atol=1e-6)
    assert -500 <= found[1] <= 500
    assert -57600 <= found[2] <= 0
    beyond = joints.copy()
    beyond[place] += sign * 1e-3
    result, kept = module.inverse(module.world(motors(beyond)), motors(joints))
    assert result == -1
    assert module.message == f"{NAME}: out of reach, or outside joint limits\n"
    np.testing.assert_array_equal(kept, motors(joints))


def test_a_runtime_parameter_of_a_drive_is_a_pin(module: Module) -> None:
    """A screw of another pitch."""
    module.set("param.pitch", 8.0)
    for kind in (0, 1):
        module.library.kinematicsSwitch(kind)
        for each in samples(5):
            world = module.world(motors(each, 8.0))
            np.testing.assert_allclose(world[[3, 5]], each[3:], atol=1e-9)
            np.testing.assert_allclose(module.joints(world, motors(each, 8.0)), motors(each, 8.0), atol=1e-6)


@pytest.mark.parametrize("wrong", [math.nan, math.inf, -math.inf, 1e308])
def test_what_is_not_a_number_is_refused_and_moves_nothing(wrong: float, module: Module) -> None:
    joints = motors(np.array([10.0, 20.0, 300.0, 5.0, 7.0]))
    for kind in (0, 1):
        module.library.kinematicsSwitch(kind)
        world = module.world(joints)
        for place in (0, 1, 2, 3, 5):
            bad = world.copy()
            bad[place] = wrong
            result, found = module.inverse(bad, joints)
            assert result == -1
            assert module.message
            np.testing.assert_array_equal(found, joints)
            assert module.inverse(world, joints)[0] == 0
        for place in range(5):
            moved = joints.copy()
            moved[place] = wrong
            assert module.forward(moved)[0] == -1
        before = module.pins[f"{NAME}_kins.param.pitch"].number
        for pitch in (wrong, 0.0):
            module.set("param.pitch", pitch)
            assert module.inverse(world, joints)[0] == -1
        module.set("param.pitch", before)


@pytest.mark.parametrize("kind", [0, 1])
def test_no_motor_is_faster_than_its_pin_says(kind: int, module: Module) -> None:
    module.library.kinematicsSwitch(kind)
    place, other = (ctypes.c_double * 9)(), (ctypes.c_double * 9)()
    begin, end = (np.array([10.0, 20.0, 300.0, 5.0, 7.0 + turned]) for turned in (0.0, 0.1))
    ahead = module.world(motors(end), other)
    module.world(motors(begin), place)
    place[:] = list(ahead)
    module.set("servo-period", 1e6)
    module.set("max-speed.3", 2900.0)
    assert module.inverse(ahead, motors(begin))[0] == 0
    result, found = module.inverse(place, motors(begin))
    assert result == -1
    assert module.message == f"{NAME}: joint 3 would be faster than {NAME}_kins.max-speed.3\n"
    np.testing.assert_array_equal(found, motors(begin))
    module.set("max-speed.3", 3100.0)
    assert module.inverse(place, motors(begin))[0] == 0


def test_the_example_begins_at_motors_of_its_home_with_their_limits(folder: Path) -> None:
    sections = (folder / "sim" / f"{NAME}.ini").read_text().split("[JOINT_")[1:]

    def entries(key: str) -> list[float]:
        return [float(section.split(f"\n{key} = ")[1].split()[0]) for section in sections]

    np.testing.assert_allclose(entries("HOME"), motors(np.array(HOME)))
    assert entries("MIN_LIMIT") == [-700, -500, -57600, -20000, -270000]
    assert entries("MAX_LIMIT") == [700, 500, 0, 20000, 252000]
    assert ["TYPE = LINEAR" in section for section in sections] == [True, True, False, False, True]
    readme = " ".join((folder / "README.md").read_text().split())
    assert "| 2 | screw | deg | -57600 to 0 |" in readme
    assert "| Z | z_axis | mm | 0 to 800 |" in readme


def test_an_example_begins_where_its_motors_can_be(tmp_path: Path) -> None:
    """With the middle of the strokes outside the limits of a motor."""
    text = file_of(NAME).read_text().replace("limits: [-500, 500]", "limits: [100, 500]")
    folder = write_linuxcnc(tmp_path, loads(text, NAME), solved=False)
    ini = (folder / "sim" / f"{NAME}.ini").read_text()
    begin = float(ini.split("[JOINT_1]")[1].split("\nHOME = ")[1].split()[0])
    assert 100 < begin < 500


def test_motors_that_are_not_one_for_each_joint_are_refused() -> None:
    text = file_of(NAME).read_text()
    text = text.replace("    lower: number\n", "    lower: number\n    spare: angle\n")
    text = text.replace("value: pitch*screw/(-2*pi)", "value: pitch*(screw + spare)/(-2*pi)")
    text = text.replace("offsets: [30, 0]}\n", "offsets: [30, 0]}\n  inverse: {spare: 0, screw: -2*pi*z_axis/pitch}\n")
    with pytest.raises(KinegenError, match="it has 6 readings of actuators for 5 joints"):
        mill_for(loads(text, NAME), solved=False)
