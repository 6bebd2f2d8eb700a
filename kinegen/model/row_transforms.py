"""Rows of a table as elementary transforms, in the order of each convention.

- standard: `Rz(theta) Tz(d) Tx(a) Rx(alpha)` (Paul 1981, eq. 2.30; Siciliano et al. 2009, eq. 2.52);
- modified: `Rx(alpha) Tx(a) Rz(theta) Tz(d)` (Craig 2005, eq. 3.5);
- modified_prev_d: `Rx(alpha) Rz(theta) T(a, 0, d)`, Craig's axes with the offsets after the turn;
- hayati: `Rz(theta) Tx(a) Rx(alpha) Ry(beta)` (Hayati and Mirmirani 1985), for nearly parallel axes.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from kinegen.model.expression_parser import ZERO, Expression
from kinegen.model.robot import Convention, Row, Step, StepKind
from kinegen.support.dataclass import dataclass

ROW_TRANSFORMS: Mapping[Convention, tuple[tuple[StepKind, str], ...]] = {
    Convention.STANDARD: (
        (StepKind.RZ, "theta"),
        (StepKind.TZ, "d"),
        (StepKind.TX, "a"),
        (StepKind.RX, "alpha"),
    ),
    Convention.MODIFIED: (
        (StepKind.RX, "alpha"),
        (StepKind.TX, "a"),
        (StepKind.RZ, "theta"),
        (StepKind.TZ, "d"),
    ),
    Convention.MODIFIED_PREV_D: (
        (StepKind.RX, "alpha"),
        (StepKind.RZ, "theta"),
        (StepKind.TX, "a"),
        (StepKind.TZ, "d"),
    ),
    Convention.HAYATI: (
        (StepKind.RZ, "theta"),
        (StepKind.TX, "a"),
        (StepKind.RX, "alpha"),
        (StepKind.RY, "beta"),
    ),
    Convention.ETS: (),
}
"""The elementary transforms of a row from left to right, each with the entry that it takes."""

ENTRY_KINDS = {entry: kind for transforms in ROW_TRANSFORMS.values() for kind, entry in transforms}
"""The elementary transform of each entry, which is the same in all conventions."""


@dataclass(frozen=True, slots=True)
class ElementaryTransform:
    """A turn or a shift by an expression.

    Attributes:
        entry: Column of the table that it takes; empty for a step of a sequence.
    """

    kind: StepKind
    entry: str
    value: Expression


def row_transforms(row: Row) -> tuple[ElementaryTransform, ...]:
    """Return the elementary transforms of a row from its parent to its frame, also those that do nothing."""
    if row.convention is Convention.ETS:
        return step_transforms(row.steps)
    return tuple(
        ElementaryTransform(kind, entry, getattr(row, entry) or ZERO) for kind, entry in ROW_TRANSFORMS[row.convention]
    )


def step_transforms(steps: Iterable[Step]) -> tuple[ElementaryTransform, ...]:
    """Return the elementary transforms of a sequence that is written out in the file."""
    return tuple(ElementaryTransform(step.kind, "", step.value) for step in steps)
