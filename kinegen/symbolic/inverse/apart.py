"""How far the tip of the nearest arm of a family is from an arm's own tip, for the same joint vector."""

from __future__ import annotations

import math
from dataclasses import dataclass

from kinegen.robot.extent import joint_box
from kinegen.robot.model import Robot
from kinegen.symbolic.inverse.axes import Axes
from kinegen.symbolic.inverse.family import Family

SAMPLES = 1000
"""Joint vectors that are tried."""

_STRIDES = tuple(math.sqrt(prime) for prime in (2, 3, 5, 7, 11, 13, 17))
"""Multiples of these, without their whole parts, are spread evenly (Weyl)."""

Matrix = list[list[float]]
"""The upper three rows of a homogeneous matrix."""


@dataclass(frozen=True, slots=True)
class TipApart:
    """The largest distances found; a larger one may exist.

    Attributes:
        length: Between the tips, in the length unit of the file.
        angle: Between their attitudes, in radians.
    """

    length: float
    angle: float


def tip_apart(robot: Robot, family: Family) -> TipApart:
    """Compare both arms at joint vectors that are spread evenly in the joint box.

    Args:
        robot: The arm.
        family: The family that it is nearly of.

    Returns:
        The largest distance and the largest angle of `SAMPLES` joint vectors; zeros where the arm is of the family.
    """
    if family.defect is None:
        return TipApart(0.0, 0.0)
    same = family.defect.axes.reversed() if family.is_reversed else family.defect.axes
    own, special = _screws(same), _screws(family.axes)
    box = joint_box(robot)
    length = angle = 0.0
    for sample in range(SAMPLES):
        drawn = [low + (high - low) * (sample * each % 1) for (low, high), each in zip(box, _STRIDES, strict=False)]
        q = [drawn[number - 1] for number in family.axes.numbers]
        a, b = _tip(own, q), _tip(special, q)
        length = max(length, math.dist(*([row[3] for row in each] for each in (a, b))))
        square = sum((a[i][j] - b[i][j]) ** 2 for i in range(3) for j in range(3))
        angle = max(angle, 2 * math.asin(min(1.0, math.sqrt(square / 8))))
    return TipApart(length, angle)


def _screws(axes: Axes) -> tuple[list[tuple[list[float], list[float], float]], Matrix]:
    """Direction, point and rate of each joint, and the tip at q = 0, as floats."""
    joints = [
        ([float(entry) for entry in joint.direction], [float(entry) for entry in joint.point], float(joint.rate))
        for joint in axes.joints
    ]
    tip = [[*map(float, row), float(entry)] for row, entry in zip(axes.rotation, axes.position, strict=True)]
    return joints, tip


def _tip(screws: tuple[list[tuple[list[float], list[float], float]], Matrix], q: list[float]) -> Matrix:
    """The pose of the tip: its pose at q = 0, turned about each axis from the last to the first."""
    joints, start = screws
    columns = [[row[j] for row in start] for j in range(4)]
    for (axis, point, rate), value in zip(reversed(joints), reversed(q), strict=True):
        turned = [_turned(axis, rate * value, column) for column in columns[:3]]
        place = _turned(axis, rate * value, [a - b for a, b in zip(columns[3], point, strict=True)])
        columns = [*turned, [a + b for a, b in zip(place, point, strict=True)]]
    return [[columns[j][i] for j in range(4)] for i in range(3)]


def _turned(axis: list[float], angle: float, vector: list[float]) -> list[float]:
    """A vector turned about an axis through the origin (Rodrigues)."""
    cosine, sine = math.cos(angle), math.sin(angle)
    along = sum(a * b for a, b in zip(axis, vector, strict=True)) * (1 - cosine)
    across = [axis[(i + 1) % 3] * vector[(i + 2) % 3] - axis[(i + 2) % 3] * vector[(i + 1) % 3] for i in range(3)]
    return [cosine * v + sine * c + along * a for v, c, a in zip(vector, across, axis, strict=True)]
