"""The places of a robot file that hold an expression, read but not yet converted.

In: scalars. Out: `ExpressionField` records with the exact tree in the units of the file, and the raw rows and frames
made of them. Which names exist, and what they measure, is decided when the whole file has been read.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from kinegen.errors import quote
from kinegen.io.messages import expected, fail, within
from kinegen.io.robot_file.keys import MAX_STEPS, STEPS
from kinegen.io.robot_file.tree import Node, items, word
from kinegen.model.expression_parser import FUNCTIONS, Expression, ExpressionError, largest_number, parse, text_names
from kinegen.model.expression_values import Dimension
from kinegen.model.robot import Convention, StepKind
from kinegen.support.dataclass import dataclass

OWN = "q"
"""What a row calls its own joint variable."""

MAX_BITS = 512
"""Size of an exact numerator or denominator; 60 digits and an exponent of 64 fit."""

_NOT_FINITE = re.compile(r"[+-]?\.(nan|inf)\Z", re.IGNORECASE)
"""YAML's words for them; `nan` without a dot is refused as a name that nobody defined."""

_STEP = re.compile(r"([A-Za-z]\w*)\s*\((.*)\)\Z", re.DOTALL)


@dataclass(frozen=True, slots=True)
class ExpressionField:
    """One expression of the file.

    Attributes:
        label: What to call it: `theta`, `ets step 2`, `xyz`.
        expression: In the units of the file; the row's own variable is still called `q`.
        words: Names in the text as written, also those that fold away, as in `0*q`.
        axis: Axis that the value turns about or moves along; None where no joint variable may stand.
    """

    label: str
    expression: Expression
    words: tuple[str, ...]
    dimension: Dimension
    axis: int | None
    line: int


@dataclass(frozen=True, slots=True)
class RawStep:
    """One elementary transform as written."""

    kind: StepKind
    slot: ExpressionField


@dataclass(frozen=True, slots=True)
class RawRow:
    """One row of the table as written; `parent` is resolved, `offset` and `limits` have no dimension yet."""

    name: str
    number: int
    parent: str
    convention: Convention
    entries: tuple[ExpressionField, ...]
    steps: tuple[RawStep, ...]
    offset: ExpressionField | None
    limits: tuple[ExpressionField, ExpressionField] | None
    declared: str | None
    line: int

    @property
    def where(self) -> str:
        """Return how messages name the row."""
        return f"joint {self.number} ({self.name})"

    @property
    def slots(self) -> tuple[ExpressionField, ...]:
        """Its entries or steps, without offset and limits."""
        return self.entries + tuple(step.slot for step in self.steps)

    @property
    def constants(self) -> tuple[ExpressionField, ...]:
        """Its offset and limits, which hold no joint variable."""
        return (*([self.offset] if self.offset else []), *(self.limits or ()))


@dataclass(frozen=True, slots=True)
class RawFrame:
    """Base, tool or a named frame as written."""

    where: str
    name: str
    parent: str
    steps: tuple[RawStep, ...]
    line: int
    tip: bool = False


def read_slot(
    node: Node, label: str, dimension: Dimension, axis: int | None = None, functions: tuple[str, ...] = FUNCTIONS
) -> ExpressionField:
    """Read one expression, whose value may move about or along `axis`."""
    with within(label, node.line):
        text = word(node, "a number or an expression")
    return _slot(text, label, dimension, axis, node.line, functions)


def _slot(
    text: str,
    label: str,
    dimension: Dimension,
    axis: int | None,
    line: int,
    functions: tuple[str, ...] = FUNCTIONS,
) -> ExpressionField:
    with within(label, line):
        if _NOT_FINITE.match(text.strip()):
            fail(f"{quote(text.strip())} is not a finite number")
        tree = parse(text, functions)
        if largest_number(tree) >= 1 << MAX_BITS:
            raise ExpressionError("a number in it is too long")
    return ExpressionField(label, tree, text_names(text, functions), dimension, axis, line)


def read_steps(node: Node, *, moving: bool) -> tuple[RawStep, ...]:
    """Read a list such as `[Rz(q), Tx(l1), Ry(-90)]`, in which joint variables may stand or not."""
    with within("ets", node.line):
        parts = items(node, "a list such as [Rz(q), Tx(l1), Ry(-90)]")
        if len(parts) > MAX_STEPS:
            fail(f"{len(parts)} steps are too many (at most {MAX_STEPS})")
    return tuple(_read_step(part, f"ets step {i}", moving=moving) for i, part in enumerate(parts, start=1))


def _read_step(node: Node, label: str, *, moving: bool) -> RawStep:
    with within(label, node.line):
        text = word(node, "a step such as Rz(90)")
        match = _STEP.match(text)
        if match is None:
            fail(f"{quote(text)} is not a step such as Rz(90) or Tx(0.1)")
        if match[1] not in STEPS:
            fail(f"unknown step {quote(match[1])} {expected(match[1], STEPS)}")
    kind = StepKind(match[1])
    dimension = Dimension.ANGLE if kind.is_rotation else Dimension.LENGTH
    axis = kind.axis if moving else None
    return RawStep(kind, _slot(match[2], f"{label} ({kind})", dimension, axis, node.line))


def all_slots(rows: tuple[RawRow, ...], fixed: tuple[RawFrame, ...]) -> Iterator[tuple[str, ExpressionField]]:
    """Return every slot outside the parameters, with the name of its row or frame."""
    for row in rows:
        yield from ((row.where, slot) for slot in row.slots + row.constants)
    for frame in fixed:
        yield from ((frame.where, step.slot) for step in frame.steps)
