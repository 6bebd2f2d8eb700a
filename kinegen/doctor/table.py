"""A robot as elementary transforms with numbers, the form in which thousands of variants are evaluated at once.

In: a `Robot` and the frame that was measured. Out: `Table`, one slot for each angle and length on the way from the base
to that frame: a constant, and its coefficients of the joint variables. Radians and the file's length unit.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinegen.errors import KinegenError
from kinegen.robot.expressions import Expression, evaluate, linear
from kinegen.robot.floats import FLOATS
from kinegen.robot.model import TOOL, WRIST, Convention, JointType, Robot, Row, Step, StepKind

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

KINDS = {"theta": StepKind.RZ, "d": StepKind.TZ, "a": StepKind.TX, "alpha": StepKind.RX, "beta": StepKind.RY}
"""The elementary transform of each entry."""

ORDERS = {
    Convention.STANDARD: ("theta", "d", "a", "alpha"),
    Convention.MODIFIED: ("alpha", "a", "theta", "d"),
    Convention.MODIFIED_PREV_D: ("alpha", "theta", "a", "d"),
    Convention.HAYATI: ("theta", "a", "alpha", "beta"),
}
"""How the entries of a row combine, from left to right."""


@dataclass(frozen=True, slots=True)
class Slot:
    """One angle or length.

    Attributes:
        entry: `alpha`, `a`, `d`, `theta`, `beta`, or `ets 2 (Tx)` for a step.
        kind: The elementary transform.
        step: Place of a step in its list, from 0; -1 for an entry of a table row.
    """

    entry: str
    kind: StepKind
    step: int = -1


@dataclass(frozen=True, slots=True)
class TableRow:
    """The slots of one row, by their places in `Table.slots`.

    Attributes:
        name: The joint.
        number: Its row in the file, from 1.
        convention: How its entries combine.
        follows: Whether it has the convention of the file.
        slots: Place of each entry, or of each step of an elementary sequence in order.
        moves: Whether a joint variable is in it.
    """

    name: str
    number: int
    convention: Convention
    follows: bool
    slots: Mapping[str, int]
    moves: bool

    @property
    def label(self) -> str:
        """How messages name the row."""
        return f"joint {self.number} ({self.name})"

    def order(self, convention: Convention) -> tuple[int, ...]:
        """Its slots from left to right, where the file has this convention."""
        own = convention if self.follows else self.convention
        return tuple(self.slots.values()) if own is Convention.ETS else tuple(self.slots[key] for key in ORDERS[own])


@dataclass(frozen=True, slots=True)
class Table:
    """The way from the base to the measured frame.

    Attributes:
        robot: Where it comes from.
        frame: The measured frame.
        slots: All angles and lengths.
        constants: Their constants, shape (slots,).
        coefficients: Their coefficients of the joint variables, shape (slots, dof).
        base: Places of the steps before the first row.
        rows: The rows on the way.
        tail: Places of the steps after the last row.
        prismatic: Which joint variables are lengths, shape (dof,).
    """

    robot: Robot
    frame: str
    slots: tuple[Slot, ...]
    constants: FloatArray
    coefficients: FloatArray
    base: tuple[int, ...]
    rows: tuple[TableRow, ...]
    tail: tuple[int, ...]
    prismatic: BoolArray

    @property
    def turns(self) -> BoolArray:
        """Which slots are angles, shape (slots,)."""
        return np.array([slot.kind.is_rotation for slot in self.slots], dtype=bool)

    @property
    def reach(self) -> float:
        """The sum of the sizes of all lengths; 1 where there is none, so that it can divide."""
        return float(np.abs(self.constants[~self.turns]).sum()) or 1.0


class _Builder:
    """Collects slots."""

    def __init__(self, robot: Robot) -> None:
        self.slots: list[Slot] = []
        self.constants: list[float] = []
        self.coefficients: list[list[float]] = []
        self._names = [variable.name for variable in robot.variables]
        self._values: dict[str, Any] = {
            entry.name: float(evaluate(entry.value, {}, FLOATS)) for entry in robot.parameters
        }

    def add(self, slot: Slot, expression: Expression) -> int:
        """Add a slot; returns its place."""
        factors, offset = linear(expression, frozenset(self._names))
        found = {name: float(evaluate(factor, self._values, FLOATS)) for name, factor in factors.items()}
        self.slots.append(slot)
        self.constants.append(float(evaluate(offset, self._values, FLOATS)))
        self.coefficients.append([found.get(name, 0.0) for name in self._names])
        return len(self.slots) - 1

    def steps(self, steps: tuple[Step, ...]) -> tuple[int, ...]:
        """Add the steps of a transform."""
        return tuple(
            self.add(Slot(f"step {index + 1} ({step.kind})", step.kind, index), step.value)
            for index, step in enumerate(steps)
        )

    def row(self, row: Row, robot: Robot) -> TableRow:
        """Add a row."""
        if row.convention is Convention.ETS:
            found = {self.slots[place].entry: place for place in self.steps(row.steps)}
        else:
            entries = {key: getattr(row, key) for key in KINDS}
            found = {key: self.add(Slot(key, KINDS[key]), value) for key, value in entries.items() if value is not None}
        moves = any(any(self.coefficients[place]) for place in found.values())
        follows = row.convention is robot.convention
        return TableRow(row.name, row.number, row.convention, follows, found, moves)


def table_of(robot: Robot, frame: str) -> Table:
    """Make the table for one frame.

    Args:
        robot: The robot.
        frame: A row, `TOOL`, `WRIST` or a named frame.

    Raises:
        KinegenError: If there is no such frame.
    """
    link, steps = _way(robot, frame)
    builder = _Builder(robot)
    base = builder.steps(() if link is None else robot.base)
    rows = tuple(builder.row(row, robot) for row in _rows(robot, link))
    tail = builder.steps(steps)
    shape = (len(builder.slots), robot.dof)
    return Table(
        robot,
        frame,
        tuple(builder.slots),
        np.array(builder.constants),
        np.array(builder.coefficients).reshape(shape),
        base,
        rows,
        tail,
        np.array([variable.type is JointType.PRISMATIC for variable in robot.variables], dtype=bool),
    )


def _way(robot: Robot, frame: str) -> tuple[str | None, tuple[Step, ...]]:
    """The row that a frame is on, None for the root, and the steps from there to it."""
    frames = {entry.name: entry for entry in robot.frames}
    last = robot.rows[-1].name if robot.rows else robot.root
    rows = {row.name for row in robot.rows}
    steps: tuple[Step, ...] = ()
    while frame in frames:
        steps = frames[frame].steps + steps
        frame = frames[frame].parent
    if frame in rows:
        return frame, steps
    if frame == robot.root and steps:
        return None, steps
    if frame == TOOL and not robot.is_tree:
        return last, robot.tool + steps
    if frame == WRIST and not robot.is_tree:
        return last, steps
    raise KinegenError(f"unknown frame {frame!r} (expected {', '.join(robot.frame_names)})")


def _rows(robot: Robot, link: str | None) -> tuple[Row, ...]:
    """The rows from the base to a link, in order."""
    by_name = {row.name: row for row in robot.rows}
    found: list[Row] = []
    while link in by_name:
        found.append(by_name[link])
        link = found[-1].parent
    return tuple(reversed(found))
