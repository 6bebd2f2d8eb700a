"""What may be wrong with single entries of a table: signs, quarter turns, columns shifted by a row.

In: a `Table`. Out: `Edit`s, each an affine change of the constants of all slots and a sign for each motion, so that
thousands of combinations are made by indexing and multiplying.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kinegen.doctor.table import FloatArray, Table, TableRow
from kinegen.older import StrEnum
from kinegen.robot.model import Convention

QUARTER = math.pi / 2
_NOTHING = 1e-9
"""An angle below this has no sign that matters, in radians."""


class EditKind(StrEnum):
    """What an edit does."""

    MOTION_SIGN = "motion sign"
    ENTRY_SIGN = "entry sign"
    QUARTER = "quarter"
    SHIFT = "shift"


@dataclass(frozen=True, slots=True)
class Edit:
    """One change of entries.

    Attributes:
        words: What it is, for people.
        kind: What it does.
        places: What it is about; two edits with a common place exclude each other.
        rows: Numbers of the rows of the file, from 1, in the order of the table.
        entries: Names of the entries, as in `TableRow.slots`.
        amount: Quarter turns, or rows to shift by; 1 or -1 for a column.
        take: Which slot's constant each slot gets, shape (slots,).
        times: Factor of that constant.
        plus: What is added to it, in radians.
        turns: Factor of the motion of each slot.
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

    def apply(self, constants: FloatArray, gains: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Change a batch of tables.

        Args:
            constants: Shape (N, slots).
            gains: Signs of the motions, shape (N, slots).
        """
        return constants[:, self.take] * self.times + self.plus, gains * self.turns


def edits(table: Table) -> tuple[Edit, ...]:
    """All single edits of a table, in the order in which they are applied: shifts are last."""
    found = [edit for row in table.rows for edit in _of_row(table, row)]
    return (*found, *_shifts(table))


def _edit(
    table: Table, words: str, kind: EditKind, places: frozenset[str], rows: tuple[int, ...], entries: tuple[str, ...]
) -> Edit:
    """An edit that changes nothing yet."""
    size = len(table.slots)
    return Edit(words, kind, places, rows, entries, 1, np.arange(size), np.ones(size), np.zeros(size), np.ones(size))


def _of_row(table: Table, row: TableRow) -> Iterator[Edit]:
    moving = [place for place in row.slots.values() if table.coefficients[place].any()]
    if moving:
        words = f"{row.label}: the other direction"
        edit = _edit(table, words, EditKind.MOTION_SIGN, frozenset({f"{row.number} sign"}), (row.number,), ())
        edit.turns[moving] = -1
        yield edit
    for key, place in row.slots.items():
        if _turns_by_quarters(table, row, key, place):
            yield from _quarters(table, row, key, place)
        if _has_sign(table, place, quarters=_turns_by_quarters(table, row, key, place)):
            words = f"{row.label}: the other sign of {'the constant in ' * place_moves(table, place)}{key}"
            places = frozenset({f"{row.number} {key} sign"})
            edit = _edit(table, words, EditKind.ENTRY_SIGN, places, (row.number,), (key,))
            edit.times[place] = -1
            yield edit


def place_moves(table: Table, place: int) -> bool:
    """Whether a joint variable is in a slot."""
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
        edit = _edit(table, words, EditKind.QUARTER, places, (row.number,), (key,))
        edit.plus[place] = amount * QUARTER
        yield _with_amount(edit, amount)


def _with_amount(edit: Edit, amount: int) -> Edit:
    return Edit(
        edit.words,
        edit.kind,
        edit.places,
        edit.rows,
        edit.entries,
        amount,
        edit.take,
        edit.times,
        edit.plus,
        edit.turns,
    )


def _has_sign(table: Table, place: int, *, quarters: bool) -> bool:
    """Whether the opposite constant is another value that no turn by `quarters` gives: no zero, and no half turn."""
    value = float(table.constants[place])
    if not table.slots[place].kind.is_rotation:
        return value != 0
    return abs(math.sin(2 * value if quarters else value)) > _NOTHING


def _shifts(table: Table) -> Iterator[Edit]:
    """Columns `a` and `alpha`, alone and together, one row up or down; the last value goes to the other end."""
    rows = [row for row in table.rows if {"a", "alpha"} <= set(row.slots)]
    if len(rows) < 2:
        return
    for columns in (("a", "alpha"), ("a",), ("alpha",)):
        for amount, direction in ((1, "down"), (-1, "up")):
            words = f"column{'s' * (len(columns) > 1)} {' and '.join(columns)}: one row {direction}"
            places = frozenset(f"shift {column}" for column in columns)
            numbers = tuple(row.number for row in rows)
            edit = _with_amount(_edit(table, words, EditKind.SHIFT, places, numbers, columns), amount)
            changed = False
            for column in columns:
                slots = np.array([row.slots[column] for row in rows])
                edit.take[slots] = np.roll(slots, amount)
                changed |= bool((table.constants[edit.take] != table.constants).any())
            if changed:
                yield edit
