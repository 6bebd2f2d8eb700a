"""Targets for the self-test of an inverse: poses, and the joint vectors that they come from."""

from __future__ import annotations

import math

import numpy as np

from kinegen.reference import Kinematics
from kinegen.robot.extent import joint_box, reach
from kinegen.robot.model import JointType, JointVariable, Robot
from kinegen.verify.known import Numbers
from kinegen.verify.samples import SEED, FloatArray

TARGETS = 8
"""Targets in a self-test."""

CANDIDATES = 200
"""Joint vectors among which those are chosen that are far from singular ones."""

_INNER = 0.9
"""The part of each range, about its middle, in which they lie: rounding must not carry a solution past a limit."""

_DECIMALS = 9
"""Decimals of what is compared: far above what rounding moves."""

_GRID = 1024
"""Joint values are multiples of one part of so many, which floats hold exactly."""


def inverse_targets(robot: Robot) -> tuple[Numbers, FloatArray]:
    """Poses that an inverse has to solve, as exactly as 50 digits can say.

    Args:
        robot: The robot, which has one tip.

    Returns:
        Poses of the tip, shape (N, 4, 4), and their joint vectors (N, dof): of random ones well within the limits those
        whose Jacobian, with lengths relative to the reach, is farthest from losing a rank.
    """
    box = np.array([_narrow(*entry) for entry in zip(robot.variables, joint_box(robot), strict=True)])
    middle, half = box.mean(axis=1), np.ptp(box, axis=1) / 2 * _INNER
    parts = np.random.default_rng(SEED).uniform(-1, 1, (CANDIDATES, robot.dof))
    points = np.round((middle + parts * half) * _GRID) / _GRID
    (tip,) = robot.tips
    weights = np.array([1 / reach(robot)] * 3 + [1.0] * 3)[:, None]
    least = np.linalg.svd(Kinematics(robot, points).jacobian(tip) * weights, compute_uv=False).min(axis=1)
    # Rounded, since libraries for matrices round in ways of their own: a tie has to stay one on every machine.
    chosen = points[np.argsort(-np.round(least, _DECIMALS), kind="stable")[:TARGETS]]
    return Kinematics(robot, chosen, exact=True).pose(tip), chosen


def _narrow(variable: JointVariable, ends: tuple[float, float]) -> tuple[float, float]:
    """Of more than a whole turn the middle one: a solution may be turned back to it."""
    low, high = ends
    if variable.type is JointType.PRISMATIC or high - low <= 2 * math.pi:
        return ends
    return max(low, -math.pi), min(high, math.pi)
