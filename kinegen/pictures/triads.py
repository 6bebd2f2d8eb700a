"""Frames as three arrows with names: x red, y green, z blue.

Frames with the same origin share one name tag, and arrows of theirs that have the same direction share a letter.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from kinegen.pictures.labels import Candidate, around
from kinegen.pictures.marks import AXES, FRAMES, INK, Mark, Stroke, Words, arrow_head
from kinegen.pictures.sides import FloatArray, View
from kinegen.pictures.words import lowered

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
    """The arrows of the frames at one origin; `length` is that of the first, in points."""
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
    """Where the names of the frames at one origin can be."""
    origin = view.place(group[0].pose[:3, 3])
    text = ", ".join(each.name if each.index is None else f"{each.index} {each.name}" for each in group)
    words = Words(text, 0.0, 0.0, 0.0, 7.5, INK, f"frame-{group[0].name}")
    return around(words, origin, (8.0, 16.0, 26.0, 38.0, 54.0, 74.0), origin - middle)


def letters(found: list[list[Triad]], view: View, length: float) -> Iterator[list[Candidate]]:
    """Where the letters of the arrows can be."""
    if len(found) > _LETTERS_FIT:
        return
    for group in found:
        for axis, text, way in _shared(group):
            path = view.place(np.array([group[0].pose[:3, 3], group[0].pose[:3, 3] + length / view.scale * way]))
            if math.hypot(*(path[1] - path[0])) < 6.0:
                continue
            words = Words(text, 0.0, 0.0, 0.0, 7.0, AXES[axis])
            yield around(words, path[1], (3.0, 5.0, 8.0, 12.0), path[1] - path[0])


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
