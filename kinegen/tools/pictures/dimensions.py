"""Draws the entries of rows as dimension lines and arcs, and frames as three arrows with names.

Dimensions are candidates for `labels.Layout`, which draws the best ones. A length is measured beside the line along
which it shifts, between two lines that lead to its ends; an angle is an arc about its axis, between the directions
before and after it. Lengths that are seen from their ends have no picture. Frames with the same origin share one name
tag, and arrows of theirs that have the same direction share a letter.
"""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Iterable, Iterator

import numpy as np

from kinegen.backends.textbook.notation import TableText
from kinegen.backends.textbook.table import Table, read_table
from kinegen.model.robot import Convention, Robot
from kinegen.support.dataclass import dataclass
from kinegen.tools.pictures.labels import Candidate, around, sampled
from kinegen.tools.pictures.postures import Place
from kinegen.tools.pictures.projection import (
    ANGLE,
    AXES,
    CENTRE,
    DIMENSIONS,
    FRAMES,
    INK,
    LENGTH,
    FloatArray,
    Mark,
    Stroke,
    View,
    Words,
    arrow_head,
)

_LETTERS = {"theta": "θ", "alpha": "α", "beta": "β", "a": "a", "d": "d"}
_LOWER = str.maketrans("0123456789-", "₀₁₂₃₄₅₆₇₈₉₋")
_NUMBER = re.compile(r"-?[0-9.]+\Z")


def lowered(index: int) -> str:
    """Return a number as an index."""
    return str(index).translate(_LOWER)


class Labels:
    """The texts of all dimensions of a robot."""

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        self.table: Table = read_table(robot)
        self.rows = {row.name: row for row in self.table.rows}
        self.steps = {frame.name: frame.steps for frame in self.table.frames}

    def of(self, place: Place) -> str:
        """Such as `a₂ = 0.4318 m`, `θ₁ = q1 + 90° = 120°`, or `Tx = 20 mm` in an elementary sequence."""
        parts = [self._symbol(place), self._written(place), self._value(place)]
        kept = [part for number, part in enumerate(parts) if part and part not in parts[:number]]
        return " = ".join(kept)

    def _symbol(self, place: Place) -> str:
        """Return the letter and index of the convention's books; alpha and a of a modified table are those of i-1."""
        row = self.rows.get(place.frame)
        if row is None or not place.move.entry:
            return place.move.kind.value
        before = row.convention is Convention.MODIFIED and place.move.entry in ("a", "alpha")
        return _LETTERS[place.move.entry] + lowered(row.number - before)

    def _written(self, place: Place) -> str:
        """Return the entry as the file has it, unless it is only a number or the symbol itself."""
        row = self.rows.get(place.frame)
        steps = row.steps if row is not None else self.steps.get(place.frame, ())
        # Entries of the table as they are printed, steps by their number.
        if place.move.entry and row is not None:
            sum_ = row.entries[self.table.columns.index(place.move.entry)]
        elif place.number < len(steps):
            sum_ = steps[place.number].value
        else:
            return ""
        text = "" if sum_ is None else TableText().entry(sum_)
        # What only repeats the symbol or the value says nothing more.
        plain = self._symbol(place).translate(str.maketrans("₀₁₂₃₄₅₆₇₈₉", "0123456789"))
        if _NUMBER.match(text) or text == plain or len(text) > 24:
            return ""
        text = re.sub(r"\bpi\b", "π", text.replace("*", "·"))
        return re.sub(r"([+-] [0-9.]+)\Z", r"\1°", text) if self._in_degrees(place) else text

    def _in_degrees(self, place: Place) -> bool:
        return place.move.kind.is_rotation and self.robot.units.angle == "deg"

    def _value(self, place: Place) -> str:
        value = place.move.value
        if self._in_degrees(place):
            return f"{_plain(math.degrees(value))}°"
        return f"{_plain(value)} {'rad' if place.move.kind.is_rotation else self.robot.units.length}"


def _plain(value: float) -> str:
    """Six digits, or all before the point, without an exponent up to 1e12; a minus sign as printers have it."""
    text = f"{value:.6g}" if abs(value) < 1e6 else f"{value:.12g}"
    return text.replace("-", "\u2212") if float(text) else "0"


SIZE = 8.0
"""Of the font, in points."""

_SHORTEST = 4.0
"""A length that is shorter on paper, in points, is seen from its end."""

_OFFSETS = (15.0, 26.0, 38.0, 52.0, 68.0)
_SHIFTS = (0.0, 0.22, -0.22)
_RADIUS, _WIDER = 22.0, 11.0
_TURN = math.radians(3)
"""Angles below this have no arc; a joint that is there shows the direction in which it turns."""


def axis_line(place: Place, view: View, reach: float) -> Iterator[Mark]:
    """Yield the axis of a joint, dash-dotted."""
    ends = place.start + reach * np.outer([-1.0, 1.0], place.axis)
    path = view.place(ends)
    if math.hypot(*(path[1] - path[0])) > _SHORTEST:
        yield Stroke(path, CENTRE, 0.5, FRAMES, -1e9, dashes=(9.0, 2.5, 1.5, 2.5))


def length(place: Place, text: str, view: View, middle: FloatArray) -> list[Candidate]:
    """Return places for the dimension of a shift, away from the middle; none if it is seen from its end."""
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
    """Return the line with its arrows, and the two lines that lead to its ends."""
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


