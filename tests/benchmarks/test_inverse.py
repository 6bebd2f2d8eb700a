"""The benchmark of inverses: what it counts and compares is right, tried with a handful of targets."""

from __future__ import annotations

from collections.abc import Iterator
from types import ModuleType

import numpy as np
import pytest

from benchmarks import inverse
from benchmarks.solvers import Solver, _axes
from benchmarks.speed.arm import links
from kinegen.io.load import load
from kinegen.model.joint_bounds import joint_box
from kinegen.model.outputs import Kind, Quantity
from kinegen.runtime.extension import load_package
from kinegen.verify import closed_form_inverse as proof
from kinegen.verify import reference
from tests.builds.workshop import ROBOTS, make, set_machine


@pytest.fixture(scope="module")
def planar(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ModuleType]:
    """A package in NumPy."""
    folder = tmp_path_factory.mktemp("packages")
    with pytest.MonkeyPatch.context() as patch:
        set_machine(patch, folder / "cache")
        patch.setattr(proof, "TARGETS", 100)
        patch.setattr(proof, "FEWER", 100)
        built = make(
            ROBOTS / "planar_3r.yaml", folder, quantities=(Quantity.POSE, Quantity(Kind.INVERSE)), compile=False
        )
        yield load_package(built.folder)


@pytest.mark.parametrize("name", ["puma560", "ur5", "iiwa14", "panda"])
def test_other_tools_are_given_the_same_arm(name: str) -> None:
    """Turns about the axes, one after the other, along the offsets: the pose, and then the last frame."""
    robot = load(ROBOTS / f"{name}.yaml")
    axes, offsets, last = _axes(links(robot))
    q = np.random.default_rng(0).uniform(*np.array(joint_box(robot)).T)
    pose = np.eye(4)
    for axis, offset, angle in zip(axes, offsets, q):
        cross = np.cross(np.eye(3), axis)
        step = np.eye(4)
        step[:3, :3] += np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
        step[:3, 3] = offset
        pose = pose @ step
    pose[:3, 3] += pose[:3, :3] @ offsets[-1]

    np.testing.assert_allclose(pose @ last, reference.pose(robot, q[None])[0, 0], atol=1e-12)


def test_solutions_count_once_and_only_where_they_hold() -> None:
    robot = load(ROBOTS / "puma560.yaml")
    q = np.array([[0.1, -1.0, 0.5, 0.2, 0.3, 0.4], [0.3, -0.5, 0.2, -0.2, 0.6, 0.1]])
    targets = reference.pose(robot, q)[:, 0]
    twice = np.stack([q[0], q[0] + [0, 0, 2 * np.pi, 0, 0, 0], q[0] + 1e-3])

    assert inverse._holding(robot, targets, [twice, q[1:]]) == 2
    assert inverse._holding(robot, targets, [q[:0], q[:0]]) == 0
    assert inverse._holding(robot, targets, [q[1:], q[:1]]) == 0


def test_what_a_closed_form_misses_is_counted(planar: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    q = inverse._random("planar_3r", 50)
    assert inverse._missed("planar_3r", planar, q) == (0, 0)
    assert inverse._unsolved("planar_3r", planar, inverse._singular("planar_3r")[::1000]) == 0

    solve = planar.inverse
    monkeypatch.setattr(planar, "inverse", lambda targets: (solve(targets)[0] + 1e-3, solve(targets)[1]))
    assert inverse._missed("planar_3r", planar, q)[0] > 45
    assert inverse._unsolved("planar_3r", planar, q) == 50


def test_a_row_names_the_peer_and_both_counts(planar: ModuleType) -> None:
    solver = Solver("peer", 20, lambda targets, _: inverse._solve(planar, True, targets, _), inverse._valid)
    what, found, asked = inverse._compared("planar_3r", solver, solver)

    assert what.startswith("planar_3r: peer: ")
    assert what.split(", ")[1].split()[0] == found.split(", ")[-1]
    assert asked == "faster, no fewer"
