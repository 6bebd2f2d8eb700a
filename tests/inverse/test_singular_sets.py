"""A solution that is called valid leads to its target, at every distance from every singular set of its family."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
import sympy as sp

from kinegen.derive.inverse.singular_configurations import alignments, boundaries
from kinegen.derive.singularities.loci import singular_loci
from kinegen.derive.singularities.singular_points import lengths_of
from kinegen.io.load import load, loads
from kinegen.model.joint_bounds import reach
from kinegen.model.outputs import Kind, Quantity
from kinegen.model.robot import TOOL, Robot
from kinegen.verify import reference
from kinegen.verify.singular_samples import DECADES, approaching
from tests.inverse.arms import Arm, Floats, arm_of, distances, errors, evaluate, joint_vectors

ROBOTS = Path(__file__).parents[2] / "robots"
INVERSE = Quantity(Kind.INVERSE)
ACCEPTED = 1e-12
"""Radians, and parts of the reach."""

SINGLE = 3e-5

_HEAD = "kinegen: 1\nname: arm\nconvention: standard\nunits: {length: m, angle: deg}\n"


def _rows(*rows: tuple[object, object, object], head: str = "") -> str:
    joints = (
        f"  - {{name: j{place}, theta: q, d: {d}, a: {a}, alpha: {alpha}}}"
        for place, (d, a, alpha) in enumerate(rows, 1)
    )
    return "\n".join([_HEAD + head + "joints:", *joints])


def _five(shift: str, twist: float = 90) -> str:
    """A waist, three parallel axes and a roll, with the hand beside the plane of the waist."""
    rows = [(0.0686, 0, twist), (shift, 0.1468, 0), (0, 0.1775, 0), (0, 0, 90), (0.0772, 0, 0)]
    return _rows(*rows).replace("name: j4, theta: q", "name: j4, theta: q + 90")


_SEVEN = [(0.3, 0, -90), (0, 0, 90), (0.328, 0, -90), (0, 0, 90), (0.2765, 0, -90), (0, 0, 90), (0.1525, 0, 0)]
_TWIN = [(0.34, 0, -90), (0, 0, 90), (0.4, 0, 90), (0, 0, -90), (0.4, 0, -90), (0, 0, 90), (0.126, 0, 0)]
_MEETING = [(0.3, 0, -90), (0.12, 0.3, 60), (0.1, 0.1, -90), (0.35, 0, 90), (0, 0, -90), (0.1, 0, 0)]
_OFFSET = [(0, 0.11, -90), (0, 0.43, 0), (-0.07, 0.37, 90), (0.29, 0, -90), (0, 0, 90), (0.29, 0, 0)]
_RUNTIME = "parameters: {d: {value: 0.29, runtime: true}, e: {value: -0.29, runtime: true}}\n"

ARMS = {
    "axes 1 and 2 meet": _rows(*_MEETING),
    "seven joints, the last one given": _rows(*_SEVEN, head="redundancy: j7\n"),
    "seven joints, the first one given": _rows(*_SEVEN, head="redundancy: j1\n"),
    "seven joints, links of equal length": _rows(*_TWIN, head="redundancy: j7\n"),
    "seven joints, arm angle": _rows(*_SEVEN, head="redundancy: arm_angle\n"),
    "offset waist and a shift": _rows(*_OFFSET),
    "runtime links of opposite signs": _rows((0, 0, 90), (0, "d", 0), (0, "e", 0), head=_RUNTIME),
    "five joints, a small shift": _five("0.0002"),
    "five joints, a shift": _five("0.02"),
    "five joints, skew waist": _five("0.02", 60),
    **{path.stem: path.read_text() for path in (ROBOTS / f"{name}.yaml" for name in ("puma560", "ur5", "stanford"))},
}
"""One arm of each way to be solved, and of what is special about it."""

FEW = ("five joints, a small shift", "runtime links of opposite signs")


@cache
def robot_of(name: str) -> Robot:
    return loads(ARMS[name], "arm.yaml")


@cache
def arm(name: str) -> Arm:
    return arm_of(robot_of(name))


def solved(name: str, q: Floats, kind: type = float, noise: float = 0.0) -> tuple[Floats, Floats, Floats]:
    """The solutions for the poses of joint vectors, which are valid, and how far they miss: rad, or parts of reach."""
    robot = robot_of(name)
    poses = reference.pose(robot, q)[:, 0]
    room = noise * np.array([1, 1, 1, reach(robot)])
    poses[:, :3] += np.random.default_rng(6).uniform(-room, room, (len(q), 3, 4))
    given = reference.redundancy(robot, q).astype(kind) if robot.redundancy else None
    solutions, valid = evaluate(arm(name), poses.astype(kind), given)
    off = errors(arm(name), np.nan_to_num(solutions.astype(float)), poses) / max(1.0, reach(robot))
    return solutions, valid, np.where(valid != 0, off, 0)


@pytest.mark.parametrize("name", ARMS)
def test_every_solution_leads_to_its_target_at_every_distance_from_every_singular_set(name: str) -> None:
    approach = approaching(robot_of(name), INVERSE)
    _, valid, off = solved(name, approach.points)

    assert len(approach.points) >= 4 * (DECADES + 1)
    assert off.max() < ACCEPTED
    assert (valid != 0).any(axis=1).all()


@pytest.mark.parametrize("name", ARMS)
def test_so_does_every_solution_in_single_precision(name: str) -> None:
    _, valid, off = solved(name, approaching(robot_of(name), INVERSE).points, np.float32)

    assert off.max() < SINGLE
    assert (valid != 0).any(axis=1).all()


@pytest.mark.parametrize(("kind", "accepted"), [(float, ACCEPTED), (np.float32, SINGLE)])
@pytest.mark.parametrize("name", ARMS)
def test_so_does_every_solution_for_a_pose_that_was_computed_in_its_number_type(
    name: str, kind: type, accepted: float
) -> None:
    """Small entries of such a pose are known to no more digits than the others."""
    points = approaching(robot_of(name), INVERSE).points
    _, valid, off = solved(name, points, kind, float(np.finfo(kind).eps))

    assert off.max() < accepted
    # A folded elbow of links that are nearly equal is beside targets that are out of reach.
    assert (valid != 0).any(axis=1).mean() > (0.95 if kind is np.float32 else 1 - 1e-9)


@pytest.mark.parametrize("distance", [1e-7, 1e-9, 1e-10, 1e-11, 1e-12, 1e-13, 0.0])
@pytest.mark.parametrize("name", [name for name in ARMS if name.startswith("five joints")])
def test_a_hand_on_the_waist_that_points_along_it_is_approached_without_a_loss(name: str, distance: float) -> None:
    """Several factors vanish there together: the hand points along axis 1, and its axis is as near to it as it gets."""
    robot = robot_of(name)
    q = joint_vectors(robot, 400, 7)
    q[:, 1:4] = _over_the_waist(q[:, 1])
    q += distance * np.random.default_rng(2).normal(size=q.shape)
    _, valid, off = solved(name, q, noise=float(np.finfo(float).eps))

    assert (valid != 0).any(axis=1).all()
    assert off.max() < ACCEPTED


def _over_the_waist(shoulder: Floats) -> Floats:
    """Joints 2 to 4 that bring the hand of `_five` over axis 1, pointing up, from a value of joint 2."""
    cosine = -0.1468 * np.cos(shoulder) / 0.1775
    elbow = np.arccos(cosine) - shoulder
    return np.column_stack([shoulder, elbow, -shoulder - elbow])


def test_places_where_several_factors_vanish_together_are_approached() -> None:
    """A hand that points along axis 1, over or under it: its axis is turned by the waist alone."""
    robot = robot_of("five joints, a shift")
    approach = approaching(robot, INVERSE)
    poses = reference.pose(robot, approach.points[approach.decades == DECADES])[:, 0]
    upright = np.hypot(poses[:, 0, 2], poses[:, 1, 2]) < 1e-12

    assert (upright & (np.abs(np.hypot(poses[:, 0, 3], poses[:, 1, 3]) - 0.02) < 1e-12)).sum() >= 4


@pytest.mark.parametrize("name", FEW)
def test_joint_vectors_are_among_the_solutions_for_their_poses(name: str) -> None:
    q = joint_vectors(robot_of(name), 2000, 3)
    solutions, valid, off = solved(name, q)
    own = np.where(valid != 0, distances(arm(name), solutions, q), np.inf).min(axis=1)

    assert own.max() < 1e-6
    assert off.max() < ACCEPTED


@pytest.mark.parametrize("distance", 10.0 ** -np.arange(1, 17))
def test_the_point_on_the_first_axis_is_approached_without_a_loss(distance: float) -> None:
    """These joint values bring the wrist's centre of this arm to axis 1."""
    q = np.array([[0.3, 1.8664680316 + distance, -1.8620727187, 0.5, 0.6, 0.7]])
    _, valid, off = solved("axes 1 and 2 meet", q)

    assert valid.any()
    assert off.max() < ACCEPTED


