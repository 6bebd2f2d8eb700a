"""The Jacobian of a chain in the axes and for the origin of any of its frames, and determinants by blocks.

The determinant is the same for all frames; how many entries vanish, and how short the others are, is not. A matching of
rows with columns says whether a determinant vanishes identically; the strong components of the graph in which a row
leads to the columns of its entries are the blocks (Dulmage and Mendelsohn 1958).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import field
from functools import lru_cache

import numpy as np
import sympy as sp
from numpy.typing import NDArray
from sympy.polys.rings import PolyElement

from kinegen.derive.singularities.trigonometric_polynomials import MOST_TERMS, Algebra, TooLongError
from kinegen.derive.transforms import Elementary, Turn
from kinegen.support.dataclass import dataclass

Column = tuple[PolyElement, ...]
Triad = tuple[tuple[PolyElement, ...], ...]

ROWS = ("vx", "vy", "vz", "wx", "wy", "wz")
"""Names of the rows of a Jacobian: linear velocity, then angular velocity."""

SEED = 5

NOTHING = 1e-9
"""Numbers below this vanish, where others are of the order of 1."""


@dataclass(frozen=True, slots=True)
class View:
    """Axes and a point: numbers of the elementary transforms after which frames are taken."""

    axes: int
    point: int


@dataclass(slots=True)
class Screws:
    """A chain and its joints.

    `joints`: the joint variables that move something. `rates`: for each joint the transforms that it moves, by their
    number, with their rates. `stations`: numbers of transforms before which there is a frame with a name, the end among
    them.
    """

    steps: tuple[Elementary, ...]
    joints: tuple[sp.Symbol, ...]
    rates: tuple[dict[int, sp.Expr], ...]
    algebra: Algebra
    stations: tuple[int, ...]
    _columns: dict[View, tuple[Column, ...]] = field(default_factory=dict)
    _places: dict[int, list[tuple[Triad, Column]]] = field(default_factory=dict)

    def columns(self, view: View) -> tuple[Column, ...]:
        """Return the columns of the Jacobian, one for each joint; rows as in `ROWS`.

        Raises TooLongError if an entry has too many terms.
        """
        if view not in self._columns:
            self._columns[view] = self._seen(view)
        if max(len(entry) for column in self._columns[view] for entry in column) > MOST_TERMS:
            raise TooLongError
        return self._columns[view]

    def _seen(self, view: View) -> tuple[Column, ...]:
        if view.axes not in self._places:
            self._places[view.axes] = self._frames(view.axes)
        # Each transform that a joint moves adds its twist at the point of the view.
        places = self._places[view.axes]
        zero = self.algebra.ring.zero
        point = places[view.point][1]
        found = []
        for rates in self.rates:
            column = [zero] * 6
            for index, rate in rates.items():
                axes, origin = places[index]
                step = self.steps[index]
                axis = axes[step.axis]
                arm = [a - b for a, b in zip(origin, point, strict=True)]
                entries = [*cross(arm, axis), *axis] if isinstance(step, Turn) else [*axis, zero, zero, zero]
                factor = self.algebra.element(rate)
                column = [old + factor * new for old, new in zip(column, entries, strict=True)]
            found.append(tuple(map(self.algebra.reduced, column)))
        return tuple(found)

    def _frames(self, start: int) -> list[tuple[Triad, Column]]:
        """Axes and origin of the frame before every transform and at the end, as seen from one of them."""
        ring = self.algebra.ring
        upright = tuple(tuple(ring.one if i == j else ring.zero for i in range(3)) for j in range(3))
        places = {start: (upright, (ring.zero,) * 3)}
        for index in range(start, len(self.steps)):
            places[index + 1] = self._moved(*places[index], self.steps[index])
        for index in reversed(range(start)):
            places[index] = self._moved(*places[index + 1], self.steps[index], -1)
        return [places[index] for index in range(len(self.steps) + 1)]

    def _moved(self, axes: Triad, origin: Column, step: Elementary, sign: int = 1) -> tuple[Triad, Column]:
        if not isinstance(step, Turn):
            length = sign * self.algebra.element(step.length)
            return axes, tuple(a + length * b for a, b in zip(origin, axes[step.axis], strict=True))
        cosine, sine = self.algebra.cosine_sine(step.angle)
        sine *= sign
        i, j = (step.axis + 1) % 3, (step.axis + 2) % 3
        turned = list(axes)
        reduced = self.algebra.reduced
        turned[i] = tuple(reduced(cosine * a + sine * b) for a, b in zip(axes[i], axes[j], strict=True))
        turned[j] = tuple(reduced(cosine * b - sine * a) for a, b in zip(axes[i], axes[j], strict=True))
        return tuple(turned), origin

    def numbers(self, values: dict[sp.Symbol, float]) -> Numbers:
        """Return the chain with numbers for all symbols."""
        return Numbers(self, values)

    def generic(self) -> Numbers:
        """Return the chain with random numbers for all symbols, in which nothing vanishes by chance."""
        symbols = {symbol for step in self.steps for symbol in _value(step).free_symbols} | set(self.joints)
        generator = np.random.default_rng(SEED)
        return self.numbers({each: generator.uniform(0.3, 1.3) for each in sorted(symbols, key=lambda each: each.name)})


class Numbers:
    """Frames and joint axes of a chain with numbers.

    `frames`: `base_T_frame` before every transform and at the end, shape (N + 1, 4, 4). `twists`: velocities of the end
    by the joints, in the axes and at the origin of the base, shape (6, n).
    """

    def __init__(self, screws: Screws, values: dict[sp.Symbol, float]) -> None:
        self._stations = screws.stations
        frames = [np.eye(4)]
        for step in screws.steps:
            frames.append(frames[-1] @ _matrix(step, float(_value(step).subs(values))))
        self.frames = np.array(frames)
        self.twists = np.zeros((6, len(screws.joints)))
        for column, rates in enumerate(screws.rates):
            for index, rate in rates.items():
                axis, origin = frames[index][:3, screws.steps[index].axis], frames[index][:3, 3]
                turns = isinstance(screws.steps[index], Turn)
                twist = [*np.cross(origin, axis), *axis] if turns else [*axis, 0, 0, 0]
                self.twists[:, column] += float(rate.subs(values)) * np.array(twist)

    def jacobian(self, view: View) -> NDArray[np.float64]:
        """Return the Jacobian in the axes and at the point of a view, shape (6, n)."""
        turn, point = self.frames[view.axes][:3, :3], self.frames[view.point][:3, 3]
        linear = self.twists[:3] + np.cross(self.twists[3:], point, axisa=0, axisc=0)
        return np.concatenate([turn.T @ linear, turn.T @ self.twists[3:]])

    def views(self) -> Iterator[View]:
        """Yield all views; of frames at one place or with the same axes, the first."""
        axes = self._distinct(self.frames[:, :3, :3].reshape(len(self.frames), -1))
        points = self._distinct(self.frames[:, :3, 3])
        for each in axes:
            yield from (View(each, point) for point in points)

    def _distinct(self, rows: NDArray[np.float64]) -> list[int]:
        """Numbers of rows that differ, of equal ones that of a frame with a name."""
        found: list[int] = []
        for index in (*self._stations, *range(len(rows))):
            if all(np.abs(rows[index] - rows[other]).max() > NOTHING for other in found):
                found.append(index)
        return found


def cross(a: Sequence[PolyElement], b: Sequence[PolyElement]) -> Column:
    """Return the vector product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _value(step: Elementary) -> sp.Expr:
    return step.angle if isinstance(step, Turn) else step.length


