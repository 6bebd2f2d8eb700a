"""What lies on paper: strokes, areas and words, in points (1/72 inch), x to the right and y up."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from kinegen.pictures.sides import FloatArray

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
    """A line through some points.

    Attributes:
        points: Shape (n, 2).
        colour: As #rrggbb.
        width: In points.
        layer: One of the layers of this module.
        depth: Nearness to the viewer.
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
    """A text whose middle is at a point.

    Attributes:
        text: One line.
        x: To the right.
        y: Up.
        angle: Against the clock, in radians.
        size: Of the font, in points.
        colour: As #rrggbb.
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
    """A colour moved towards the paper."""
    parts = (int(colour[place : place + 2], 16) for place in (1, 3, 5))
    return "#" + "".join(f"{round(part + (255 - part) * share):02x}" for part in parts)


def arrow_head(tip: ArrayLike, along: ArrayLike, colour: str, size: float, layer: int, name: str = "") -> Area:
    """A filled triangle that ends at a point; `along` is its direction."""
    end, way = np.asarray(tip, dtype=np.float64), np.asarray(along, dtype=np.float64)
    way = way / (math.hypot(*way) or 1.0)
    across = np.array([-way[1], way[0]])
    points = np.array([end, end - size * way + 0.36 * size * across, end - size * way - 0.36 * size * across])
    return Area(points, colour, colour, 0.0, layer, 1e9, name)


def hull(points: FloatArray) -> FloatArray:
    """The convex hull of some points on paper, against the clock (A. M. Andrew's monotone chain, 1979)."""
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
