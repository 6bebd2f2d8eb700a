"""Joint values beyond the limits, as far as sines and cosines are promised.

In: a robot. Out: joint vectors in groups of one size.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from kinegen.robot.expressions import Expression, evaluate, linear
from kinegen.robot.extent import joint_box
from kinegen.robot.floats import FLOATS
from kinegen.robot.model import JointType, Robot
from kinegen.verify.samples import SEED, FloatArray

LARGEST_ANGLE = {"double": 1e5, "float": 12_000.0}
"""Magnitude in radians up to which the headers promise sines and cosines; beyond it they are NaN."""

POSES = 192
"""Joint vectors of each size."""

SIZES = (1 / 64, 1.0)
"""Sizes as shares of the largest."""

MARGIN = 0.9
STROKES = 4


def beyond_limits(robot: Robot, real: str) -> Iterator[FloatArray]:
    """Joint vectors within and beyond the limits of the robot file.

    Args:
        robot: The robot.
        real: `double` or `float`.

    Yields:
        Groups of one size, shape (N, dof) each: angles of up to that size, strokes of up to `STROKES` times the box.
        No angle in the table, and no sum of them, gets beyond what is promised. None for a robot without joints.
    """
    turns = angle_rates(robot)
    if robot.dof == 0:
        return
    generator = np.random.default_rng(SEED)
    is_stroke = np.array([variable.type is JointType.PRISMATIC for variable in robot.variables])
    strokes = STROKES * np.abs(np.array(joint_box(robot))).max(axis=1)
    for size in SIZES:
        # Entries of the table that do not depend on joints have no more than a few turns.
        total = size * (MARGIN * LARGEST_ANGLE[real] - 100) / max(1.0, sum(turns))
        share = generator.uniform(-1, 1, (POSES, robot.dof))
        yield share * np.where(is_stroke, strokes, total)


def angle_rates(robot: Robot) -> tuple[float, ...]:
    """How fast the angles of the table grow with each joint variable, added up over all rows.

    Args:
        robot: The robot.

    Returns:
        One number for each variable, in radians per radian (or length unit); 0 for one that turns nothing.
    """
    names = tuple(variable.name for variable in robot.variables)
    values = {entry.name: float(evaluate(entry.value, {}, FLOATS)) for entry in robot.parameters}
    found = dict.fromkeys(names, 0.0)
    for angle in _angles(robot):
        factors, _ = linear(angle, frozenset(names))
        for name, factor in factors.items():
            found[name] += abs(float(evaluate(factor, values, FLOATS)))
    return tuple(found.values())


def _angles(robot: Robot) -> Iterator[Expression]:
    for row in robot.rows:
        yield from (entry for entry in (row.alpha, row.theta, row.beta) if entry is not None)
        yield from (step.value for step in row.steps if step.kind.is_rotation)