def _matrix(step: Elementary, value: float) -> NDArray[np.float64]:
    found = np.eye(4)
    if isinstance(step, Turn):
        i, j = (step.axis + 1) % 3, (step.axis + 2) % 3
        found[[i, j], [i, j]] = np.cos(value)
        found[j, i], found[i, j] = np.sin(value), -np.sin(value)
    else:
        found[step.axis, 3] = value
    return found


def make_screws(steps: tuple[Elementary, ...], joints: Sequence[sp.Symbol], stations: tuple[int, ...]) -> Screws:
    """Gather how the joints move a chain.

    `joints`: symbols of joint variables; those that move nothing are left out.
    """
    rates = {
        joint: {i: sp.diff(_value(step), joint) for i, step in enumerate(steps) if _value(step).has(joint)}
        for joint in joints
    }
    moving = tuple(joint for joint in joints if rates[joint])
    factors = [rate for joint in moving for rate in rates[joint].values()]
    return Screws(steps, moving, tuple(rates[joint] for joint in moving), Algebra(steps, factors, joints), stations)


Pattern = tuple[tuple[bool, ...], ...]
"""Which entries do not vanish."""

Block = tuple[tuple[int, ...], tuple[int, ...]]
"""Rows and columns."""


@lru_cache(maxsize=4096)
def blocks(pattern: Pattern) -> tuple[Block, ...] | None:
    """Return the blocks of a square matrix, or None if its determinant vanishes identically."""
    size = len(pattern)
    row_of = _matching(pattern)
    if row_of is None:
        return None
    # Columns that lead to each other belong to one block (transitive closure by Warshall).
    # From a column to the columns in the row that is matched with it.
    leads = [[pattern[row_of[a]][b] for b in range(size)] for a in range(size)]
    for middle in range(size):
        for a in range(size):
            for b in range(size):
                leads[a][b] = leads[a][b] or (leads[a][middle] and leads[middle][b])
    found: dict[tuple[int, ...], Block] = {}
    for a in range(size):
        columns = tuple(b for b in range(size) if a == b or (leads[a][b] and leads[b][a]))
        found.setdefault(columns, (tuple(sorted(row_of[b] for b in columns)), columns))
    return tuple(found.values())


