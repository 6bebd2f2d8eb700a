"""All solutions are there, all of them lead to the target, and what has none gets none."""

from __future__ import annotations

import sys
from typing import Any

import numpy as np
import pytest

from kinegen.io.load import load
from kinegen.model.joint_bounds import joint_box, reach
from kinegen.verify import reference
from kinegen.verify.inverse_targets import pose_errors, unchecked
from tests.builds.workshop import ROBOTS
from tests.complete_inverse.conftest import Packages
from tests.complete_inverse.starts import Array, apart, solutions_from_starts

BACKENDS = ("c", "numpy")
ARMS = ("jaco2", "crx10ial", "xarm6", "gen3_lite", "general_6r", "manseur_doty", "ur5")
FREE = ("crx10ial", "general_6r", "manseur_doty")
"""Arms without limits, whose solutions another method can count."""

QUICK = ("jaco2", "general_6r")
"""Arms that every run of the suite builds; the others take half a minute together."""


def some(names: tuple[str, ...]) -> list[Any]:
    """The names of arms, of which those that are not quick are left to `make test-long`."""
    return [name if name in QUICK else pytest.param(name, marks=pytest.mark.long) for name in names]


# Manseur and Doty 1989, from memory to six digits; the rotation is made orthonormal before it is used.
PRINTED = [
    [-0.760117, -0.641689, 0.102262, -1.140175],
    [0.133333, 0.0, 0.991071, 0.0],
    [-0.635959, 0.766965, 0.085558, 0.0],
]


def planted(name: str, count: int, seed: int = 4) -> tuple[Array, Array]:
    """Random joint vectors of a robot and their poses."""
    robot = load(ROBOTS / f"{name}.yaml")
    low, high = np.array(joint_box(robot)).T
    q = np.random.default_rng(seed).uniform(low, high, (count, 6))
    return q, reference.pose(robot, q)[:, 0]


def nearest(q: Array, solutions: Array, valid: Array) -> Array:
    """How far the nearest solution of each target is from a joint vector."""
    off = np.abs((solutions - q[:, None] + np.pi) % (2 * np.pi) - np.pi).max(axis=2)
    found: Array = np.where(valid, off, np.inf).min(axis=1)
    return found


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("name", some(ARMS))
def test_there_and_back(name: str, backend: str, package: Packages) -> None:
    q, targets = planted(name, 1000 if backend == "c" else 50)
    solutions, valid = package(name, backend).complete_inverse(targets)
    rows, places = np.nonzero(valid)
    robot = load(ROBOTS / f"{name}.yaml")
    errors = pose_errors(reference.pose(robot, solutions[rows, places])[:, 0], targets[rows])

    assert nearest(q, solutions, valid).max() < 1e-6
    assert (errors < 2e-10 * np.array([reach(robot, robot.tips), 1.0])).all()
    assert not solutions[~valid].any()


@pytest.mark.parametrize("name", some(FREE))
def test_another_method_finds_the_same_solutions(name: str, package: Packages) -> None:
    robot = load(ROBOTS / f"{name}.yaml")
    for target in planted(name, 2, seed=8)[1]:
        solutions, valid = package(name, "c").complete_inverse(target)
        others = solutions_from_starts(robot, target, starts=400, seed=1)

        assert len(others) == valid.sum()
        assert all(min(apart(other, each) for each in solutions[valid]) < 1e-6 for other in others)


@pytest.mark.parametrize("backend", BACKENDS)
def test_manseur_and_doty_have_sixteen(backend: str, package: Packages) -> None:
    target = np.vstack([PRINTED, [0, 0, 0, 1]])
    left, _, right = np.linalg.svd(target[:3, :3])
    target[:3, :3] = left @ right
    solutions, valid = package("manseur_doty", backend).complete_inverse(target)

    assert valid.all()
    assert min(apart(one, other) for i, one in enumerate(solutions) for other in solutions[:i]) > 0.01


def test_c_and_numpy_find_the_same(package: Packages) -> None:
    _, targets = planted("general_6r", 60)
    (c, in_c), (n, in_numpy) = (package("general_6r", backend).complete_inverse(targets) for backend in BACKENDS)

    assert (in_c == in_numpy).all()
    assert all(
        min(apart(q, other) for other in n[row, in_numpy[row]]) < 1e-7 for row in range(60) for q in c[row, in_c[row]]
    )


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("name", ["jaco2", "general_6r"])
def test_singular_poses_are_solved(name: str, backend: str, package: Packages) -> None:
    """Two solutions meet where the Jacobian is singular; the pose there has a double root."""
    module = package(name, backend)
    low, high = np.array(joint_box(load(ROBOTS / f"{name}.yaml"))).T
    start = np.random.default_rng(2).uniform(low, high, (60, 6))
    one, other = start.copy(), start.copy()
    other[:, 2] += 0.5
    sign = np.sign(np.linalg.det(module.fk_jacobian(one)[1]))
    crosses = sign * np.linalg.det(module.fk_jacobian(other)[1]) < 0
    one, other, sign = one[crosses], other[crosses], sign[crosses]
    for _ in range(60):
        middle = (one + other) / 2
        same = sign * np.linalg.det(module.fk_jacobian(middle)[1]) > 0
        one[same], other[~same] = middle[same], middle[~same]
    inside = ((one >= low) & (one <= high)).all(axis=1)
    solutions, valid = module.complete_inverse(module.fk(one[inside]))

    assert inside.sum() >= 4
    assert nearest(one[inside], solutions, valid).max() < 1e-4


