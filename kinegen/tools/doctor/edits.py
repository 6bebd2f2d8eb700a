"""Lists the mistakes that a table may have: signs, quarter turns, exchanged or shifted entries, coupled joints.

An `Edit` is an affine change of the constants of all slots and a sign for each motion, so that thousands of
combinations are made by indexing and multiplying. Rare ones are tried alone and with one of the usual changes.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from itertools import combinations, pairwise

import numpy as np
from numpy.typing import NDArray

from kinegen.model.robot import Convention
from kinegen.support.compat import StrEnum
from kinegen.support.dataclass import dataclass
from kinegen.tools.doctor.numeric_table import Change, Table, TableRow
from kinegen.tools.doctor.observed_poses import FloatArray

QUARTER = math.pi / 2
_NOTHING = 1e-9
"""An angle below this has no sign that matters, in radians."""


class EditKind(StrEnum):
    """Kinds of edits."""

    MOTION_SIGN = "motion sign"
    ENTRY_SIGN = "entry sign"
    QUARTER = "quarter"
    SHIFT = "shift"
    SWAP = "swap"
    ROWS = "rows"
    NUMBER = "number"


@dataclass(frozen=True, slots=True)
class Edit:
    """One change of entries, in words and in numbers.

    Attributes:
        places: What it is about; two edits with a common place exclude each other.
        entries: Names of the entries, as in `TableRow.slots`.
        amount: Quarter turns, or rows to shift by; 1 or -1 for a column.
        take: Which slot's constant each slot gets, shape (slots,).
        plus: What is added to it, in radians.
        turns: Factor of the motion of each slot.
        place: The slot that gets a number, or -1.
    """

    words: str
    kind: EditKind
    places: frozenset[str]
    rows: tuple[int, ...]
    entries: tuple[str, ...]
    amount: int
    take: NDArray[np.intp]
    times: FloatArray
    plus: FloatArray
    turns: FloatArray
    place: int = -1
    text: str = ""

    def by(self, amount: int) -> Edit:
        """Return the same edit by another amount."""
        return replace(self, amount=amount)

    def apply(self, constants: FloatArray, gains: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Change constants and signs of motions of a batch of tables, shape (N, slots) each."""
        return constants[:, self.take] * self.times + self.plus, gains * self.turns


def edits(table: Table) -> tuple[Edit, ...]:
    """Return all single edits of a table, in the order in which they are applied: shifts are last."""
    found = [edit for row in table.rows for edit in _of_row(table, row)]
    return (*found, *_shifts(table))


def blank(
    table: Table, words: str, kind: EditKind, places: frozenset[str], rows: tuple[int, ...], entries: tuple[str, ...]
) -> Edit:
    """Return an edit that changes nothing yet; whoever makes it fills its arrays."""
    size = len(table.slots)
    return Edit(words, kind, places, rows, entries, 1, np.arange(size), np.ones(size), np.zeros(size), np.ones(size))


def _of_row(table: Table, row: TableRow) -> Iterator[Edit]:
    moving = [place for place in row.slots.values() if table.coefficients[place].any()]
    # A joint may count the other way in all entries that it moves.
    if moving:
        words = f"{row.label}: the other direction"
        edit = blank(table, words, EditKind.MOTION_SIGN, frozenset({f"{row.number} sign"}), (row.number,), ())
        edit.turns[moving] = -1
        yield edit
    # Constants may have another sign, and angles other quarter turns.
    for key, place in row.slots.items():
        if _turns_by_quarters(table, row, key, place):
            yield from _quarters(table, row, key, place)
        if _has_sign(table, place, quarters=_turns_by_quarters(table, row, key, place)):
            words = f"{row.label}: the other sign of {'the constant in ' * place_moves(table, place)}{key}"
            places = frozenset({f"{row.number} {key} sign"})
            edit = blank(table, words, EditKind.ENTRY_SIGN, places, (row.number,), (key,))
            edit.times[place] = -1
            yield edit


def place_moves(table: Table, place: int) -> bool:
    """Tell whether a joint variable is in a slot."""
    return bool(table.coefficients[place].any())


def _turns_by_quarters(table: Table, row: TableRow, key: str, place: int) -> bool:
    """Theta of every row of a table; in an elementary sequence the turns that move."""
    if row.convention is Convention.ETS:
        return table.slots[place].kind.is_rotation and place_moves(table, place)
    return key == "theta"


def _quarters(table: Table, row: TableRow, key: str, place: int) -> Iterator[Edit]:
    for amount, angle in ((1, "+90"), (2, "180"), (-1, "-90")):
        words = f"{row.label}: {angle} degrees in {key}"
        places = frozenset({f"{row.number} {key} quarter"})
        edit = blank(table, words, EditKind.QUARTER, places, (row.number,), (key,))
        edit.plus[place] = amount * QUARTER
        yield edit.by(amount)


def _has_sign(table: Table, place: int, *, quarters: bool) -> bool:
    """Tell whether the opposite constant is a value that no turn by `quarters` gives: no zero, and no half turn."""
    value = float(table.constants[place])
    if not table.slots[place].kind.is_rotation:
        return value != 0
    return abs(math.sin(2 * value if quarters else value)) > _NOTHING