def angle(place: Place, text: str, view: View, centre: FloatArray, level: int) -> list[Candidate]:
    """Return places for the text of a turn with its arc about a point, outside of `level` arcs that are there."""
    reach = (_RADIUS + _WIDER * level) / view.scale
    # Turns about z are measured from x, all others from z.
    first = place.before[:3, 0 if place.move.kind.axis == 2 else 2]
    second = np.cross(place.axis, first)
    still = abs(place.move.value) < _TURN
    turned = math.radians(50) if still else math.fmod(place.move.value, 2 * math.pi)
    count = max(6, int(abs(turned) / math.radians(4)))
    angles = np.linspace(0.0, turned, count + 1)
    arc = centre + reach * (np.outer(np.cos(angles), first) + np.outer(np.sin(angles), second))
    path = view.place(arc)
    name = f"angle-{place.frame}-{place.number}"
    marks: list[Mark] = [
        Stroke(path, ANGLE, 0.8, DIMENSIONS, dashes=(2.0, 1.5) if still else (), name=name),
        arrow_head(path[-1], path[-1] - path[-2], ANGLE, 4.5, DIMENSIONS),
    ]
    for point in (arc[0],) if still else (arc[0], arc[-1]):
        ends = np.array([centre, centre + 1.12 * (point - centre)])
        marks.append(Stroke(view.place(ends), ANGLE, 0.45, DIMENSIONS, dashes=(2.5, 2.0)))
    target = path[len(path) // 2]
    words = Words(text, 0.0, 0.0, 0.0, SIZE, ANGLE, _name(place))
    outward = target - view.place(centre)
    return around(words, target, (4.0, 9.0, 18.0, 30.0, 45.0, 65.0), outward, tuple(marks))


def _name(place: Place) -> str:
    return f"dimension-{place.frame}-{place.number}"


_SHORTER = 0.8
"""Each further triad at one origin is shorter by this factor, so that all arrow heads are seen."""

_LETTERS_FIT = 9
"""With more origins than this, arrows have no letters: their colours say which they are."""


@dataclass(frozen=True, slots=True, eq=False)
class Triad:
    """A frame: its name as printed, its index (None for one without number), and its pose, shape (4, 4)."""

    name: str
    index: int | None
    pose: FloatArray


def groups(triads: Iterable[Triad], near: float) -> list[list[Triad]]:
    """Frames that have their origin in common."""
    found: list[list[Triad]] = []
    for triad in triads:
        same = [each for each in found if np.linalg.norm(each[0].pose[:3, 3] - triad.pose[:3, 3]) <= near]
        same[0].append(triad) if same else found.append([triad])
    return found


def arrows(group: list[Triad], view: View, length: float) -> Iterator[Mark]:
    """Yield the arrows of the frames at one origin; `length` is that of the first, in points."""
    for number, triad in enumerate(group):
        size = length * _SHORTER**number
        origin = triad.pose[:3, 3]
        for axis in sorted(range(3), key=lambda axis: float(triad.pose[:3, axis] @ view.towards)):
            path = view.place(np.array([origin, origin + size / view.scale * triad.pose[:3, axis]]))
            way = path[1] - path[0]
            name = f"axis-{triad.name}-{'xyz'[axis]}"
            if math.hypot(*way) < 3.0:
                # Seen from its end: only its origin can be drawn.
                path[1] = path[0] + np.array([0.01, 0.0])
                yield Stroke(path, AXES[axis], 3.2, FRAMES, view.depth(origin) + 5.0, name=name)
                continue
            depth = view.depth(origin) + float(triad.pose[:3, axis] @ view.towards) * size
            yield Stroke(path, AXES[axis], 1.3, FRAMES, depth, name=name)
            yield arrow_head(path[1] + 2.0 * way / math.hypot(*way), way, AXES[axis], 5.0, FRAMES)


def tag(group: list[Triad], view: View, middle: FloatArray) -> list[Candidate]:
    """Return where the names of the frames at one origin can be."""
    origin = view.place(group[0].pose[:3, 3])
    text = ", ".join(each.name if each.index is None else f"{each.index} {each.name}" for each in group)
    words = Words(text, 0.0, 0.0, 0.0, 7.5, INK, f"frame-{group[0].name}")
    return around(words, origin, (8.0, 16.0, 26.0, 38.0, 54.0, 74.0), origin - middle)


def letters(found: list[list[Triad]], view: View, length: float) -> Iterator[list[Candidate]]:
    """Yield where the letters of the arrows can be."""
    if len(found) > _LETTERS_FIT:
        return
    for group in found:
        for axis, text, way in _shared(group):
            path = view.place(np.array([group[0].pose[:3, 3], group[0].pose[:3, 3] + length / view.scale * way]))
            if math.hypot(*(path[1] - path[0])) < 6.0:
                continue
            words = Words(text, 0.0, 0.0, 0.0, 7.0, AXES[axis])
            yield around(words, path[1], (3.0, 5.0, 8.0, 12.0, 18.0, 26.0, 38.0), path[1] - path[0])


def _shared(group: list[Triad]) -> Iterator[tuple[int, str, FloatArray]]:
    """x and z of all frames with a number: directions with the letters that they have in common."""
    done: list[tuple[int, FloatArray, list[str]]] = []
    for axis in (0, 2):
        for triad in group:
            if triad.index is None:
                continue
            way = triad.pose[:3, axis]
            text = "xyz"[axis] + lowered(triad.index)
            same = [each for each in done if each[0] == axis and float(each[1] @ way) > 1 - 1e-9]
            same[0][2].append(text) if same else done.append((axis, way, [text]))
    for axis, way, texts in done:
        yield axis, " ".join(texts), way
