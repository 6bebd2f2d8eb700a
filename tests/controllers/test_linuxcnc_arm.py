"""Arms in LinuxCNC: tools, runtime parameters, motors and speeds; with headers that are printed from the contract."""

from __future__ import annotations

import ctypes
import math
import os
import re
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from kinegen.backends.controllers.hal import INWARDS, OUTWARDS, parameters_of, tool_lengths
from kinegen.backends.controllers.machine import home_of
from kinegen.errors import KinegenError
from kinegen.io.load import load, loads
from kinegen.model.robot import Robot
from kinegen.verify import reference
from tests.controllers.modules import Joints, Module, Numbers, turn, write_linuxcnc
from tests.controllers.packages import file_of, need, run

pytestmark = pytest.mark.controllers

SCARA = """\
kinegen: 1
name: scara_tool
convention: standard
units: {length: m, angle: deg}
parameters:
  tool_length: {value: 0.05, runtime: true}
  rail: {value: 0.3, runtime: true}
joints:
  - {name: j1, a: 0.4, alpha: 0, d: rail, theta: q, limits: [-170, 170]}
  - {name: j2, a: 0.35, alpha: 180, d: 0, theta: q, limits: [-150, 150]}
  - {name: j3, a: 0, alpha: 0, d: q, theta: 10, limits: [0, 0.18], type: prismatic}
  - {name: j4, a: 0, alpha: 0, d: tool_length, theta: q, limits: [-360, 360]}
"""

SPATIAL = """\
kinegen: 1
name: spatial_tool
convention: standard
units: {length: mm, angle: deg}
parameters:
  tip: {value: 200, runtime: true}
joints:
  - {name: j1, a: 0, alpha: 90, d: 400, theta: q, limits: [-170, 170]}
  - {name: j2, a: 500, alpha: 0, d: 0, theta: q, limits: [-100, 150]}
  - {name: j3, a: tip, alpha: 0, d: 0, theta: q, limits: [-150, -5]}
"""

UPPER = """\
kinegen: 1
name: upper_arm
convention: standard
units: {length: mm, angle: deg}
parameters:
  upper: {value: 500, runtime: true}
joints:
  - {name: j1, a: 0, alpha: 90, d: 400, theta: q, limits: [-170, 170]}
  - {name: j2, a: upper, alpha: 0, d: 0, theta: q, limits: [-100, 150]}
  - {name: j3, a: 450, alpha: 0, d: 0, theta: q, limits: [-150, -5]}
"""

DRIVEN = """\
kinegen: 1
name: driven_arm
convention: standard
units: {length: mm, angle: deg}
joints:
  - {name: waist,    a: 150, alpha: 90, d: 600, theta: q, limits: [-170, 170]}
  - {name: shoulder, a: 900, alpha: 0,  d: 0, theta: q, limits: [20, 130]}
  - {name: elbow,    a: 950, alpha: 0,  d: 0, theta: q, limits: [-175, -2]}
actuators:
  readings:
    m1: {dimension: number, limits: [-200000, 200000]}
    m2: {dimension: angle, limits: [20, 130]}
    m3: {dimension: angle, limits: [-110, 60]}
  joints:
    - {joint: waist, form: gear, actuator: m1, ratio: 131072/360}
    - {joint: shoulder, form: gear, actuator: m2, ratio: 1}
    - {joint: elbow, form: gear, actuator: m3, ratio: 1, offset: -shoulder}
"""
"""Its third motor counts the angle of the forearm from the ground, its first one increments."""

TEXTS = {"scara_tool": SCARA, "spatial_tool": SPATIAL, "driven_arm": DRIVEN, "upper_arm": UPPER}
ARMS = ("puma560", "leaning6", "scara4", "palletiser3", *TEXTS)


@cache
def arm(name: str) -> Robot:
    return loads(TEXTS[name], name) if name in TEXTS else load(file_of(name))


def units(name: str) -> Numbers:
    """LinuxCNC's units in that of each of its joints: degrees, millimetres, increments."""
    robot = arm(name)
    length = {"m": 1000.0, "mm": 1.0}[robot.units.length]
    if robot.actuators.readings:
        return np.array([1.0 if each.dimension == "number" else 180 / math.pi for each in robot.actuators.readings])
    return np.array([length if each.type == "prismatic" else 180 / math.pi for each in robot.variables])


