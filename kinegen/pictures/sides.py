"""The side from which a robot is seen, and how its points get onto paper.

In: a name such as `front`, or two angles. Out: three directions in the base frame, and coordinates on paper in points
(1/72 inch). The projection is parallel, so that equal lengths in one direction are equal on paper.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kinegen.errors import KinegenError, quote
from kinegen.robot.expressions import ZERO
from kinegen.robot.model import Robot, Row

FloatArray = NDArray[np.float64]

AUTO = "auto"
"""From the top for an arm that stays in a horizontal plane, isometric for any other robot."""

SIDES = {
    "front": (-90.0, 0.0),
    "back": (90.0, 0.0),
    "side": (0.0, 0.0),
    "left": (180.0, 0.0),
    "top": (-90.0, 90.0),
    "bottom": (-90.0, -90.0),
    "isometric": (-45.0, math.degrees(math.atan(math.sqrt(0.5)))),
}
"""Azimuth and elevation of the viewer by name, in degrees. `front` has x to the right and z up; `side` looks against
x and has y to the right."""


@dataclass(frozen=True, slots=True)
class Side:
    """Where the viewer is.

    Attributes:
        azimuth: Direction to the viewer, from x towards y of the base, in degrees.
        elevation: Height of the viewer above the x-y plane of the base, in degrees from -90 to 90.
    """

    azimuth: float
    elevation: float

    def directions(self) -> FloatArray:
        """Rows: to the right on paper, up on paper, towards the viewer; unit vectors of the base frame."""
        az, el = math.radians(self.azimuth), math.radians(self.elevation)
        right = (-math.sin(az), math.cos(az), 0.0)
        up = (-math.sin(el) * math.cos(az), -math.sin(el) * math.sin(az), math.cos(el))
        towards = (math.cos(el) * math.cos(az), math.cos(el) * math.sin(az), math.sin(el))
        # What is zero but for rounding would tilt lines by the last bit.
        return np.where(np.abs(found := np.array([right, up, towards])) < 1e-15, 0.0, found)


@dataclass(frozen=True, slots=True)
class View:
    """A projection onto paper.

    Attributes:
        directions: Shape (3, 3), as `Side.directions` gives them.
        scale: Points on paper for one unit of length.
    """

    directions: FloatArray
    scale: float

    def place(self, points: ArrayLike) -> FloatArray:
        """Points of shape (..., 3) in the base frame, on paper: shape (..., 2), in points."""
        return np.asarray(np.asarray(points, dtype=np.float64) @ self.directions[:2].T * self.scale)

    def depth(self, points: ArrayLike) -> float:
        """How near some points are to the viewer on average; more is nearer."""
        return float(np.mean(np.asarray(points, dtype=np.float64) @ self.directions[2])) * self.scale

    @property
    def towards(self) -> FloatArray:
        """The direction to the viewer."""
        return np.asarray(self.directions[2])


def find_side(side: str | Sequence[float], robot: Robot) -> Side:
    """Read a side.

    Args:
        side: One of `SIDES`, `AUTO`, a text such as `30,20`, or two numbers: azimuth and elevation in degrees.
        robot: The robot, for `AUTO`.

    Raises:
        KinegenError: If it is anything else, or the elevation is beyond 90 degrees.
    """
    if side == AUTO:
        return Side(*SIDES["top" if _is_flat(robot) else "isometric"])
    if isinstance(side, str) and side in SIDES:
        return Side(*SIDES[side])
    try:
        azimuth, elevation = (float(each) for each in (side.split(",") if isinstance(side, str) else side))
    except (TypeError, ValueError):
        azimuth = elevation = math.nan
    if not (math.isfinite(azimuth) and abs(elevation) <= 90):
        names = ", ".join((AUTO, *SIDES))
        raise KinegenError(
            f"{quote(str(side))} is not a side (expected {names}, or azimuth,elevation in degrees such as -60,25)"
        )
    return Side(azimuth, elevation)


def _is_flat(robot: Robot) -> bool:
    """Whether every joint turns about a vertical axis and nothing leads out of the plane."""
    steps = (*robot.base, *robot.tool, *(step for row in robot.rows for step in row.steps))
    upright = all(step.kind.is_rotation == (step.kind.axis == 2) for step in steps)
    return bool(robot.rows) and upright and all(map(_row_is_flat, robot.rows))


def _row_is_flat(row: Row) -> bool:
    entries = (row.alpha, row.beta, row.d)
    return all(entry is None or entry == ZERO for entry in entries)
