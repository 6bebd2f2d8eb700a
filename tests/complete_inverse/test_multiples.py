"""Poses of joints at multiples of 90, 45 and 30 degrees: solutions share angles there, and none may be lost."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from kinegen.io.load import load
from kinegen.model.joint_bounds import joint_box, reach
from kinegen.model.robot import TOOL, Robot
from kinegen.verify import reference
from tests.complete_inverse.conftest import Packages, file_of
from tests.complete_inverse.starts import Array, apart, solutions_from_starts
from tests.complete_inverse.test_solutions import BACKENDS, nearest, some

ARMS = ("jaco2", "crx10ial", "xarm6", "gen3_lite", "general_6r", "gofa5", "hollow_wrist")
REGULAR = 1e-3

# Regular poses, in degrees, at which some or all solutions were lost once.
LOST = {
    "xarm6": [(0, 90, 0, 0, 180, 180), (0, -90, 0, 0, -90, -90), (0, -90, 0, 90, 90, 180), (0, -90, 0, 180, 0, 180)],
    "gofa5": [(0, 0, 0, 0, -90, 180), (0, 90, 0, 0, 90, 90), (0, 90, -90, 0, -90, 0)],
}


def regular(robot: Robot, q: Array) -> Array:
    """Those of the joint vectors where the Jacobian is far from singular."""
    jacobian = reference.Kinematics(robot, q).jacobian(TOOL)
    jacobian[:, :3] /= reach(robot, robot.tips)
    found: Array = q[np.linalg.svd(jacobian, compute_uv=False)[:, -1] > REGULAR]
    return found


def planted(robot: Robot, step: int, count: int, seed: int) -> Array:
    """Regular joint vectors of multiples of a step within the limits, a joint at a time."""
    random = np.random.default_rng(seed)
    columns = []
    for low, high in np.degrees(joint_box(robot)):
        values = [value for value in range(-720, 721, step) if low - 1e-9 <= value <= high + 1e-9]
        columns.append(np.clip(random.choice(values, 6 * count), low, high))
    return regular(robot, np.radians(np.stack(columns, axis=1)))[:count]


@pytest.mark.parametrize("step", [90, 45, 30])
@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("name", some(ARMS))
def test_no_regular_pose_of_such_multiples_is_missed(name: str, backend: str, step: int, package: Packages) -> None:
    robot = load(file_of(name))
    q = planted(robot, step, 1500 if backend == "c" else 60, seed=step)
    solutions, valid = package(name, backend).complete_inverse(reference.pose(robot, q)[:, 0])

    assert len(q) == (1500 if backend == "c" else 60)
    assert nearest(q, solutions, valid).max() < 1e-6


@pytest.mark.parametrize("scale", [1e-12, 1e-9, 1e-6, 1e-4])
def test_no_pose_beside_them_is_missed(scale: float, package: Packages) -> None:
    robot, random = load(file_of("jaco2")), np.random.default_rng(9)
    low, high = np.array(joint_box(robot)).T
    q = np.concatenate([planted(robot, step, 600, seed=step + 1) for step in (90, 45, 30)])
    q = np.clip(q + scale * random.normal(size=q.shape) * random.integers(0, 2, q.shape), low, high)
    solutions, valid = package("jaco2", "c").complete_inverse(reference.pose(robot, q)[:, 0])

    assert nearest(q, solutions, valid).max() < 1e-6


@pytest.mark.parametrize(
    "name", [name if name == "xarm6" else pytest.param(name, marks=pytest.mark.long) for name in LOST]
)
@pytest.mark.parametrize("backend", ["numpy", pytest.param("c", marks=pytest.mark.long)])
def test_home_poses_have_the_solutions_that_were_lost_once(name: str, backend: str, package: Packages) -> None:
    robot, q = load(file_of(name)), np.radians(LOST[name])
    solutions, valid = package(name, backend).complete_inverse(reference.pose(robot, q)[:, 0])

    assert len(regular(robot, q)) == len(q)
    assert nearest(q, solutions, valid).max() < 1e-6


@pytest.mark.parametrize("backend", ["numpy", pytest.param("c", marks=pytest.mark.long)])
def test_a_curve_of_solutions_leaves_room_for_isolated_ones(backend: str, package: Packages) -> None:
    """A target has at most 16 isolated solutions, and a curve would take all places of a result."""
    robot = load(file_of("quarter_twists"))
    homes = np.radians([[0.0, 90, -90, 180, 180, 0], [90, -90, -90, -180, -180, 180]])
    # Rounding decides which of them come first.
    q = np.repeat(homes, 20, axis=0) + 1e-12 * np.random.default_rng(0).normal(size=(40, 6))
    solutions, valid = package("quarter_twists", backend).complete_inverse(reference.pose(robot, q)[:, 0])

    assert len(regular(robot, q)) == len(q)
    assert valid.all()
    assert all(len(regular(robot, found)) < 16 for found in solutions)
    assert nearest(q, solutions, valid).max() < 1e-6


@pytest.mark.parametrize("name", some(("jaco2", "xarm6", "gofa5", "crx10ial", "gen3_lite")))
def test_c_and_numpy_have_the_same_regular_solutions(name: str, package: Packages) -> None:
    robot = load(file_of(name))
    q = np.concatenate([planted(robot, step, 30, seed=step + 2) for step in (90, 45, 30)])
    targets = reference.pose(robot, q)[:, 0]
    both = [package(name, backend).complete_inverse(targets) for backend in BACKENDS]
    for row, ((one, there), (other, real)) in itertools.product(range(len(q)), itertools.permutations(both)):
        for each in regular(robot, one[row, there[row]]):
            assert min(apart(each, found) for found in other[row, real[row]]) < 1e-6


@pytest.mark.long
@pytest.mark.parametrize("name", ["gofa5", "crx10ial"])
def test_newton_steps_from_many_starts_lead_to_no_other_solution(name: str, package: Packages) -> None:
    robot = load(file_of(name))
    q = np.concatenate([planted(robot, step, 6, seed=step + 3) for step in (90, 45)])
    targets = reference.pose(robot, q)[:, 0]
    solutions, valid = package(name, "c").complete_inverse(targets)
    for target, found, real in zip(targets, solutions, valid, strict=True):
        for other in regular(robot, solutions_from_starts(robot, target, starts=400, seed=3)):
            assert min(apart(other, each) for each in found[real]) < 1e-5
