"""The kinematics module inside LinuxCNC: built with its tools, loaded by halrun, called as motion calls it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from kinegen.backends.controllers.controller import Controller
from kinegen.backends.controllers.machine import samples
from kinegen.verify import reference
from tests.controllers.genserkins import compare
from tests.controllers.halrun import MODULES, SERIAL, ask, installed, write_probe
from tests.controllers.packages import kernels, machine, write_package

pytestmark = [pytest.mark.controllers, SERIAL]

ARMS = ("puma560", "ur5", "scara4", "scara", "palletiser3", "puma560_mm")


@pytest.fixture(scope="module")
def probe(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    with installed(write_probe(tmp_path_factory.mktemp("probe"))):
        yield


def text(numbers: Sequence[float] | NDArray[np.float64]) -> str:
    return " ".join(repr(float(number)) for number in numbers)


def in_machine(name: str, q: Sequence[float] | NDArray[np.float64]) -> NDArray[np.float64]:
    """Joint values in degrees and millimetres."""
    return np.array([value / joint.scale for value, joint in zip(q, machine(name, Controller.LINUXCNC).joints)])


def rotation(a: float, b: float, c: float) -> NDArray[np.float64]:
    """R = Rz(c) Ry(b) Rx(a) as a product of matrices, in degrees."""
    (sa, ca), (sb, cb), (sc, cc) = ((math.sin(x), math.cos(x)) for x in map(math.radians, (a, b, c)))
    x = np.array([[1, 0, 0], [0, ca, -sa], [0, sa, ca]])
    y = np.array([[cb, 0, sb], [0, 1, 0], [-sb, 0, cb]])
    z = np.array([[cc, -sc, 0], [sc, cc, 0], [0, 0, 1]])
    return np.asarray(z @ y @ x)


@pytest.mark.parametrize("name", ARMS)
def test_halrun_goes_to_the_world_and_back(name: str, probe: None, tmp_path: Path) -> None:
    go_there_and_back(name, tmp_path)


def go_there_and_back(name: str, place: Path, change: tuple[str, str] = ("", "")) -> None:
    """Poses are those of the reference in LinuxCNC's world; joints beside them lead back."""
    made = machine(name, Controller.LINUXCNC)
    arm = kernels(name).robot
    vectors = [np.asarray(q) + 0.013 for q in samples(arm, 60)]
    folder = write_package(place, name, Controller.LINUXCNC)
    glue = folder / f"{name}_glue.c"
    assert change[0] in glue.read_text()
    glue.write_text(glue.read_text().replace(*change) if change[0] else glue.read_text())
    with installed(folder) as module:
        load = [f"loadrt {module}"]
        first = [f"use {MODULES}/{module}.so"]
        first += [f"forward {arm.dof} {text(in_machine(name, q))} 0 0 0 0 0 0" for q in vectors]
        found, *forward = ask(place, load, first)
        worlds = [np.array(row[1:7], dtype=float) for row in forward]
        back = [
            f"inverse {arm.dof} {text(in_machine(name, q + 0.01))} {text(world)}"
            for q, world in zip(vectors, worlds, strict=True)
        ]
        _, *inverse = ask(place, load, [first[0], *back])

    assert found == ["found"]
    assert [row[0] for row in (*forward, *inverse)] == ["0"] * 120
    for q, world, row in zip(vectors, worlds, inverse, strict=True):
        pose = reference.pose(arm, [q])[0, 0]
        np.testing.assert_allclose(world[:3], pose[:3, 3] * made.millimetres, atol=1e-9)
        if made.coordinates == "XYZABC":
            np.testing.assert_allclose(rotation(*world[3:]), pose[:3, :3], atol=1e-12)
        elif made.coordinates == "XYZC":
            a, b = map(math.degrees, made.tilt)
            np.testing.assert_allclose(rotation(a, b, world[5]), pose[:3, :3], atol=1e-12)
        np.testing.assert_allclose(np.array(row[1 : arm.dof + 1], dtype=float), in_machine(name, q), atol=1e-6)


def test_angles_of_the_world_stay_next_to_those_before(probe: None, tmp_path: Path) -> None:
    """A tool that has turned by more than half a turn, or looks straight up or down, keeps counting."""
    q = np.radians([30.0, -50, 60, 20, 40, 10])
    joints = text(in_machine("puma560", q))
    with installed(write_package(tmp_path, "puma560", Controller.LINUXCNC)) as module:
        use = f"use {MODULES}/{module}.so"
        load = [f"loadrt {module}"]
        _, plain = ask(tmp_path, load, [use, f"forward 6 {joints} 0 0 0 0 0 0"])
        a, b, c = (float(word) for word in plain[4:7])
        _, turned, other = ask(
            tmp_path,
            load,
            [
                use,
                f"forward 6 {joints} 0 0 0 {a + 350} {b - 5} {c - 725}",
                f"forward 6 {joints} 0 0 0 {a + 178} {178 - b} {c - 182}",
            ],
        )

    np.testing.assert_allclose([float(word) for word in turned[4:7]], [a + 360, b, c - 720], atol=1e-9)
    np.testing.assert_allclose([float(word) for word in other[4:7]], [a + 180, 180 - b, c - 180], atol=1e-9)


def test_beside_genserkins_it_is_quick_and_does_not_fail_at_the_wrist(probe: None, tmp_path: Path) -> None:
    """The same arm in the same run: a pose and the joints for it, from joints up to 15 degrees away."""
    anywhere, straight = compare(tmp_path / "anywhere", straight=False), compare(tmp_path / "straight", straight=True)

    assert anywhere.failures.ours == straight.failures.ours == 0
    assert anywhere.ticks.ours <= 0.12 * anywhere.ticks.theirs
    assert straight.failures.theirs >= 100


@pytest.mark.parametrize(
    "change",
    [
        ("pose[8] = -sb", "pose[8] = sb"),
        ("read_joints(joint, q); /* the current", "for (int i = 0; i < 6; i++) q[i] = 0.0; /* the current"),
        ("world->tran.y = pose[7]", "world->tran.y = pose[3]"),
        ("_RADIAN 57.29577951308232", "_RADIAN 57.2957"),
    ],
    ids=["sign", "seed", "row", "degrees"],
)
def test_an_altered_module_is_noticed(change: tuple[str, str], probe: None, tmp_path: Path) -> None:
    with pytest.raises(AssertionError):
        go_there_and_back("puma560", tmp_path, change)