def _matching(pattern: Pattern) -> list[int] | None:
    """Return the row of each column in a matching that leaves none out."""
    size = len(pattern)
    row_of: dict[int, int] = {}

    def place(row: int, tried: set[int]) -> bool:
        for column in range(size):
            if pattern[row][column] and column not in tried:
                tried.add(column)
                if column not in row_of or place(row_of[column], tried):
                    row_of[column] = row
                    return True
        return False

    return [row_of[column] for column in range(size)] if all(place(row, set()) for row in range(size)) else None


def block_determinants(matrix: Sequence[Sequence[PolyElement]], algebra: Algebra) -> tuple[PolyElement, ...]:
    """Return the determinants of the blocks of a square matrix; their product is its determinant.

    Returns one polynomial for each block, the sign of the order among them; a single zero if the determinant vanishes.
    Raises TooLongError if a polynomial has too many terms.
    """
    found = blocks(tuple(tuple(bool(entry) for entry in row) for row in matrix))
    if found is None:
        return (algebra.ring.zero,)
    rows = [row for each, _ in found for row in each]
    columns = [column for _, each in found for column in each]
    parts = [_expanded([[matrix[r][c] for c in of] for r in each], algebra) for each, of in found]
    parts[:1] = [_sign(rows) * _sign(columns) * parts[0]]
    return tuple(parts)


def _sign(order: Sequence[int]) -> int:
    turned = sum(a > b for index, a in enumerate(order) for b in order[index + 1 :])
    return -1 if turned % 2 else 1


def _expanded(matrix: Sequence[Sequence[PolyElement]], algebra: Algebra) -> PolyElement:
    """Return a determinant by minors, from the rows with few and short entries on."""
    size = len(matrix)
    order = sorted(range(size), key=lambda row: sum(len(entry) for entry in matrix[row]), reverse=True)
    known: dict[tuple[int, ...], PolyElement] = {(): algebra.ring.one}

    def minor(columns: tuple[int, ...]) -> PolyElement:
        if columns not in known:
            row = matrix[order[len(columns) - 1]]
            found = algebra.ring.zero
            for place, column in enumerate(columns):
                if row[column]:
                    part = algebra.product(row[column], minor(columns[:place] + columns[place + 1 :]))
                    found = found - part if (place + len(columns) - 1) % 2 else found + part
            known[columns] = found
        return known[columns]

    return _sign(order) * minor(tuple(range(size)))
