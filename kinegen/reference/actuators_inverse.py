"""Readings of actuators that bring joints about, with 50 digits: formulas of the books, or a search for the root.

The entries of a file are taken in order, as for the joints: each is solved for the readings that no earlier one has
given. Where a book has no formula, the root of the entry itself is found.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import mpmath
import numpy as np
from numpy.typing import ArrayLike, NDArray

from kinegen.reference.actuators import driven, middle
from kinegen.reference.numbers import DIGITS, Kind, digit_arrays
from kinegen.robot.actuators.extent import reading_box
from kinegen.robot.actuators.model import Coupling, Drive, Formula, FourBar, Triangle
from kinegen.robot.expressions import Expression, evaluate
from kinegen.robot.model import Robot

Numbers = NDArray[Any]

_GRID = 16
"""Places between the limits of a crank from which the best is taken to begin the search."""


def readings(robot: Robot, joints: ArrayLike) -> Numbers:
    """Solve for the readings.

    Args:
        robot: The robot, with actuators.
        joints: Joint vectors, shape (N, dof), which actuators can bring about.

    Returns:
        Actuator vectors as mpmath numbers, shape (N, number of actuators).
    """
    with mpmath.workdps(DIGITS):
        rows = [_row(robot, [mpmath.mpf(entry) for entry in row]) for row in np.atleast_2d(joints)]
    return np.array(rows, dtype=object).reshape(len(rows), len(robot.actuators.readings))


def _row(robot: Robot, joints: list[Any]) -> list[Any]:
    kind = digit_arrays()
    values = {entry.name: evaluate(entry.value, {}, kind.arithmetic) for entry in robot.parameters}
    values |= {variable.name: entry for variable, entry in zip(robot.variables, joints, strict=True)}
    for name, expression in robot.actuators.inverse:
        values[name] = evaluate(expression, values, kind.arithmetic)
    for drive in robot.actuators.drives:
        unknown = [name for name in drive.actuators if name not in values]
        if unknown:
            values |= _solved(robot, drive, unknown, values, kind)
    return [values[reading.name] for reading in robot.actuators.readings]


def _solved(robot: Robot, drive: Drive, unknown: list[str], values: Mapping[str, Any], kind: Kind) -> dict[str, Any]:
    """The readings that one entry gives."""

    def value(expression: Expression) -> Any:
        return evaluate(expression, values, kind.arithmetic)

    match drive:
        case Coupling():
            matrix = mpmath.matrix([[value(entry) for entry in row] for row in drive.matrix])
            turned = [values[joint] - value(offset) for joint, offset in zip(drive.joints, drive.offsets, strict=True)]
            found = dict(zip(drive.actuators, mpmath.lu_solve(matrix, mpmath.matrix(turned)), strict=True))
            return {name: found[name] for name in unknown}
        case Triangle():
            a, b = (value(side) for side in drive.sides)
            angle = drive.sign * (values[drive.joint] - value(drive.offset))
            length = mpmath.sqrt(a**2 + b**2 - 2 * a * b * mpmath.cos(angle))
            return {drive.actuator: (length - value(drive.length[1])) / value(drive.length[0])}
        case FourBar() | Formula():
            return {unknown[0]: _root(robot, drive, unknown[0], values)}


def _root(robot: Robot, drive: FourBar | Formula, unknown: str, values: Mapping[str, Any]) -> Any:
    """The reading at which an entry gives its joint, by the secant method from the best place of a grid."""
    place = next(each.index for each in robot.actuators.readings if each.name == unknown)
    low, high = reading_box(robot)[place]
    middles = {each.name: middle(each) for each in robot.actuators.readings}

    def miss(reading: Any) -> Any:
        return driven(drive, {**values, unknown: reading}, middles, digit_arrays())[0] - values[drive.joint]

    grid = [mpmath.mpf(low + (high - low) * step / _GRID) for step in range(_GRID + 1)]
    start = min(grid, key=lambda reading: abs(miss(reading)))
    return mpmath.findroot(miss, (start, start + mpmath.mpf(high - low) / _GRID**2))
