"""What readings can be by the limits of the joints that they drive.

In: a `Robot` with actuators. Out: floats in the units of the kernels. Only gears, couplings and what is linear in one
reading are followed back; the range of a coupling's reading is the smallest box around all that its
joints allow.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from kinegen.robot.actuators.model import Coupling, Drive, Formula, Reading
from kinegen.robot.algebra import ExpressionError
from kinegen.robot.expressions import Expression, evaluate
from kinegen.robot.floats import FLOATS
from kinegen.robot.model import Robot
from kinegen.robot.trees import linear

_ROUNDING = 1e-12
"""Share of a range by which it is wider, so that a reading computed from a joint at its limit is within."""

Range = tuple[float, float]
Affine = tuple[tuple[tuple[Expression, ...], ...], tuple[Expression, ...]]
"""A matrix with a row for each joint and a column for each reading, and what is added to each row."""


def allowed_by_joints(robot: Robot, reading: Reading) -> Range:
    """The range within which a reading can leave its joints within their limits.

    Args:
        robot: The robot; runtime parameters have the values of the file.
        reading: The reading.

    Returns:
        A lower and an upper bound, infinite where nothing is known.
    """
    found = [allowed for drive in robot.actuators.drives for allowed in _by_drive(robot, drive, reading)]
    return max((low for low, _ in found), default=-math.inf), min((high for _, high in found), default=math.inf)


def _by_drive(robot: Robot, drive: Drive, reading: Reading) -> Iterator[Range]:
    form = _affine(drive)
    if form is None or reading.name not in drive.actuators:
        return
    known = {entry.name: evaluate(entry.value, {}, FLOATS) for entry in robot.parameters}
    matrix = [[float(evaluate(entry, known, FLOATS)) for entry in row] for row in form[0]]
    weights = _inverse_row(matrix, drive.actuators.index(reading.name))
    # What the matrix has to make of the readings: the joints less what is added.
    needed = [
        _sum([_limits(robot, joint), _scaled(-1.0, _of(robot, offset))])
        for joint, offset in zip(drive.joints, form[1], strict=True)
    ]
    low, high = _sum([_scaled(weight, each) for weight, each in zip(weights, needed, strict=True) if weight])
    slack = _ROUNDING * max(abs(low), abs(high)) if math.isfinite(low) and math.isfinite(high) else 0.0
    yield low - slack, high + slack


def _affine(drive: Drive) -> Affine | None:
    """A drive as a matrix and what is added; None for what bends."""
    if isinstance(drive, Coupling):
        return drive.matrix, drive.offsets
    if isinstance(drive, Formula) and len(drive.actuators) == 1:
        try:
            factors, rest = linear(drive.value, frozenset(drive.actuators))
        except ExpressionError:
            return None
        return (((factors[drive.actuators[0]],),), (rest,))
    return None


def _limits(robot: Robot, joint: str) -> Range:
    limits = next(variable.limits for variable in robot.variables if variable.name == joint)
    if limits is None:
        return -math.inf, math.inf
    low, high = (float(evaluate(limit, {}, FLOATS)) for limit in limits)
    return low, high


def _of(robot: Robot, offset: Expression) -> Range:
    """The range of what is added to a joint, over the limits of the joints that stand in it."""
    known = {entry.name: evaluate(entry.value, {}, FLOATS) for entry in robot.parameters}
    try:
        factors, rest = linear(offset, frozenset(variable.name for variable in robot.variables))
    except ExpressionError:
        return -math.inf, math.inf
    parts = [
        _scaled(float(evaluate(factor, known, FLOATS)), _limits(robot, joint)) for joint, factor in factors.items()
    ]
    constant = float(evaluate(rest, known, FLOATS))
    return _sum([(constant, constant), *parts])


def _scaled(factor: float, ends: Range) -> Range:
    if factor == 0.0:
        return 0.0, 0.0
    low, high = sorted(factor * end for end in ends)
    return low, high


def _sum(ranges: Sequence[Range]) -> Range:
    return sum(low for low, _ in ranges), sum(high for _, high in ranges)


def _inverse_row(matrix: Sequence[Sequence[float]], row: int) -> list[float]:
    """One row of the inverse of a square matrix that is not singular: x with x M = the unit vector of that row."""
    size = len(matrix)
    # The columns of M are the rows of the equations for x.
    rows = [[matrix[i][j] for i in range(size)] + [float(j == row)] for j in range(size)]
    for place in range(size):
        pivot = max(range(place, size), key=lambda other: abs(rows[other][place]))
        rows[place], rows[pivot] = rows[pivot], rows[place]
        rows[place] = [entry / rows[place][place] for entry in rows[place]]
        for other in range(size):
            if other != place:
                factor = rows[other][place]
                rows[other] = [a - factor * b for a, b in zip(rows[other], rows[place], strict=True)]
    return [entries[size] for entries in rows]
