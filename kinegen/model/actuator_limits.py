"""How far the actuators of a robot go, by their own limits and by those of the joints that they drive.

In: a `Robot` with actuators. Out: floats in the units of the kernels.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

from kinegen.model.actuators import Coupling, Drive, Formula, FourBar, Reading, Triangle
from kinegen.model.expression_nodes import ExpressionError, linear
from kinegen.model.expression_parser import Expression, evaluate
from kinegen.model.expression_values import FLOAT64, Dimension
from kinegen.model.joint_bounds import joint_box, parameter_values
from kinegen.model.robot import Robot

_ROUNDING = 1e-12
"""Share of a range by which it is wider, so that a reading computed from a joint at its limit is within."""

Range = tuple[float, float]
Affine = tuple[tuple[tuple[Expression, ...], ...], tuple[Expression, ...]]
"""A matrix with a row for each joint and a column for each reading, and what is added to each row."""


def allowed_by_joints(robot: Robot, reading: Reading) -> Range:
    """Return the range within which a reading can leave its joints within their limits, infinite if unknown.

    Only gears, couplings and what is linear in one reading are followed back, with the parameters of the file; the
    range of a coupling's reading is the smallest box around all that its joints allow.
    """
    found = [allowed for drive in robot.actuators.drives for allowed in _by_drive(robot, drive, reading)]
    return max((low for low, _ in found), default=-math.inf), min((high for _, high in found), default=math.inf)


def _by_drive(robot: Robot, drive: Drive, reading: Reading) -> Iterator[Range]:
    form = _affine(drive)
    if form is None or reading.name not in drive.actuators:
        return
    known = parameter_values(robot)
    matrix = [[float(evaluate(entry, known, FLOAT64)) for entry in row] for row in form[0]]
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
    """Return a drive as a matrix and what is added; None for what bends."""
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
    low, high = (float(evaluate(limit, {}, FLOAT64)) for limit in limits)
    return low, high


def _of(robot: Robot, offset: Expression) -> Range:
    """Return the range of what is added to a joint, over the limits of the joints that stand in it."""
    known = parameter_values(robot)
    try:
        factors, rest = linear(offset, frozenset(variable.name for variable in robot.variables))
    except ExpressionError:
        return -math.inf, math.inf
    parts = [
        _scaled(float(evaluate(factor, known, FLOAT64)), _limits(robot, joint)) for joint, factor in factors.items()
    ]
    constant = float(evaluate(rest, known, FLOAT64))
    return _sum([(constant, constant), *parts])


def _scaled(factor: float, ends: Range) -> Range:
    if factor == 0.0:
        return 0.0, 0.0
    low, high = sorted(factor * end for end in ends)
    return low, high


def _sum(ranges: Sequence[Range]) -> Range:
    return sum(low for low, _ in ranges), sum(high for _, high in ranges)


def _inverse_row(matrix: Sequence[Sequence[float]], row: int) -> list[float]:
    """Solve for one row of the inverse of a square matrix M: x with x M = the unit vector of that row."""
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


MARGIN = 0.01
"""Share of the way of a linkage that is left out at either end: at a dead centre every rounding error is boundless."""


Interval = tuple[float, float]


def reading_ranges(robot: Robot) -> tuple[Interval, ...]:
    """Return what each reading can be.

    Args:
        robot: The robot; runtime parameters have the values of the file.

    Returns:
        A lower and an upper bound for each reading: the limits of the file, or what those of its joints allow; where
        it drives a triangle no more than lets that close; infinite where nothing is known.
    """
    return tuple(_range(robot, reading) for reading in robot.actuators.readings)


def reading_box(robot: Robot) -> tuple[Interval, ...]:
    """Return the box of actuator vectors over which kernels are compared.

    Returns:
        The ranges, where linkages stay clear of their dead centres by `MARGIN`. A reading without any bound goes as far
        as takes one of its joints from end to end of its box, or else half a turn or 1 to either side.
    """
    box = []
    for reading in robot.actuators.readings:
        low, high = _met(_own_limits(reading), *_closing(robot, reading, MARGIN))
        far = _far(robot, reading)
        box.append((low if math.isfinite(low) else -far, high if math.isfinite(high) else far))
    return tuple(box)


def _range(robot: Robot, reading: Reading) -> Interval:
    own = allowed_by_joints(robot, reading) if reading.limits is None else _own_limits(reading)
    return _met(own, *_closing(robot, reading, 0.0))


def _value(robot: Robot, expression: Expression) -> float:
    return float(evaluate(expression, parameter_values(robot), FLOAT64))


def _own_limits(reading: Reading) -> Interval:
    if reading.limits is None:
        return -math.inf, math.inf
    low, high = (float(evaluate(limit, {}, FLOAT64)) for limit in reading.limits)
    return low, high


def _met(*ranges: Interval) -> Interval:
    return max(low for low, _ in ranges), min(high for _, high in ranges)


def _closing(robot: Robot, reading: Reading, margin: float) -> list[Interval]:
    """Return the ranges within which the linkages that a reading drives close."""
    found = []
    for drive in robot.actuators.drives:
        if isinstance(drive, Triangle) and drive.actuator == reading.name:
            a, b = (_value(robot, side) for side in drive.sides)
            factor, rest = (_value(robot, part) for part in drive.length)
            ends = sorted(((abs(a - b) - rest) / factor, (a + b - rest) / factor))
            found.append(_shrunk((ends[0], ends[1]), margin))
        if isinstance(drive, FourBar) and drive.actuator == reading.name and not drive.parallelogram:
            found.append(_shrunk(_own_limits(reading), margin))
    return found


def _shrunk(ends: Interval, margin: float) -> Interval:
    inset = margin * (ends[1] - ends[0])
    return ends[0] + inset, ends[1] - inset


def _far(robot: Robot, reading: Reading) -> float:
    """Return how far a reading without bounds goes to either side."""
    boxes = {variable.name: box for variable, box in zip(robot.variables, joint_box(robot), strict=True)}
    ways = [
        way
        for drive in robot.actuators.drives
        if isinstance(drive, Coupling)
        for way in _ways(robot, drive, reading, boxes)
    ]
    return min(ways, default=math.pi if reading.dimension is Dimension.ANGLE else 1.0)


def _ways(robot: Robot, drive: Coupling, reading: Reading, boxes: Mapping[str, Interval]) -> list[float]:
    if reading.name not in drive.actuators:
        return []
    column = drive.actuators.index(reading.name)
    factors = [(joint, abs(_value(robot, row[column]))) for joint, row in zip(drive.joints, drive.matrix, strict=True)]
    return [max(-boxes[joint][0], boxes[joint][1]) / factor for joint, factor in factors if factor]