def vectors(name: str, count: int = 25) -> list[Numbers]:
    """LinuxCNC's joints (J,) beside the home of an arm."""
    robot = arm(name)
    home = np.array(home_of(robot))
    if robot.actuators.readings:
        home = reference.readings(robot, [home])[0].astype(float)
    spread = np.where(units(name) == 1000.0, 0.02, 0.15)
    random = np.random.default_rng(3)
    found = [home + spread * (2 * random.random(len(home)) - 1) for _ in range(count)]
    return [each * units(name) for each in found]


def pose_of(name: str, joints: Joints, params: dict[str, float] | None = None) -> Numbers:
    """The pose (4, 4) in millimetres by the reference."""
    robot = arm(name)
    values = np.array(joints) / units(name)
    if robot.actuators.readings:
        values = reference.Actuation(robot, [values]).joints[0]
    pose = np.array(reference.pose(robot, [values], params)[0, 0])
    pose[:3, 3] *= {"m": 1000.0, "mm": 1.0}[robot.units.length]
    return pose


def rotation(world: Numbers) -> Numbers:
    return (turn(2, world[5]) @ turn(1, world[4]) @ turn(0, world[3]))[:3, :3]


def compared(name: str, module: Module, tool: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> None:
    """The world is the tip by the reference, with the offset that the interpreter adds, and its joints lead back."""
    has_tool = any(pin.endswith("tool-offset.x") for pin in module.pins)
    for axis, offset in zip("xyz", tool, strict=True):
        if has_tool:
            module.set(f"tool-offset.{axis}", offset)
    for joints in vectors(name):
        pose, world = pose_of(name, joints), module.world(joints)
        # Out of the flange: the offset's axes are the tool's, turned by half a turn about x.
        tip = pose[:3, 3] - pose[:3, :3] @ (np.array([1, -1, -1]) * tool)
        expected = tip + np.array(tool) if has_tool and arm(name).dof > 3 else pose[:3, 3] + np.array(tool) * has_tool
        np.testing.assert_allclose(world[:3], expected, atol=1e-9)
        if arm(name).dof == 6:
            np.testing.assert_allclose(rotation(world), pose[:3, :3], atol=1e-12)
        beside = joints + 0.5 * np.minimum(units(name), 60.0) / 60.0
        np.testing.assert_allclose(module.joints(world, beside), joints, atol=1e-6, rtol=1e-10)


@pytest.mark.parametrize("name", ARMS)
def test_the_world_is_the_tip_of_the_tool(name: str, tmp_path: Path) -> None:
    module = Module(write_linuxcnc(tmp_path, arm(name), solved=True))
    compared(name, module)
    compared(name, module, (3.0, -5.0, 40.0))


@pytest.mark.parametrize(
    ("name", "has"),
    [("puma560", True), ("scara4", True), ("palletiser3", False), ("scara_tool", True), ("spatial_tool", True)],
)
def test_offsets_of_tools_have_pins_where_the_kinematics_can_follow_them(
    name: str, *, has: bool, tmp_path: Path
) -> None:
    module = Module(write_linuxcnc(tmp_path, arm(name), solved=True))
    assert (f"{name}_kins.tool-offset.z" in module.pins) is has


def test_a_tool_that_hangs_down_moves_nothing_when_its_offset_comes_into_effect(tmp_path: Path) -> None:
    module = Module(write_linuxcnc(tmp_path, arm("scara4"), solved=True))
    joints = vectors("scara4")[0]
    world = module.world(joints)
    module.set("tool-offset.z", 75.0)
    np.testing.assert_allclose(module.world(joints), world, atol=1e-9)


def test_runtime_parameters_are_pins_in_the_units_of_the_machine(tmp_path: Path) -> None:
    module = Module(write_linuxcnc(tmp_path, arm("scara_tool"), solved=True))
    assert module.pins["scara_tool_kins.param.tool-length"].number == pytest.approx(50.0)
    assert module.pins["scara_tool_kins.param.rail"].number == pytest.approx(300.0)
    joints = vectors("scara_tool")[0]
    module.set("param.tool-length", 80.0)
    module.set("param.rail", 310.0)

    world = module.world(joints)

    expected = pose_of("scara_tool", joints, {"tool_length": 0.08, "rail": 0.31})[:3, 3]
    np.testing.assert_allclose(world[:3], expected, atol=1e-9)
    np.testing.assert_allclose(module.joints(world, joints + 0.1), joints, atol=1e-6)


def test_a_parameter_and_an_offset_may_share_the_length_of_the_tool(tmp_path: Path) -> None:
    folder = write_linuxcnc(tmp_path, arm("scara_tool"), solved=True)
    module = Module(folder)
    joints, worlds = vectors("scara_tool")[0], []
    for length, offset in ((80.0, 0.0), (0.0, 80.0), (30.0, 50.0)):
        module.set("param.tool-length", length)
        module.set("tool-offset.z", offset)
        worlds.append(module.world(joints)[:3] - np.array([0, 0, offset]))
    np.testing.assert_allclose(worlds, [worlds[0]] * 3, atol=1e-9)
    hal = (folder / "sim" / "scara_tool.hal").read_text()
    assert "setp scara_tool_kins.param.tool-length 0" in hal
    assert "param.rail" not in hal  # a height, along which the tool hangs too


@pytest.mark.parametrize(
    ("name", "signs", "lengths"),
    [
        ("scara_tool", OUTWARDS, ["tool_length"]),  # and not `rail`, a height along which the tool hangs too
        ("scara_tool", INWARDS, []),  # it would grow into the holder
        ("spatial_tool", (), []),
        ("tooled6", OUTWARDS, []),  # angles of the tool that are set at run time turn them away
    ],
)
def test_a_parameter_is_the_length_of_the_tool_where_it_is_behind_the_last_joint_and_along_its_axis(
    name: str, signs: tuple[str, ...], lengths: list[str]
) -> None:
    found = parameters_of(arm(name), arm(name), signs)
    assert [parameter.name for parameter in found if parameter.is_tool] == lengths


def test_the_length_of_a_tool_that_an_arm_is_solved_for_follows_the_tool_table(tmp_path: Path) -> None:
    """The pin of the parameter and the offset get the same signal; then the program's words are the tip."""
    module = Module(write_linuxcnc(tmp_path, arm("spatial_tool"), solved=True))
    joints = vectors("spatial_tool")[0]
    module.set("param.tip", 230.0)
    module.set("tool-offset.z", 230.0)
    tip = pose_of("spatial_tool", joints, {"tip": 230.0})[:3, 3]
    np.testing.assert_allclose(module.world(joints)[:3], tip + np.array([0, 0, 230.0]), atol=1e-9)


@pytest.mark.parametrize(
    ("name", "lengths"),
    [
        ("spatial_tool", {"tip": "along"}),
        ("coupled3", {"tool_x": "", "tool_z": "up"}),  # its file has -50 for a tool that hangs
        ("scara_tool", {"tool_length": "down", "rail": "up"}),
        ("upper_arm", {"upper": ""}),
    ],
)
def test_the_way_a_parameter_moves_the_tip_decides_how_the_tool_table_sets_it(
    name: str, lengths: dict[str, str]
) -> None:
    robot = arm(name)
    found = tool_lengths(robot, robot.runtime_parameters, ())
    assert dict(zip(lengths, map(str, found), strict=True)) == lengths


def test_a_parameter_that_moves_the_tip_up_follows_the_tool_table_through_a_gain_of_minus_one(tmp_path: Path) -> None:
    folder = write_linuxcnc(tmp_path, arm("coupled3"), solved=True)
    readme = " ".join((folder / "README.md").read_text().split())
    assert "`tool_z` moves the tip up by what it grows: connect `param.tool-z` through a gain of -1" in readme
    assert "param.tool-x` directly" not in readme
    module = Module(folder)
    bare = module.world(np.array([10.0, 40.0, 0.0]))  # with the tool of the file, 50 mm below the flange
    module.set("param.tool-z", -80.0)
    module.set("tool-offset.z", 80.0)
    words = module.world(np.array([10.0, 40.0, 0.0]))[:3] - np.array([0, 0, 80.0])
    np.testing.assert_allclose(words, bare[:3] - np.array([0, 0, 30.0]), atol=1e-9)


def test_no_parameter_is_connected_to_the_tool_table_if_none_is_the_length_of_a_tool(tmp_path: Path) -> None:
    readme = " ".join((write_linuxcnc(tmp_path, arm("upper_arm"), solved=True) / "README.md").read_text().split())
    assert "so none can be connected to the tool table" in readme
    assert "pin of that parameter" not in readme


def test_joints_of_linuxcnc_are_motors_and_their_limits_those_of_motors(tmp_path: Path) -> None:
    folder = write_linuxcnc(tmp_path, arm("driven_arm"), solved=True)
    ini = (folder / "sim" / "driven_arm.ini").read_text()
    sections = ini.split("[JOINT_")[1:]

    assert [section.split("MIN_LIMIT = ")[1].split()[0] for section in sections] == ["-200000", "20", "-110"]
    assert ["TYPE = LINEAR" in section for section in sections] == [True, False, False]
    module = Module(folder)
    joints = vectors("driven_arm")[0]
    world = module.world(joints)
    moved = joints + np.array([0.0, 3.0, 0.0])  # the upper arm alone: the forearm keeps its angle from the ground
    beside = module.world(moved)
    turned = 900.0 * (np.cos(np.radians(moved[1])) - np.cos(np.radians(joints[1])))
    assert np.hypot(*beside[:2]) - np.hypot(*world[:2]) == pytest.approx(turned, abs=1e-9)


@pytest.mark.parametrize("wrong", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("name", ["puma560", "scara_tool", "palletiser3", "driven_arm"])
def test_what_is_not_a_number_is_refused_and_moves_nothing(name: str, wrong: float, tmp_path: Path) -> None:
    module = Module(write_linuxcnc(tmp_path, arm(name), solved=True))
    joints = vectors(name)[0]
    world = module.world(joints)
    words = [0, 1, 2, *([5] if arm(name).dof == 4 else [3, 4, 5] if arm(name).dof == 6 else [])]
    for place in words:
        bad = world.copy()
        bad[place] = wrong
        result, found = module.inverse(bad, joints)
        assert result == -1
        assert "is not a finite number" in module.message
        np.testing.assert_array_equal(found, joints)
        assert module.inverse(world, joints)[0] == 0
    for place in range(len(joints)):
        moved = joints.copy()
        moved[place] = wrong
        assert module.forward(moved)[0] == -1
        assert module.inverse(world, moved)[0] == -1
    for pin in (each for each in module.pins if ".param." in each or ".tool-offset." in each):
        before = module.pins[pin].number
        module.pins[pin].number = wrong
        assert module.forward(joints)[0] == module.inverse(world, joints)[0] == -1
        module.pins[pin].number = before


@pytest.mark.parametrize("name", ["puma560", "driven_arm"])
def test_no_joint_is_faster_than_its_pin_says_and_ends_of_moves_are_only_looked_at(name: str, tmp_path: Path) -> None:
    module = Module(write_linuxcnc(tmp_path, arm(name), solved=True))
    place, other = (ctypes.c_double * 9)(), (ctypes.c_double * 9)()
    joints = vectors(name)[0]
    ahead = joints + np.array([36.0 if name == "driven_arm" else 0.1, *[0.0] * (len(joints) - 1)])
    world = module.world(ahead, other)
    module.world(joints, place)
    place[:] = list(world)
    change = abs(ahead[0] - joints[0])
    module.set("servo-period", 1e6)
    module.set("max-speed.0", 0.9 * change * 1000)

    assert module.inverse(world, joints)[0] == 0
    result, found = module.inverse(place, joints)
    assert result == -1
    assert module.message == f"{name}: joint 0 would be faster than {name}_kins.max-speed.0\n"
    np.testing.assert_array_equal(found, joints)
    for pin in ("max-speed.0", "servo-period"):
        before = module.pins[f"{name}_kins.{pin}"].number
        module.set(pin, math.nan)
        assert module.inverse(place, joints)[0] == -1
        module.set(pin, before)
    for limit in (0.0, -1.0, change * 1000, math.inf):
        module.set("max-speed.0", limit)
        assert module.inverse(place, joints)[0] == 0


def test_what_cannot_be_reached_says_so_once(tmp_path: Path) -> None:
    module = Module(write_linuxcnc(tmp_path, arm("puma560"), solved=True))
    joints = vectors("puma560")[0]
    world = module.world(joints)
    far = world + np.array([9000.0, *[0.0] * 8])

    assert module.inverse(far, joints)[0] == -1
    assert module.message == "puma560: out of reach, or outside joint limits\n"
    assert module.inverse(far, joints)[0] == -1
    assert module.message == ""
    assert module.inverse(world, joints)[0] == 0


def test_a_module_has_the_functions_that_motion_looks_for_and_no_others(tmp_path: Path) -> None:
    library = Module(write_linuxcnc(tmp_path, arm("puma560"), solved=True)).library
    for name in (
        "kinematicsForward",
        "kinematicsInverse",
        "kinematicsType",
        "kinematicsSwitchable",
        "kinematicsSwitch",
    ):
        assert hasattr(library, name)
    assert library.kinematicsSwitchable() == 0
    assert library.kinematicsType() == 4
    for name in ("kinematicsToolFrame", "kinematicsWorkFrame", "kinematicsJacobian"):
        assert not hasattr(library, name)


def test_lengths_in_inches(tmp_path: Path) -> None:
    module = Module(
        write_linuxcnc(tmp_path, arm("scara_tool"), solved=True), flags=[f"-DSCARA_TOOL_MACHINE_UNITS={1000 / 25.4}"]
    )
    joints = vectors("scara_tool")[0].copy()
    millimetres = pose_of("scara_tool", joints)[:3, 3]
    joints[2] /= 25.4
    module.set("tool-offset.z", 2.0)
    down = np.array([0, 0, 2.0])
    np.testing.assert_allclose(module.world(joints)[:3], millimetres / 25.4 - down + down, atol=1e-9)
    assert module.pins["scara_tool_kins.param.rail"].number == pytest.approx(300 / 25.4)


def test_parameters_may_have_the_names_of_units(tmp_path: Path) -> None:
    """Macros of the module begin with the name of the robot, so that they replace no member of the parameters."""
    text = SCARA.replace("tool_length", "RADIAN").replace("rail", "MACHINE_UNITS")
    folder = write_linuxcnc(tmp_path, loads(text, "scara.yaml"), solved=True)
    defined = re.findall(r"#define (\w+)", (folder / "scara_tool_glue.c").read_text())
    assert defined == ["SCARA_TOOL_MACHINE_UNITS", "SCARA_TOOL_RADIAN"]
    module = Module(folder)
    assert module.pins["scara_tool_kins.param.RADIAN"].number == pytest.approx(50.0)
    assert module.pins["scara_tool_kins.param.MACHINE-UNITS"].number == pytest.approx(300.0)


def test_the_line_for_inches_is_compiled_after_a_build_without_it(tmp_path: Path) -> None:
    need("halcompile", "gcc", "make")
    folder = write_linuxcnc(tmp_path, arm("scara_tool"), solved=True)
    (line,) = re.findall(r"^EXTRA_CFLAGS.*$", (folder / "README.md").read_text(), re.MULTILINE)
    assert line == f"EXTRA_CFLAGS += -DSCARA_TOOL_MACHINE_UNITS={1000 / 25.4}"
    run(["make", "modules"], folder)
    before = (folder / "scara_tool_glue.o").read_bytes()
    makefile = folder / "Makefile"
    makefile.write_text(makefile.read_text() + line + "\n")
    later = (folder / "scara_tool_glue.o").stat().st_mtime + 2
    os.utime(makefile, (later, later))

    run(["make", "modules"], folder)

    assert (folder / "scara_tool_glue.o").read_bytes() != before
    run(["make", "clean"], folder)
    assert not [path.name for path in folder.iterdir() if path.suffix in (".o", ".so", ".tmp", ".sym", ".ver")]


def test_names_that_hal_does_not_take_are_refused(tmp_path: Path) -> None:
    text = SCARA.replace("tool_length", "length_of_the_tool_from_flange").replace("scara_tool", "scara_with_tools")
    with pytest.raises(
        KinegenError, match="has 58 characters, and HAL takes 47; give the robot or the parameter a shorter"
    ):
        write_linuxcnc(tmp_path, loads(text, "scara.yaml"), solved=True)


@pytest.mark.parametrize(
    "change",
    [
        ("world->tran.x += tool[0]", "world->tran.x -= tool[0]"),
        ("(row[2] * -tool[2])", "(row[2] * tool[2])"),
        ("pose[(4 * i) + 3] -= (tool[i] + apart[i])", "pose[(4 * i) + 3] -= (tool[i] - apart[i])"),
        ("values[1] / SCARA_TOOL", "values[0] / SCARA_TOOL"),
    ],
    ids=["added", "turned", "inverse", "parameter"],
)
def test_an_altered_module_is_noticed(change: tuple[str, str], tmp_path: Path) -> None:
    module = Module(write_linuxcnc(tmp_path, arm("scara_tool"), solved=True), change)
    with pytest.raises(AssertionError):
        compared("scara_tool", module, (3.0, -5.0, 40.0))
