"""Places words beside what they name, and clear of each other and of what is drawn, as far as there is room.

In: for every text a list of candidates, each with the lines that it takes. Out: the chosen marks. Texts are placed one
after the other; each takes the candidate with the lowest cost.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Sequence
from functools import lru_cache

import numpy as np

from kinegen.support.dataclass import dataclass
from kinegen.tools.pictures.projection import DIMENSIONS, Area, FloatArray, Mark, Stroke, Words

_OVERLAP, _CROSSED, _COVERED = 1000.0, 60.0, 5.0
"""What another text under a text costs, a line through another text, and each point of a drawing under a text."""

_STEP = 3.0
"""Distance of the points that stand for lines, in points of paper."""

_WIDE = 3.0
"""From this width on, in points, the edges of a line count too."""

_LEAD = 13.0
"""From this distance on, in points, a line leads from a text to what it names."""

_GAP = 1.5
"""Free paper around a text, in points."""


@dataclass(frozen=True, slots=True, eq=False)
class Candidate:
    """A place for a text, its marks and their sampled lines, and the distance from the ideal as its cost."""

    words: Words
    marks: tuple[Mark, ...]
    cost: float
    lines: FloatArray


@lru_cache(maxsize=4096)
def measure(text: str, size: float) -> tuple[float, float]:
    """Width and height of a text in points, from the outlines of its letters, so that it is the same everywhere."""
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import TextToPath

    font = FontProperties(family="DejaVu Sans", size=size)
    width, height, _ = TextToPath().get_text_width_height_descent(text, font, ismath=False)
    return float(width), float(max(height, 0.75 * size))


def corners(words: Words, gap: float = 0.0) -> FloatArray:
    """Return the corners of the box of a text, shape (4, 2)."""
    width, height = measure(words.text, words.size)
    along = np.array([math.cos(words.angle), math.sin(words.angle)])
    across = np.array([-along[1], along[0]])
    signs = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]])
    half = np.array([width / 2 + gap, height / 2 + gap])
    return np.asarray(np.array([words.x, words.y]) + (signs * half) @ np.array([along, across]))


def overlap(first: Words, second: Words, gap: float = 0.0) -> bool:
    """Tell whether the boxes of two texts have a point in common (separating axes of two rectangles)."""
    (w1, h1), (w2, h2) = measure(first.text, first.size), measure(second.text, second.size)
    x, y = abs(first.x - second.x), abs(first.y - second.y)
    # Most words are level, and boxes that are far apart need no test of axes.
    if not first.angle and not second.angle:
        return x < (w1 + w2) / 2 + gap and y < (h1 + h2) / 2 + gap
    if math.hypot(x, y) > (math.hypot(w1, h1) + math.hypot(w2, h2)) / 2 + 2 * gap:
        return False
    one, other = corners(first, gap), corners(second)
    for words in (first, second):
        for turn in (0.0, math.pi / 2):
            axis = np.array([math.cos(words.angle + turn), math.sin(words.angle + turn)])
            a, b = one @ axis, other @ axis
            if a.max() <= b.min() or b.max() <= a.min():
                return False
    return True


def inside(points: FloatArray, words: Words, gap: float = 0.0) -> int:
    """Return how many points are in the box of a text."""
    width, height = measure(words.text, words.size)
    offset = points - np.array([words.x, words.y])
    c, s = math.cos(words.angle), math.sin(words.angle)
    along, across = offset @ np.array([c, s]), offset @ np.array([-s, c])
    return int(np.count_nonzero((np.abs(along) < width / 2 + gap) & (np.abs(across) < height / 2 + gap)))


class Layout:
    """Takes texts one after the other and keeps them clear of each other and of what is drawn."""

    def __init__(self, drawn: Iterable[Mark]) -> None:
        self.marks: list[Mark] = []
        self.texts: list[Words] = []
        self.points = sampled(drawn)

    def put(self, candidates: Sequence[Candidate]) -> None:
        """Choose a candidate for one text."""
        places = np.array([(each.words.x, each.words.y) for each in candidates])
        width = measure(candidates[0].words.text, candidates[0].words.size)[0]
        low, high = places.min(axis=0) - width, places.max(axis=0) + width
        # Only what can touch a candidate is looked at.
        near = self.points[((self.points > low) & (self.points < high)).all(axis=1)]
        texts = self._texts_near(candidates, low, high)
        best, least = candidates[0], math.inf
        # A candidate costs at least its own cost, so the search ends early.
        for candidate in sorted(candidates, key=lambda each: each.cost):
            if candidate.cost >= least:
                break
            cost = self._cost(candidate, near, texts)
            if cost < least:
                best, least = candidate, cost
        self.marks += [*best.marks, best.words]
        self.texts.append(best.words)
        self.points = np.concatenate([self.points, best.lines])

    def _texts_near(self, candidates: Sequence[Candidate], low: FloatArray, high: FloatArray) -> list[Words]:
        """Return the texts that a candidate or its lines could meet."""
        lines = [each.lines for each in candidates if len(each.lines)]
        least = np.min([low, *(each.min(axis=0) for each in lines)], axis=0)
        most = np.max([high, *(each.max(axis=0) for each in lines)], axis=0)
        found = []
        for text in self.texts:
            reach = measure(text.text, text.size)[0]
            if least[0] - reach < text.x < most[0] + reach and least[1] - reach < text.y < most[1] + reach:
                found.append(text)
        return found

    def _cost(self, candidate: Candidate, near: FloatArray, texts: Sequence[Words]) -> float:
        words, lines = candidate.words, candidate.lines
        cost = candidate.cost + _COVERED * (inside(near, words, _GAP) + inside(lines, words, _GAP))
        low, high = (lines.min(axis=0), lines.max(axis=0)) if len(lines) else (np.zeros(2), np.zeros(2))
        for other in texts:
            cost += _OVERLAP * overlap(words, other, _GAP)
            reach = measure(other.text, other.size)[0] / 2
            if low[0] - reach < other.x < high[0] + reach and low[1] - reach < other.y < high[1] + reach:
                cost += _CROSSED * min(inside(lines, other, _GAP), 3)
        return cost


def sampled(marks: Iterable[Mark]) -> FloatArray:
    """Return points along lines and in areas, shape (n, 2)."""
    found = [np.zeros((0, 2))]
    for mark in marks:
        if isinstance(mark, Words):
            continue
        points = mark.points
        # Areas count inside too, and wide strokes at both sides.
        if isinstance(mark, Area):
            middle = points.mean(axis=0)
            rings = [middle + share * (points - middle) for share in (0.4, 0.75)]
            points = np.concatenate([points, points[:1]])
            found += rings
        pairs = list(itertools.pairwise(points))
        found += [_along(a, b) for a, b in pairs]
        if isinstance(mark, Stroke) and mark.width > _WIDE:
            found += [_along(a, b) + side for a, b in pairs for side in _sides(a, b, mark.width)]
    return np.concatenate(found)


def _along(a: FloatArray, b: FloatArray) -> FloatArray:
    count = min(max(1, math.ceil(math.hypot(*(b - a)) / _STEP)), 400)
    return np.asarray(a + np.linspace(0.0, 1.0, count + 1)[:, None] * (b - a))


def _sides(a: FloatArray, b: FloatArray, width: float) -> tuple[FloatArray, FloatArray]:
    """From the middle of a wide line to its edges."""
    way = b - a
    across = np.array([-way[1], way[0]]) * (width / 2 / (math.hypot(*way) or 1.0))
    return across, -across


def around(
    words: Words, target: FloatArray, gaps: Sequence[float], preferred: FloatArray, marks: tuple[Mark, ...] = ()
) -> list[Candidate]:
    """Return places around a target, (2,), in twelve directions; far ones have a line that leads to the point.

    Gaps are distances from the point to the box of the text, in points; `preferred` is a direction, zero for none.
    """
    width, height = measure(words.text, words.size)
    length = math.hypot(*preferred) or 1.0
    found, lines = [], sampled(marks)
    for gap in gaps:
        for turn in range(12):
            way = np.array([math.cos(turn * math.pi / 6), math.sin(turn * math.pi / 6)])
            at = target + (gap + _support(way, width, height)) * way
            away = 1.0 - float(way @ preferred) / length
            placed = Words(words.text, float(at[0]), float(at[1]), 0.0, words.size, words.colour, words.name)
            # Words that are far away need a line to what they name.
            lead: tuple[Mark, ...] = ()
            if gap > _LEAD:
                end = target + (gap - 1.5) * way
                lead = (Stroke(np.array([target + 3.0 * way, end]), words.colour, 0.4, DIMENSIONS),)
            whole = np.concatenate([lines, sampled(lead)]) if lead else lines
            found.append(Candidate(placed, (*marks, *lead), 0.45 * gap + 2.0 * away, whole))
    return found


def _support(way: FloatArray, width: float, height: float) -> float:
    """From the middle of a box to where a ray leaves it."""
    reach = [half / abs(part) for part, half in zip(way, (width / 2, height / 2), strict=True) if abs(part) > 1e-9]
    return float(min(reach))
