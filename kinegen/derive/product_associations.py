"""Other ways to evaluate a folded chain than from its end.

By association, for chains with fixed turns that are no quarter turns: such a turn before a joint and one behind it make
one matrix with few operations, and a product of the first turns, in which they are constants of sums, may be computed
from its end and the rest of the chain from there outwards.

By rows, from the start outwards: two rows of the rotation are turned, the third is their cross product, and shifts are
multiples of entries that are needed anyway. An arm whose shifts are along axes, as those between spherical shoulder,
elbow and wrist, takes fewer operations than from the tip.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import combinations, groupby

import sympy as sp

from kinegen.derive.expressions import LetBindings
from kinegen.derive.folding import NULL, UNITS, Columns, FoldedChain, Vector, combined, cross, total
from kinegen.derive.transforms import Turn
from kinegen.support.dataclass import dataclass


@dataclass(frozen=True, slots=True)
class Association:
    """One way to associate the product.

    Attributes:
        carried: The columns that are turned towards the base; a missing third is a cross product.
        blocks: First and last turn of each product that is computed as a matrix before it is applied.
        middle: The turns before this one are multiplied from the last to the first and those from it on outwards; None
            for all from the last to the first.
        row: The row of the whole that is a cross product where turns are multiplied outwards.
        by_columns: Whether the last shift is added as a multiple of the columns; otherwise it is turned as they are.
    """

    carried: tuple[int, ...]
    blocks: tuple[tuple[int, int], ...] = ()
    middle: int | None = None
    row: int = 2
    by_columns: bool = False

    def __str__(self) -> str:
        columns = " and ".join("xyz"[axis] for axis in self.carried)
        if self.middle is None:
            matrices = ", ".join(f"{first + 1} to {last + 1}" for first, last in self.blocks)
            place = "base" if self.by_columns else "tip"
            return f"columns {columns} turned, turns {matrices} as one; last shift added at the {place}"
        last = "; last shift added at the base" if self.by_columns else ""
        return f"columns {columns} of the first {self.middle} turns, then all but row {'xyz'[self.row]} outwards{last}"


def is_inclined(turns: Iterable[Turn]) -> bool:
    """Tell whether fixed turns that are no quarter turns are among those of a folded chain."""
    return any(not turn.angle.free_symbols for turn in turns)


def associations(folded: FoldedChain) -> Iterator[Association]:
    """Yield the ways that are tried."""
    fixed = [not turn.angle.free_symbols for turn in folded.turns]
    blocks = tuple(_between(fixed))
    for carried in combinations(range(3), 2):
        if blocks:
            yield Association(carried, blocks)
            yield Association(carried, blocks, by_columns=True)
    if runs := fixed_runs(folded):
        for kept in (*combinations(range(3), 2), (0, 1, 2)):
            yield Association(kept, runs)
            yield Association(kept, runs, by_columns=True)
    for middle in range(1, len(folded.turns)):
        for row in range(3):
            for by_columns in (False, True) if any(folded.shifts[-1]) else (False,):
                yield Association((0, 1), middle=middle, row=row, by_columns=by_columns)
                yield Association((0, 1, 2), middle=middle, row=row, by_columns=by_columns)


def fixed_runs(folded: FoldedChain) -> tuple[tuple[int, int], ...]:
    """First and last of neighbouring turns that are all fixed: together they are one matrix of constants."""
    fixed = [not turn.angle.free_symbols for turn in folded.turns]
    groups = [list(places) for is_fixed, places in groupby(range(len(fixed)), fixed.__getitem__) if is_fixed]
    return tuple((places[0], places[-1]) for places in groups if len(places) > 1)


def _between(fixed: Sequence[bool]) -> Iterator[tuple[int, int]]:
    """Joints between two fixed turns, from the base on; none shares one with the next."""
    place = 0
    while place + 2 < len(fixed):
        if fixed[place] and fixed[place + 2]:
            yield place, place + 2
            place += 2
        place += 1


def associated(folded: FoldedChain, way: Association, bindings: LetBindings) -> tuple[Columns, Vector]:
    """Evaluate a folded chain as associated: columns before the attitude, and the position."""
    # From the end, with blocks of turns as one matrix each.
    if way.middle is None:
        columns = {axis: UNITS[axis] for axis in way.carried}
        position = NULL if way.by_columns else folded.shifts[-1]
        for span in reversed(_spans(way.blocks, len(folded.turns))):
            matrix = _matrix(folded, span, bindings)
            columns = {axis: _applied(matrix, column, bindings) for axis, column in columns.items()}
            position = bindings.vector(total(_applied(matrix, position, bindings), _inside(folded, span, bindings)))
        whole = completed(columns, bindings)
        if way.by_columns:
            position = bindings.vector(total(position, _applied(whole, folded.shifts[-1], bindings)))
        return whole, position
    # The first turns from their end, the others from there outwards by rows.
    near = FoldedChain(folded.shifts[: way.middle + 1], folded.turns[: way.middle], folded.attitude)
    columns = {axis: UNITS[axis] for axis in way.carried}
    position = NULL
    # The shifts behind the middle make one lever, which the first matrix turns.
    lever = NULL if way.by_columns else folded.shifts[-1]
    for level in range(len(folded.turns) - 1, way.middle - 1, -1):
        lever = bindings.vector(total(bindings.turned(folded.turns[level], lever), folded.shifts[level]))
    for level in reversed(range(way.middle)):
        columns = {axis: bindings.turned(near.turns[level], column) for axis, column in columns.items()}
        position = bindings.vector(total(bindings.turned(near.turns[level], position), near.shifts[level]))
    first = completed(columns, bindings)
    position = bindings.vector(total(position, _applied(first, lever, bindings)))
    whole = _outwards(first, folded.turns[way.middle :], way.row, bindings)
    if way.by_columns:
        position = bindings.vector(total(position, _applied(whole, folded.shifts[-1], bindings)))
    return whole, position


def _spans(blocks: Sequence[tuple[int, int]], turns: int) -> list[tuple[int, int]]:
    inside = {place for first, last in blocks for place in range(first, last + 1)}
    return sorted([*blocks, *((place, place) for place in range(turns) if place not in inside)])


def _matrix(folded: FoldedChain, span: tuple[int, int], bindings: LetBindings) -> Columns:
    columns = list(UNITS)
    for level in range(span[1], span[0] - 1, -1):
        columns = [bindings.turned(folded.turns[level], column) for column in columns]
    return columns[0], columns[1], columns[2]


def _inside(folded: FoldedChain, span: tuple[int, int], bindings: LetBindings) -> Vector:
    """Return the shifts before some turns and between them, in the axes before them."""
    vector = folded.shifts[span[1]]
    for level in range(span[1] - 1, span[0] - 1, -1):
        vector = bindings.vector(total(bindings.turned(folded.turns[level], vector), folded.shifts[level]))
    return vector


def _applied(matrix: Columns, vector: Vector, bindings: LetBindings) -> Vector:
    return bindings.vector(combined(vector, matrix.__getitem__))


def completed(columns: dict[int, Vector], bindings: LetBindings) -> Columns:
    """Return all columns, a missing third as the cross product of the two others in cyclic order, which is named."""
    found = dict(columns)
    for axis in range(3):
        if axis not in found:
            found[axis] = bindings.vector(cross(columns[(axis + 1) % 3], columns[(axis + 2) % 3]))
    return found[0], found[1], found[2]


def _outwards(first: Columns, turns: Sequence[Turn], row: int, bindings: LetBindings) -> Columns:
    """More turns behind a rotation: two of its rows are turned, the other one is their cross product."""
    rows = {place: (first[0][place], first[1][place], first[2][place]) for place in range(3) if place != row}
    for turn in turns:
        rows = {place: bindings.turned(Turn(turn.axis, -turn.angle), each) for place, each in rows.items()}
    whole = completed(rows, bindings)
    x, y, z = ((whole[0][axis], whole[1][axis], whole[2][axis]) for axis in range(3))
    return x, y, z


@dataclass(frozen=True, slots=True)
class ByRows:
    """One way to evaluate a chain by rows; the row `missing` is a cross product."""

    missing: int

    def __str__(self) -> str:
        return f"all rows but {'xyz'[self.missing]} turned outwards, that one their cross product; shifts added by rows"


def by_rows(folded: FoldedChain) -> Iterator[ByRows]:
    """Yield the ways that are tried: the row that the first turn leaves as it is has the fewest operations."""
    if folded.turns:
        yield from (ByRows(row) for row in range(3) if row != folded.turns[0].axis)


@dataclass(slots=True)
class _Rows:
    """Two rows of the rotation as far as the walk has come.

    `since`: for each axis, the two rows behind the last turn that changed the entries of that axis.
    """

    bindings: LetBindings
    missing: int
    known: tuple[Vector, Vector]
    since: list[tuple[Vector, Vector]]

    def turn(self, turn: Turn) -> None:
        one, other = (self.bindings.turned(Turn(turn.axis, -turn.angle), row) for row in self.known)
        self.known = one, other
        self.since = [self.since[axis] if axis == turn.axis else self.known for axis in range(3)]

    def entry(self, row: int, axis: int) -> sp.Expr:
        """Return an entry; of the missing row it is made of the rows after the last turn that changed it."""
        if row != self.missing:
            return self.known[(row - self.missing - 1) % 3][axis]
        one, other = self.since[axis]
        i, j = (axis + 1) % 3, (axis + 2) % 3
        return self.bindings.name(one[i] * other[j] - one[j] * other[i])

    def column(self, axis: int) -> Vector:
        return self.entry(0, axis), self.entry(1, axis), self.entry(2, axis)


def evaluate_by_rows(folded: FoldedChain, way: ByRows, bindings: LetBindings) -> tuple[Columns, Vector]:
    """Evaluate a folded chain from its start: columns before the attitude, and the position."""
    units = UNITS[(way.missing + 1) % 3], UNITS[(way.missing + 2) % 3]
    rows = _Rows(bindings, way.missing, units, [units] * 3)
    position = NULL
    for level, shift in enumerate(folded.shifts):
        if level:
            rows.turn(folded.turns[level - 1])
        position = bindings.vector(combined(shift, rows.column, position))
    return (rows.column(0), rows.column(1), rows.column(2)), position
