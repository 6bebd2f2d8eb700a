"""Joint values at which an example begins: within the limits, on a round grid, far from singularities."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from kinegen import reference
from kinegen.robot.extent import joint_box, reach
from kinegen.robot.model import TOOL, JointType, Robot

_TRIED = 200
_MARGIN = 0.2
"""Part of each range that is left free at either end."""

_GRID = math.radians(5.0)
_MULTIPLIER, _INCREMENT, _MODULUS = 1664525, 1013904223, 2**32
"""A linear congruential sequence (Numerical Recipes, 2nd ed., section 7.1): the same on every machine."""


def samples(robot: Robot, count: int = 12) -> Iterator[tuple[float, ...]]:
    """Joint vectors within the limits, on a grid of 5 degrees or a hundredth of the range.

    Args:
        robot: The robot.
        count: How many.

    Yields:
        Joint values in radians or the file's length unit.
    """
    state = 1
    for _ in range(count):
        vector = []
        for (low, high), variable in zip(joint_box(robot), robot.variables, strict=True):
            state = (_MULTIPLIER * state + _INCREMENT) % _MODULUS
            part = _MARGIN + (1 - 2 * _MARGIN) * state / _MODULUS
            turns = variable.type is JointType.REVOLUTE
            begin, end = (max(low, -math.pi), min(high, math.pi)) if turns else (low, high)
            grid = _GRID if turns else (end - begin) / 100 or 1.0
            vector.append(round((begin + part * (end - begin)) / grid) * grid)
        yield tuple(vector)


def home_of(robot: Robot) -> tuple[float, ...]:
    """The one of some joint vectors whose columns of the Jacobian are most nearly at right angles.

    Args:
        robot: The robot.

    Returns:
        Joint values in radians or the file's length unit.
    """
    tried = list(samples(robot, _TRIED))
    jacobians = reference.Kinematics(robot, tried).jacobian(TOOL)
    return tried[int(np.argmax([_spread(jacobian, reach(robot)) for jacobian in jacobians]))]


def _spread(jacobian: NDArray[np.float64], size: float) -> float:
    """Product of the squared sines between the columns of a (6, n) Jacobian, with lengths over the reach."""
    rows = jacobian if jacobian.shape[1] > 3 else jacobian[:3]
    scaled = rows / np.array([size] * 3 + [1.0] * 3)[: len(rows), None]
    lengths = np.linalg.norm(scaled, axis=0)
    if not lengths.all():
        return 0.0
    columns = scaled / lengths
    return float(np.linalg.det(columns.T @ columns))