@pytest.mark.parametrize("angle", [1e-9, 3e-10, 1e-10, 1e-11, 1e-12, 4e-13, 1e-13, 1e-15, 0.0])
def test_a_wrist_that_is_nearly_in_line_reaches_its_target(angle: float) -> None:
    q = joint_vectors(robot_of("puma560"), 200, 5)
    q[:, 4] = angle
    _, valid, off = solved("puma560", q)

    assert off.max() < ACCEPTED
    assert (valid != 0).any(axis=1).all()


def test_each_shoulder_of_five_joints_has_a_plane_of_its_own() -> None:
    """A hand that points nearly down is in the plane of the other shoulder but for so little."""
    q = joint_vectors(robot_of("five joints, a shift"), 500, 8)
    for off_vertical in (1e-4, 1e-6, 1e-8):
        q[:, 3] = -q[:, 1] - q[:, 2] + off_vertical
        solutions, valid, off = solved("five joints, a shift", q)
        own = np.where(valid != 0, distances(arm("five joints, a shift"), solutions, q), np.inf).min(axis=1)

        assert off.max() < ACCEPTED
        assert own.max() < 1e-6


def test_a_target_of_five_joints_may_be_beside_its_plane() -> None:
    """What is written with seven digits is not in the plane to sixteen."""
    robot = robot_of("five joints, a shift")
    q = joint_vectors(robot, 500, 9)
    poses = reference.pose(robot, q)[:, 0]
    poses[:, :3, 3] += np.random.default_rng(4).uniform(-5e-8, 5e-8, (500, 3))
    solutions, valid = evaluate(arm("five joints, a shift"), poses)
    off = np.where(valid != 0, errors(arm("five joints, a shift"), solutions, poses), 0)

    assert (valid != 0).any(axis=1).all()
    assert off.max() < 1e-6


