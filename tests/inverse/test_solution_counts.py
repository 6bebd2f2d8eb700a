"""The closed forms have as many solutions as another method finds, and the same ones: none is missed, none too many.

The other method takes Newton steps from very many random starts on the reference; it knows nothing of families. Targets
are random, at limits, and beside every singular set that the family knows, where solutions are near to each other.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from kinegen.derive.inverse.singular_configurations import alignments, boundaries
from kinegen.io.load import load
from kinegen.model.joint_bounds import joint_box
from kinegen.model.robot import TOOL, Robot
from kinegen.verify import reference
from tests.complete_inverse.starts import Array, solutions_from_starts, turning
from tests.inverse.arms import Arm, arm_of, evaluate, joint_vectors

ROBOTS = Path(__file__).parents[2] / "robots"
ARMS = ("puma560", "ur5", "stanford", "panda_joint_7", "iiwa14_arm_angle")
BESIDE = 0.003
"""How far from a singular set, in rad; two solutions are twice as far from each other."""

CLEAR = 0.01
"""The least singular value of a Jacobian, in metres and radians, that is clearly not zero."""

SAME = 1e-6
QUICK, MANY = 150, 400
"""Starts for a pose."""


@cache
def arm(name: str) -> Arm:
    return arm_of(load(ROBOTS / f"{name}.yaml"))


def random(name: str, count: int) -> Array:
    return joint_vectors(arm(name).robot, count, seed=11)


def at_limits(name: str, count: int) -> Array:
    """Random joint vectors with one joint exactly at one of its limits, singular ones aside."""
    robot = arm(name).robot
    q, box = joint_vectors(robot, count, seed=12), np.array(joint_box(robot))
    for row, each in enumerate(q):
        joint = row % robot.dof
        each[joint] = box[joint, row // robot.dof % 2]
    held = arm(name).family.held
    jacobians = reference.Kinematics(robot, q).jacobian(TOOL)
    jacobians = jacobians if held is None else np.delete(jacobians, held.number - 1, axis=2)
    clear: Array = q[np.linalg.svd(jacobians, compute_uv=False).min(axis=1) > CLEAR]
    return clear


def beside_singular(name: str, count: int) -> Array:
    """Random joint vectors with one joint beside a value at which branches meet, so many for each value."""
    robot, family = arm(name).robot, arm(name).family
    low, high = np.array(joint_box(robot)).T
    found: list[Array] = []
    for joint, values in (*boundaries(family), *alignments(family)):
        for value in values:
            q = joint_vectors(robot, count, seed=13 + len(found))
            turned = value + 2 * np.pi * np.ceil((low[joint] - value) / (2 * np.pi) - 1e-9)
            q[:, joint] = turned + BESIDE * (-1.0) ** np.arange(count)
            found.append(q[(q[:, joint] > low[joint]) & (q[:, joint] < high[joint])])
    return np.concatenate(found)


def differing(name: str, q: Array, starts: int) -> list[str]:
    """The joint vectors for whose poses the two methods do not have the same solutions."""
    one = arm(name)
    poses = reference.pose(one.robot, q)[:, 0]
    given = reference.redundancy(one.robot, q) if one.robot.redundancy else None
    solutions, valid = evaluate(one, poses, given)
    found = []
    for row, target in enumerate(poses):
        value = None if given is None else float(given[row])
        others = within(one.robot, solutions_from_starts(one.robot, target, starts, row, value))
        ours = solutions[row, valid[row] != 0]
        same = all(nearest(one.robot, each, others) < SAME for each in ours)
        if not (len(ours) == len(others) and same and nearest(one.robot, q[row], ours) < SAME):
            found.append(f"{q[row].tolist()}: {len(ours)} and {len(others)} solutions")
    return found


def nearest(robot: Robot, q: Array, others: Array) -> float:
    """How far the nearest of other joint vectors is, whole turns aside."""
    apart = np.abs(others - q)
    turned = np.abs((apart + np.pi) % (2 * np.pi) - np.pi)
    return float(np.where(turning(robot), turned, apart).max(axis=1).min(initial=np.inf))


def within(robot: Robot, q: Array) -> Array:
    """Joint vectors within the limits, some whole turns added."""
    low, high = np.array(joint_box(robot)).T
    limited = np.array([each.limits is not None for each in robot.variables])
    turns = np.where(turning(robot), np.ceil((low - q) / (2 * np.pi) - 1e-9), 0.0)
    turned = q + 2 * np.pi * turns
    inside: Array = q[(~limited | ((turned >= low - 1e-9) & (turned <= high + 1e-9))).all(axis=1)]
    return inside


@pytest.mark.parametrize("name", ARMS[:-1])
def test_another_method_finds_the_same_solutions(name: str) -> None:
    q = np.concatenate([random(name, 1), beside_singular(name, 1)[:1]])

    assert differing(name, q, QUICK) == []


@pytest.mark.counts
@pytest.mark.parametrize(("kind", "count"), [(random, 200), (at_limits, 140), (beside_singular, 30)])
@pytest.mark.parametrize("name", ARMS)
def test_at_two_thousand_poses(name: str, kind: Callable[[str, int], Array], count: int) -> None:
    """Takes a second a pose, for the arm angle ten."""
    q = kind(name, count)

    assert len(q) >= 60
    assert differing(name, q, MANY) == []
