"""Drawings of frames in space: elementary transforms in, an SVG out. docs/make_robot_file.py draws the conventions.

A turn is an arc from the old axis (dashed) to the new one, a shift an arrow; both are computed from the transforms that
the drawing is about, so that a figure cannot show another convention than its formula.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Point = NDArray[np.float64]

SCALE = 120.0
MARGIN = 26.0
AZIMUTH, ELEVATION = math.radians(-58), math.radians(30)
INK = {"x": "#b3261e", "y": "#2e7d32", "z": "#1f4e9c", "shift": "#8a5a00", "turn": "#6a1b9a", "line": "#6b7683"}
AXES = {"x": np.array([1.0, 0, 0]), "y": np.array([0, 1.0, 0]), "z": np.array([0, 0, 1.0])}
SEEN_FROM = {"x": "z", "y": "z", "z": "x"}
"""The axis whose turning an arc about another one shows."""

RIGHT = np.array([-math.sin(AZIMUTH), math.cos(AZIMUTH), 0.0])
UP = np.array([-math.cos(AZIMUTH) * math.sin(ELEVATION), -math.sin(AZIMUTH) * math.sin(ELEVATION), math.cos(ELEVATION)])


@dataclass(slots=True)
class Drawing:
    """Collects lines and words.

    Attributes:
        parts: SVG elements.
        points: Every place that the picture has to hold, on paper.
    """

    parts: list[str] = field(default_factory=list)
    points: list[tuple[float, float]] = field(default_factory=list)

    def line(self, start: Point, end: Point, kind: str, style: str = "") -> None:
        """A straight line; `style` holds further attributes."""
        (x1, y1), (x2, y2) = self._place(start), self._place(end)
        self.parts.append(f'<path d="M{x1:.1f} {y1:.1f} L{x2:.1f} {y2:.1f}" stroke="{INK[kind]}" {style}/>')

    def arc(self, centre: Point, start: Point, axis: Point, angle: float, label: str) -> None:
        """An arc about an axis, from one direction to where the angle takes it."""
        angles = np.linspace(0.0, angle, 24)
        places = [self._place(centre + turned(start, axis, each)) for each in angles]
        path = " L".join(f"{x:.1f} {y:.1f}" for x, y in places)
        self.parts.append(f'<path d="M{path}" stroke="{INK["turn"]}" stroke-width="2" marker-end="url(#turn)"/>')
        self.text(centre + 1.32 * turned(start, axis, angle / 2), label, "turn")

    def text(self, at: Point, words: str, kind: str) -> None:
        """Words about a place."""
        self.label(at, (0.0, 0.0), words, "", kind)

    def label(self, at: Point, aside: tuple[float, float], words: str, index: str, kind: str) -> None:
        """Words with an index, some way aside of a place on paper."""
        x, y = self._place(at)
        x, y = x + aside[0], y + aside[1]
        half = 4.2 * len(words) + 3.2 * len(index)
        self.points += [(x - half, y - 9), (x + half, y + 9)]
        lower = f'<tspan font-size="11" dx="1" dy="4">{index}</tspan>' if index else ""
        self.parts.append(f'<text x="{x:.1f}" y="{y + 5:.1f}" fill="{INK[kind]}">{words}{lower}</text>')

    def svg(self, title: str) -> str:
        """The picture."""
        xs, ys = zip(*self.points, strict=True)
        left, top = min(xs) - MARGIN, min(ys) - MARGIN
        width, height = max(xs) - left + MARGIN, max(ys) - top + MARGIN
        box = f"{left:.0f} {top:.0f} {width:.0f} {height:.0f}"
        markers = "".join(_marker(kind) for kind in ("x", "y", "z", "shift", "turn"))
        size = f'width="{width:.0f}" height="{height:.0f}"'
        return "\n".join(
            [
                f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="{box}" {size} role="img" fill="none"',
                '     stroke-linecap="round" font-family="system-ui, \'Segoe UI\', Arial, sans-serif" font-size="15"',
                '     text-anchor="middle">',
                f"  <title>{title}</title>",
                f"  <defs>{markers}</defs>",
                f'  <rect x="{left:.0f}" y="{top:.0f}" width="{width:.0f}" height="{height:.0f}" fill="#ffffff"/>',
                *(f"  {part}" for part in self.parts),
                "</svg>\n",
            ]
        )

    def _place(self, point: Point) -> tuple[float, float]:
        """Where a point is on paper."""
        x, y = SCALE * float(point @ RIGHT), -SCALE * float(point @ UP)
        self.points.append((x, y))
        return x, y


def _marker(kind: str) -> str:
    head = f'<path d="M0 0 L10 5 L0 10 z" fill="{INK[kind]}"/>'
    size = 'markerWidth="11" markerHeight="11" markerUnits="userSpaceOnUse"'
    return f'<marker id="{kind}" viewBox="0 0 10 10" refX="9" refY="5" {size} orient="auto">{head}</marker>'


def turned(vector: Point, axis: Point, angle: float) -> Point:
    """A vector turned about a unit axis."""
    along = axis * float(axis @ vector)
    return along + (vector - along) * math.cos(angle) + np.cross(axis, vector) * math.sin(angle)


@dataclass(frozen=True, slots=True)
class Move:
    """One elementary transform of a figure: `kind` such as Rz or Tx, its value (radians or lengths) and its label."""

    kind: str
    value: float
    label: str


def figure(title: str, moves: tuple[Move, ...], names: tuple[str, str], axes: tuple[str, str] = ("", "")) -> str:
    """Draw two frames and the way between them.

    Args:
        title: Title of the picture.
        moves: From the first frame to the second, left to right.
        names: Index of the axes of either frame, such as i-1 and i.
        axes: Names of the lines along z of either frame; empty for no line.
    """
    drawing = Drawing()
    frame, origin = np.eye(3), np.zeros(3)
    ends = [(frame, origin)]
    for move in moves:
        frame, origin = _moved(frame, origin, move)
        ends.append((frame, origin))
    for (rotation, place), line in zip((ends[0], ends[-1]), axes, strict=True):
        if line:
            _joint_axis(drawing, place, rotation[:, 2], line)
    for number, ((rotation, place), move) in enumerate(zip(ends, moves, strict=False)):
        _draw_move(drawing, rotation, place, move, number)
    turns = ((moves[0], ends[0], ends[1]), (moves[-1], ends[-1], ends[-2]))
    for (move, (rotation, place), (other, _)), index in zip(turns, names, strict=True):
        _draw_frame(drawing, rotation, place, index, _free_side(rotation, other) if move.kind[0] == "R" else -1)
    return drawing.svg(title)


def _free_side(frame: Point, other: Point) -> int:
    """Where the label of z has room, -1 for left and 1 for right: away from an arc between two directions of z."""
    return 1 if float((frame - other)[:, 2] @ RIGHT) > 0 else -1


def _moved(frame: Point, origin: Point, move: Move) -> tuple[Point, Point]:
    axis = frame @ AXES[move.kind[1]]
    if move.kind[0] == "T":
        return frame, origin + move.value * axis
    return np.column_stack([turned(column, axis, move.value) for column in frame.T]), origin


def _joint_axis(drawing: Drawing, place: Point, along: Point, words: str) -> None:
    drawing.line(place - 0.55 * along, place + 1.25 * along, "line", 'stroke-width="1.3" stroke-dasharray="9 4 2 4"')
    drawing.text(place + 1.36 * along, words, "line")


def _draw_move(drawing: Drawing, frame: Point, origin: Point, move: Move, number: int) -> None:
    axis = frame @ AXES[move.kind[1]]
    if move.kind[0] == "T":
        end = origin + move.value * axis
        drawing.line(origin, end, "shift", 'stroke-width="3.2" marker-end="url(#shift)"')
        drawing.label((origin + end) / 2, _beside(end - origin), move.label, "", "shift")
        return
    start = frame @ AXES[SEEN_FROM[move.kind[1]]]
    radius = 0.5 + 0.05 * number
    for direction in (start, turned(start, axis, move.value)):
        drawing.line(origin, origin + (radius + 0.06) * direction, "turn", 'stroke-width="1.1" stroke-dasharray="3 4"')
    drawing.arc(origin, radius * start, axis, move.value, move.label)


def _beside(way: Point) -> tuple[float, float]:
    """Away from a line on paper: above it, or to the right of one that stands."""
    across, up = float(way @ RIGHT), float(way @ UP)
    length = math.hypot(across, up)
    return (15.0, 0.0) if abs(up) > 1.5 * abs(across) else (-14.0 * up / length, -14.0 * abs(across) / length)


def _draw_frame(drawing: Drawing, frame: Point, origin: Point, index: str, side: int) -> None:
    for letter, aside in (("x", (2.0, 17.0)), ("z", (side * 22.0, 2.0))):
        along = frame @ AXES[letter]
        drawing.line(origin, origin + 0.72 * along, letter, f'stroke-width="2.4" marker-end="url(#{letter})"')
        drawing.label(origin + 0.72 * along, aside, letter, index, letter)
    x, y = drawing._place(origin)  # noqa: SLF001 - the dot is part of the drawing
    drawing.parts.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3.6" fill="#1a202c"/>')