@pytest.mark.long
@pytest.mark.parametrize("backend", BACKENDS)
def test_quarter_turns_are_solved(backend: str, package: Packages) -> None:
    """There the elimination of a special arm loses rank; every reachable pose gets a solution all the same."""
    module, robot = package("crx10ial", backend), load(ROBOTS / "crx10ial.yaml")
    q = np.random.default_rng(3).integers(-1, 3, (200 if backend == "c" else 20, 6)) * (np.pi / 2)
    _, valid = module.complete_inverse(reference.pose(robot, q)[:, 0])

    assert valid.any(axis=1).all()


@pytest.mark.parametrize("backend", BACKENDS)
def test_what_is_no_pose_or_out_of_reach_has_no_solution(backend: str, package: Packages) -> None:
    module = package("general_6r", backend)
    targets = np.repeat(planted("general_6r", 1)[1], 7, axis=0)
    targets[0, 0, 0], targets[1, 2, 3], targets[2, 1, 3] = np.nan, np.inf, np.nan
    targets[3, :3, :3] *= 2
    targets[4, :3, 0] *= -1
    targets[5, 0, 3] += 10
    targets[6, :, :] = 0
    with unchecked(sys.modules[f"{module.__name__}._runtime._complete_inverse"]):
        solutions, valid = module.complete_inverse(targets)

    assert not valid.any()
    assert not solutions.any()


def test_python_refuses_what_is_no_pose(package: Packages) -> None:
    module = package("general_6r", "c")
    with pytest.raises(ValueError, match=r"complete_inverse: base_T_tool has entries that are not finite"):
        module.complete_inverse(np.full((4, 4), np.nan))
    with pytest.raises(ValueError, match=r"complete_inverse: base_T_tool has shape \(3, 3\)"):
        module.complete_inverse(np.eye(3))


@pytest.mark.parametrize("backend", BACKENDS)
def test_any_batch_and_any_number_of_threads(backend: str, package: Packages) -> None:
    module = package("general_6r", backend)
    targets = planted("general_6r", 12)[1].reshape(3, 4, 4, 4)
    solutions, valid = module.complete_inverse(targets)
    again = module.complete_inverse(targets, threads=2)
    alone = module.complete_inverse(targets[1, 2])
    empty = module.complete_inverse(targets[:0])

    assert solutions.shape == (3, 4, 16, 6)
    assert valid.shape == (3, 4, 16)
    assert (again.solutions == solutions).all()
    assert apart(alone.solutions[0], solutions[1, 2, 0]) < 1e-9
    assert empty.solutions.shape == (0, 4, 16, 6)


def test_limits_hold(package: Packages) -> None:
    robot = load(ROBOTS / "jaco2.yaml")
    solutions, valid = package("jaco2", "c").complete_inverse(planted("jaco2", 300)[1])
    for variable in robot.variables:
        if variable.limits is not None:
            low, high = joint_box(robot)[variable.index]
            values = solutions[valid][:, variable.index]
            assert values.min() >= low - 1e-8
            assert values.max() <= high + 1e-8


@pytest.mark.long
@pytest.mark.parametrize("name", ARMS)
def test_none_of_many_is_missed(name: str, package: Packages) -> None:
    q, targets = planted(name, 100_000, seed=11)
    solutions, valid = package(name, "c").complete_inverse(targets, threads=0)

    assert (nearest(q, solutions, valid) > 1e-5).sum() == 0


@pytest.mark.long
@pytest.mark.parametrize("name", FREE)
def test_another_method_finds_no_more_at_many_poses(name: str, package: Packages) -> None:
    robot = load(ROBOTS / f"{name}.yaml")
    _, targets = planted(name, 200, seed=12)
    solutions, valid = package(name, "c").complete_inverse(targets)
    for target, found, real in zip(targets, solutions, valid, strict=True):
        for other in solutions_from_starts(robot, target, starts=100, seed=2):
            assert min(apart(other, each) for each in found[real]) < 1e-5
