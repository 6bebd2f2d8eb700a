"""Projects a robot onto paper, from a side: strokes, areas and words in points (1/72 inch), x to the right and y up.

The projection is parallel, so that equal lengths in one direction are equal on paper.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kinegen.errors import KinegenError, quote
from kinegen.model.expression_parser import ZERO
from kinegen.model.robot import Robot
from kinegen.support.dataclass import dataclass

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
    """The place of the viewer.

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
    """A projection onto paper along `Side.directions`, with so many points on paper for one unit of length."""

    directions: FloatArray
    scale: float

    def place(self, points: ArrayLike) -> FloatArray:
        """Return points of shape (..., 3) in the base frame, on paper: shape (..., 2), in points."""
        return np.asarray(np.asarray(points, dtype=np.float64) @ self.directions[:2].T * self.scale)

    def depth(self, points: ArrayLike) -> float:
        """Return how near some points are to the viewer on average; more is nearer."""
        return float(np.mean(np.asarray(points, dtype=np.float64) @ self.directions[2])) * self.scale

    @property
    def towards(self) -> FloatArray:
        """Return the direction to the viewer."""
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
    # Two angles, of text or of numbers.
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
    """Tell whether every joint turns about a vertical axis and nothing leads out of the plane."""
    steps = (*robot.base, *robot.tool, *(step for row in robot.rows for step in row.steps))
    upright = all(step.kind.is_rotation == (step.kind.axis == 2) for step in steps)
    return (
        bool(robot.rows)
        and upright
        and all(entry in (None, ZERO) for row in robot.rows for entry in (row.alpha, row.beta, row.d))
    )


INK, EDGE = "#1f2933", "#39434f"
LINK, SLIDE = "#7d8a99", "#aab4bf"
BODY, CAP, FOLLOWER, GROUND = "#d5deea", "#eef2f7", "#e9e4d4", "#f1f3f5"
SCREW = "#dbe8d8"
AXES = ("#c0392b", "#1e8449", "#1f5fa8")
LENGTH, ANGLE, CENTRE = "#6c3483", "#a04000", "#6b7785"
PAPER = "#ffffff"

GHOST = 0.62
"""How far the colours of further postures are moved towards the paper."""

BEHIND, ARM, FRAMES, DIMENSIONS, WORDS = range(5)
"""Layers: later ones cover earlier ones; within one, what is nearer to the viewer covers what is farther."""


@dataclass(frozen=True, slots=True, eq=False)
class Stroke:
    """A line through points (n, 2), in a layer of this module and at a nearness to the viewer.

    Attributes:
        width: In points.
        dashes: Lengths of dashes and gaps, in points; empty for a solid line.
        name: Identifier in an SVG file; empty for none.
    """

    points: FloatArray
    colour: str
    width: float
    layer: int = ARM
    depth: float = 0.0
    dashes: tuple[float, ...] = ()
    name: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class Area:
    """A filled polygon, with an edge unless its width is 0."""

    points: FloatArray
    colour: str
    edge: str = EDGE
    width: float = 0.7
    layer: int = ARM
    depth: float = 0.0
    name: str = ""


@dataclass(frozen=True, slots=True)
class Words:
    """A line of text whose middle is at a point.

    Attributes:
        angle: Against the clock, in radians.
        name: Identifier in an SVG file; empty for none.
    """

    text: str
    x: float
    y: float
    angle: float
    size: float
    colour: str
    name: str = ""
    layer: int = field(default=WORDS, init=False)
    depth: float = field(default=0.0, init=False)


Mark = Stroke | Area | Words


def paler(colour: str, share: float = GHOST) -> str:
    """Return a colour moved towards the paper."""
    parts = (int(colour[place : place + 2], 16) for place in (1, 3, 5))
    return "#" + "".join(f"{round(part + (255 - part) * share):02x}" for part in parts)


def arrow_head(tip: ArrayLike, along: ArrayLike, colour: str, size: float, layer: int, name: str = "") -> Area:
    """Return a filled triangle that ends at a point; `along` is its direction."""
    end, way = np.asarray(tip, dtype=np.float64), np.asarray(along, dtype=np.float64)
    way = way / (math.hypot(*way) or 1.0)
    across = np.array([-way[1], way[0]])
    points = np.array([end, end - size * way + 0.36 * size * across, end - size * way - 0.36 * size * across])
    return Area(points, colour, colour, 0.0, layer, 1e9, name)


def hull(points: FloatArray) -> FloatArray:
    """Return the convex hull of some points on paper, against the clock (A. M. Andrew's monotone chain, 1979)."""
    ordered = sorted({(round(float(x), 6), round(float(y), 6)) for x, y in points})
    if len(ordered) < 3:
        return np.array(ordered)
    return np.array([*_half(ordered)[:-1], *_half(ordered[::-1])[:-1]])


def _half(points: list[tuple[float, float]]) -> list[tuple[float, float]]:
    found: list[tuple[float, float]] = []
    for point in points:
        while len(found) > 1 and _turn(found[-2], found[-1], point) <= 0:
            found.pop()
        found.append(point)
    return found


def _turn(a: tuple[float, float], b: tuple[float, float], c: tuple[float, float]) -> float:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
