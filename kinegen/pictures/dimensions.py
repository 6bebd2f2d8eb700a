"""The entries of rows as dimension lines and arcs.

In: the moves of a posture and their texts. Out: candidates for `labels.Layout`, which draws the best ones. A length is
measured beside the line along which it shifts, between two lines that lead to its ends; an angle is an arc about its
axis, between the directions before and after it. Lengths that are seen from their ends have no picture.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator

import numpy as np

from kinegen.pictures.labels import Candidate, around, sampled
from kinegen.pictures.marks import ANGLE, CENTRE, DIMENSIONS, FRAMES, LENGTH, Mark, Stroke, Words, arrow_head
from kinegen.pictures.sides import FloatArray, View
from kinegen.pictures.skeleton import Place

SIZE = 8.0
"""Of the font, in points."""

_SHORTEST = 4.0
"""A length that is shorter on paper, in points, is seen from its end."""

_OFFSETS = (15.0, 26.0, 38.0, 52.0, 68.0)
_SHIFTS = (0.0, 0.22, -0.22)
_RADIUS, _WIDER = 24.0, 8.0
_TURN = math.radians(3)
"""Angles below this have no arc; a joint that is there shows the direction in which it turns."""


def axis_line(place: Place, view: View, reach: float) -> Iterator[Mark]:
    """The axis of a joint, dash-dotted."""
    ends = place.start + reach * np.outer([-1.0, 1.0], place.axis)
    path = view.place(ends)
    if math.hypot(*(path[1] - path[0])) > _SHORTEST:
        yield Stroke(path, CENTRE, 0.5, FRAMES, -1e9, dashes=(9.0, 2.5, 1.5, 2.5))


def length(place: Place, text: str, view: View, middle: FloatArray) -> list[Candidate]:
    """Where the dimension of a shift can be; nothing if it is seen from its end.

    Args:
        place: The shift.
        text: What it says.
        view: The projection.
        middle: The middle of the robot on paper, from which dimensions keep away.
    """
    start, end = view.place(place.start), view.place(place.end)
    way = end - start
    size = math.hypot(*way)
    if size < _SHORTEST:
        return []
    way = way / size
    across = np.array([-way[1], way[0]])
    outward = 1.0 if float(((start + end) / 2 - middle) @ across) >= 0 else -1.0
    angle = math.atan2(way[1], way[0])
    # Words are read from below or from the right.
    angle = (
        angle - math.pi if angle > math.pi / 2 + 1e-6 else angle + math.pi if angle <= -math.pi / 2 + 1e-6 else angle
    )
    found = []
    for far in _OFFSETS:
        for sign in (outward, -outward):
            marks = _measured(start, end, sign * far * across, place)
            lines = sampled(marks)
            upward = np.array([-math.sin(angle), math.cos(angle)]) * (SIZE * 0.75)
            for shift, lift in itertools.product(_SHIFTS, (upward, -upward)):
                at = (start + end) / 2 + sign * far * across + lift + shift * size * way
                words = Words(text, float(at[0]), float(at[1]), angle, SIZE, LENGTH, _name(place))
                cost = 0.5 * far + 4.0 * (sign != outward) + 8.0 * abs(shift) + 1.5 * (lift is not upward)
                found.append(Candidate(words, marks, cost, lines))
    return found


def _measured(start: FloatArray, end: FloatArray, offset: FloatArray, place: Place) -> tuple[Mark, ...]:
    """The line with its arrows, and the two lines that lead to its ends."""
    a, b = start + offset, end + offset
    way, past = b - a, 3.0 * offset / math.hypot(*offset)
    size = math.hypot(*way)
    leads = tuple(
        Stroke(np.array([point + past, point + offset + past]), LENGTH, 0.4, DIMENSIONS) for point in (start, end)
    )
    head = 5.0
    if size > 3 * head:
        line = Stroke(np.array([a, b]), LENGTH, 0.7, DIMENSIONS, name=f"length-{place.frame}-{place.number}")
        return (*leads, line, _head(b, way), _head(a, -way))
    # Too short for arrows between its ends: they point at it from outside.
    beyond = 2.2 * head * way / size
    line = Stroke(
        np.array([a - beyond, b + beyond]), LENGTH, 0.7, DIMENSIONS, name=f"length-{place.frame}-{place.number}"
    )
    return (*leads, line, _head(a, way), _head(b, -way))


def _head(tip: FloatArray, along: FloatArray) -> Mark:
    return arrow_head(tip, along, LENGTH, 5.0, DIMENSIONS)


def angle(place: Place, text: str, view: View, level: int) -> list[Candidate]:
    """Where the text of a turn can be, with its arc.

    Args:
        place: The turn.
        text: What it says.
        view: The projection.
        level: How many arcs have the same centre already; each is outside those before.
    """
    reach = (_RADIUS + _WIDER * level) / view.scale
    # Turns about z are measured from x, all others from z.
    first = place.before[:3, 0 if place.move.kind.axis == 2 else 2]
    second = np.cross(place.axis, first)
    still = abs(place.move.value) < _TURN
    turned = math.radians(50) if still else math.fmod(place.move.value, 2 * math.pi)
    count = max(6, int(abs(turned) / math.radians(4)))
    angles = np.linspace(0.0, turned, count + 1)
    arc = place.start + reach * (np.outer(np.cos(angles), first) + np.outer(np.sin(angles), second))
    path = view.place(arc)
    name = f"angle-{place.frame}-{place.number}"
    marks: list[Mark] = [
        Stroke(path, ANGLE, 0.8, DIMENSIONS, dashes=(2.0, 1.5) if still else (), name=name),
        arrow_head(path[-1], path[-1] - path[-2], ANGLE, 4.5, DIMENSIONS),
    ]
    for point in (arc[0],) if still else (arc[0], arc[-1]):
        ends = np.array([place.start, place.start + 1.12 * (point - place.start)])
        marks.append(Stroke(view.place(ends), ANGLE, 0.45, DIMENSIONS, dashes=(2.5, 2.0)))
    target = path[len(path) // 2]
    words = Words(text, 0.0, 0.0, 0.0, SIZE, ANGLE, _name(place))
    outward = target - view.place(place.start)
    return around(words, target, (4.0, 9.0, 18.0, 30.0, 45.0, 65.0), outward, tuple(marks))


def _name(place: Place) -> str:
    return f"dimension-{place.frame}-{place.number}"