def _shifts(table: Table) -> Iterator[Edit]:
    """Yield columns `a` and `alpha`, alone and together, one row up or down; the last value goes to the other end."""
    rows = [row for row in table.rows if {"a", "alpha"} <= set(row.slots)]
    if len(rows) < 2:
        return
    # Books differ in the row that a and alpha stand in, most often of both.
    for columns in (("a", "alpha"), ("a",), ("alpha",)):
        for amount, direction in ((1, "down"), (-1, "up")):
            words = f"column{'s' * (len(columns) > 1)} {' and '.join(columns)}: one row {direction}"
            places = frozenset(f"shift {column}" for column in columns)
            numbers = tuple(row.number for row in rows)
            edit = blank(table, words, EditKind.SHIFT, places, numbers, columns).by(amount)
            # Columns of equal entries are the same after a shift.
            changed = False
            for column in columns:
                slots = np.array([row.slots[column] for row in rows])
                edit.take[slots] = np.roll(slots, amount)
                changed |= bool((table.constants[edit.take] != table.constants).any())
            if changed:
                yield edit


_SHIFTED = ("d", "theta")
"""Columns that slip by a row less often than a and alpha, which conventions number differently."""


def rarer_changes(table: Table) -> tuple[Change, ...]:
    """Exchanged columns of joint values, and joints whose values count from the ground."""
    names = [variable.name for variable in table.robot.variables]
    return (*_exchanged(names), *_coupled(table, names))


def rarer_edits(table: Table) -> tuple[Edit, ...]:
    """Entries, columns and rows that are exchanged, and columns that slipped by a row."""
    rows = [row for row in table.rows if {"a", "d", "alpha", "theta"} <= set(row.slots)]
    found = [*_swaps(table, rows), *_neighbours(table, rows), *_slipped(table, rows)]
    return tuple(edit for edit in found if (table.constants[edit.take] != table.constants).any())


def _exchanged(names: list[str]) -> Iterator[Change]:
    """Two columns, all in reverse, or the order of the alphabet, in which some programs log joints."""
    count = len(names)
    orders = {
        tuple(second if place == first else first if place == second else place for place in range(count)): (
            f"the columns of joints {names[first]} and {names[second]} are exchanged in the poses"
        )
        for first, second in combinations(range(count), 2)
    }
    orders.setdefault(tuple(reversed(range(count))), "the columns of the joints are in reverse order in the poses")
    by_name = sorted(range(count), key=lambda place: names[place])
    # The value of joint p is in the column that has its rank in the alphabet.
    ranks = tuple(by_name.index(place) for place in range(count))
    orders.setdefault(ranks, "the columns of the joints are in the order of the alphabet in the poses")
    orders.pop(tuple(range(count)), None)
    for order, words in orders.items():
        yield Change(words, (("mix", _rows(np.eye(count)[list(order)])),), in_file=False)


def _coupled(table: Table, names: list[str]) -> Iterator[Change]:
    turning = ~table.prismatic
    for first, second in pairwise(range(len(names))):
        if not (turning[first] and turning[second]):
            continue
        for sign, words in ((1, "plus"), (-1, "minus")):
            matrix = np.eye(len(names))
            matrix[second, first] = sign
            said = f"joint {names[second]} is at its value in the poses {words} that of {names[first]}"
            yield Change(
                f"{said} (coupled joints: `actuators:` of a robot file)", (("mix", _rows(matrix)),), in_file=False
            )


def _rows(matrix: FloatArray) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(map(float, row)) for row in matrix)


def _swaps(table: Table, rows: list[TableRow]) -> Iterator[Edit]:
    """Entries a and d of one row, or of all; rows in which one of them moves keep theirs."""
    still = [row for row in rows if not table.coefficients[[row.slots["a"], row.slots["d"]]].any()]
    for row in still:
        yield _taking(table, f"{row.label}: a and d are exchanged", EditKind.SWAP, (row,), ("a", "d"), [(row, row)])
    if len(still) > 1:
        words = "columns a and d are exchanged"
        yield _taking(table, words, EditKind.SWAP, tuple(still), ("a", "d"), [(row, row) for row in still])


def _neighbours(table: Table, rows: list[TableRow]) -> Iterator[Edit]:
    """Two rows one after the other, if the same entries move in both."""
    entries = ("theta", "d", "a", "alpha")
    for first, second in pairwise(rows):
        moving = [[bool(table.coefficients[row.slots[key]].any()) for key in entries] for row in (first, second)]
        if moving[0] == moving[1] and first.convention is second.convention:
            words = (
                f"the numbers of joints {first.number} ({first.name}) and {second.number} ({second.name}) are exchanged"
            )
            yield _taking(table, words, EditKind.ROWS, (first, second), entries, [(first, second), (second, first)])


def _slipped(table: Table, rows: list[TableRow]) -> Iterator[Edit]:
    """Yield one column of rows in which it does not move, or moves alike, one row up or down."""
    for column in _SHIFTED:
        same = [row for row in rows if row.convention is not Convention.HAYATI]
        moving = {bool(table.coefficients[row.slots[column]].any()) for row in same}
        if len(same) < 2 or (column == "d" and True in moving):
            continue
        for amount, direction in ((1, "down"), (-1, "up")):
            pairs = [(row, same[(place - amount) % len(same)]) for place, row in enumerate(same)]
            words = f"column {column}: one row {direction}"
            yield _taking(table, words, EditKind.ROWS, tuple(same), (column,), pairs)


def _taking(
    table: Table,
    words: str,
    kind: EditKind,
    rows: tuple[TableRow, ...],
    entries: tuple[str, ...],
    pairs: list[tuple[TableRow, TableRow]],
) -> Edit:
    """Return an edit in which rows get the constants of others; for `SWAP` those of the other entry."""
    places = frozenset(f"{row.number} {key}" for row in rows for key in entries)
    edit = blank(table, words, kind, places, tuple(row.number for row in rows), entries)
    sources = entries[::-1] if kind is EditKind.SWAP else entries
    for row, other in pairs:
        for key, source in zip(entries, sources, strict=True):
            edit.take[row.slots[key]] = other.slots[source]
    return edit
