"""The table as elementary turns and shifts with numbers, for one joint vector.

In: a robot and q. Out: for every frame the moves that lead to it from its parent, also those whose value is zero.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kinegen.reference.chain import ORIGIN
from kinegen.robot.expressions import Expression, evaluate, names
from kinegen.robot.floats import FLOATS
from kinegen.robot.model import TOOL, WRIST, Convention, Robot, Row, Step, StepKind

FloatArray = NDArray[np.float64]

ORDER: dict[Convention, tuple[tuple[StepKind, str], ...]] = {
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
}
"""The moves of a row in their order, each with the entry that it takes (see `symbolic/transforms.py`)."""


@dataclass(frozen=True, slots=True)
class Move:
    """One elementary transform.

    Attributes:
        kind: What it does.
        entry: Column of the table that it takes; empty in an elementary sequence.
        value: Radians, or the file's length unit.
        moving: Whether a joint variable occurs in it.
    """

    kind: StepKind
    entry: str
    value: float
    moving: bool

    def matrix(self) -> FloatArray:
        """The transform, shape (4, 4)."""
        found = np.eye(4)
        axis = self.kind.axis
        if not self.kind.is_rotation:
            found[axis, 3] = self.value
            return found
        j, k = (axis + 1) % 3, (axis + 2) % 3
        c, s = np.cos(self.value), np.sin(self.value)
        found[j, j], found[j, k], found[k, j], found[k, k] = c, -s, s, c
        return found


def moves_of(robot: Robot, q: FloatArray) -> dict[str, tuple[Move, ...]]:
    """The moves from the parent of every frame to the frame.

    Args:
        robot: The robot.
        q: One joint vector, shape (dof,), radians and the file's length unit.

    Returns:
        Moves by frame name; `reference.chain.ORIGIN` is the frame after the base transform.
    """
    values = {entry.name: float(evaluate(entry.value, {}, FLOATS)) for entry in robot.parameters}
    values |= {variable.name: float(entry) for variable, entry in zip(robot.variables, q, strict=True)}
    joints = frozenset(variable.name for variable in robot.variables)
    found = {ORIGIN: _steps(robot.base, values, joints), TOOL: _steps(robot.tool, values, joints), WRIST: ()}
    for row in robot.rows:
        found[row.name] = _row(row, values, joints)
    return found | {frame.name: _steps(frame.steps, values, joints) for frame in robot.frames}


def _row(row: Row, values: Mapping[str, float], joints: frozenset[str]) -> tuple[Move, ...]:
    if row.convention is Convention.ETS:
        return _steps(row.steps, values, joints)
    return tuple(_move(kind, entry, getattr(row, entry), values, joints) for kind, entry in ORDER[row.convention])


def _steps(steps: tuple[Step, ...], values: Mapping[str, float], joints: frozenset[str]) -> tuple[Move, ...]:
    return tuple(_move(step.kind, "", step.value, values, joints) for step in steps)


def _move(
    kind: StepKind, entry: str, value: Expression | None, values: Mapping[str, float], joints: frozenset[str]
) -> Move:
    if value is None:
        return Move(kind, entry, 0.0, moving=False)
    return Move(kind, entry, float(evaluate(value, values, FLOATS)), moving=not joints.isdisjoint(names(value)))
