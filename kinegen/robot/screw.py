"""The lead of screw joints.

In: a robot. Out: how far each screw joint moves along its axis in one turn.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from kinegen.robot.expressions import Expression, evaluate, linear
from kinegen.robot.floats import FLOATS
from kinegen.robot.model import JointType, Robot, Row


def screw_leads(robot: Robot) -> dict[str, float]:
    """The lead of every screw joint, with the parameters of the file.

    Args:
        robot: The robot.

    Returns:
        Lengths a turn in the file's unit, by joint name; negative where the joint goes back along its axis.
    """
    values = {entry.name: float(evaluate(entry.value, {}, FLOATS)) for entry in robot.parameters}

    def pitch(row: Row, parts: Iterator[Expression]) -> float:
        factors = (linear(part, frozenset({row.name}))[0].get(row.name) for part in parts)
        return sum(float(evaluate(factor, values, FLOATS)) for factor in factors if factor is not None)

    return {
        row.name: 2 * math.pi * pitch(row, _shifts(row)) / pitch(row, _turns(row))
        for row in robot.rows
        if row.type is JointType.SCREW
    }


def _shifts(row: Row) -> Iterator[Expression]:
    yield from (step.value for step in row.steps if not step.kind.is_rotation)
    yield from (entry for entry in (row.a, row.d) if entry is not None)


def _turns(row: Row) -> Iterator[Expression]:
    yield from (step.value for step in row.steps if step.kind.is_rotation)
    yield from (entry for entry in (row.theta,) if entry is not None)