def test_all_singular_sets_of_an_arm_are_approached() -> None:
    """The elbow stretched and folded, the wrist in line, and the wrist's centre beside the waist."""
    robot, family = robot_of("puma560"), arm("puma560").family
    approach = approaching(robot, INVERSE)
    on_sets = approach.points[approach.decades == DECADES]
    least = np.linalg.svd(reference.Kinematics(robot, on_sets).jacobian(TOOL), compute_uv=False)[:, -1]
    joints = [(index, value) for index, values in (*boundaries(family), *alignments(family)) for value in values]
    beside = np.array([np.abs(np.sin((on_sets[:, index] - value) / 2)) for index, value in joints])

    reached = [found for found, (index, _) in zip(beside.min(axis=1), joints, strict=True) if index == 4]
    assert max(reached[:1]) < 1e-12
    assert beside[:2].min() < 1e-7
    assert least[(beside > 1e-2).all(axis=0)].min() < 1e-7


@pytest.mark.parametrize("name", ["puma560", "ur5"])
def test_every_factor_of_the_determinant_is_approached(name: str) -> None:
    """Whatever the program of the inverse divides by."""
    robot = robot_of(name)
    approach = approaching(robot, INVERSE)
    on_sets = approach.points[approach.decades == DECADES]
    joints = [sp.Symbol(variable.name, real=True) for variable in robot.variables]
    factors = [each for (each,) in singular_loci(robot, robot.root, TOOL).sets or ()]
    values = [sp.lambdify([joints], each.subs(lengths_of(robot)))(on_sets.T) for each in factors]

    assert len(factors) == 3
    assert all((np.abs(value) < 1e-12).sum() >= 2 for value in values)


def test_an_arm_without_singular_sets_has_nothing_to_approach() -> None:
    assert len(approaching(load(ROBOTS / "cartesian.yaml"), INVERSE).points) == 0
