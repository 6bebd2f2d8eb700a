"""Joints by the readings of actuators, and back: the formulas of the books, evaluated as they stand.

Angles of triangles are arc cosines, the rocker of a four-bar linkage is Freudenstein's equation, derivatives are those
of the series; nothing of it is shared with the way to the kernels.

The entries of a file are taken in order, as for the joints: each is solved for the readings that no earlier one has
given. Where a book has no formula, the root of the entry itself is found.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import mpmath
import numpy as np
from numpy.typing import ArrayLike, NDArray

from kinegen.errors import KinegenError
from kinegen.model.actuator_limits import reading_box
from kinegen.model.actuators import Coupling, Drive, Formula, FourBar, Reading, Triangle
from kinegen.model.expression_parser import Expression, evaluate
from kinegen.model.outputs import Reference
from kinegen.model.robot import JointType, Robot
from kinegen.support.compat import assert_never
from kinegen.verify.reference.exact_numbers import DIGITS, Kind
from kinegen.verify.reference.number_types import FLOATS, WIDE, WIDE_FLOATS, digit_arrays
from kinegen.verify.reference.series import Series, constant, in_series
from kinegen.verify.reference.velocity import TIP, Kinematics

Numbers = NDArray[Any]


class Actuation:
    """A robot at some readings of its actuators.

    Args:
        robot: The robot, with actuators.
        readings: Actuator vectors, shape (N, number of actuators); radians, the file's length unit, or bare numbers.
        exact: Whether to compute with `DIGITS` digits.
        wide: Whether to compute with the widest floats of NumPy in place of float64.
    """

    def __init__(self, robot: Robot, readings: ArrayLike, *, exact: bool = False, wide: bool = False) -> None:
        self.robot = robot
        self.exact = exact
        self._wide = wide
        self._kind = digit_arrays if exact else lambda: WIDE_FLOATS if wide else FLOATS
        with mpmath.workdps(DIGITS):
            rows = np.atleast_2d(np.asarray(readings, dtype=object if exact else WIDE if wide else np.float64))
            self.readings: Numbers = np.frompyfunc(mpmath.mpf, 1, 1)(rows) if exact else rows
        self._jacobians: dict[tuple[str, Reference], Numbers] = {}

    @cached_property
    def joints(self) -> Numbers:
        """Joint vectors, shape (N, dof)."""
        with mpmath.workdps(DIGITS), np.errstate(invalid="ignore", divide="ignore"):
            found = _joints(self.robot, list(self.readings.T), self._kind())
            return self._stacked([found[variable.name] for variable in self.robot.variables])

    @cached_property
    def rates(self) -> Numbers:
        """Derivatives of the joints by the readings, shape (N, dof, number of actuators)."""
        count = self.readings.shape[1]
        with mpmath.workdps(DIGITS), np.errstate(invalid="ignore", divide="ignore"):
            columns = [Series({(): column, (place,): 1}, 1) for place, column in enumerate(self.readings.T)]
            found = _joints(self.robot, columns, in_series(self._kind(), 1))
            series = [found[variable.name] for variable in self.robot.variables]
            parts = [self._stacked([each.parts.get((place,), 0) for each in series]) for place in range(count)]
        return np.stack(parts, axis=-1)

    @cached_property
    def motion(self) -> Kinematics:
        """Poses and velocities at the joints."""
        return Kinematics(self.robot, self.joints, exact=self.exact, wide=self._wide)

    def jacobian(self, frame: str, reference: Reference = TIP) -> Numbers:
        """Velocities of a frame at unit rates of the readings, shape (N, 6, number of actuators)."""
        if (frame, reference) not in self._jacobians:
            with mpmath.workdps(DIGITS):
                self._jacobians[frame, reference] = self.motion.jacobian(frame, reference) @ self.rates
        return self._jacobians[frame, reference]

    def _stacked(self, columns: list[Any]) -> Numbers:
        shape = len(self.readings)
        return np.stack([np.broadcast_to(np.asarray(column), shape) for column in columns], axis=-1)


def _joints(robot: Robot, readings: list[Any], kind: Kind) -> dict[str, Any]:
    """Returns a value for every joint, in the order in which the file gives them."""
    values = {entry.name: evaluate(entry.value, {}, kind.arithmetic) for entry in robot.parameters}
    values |= {reading.name: column for reading, column in zip(robot.actuators.readings, readings, strict=True)}
    middles = {each.name: middle(each) for each in robot.actuators.readings}
    for drive in robot.actuators.drives:
        try:
            values |= zip(drive.joints, driven(drive, values, middles, kind), strict=True)
        except ZeroDivisionError:
            raise KinegenError(
                f"actuators: joint '{drive.joints[0]}' has no value or no derivative at a reading within the limits; "
                "narrow them, so that no root is zero, no asin or acos is of 1 or -1, and nothing is divided by zero",
                line=drive.line,
            ) from None
    return values


def middle(reading: Reading) -> float:
    """Returns the reading in the middle of its limits."""
    limits = (evaluate(limit, {}, FLOATS.arithmetic) for limit in reading.limits or ())
    return float(sum(limits)) / 2


def driven(drive: Drive, values: Mapping[str, Any], middles: Mapping[str, float], kind: Kind) -> tuple[Any, ...]:
    """Returns the joints of one entry.

    `drive`: the entry; `values`: a value for each parameter, each reading and each earlier joint that it needs;
    `middles`: each reading in the middle of its limits.
    """

    def value(expression: Expression) -> Any:
        return evaluate(expression, values, kind.arithmetic)

    match drive:
        case Coupling():
            rows = (
                sum(
                    (value(entry) * values[name] for entry, name in zip(row, drive.actuators, strict=True)),
                    value(offset),
                )
                for row, offset in zip(drive.matrix, drive.offsets, strict=True)
            )
            return tuple(rows)
        case Triangle():
            length = value(drive.length[0]) * values[drive.actuator] + value(drive.length[1])
            a, b = (value(side) for side in drive.sides)
            angle = kind.arithmetic.functions["acos"]((a**2 + b**2 - length**2) / (2 * a * b))
        case FourBar():
            angle = value(drive.angle[0]) * values[drive.actuator] + value(drive.angle[1])
            if not drive.parallelogram:
                bars = tuple(value(bar) for bar in drive.bars)
                middle = float(value(drive.angle[0])) * middles[drive.actuator] + float(value(drive.angle[1]))
                angle = _followed(bars, angle, middle, kind, crossed=drive.crossed)
        case Formula():
            return (value(drive.value),)
        case _:
            assert_never(drive)
    return (drive.sign * angle + value(drive.offset),)


def _followed(bars: tuple[Any, ...], angle: Any, middle: float, kind: Kind, *, crossed: bool) -> Any:
    """Returns the rocker's angle without jumps; in the middle of the crank's way it lies between -pi and pi."""
    ground, crank, *_ = floats = tuple(float(bar) for bar in bars)
    there = math.remainder(float(_rocker(floats, middle, FLOATS, crossed=crossed)), math.tau)
    found = _rocker(bars, angle, kind, crossed=crossed)
    # A crank longer than the ground takes the rocker with it all around.
    along = constant(angle) - middle if crank > ground else 0
    far = np.asarray(constant(found) - along - there, dtype=np.float64)
    return found - 2 * kind.arithmetic.pi * np.round(far / math.tau)


def _rocker(bars: tuple[Any, ...], angle: Any, kind: Kind, *, crossed: bool) -> Any:
    """Norton, Design of Machinery, 5th ed., eq. 4.8 to 4.10, of bars d (ground), a, b and c; up to whole turns."""
    d, a, b, c = bars
    functions = kind.arithmetic.functions
    sine, cosine = functions["sin"](angle), functions["cos"](angle)
    k1, k2, k3 = d / a, d / c, (a**2 - b**2 + c**2 + d**2) / (2 * a * c)
    A, B, C = cosine - k1 - k2 * cosine + k3, -2 * sine, k1 - (k2 + 1) * cosine + k3
    root = functions["sqrt"](B**2 - 4 * A * C)
    wanted, other = (-B + root, -B - root) if crossed else (-B - root, -B + root)
    # The product of both solutions is C / A, so the one in which terms cancel follows from the other.
    cancels = np.abs(constant(wanted)) < np.abs(constant(other))
    return 2 * functions["atan2"](_either(cancels, 2 * C, wanted), _either(cancels, other, 2 * A))


def _either(first: Any, one: Any, other: Any) -> Any:
    """Returns one of two numbers or series at each configuration."""
    if not isinstance(one, Series):
        return np.where(first, one, other)[()]
    keys = {**one.parts, **other.parts}
    return Series({key: np.where(first, one.parts.get(key, 0), other.parts.get(key, 0)) for key in keys}, one.order)


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
    """Returns the readings that one entry gives."""

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
    """Returns the reading at which an entry gives its joint, by the secant method from the best place of a grid."""
    place = next(each.index for each in robot.actuators.readings if each.name == unknown)
    low, high = reading_box(robot)[place]
    middles = {each.name: middle(each) for each in robot.actuators.readings}

    def miss(reading: Any) -> Any:
        return driven(drive, {**values, unknown: reading}, middles, digit_arrays())[0] - values[drive.joint]

    grid = [mpmath.mpf(low + (high - low) * step / _GRID) for step in range(_GRID + 1)]
    start = min(grid, key=lambda reading: abs(miss(reading)))
    return mpmath.findroot(miss, (start, start + mpmath.mpf(high - low) / _GRID**2))


_AGREED = 1e-25
"""How far joints that 50 digits bring back may be from where they began, as a share of them or of 1."""


def inverse_defect(robot: Robot, joints: Sequence[float]) -> str:
    """Find what the `inverse` of a file does wrong at a joint vector.

    `joints`: a joint vector that they can bring about, in radians and the length unit of the robot. Returns the joint
    that does not come back, and the readings, in one line; empty if all do, or without an `inverse`.
    """
    if not robot.actuators.inverse:
        return ""
    found = readings(robot, joints)
    with mpmath.workdps(DIGITS):
        back = Actuation(robot, found, exact=True).joints[0]
        apart = [
            abs(one - other) / max(1, abs(other)) for one, other in zip(back, map(mpmath.mpf, joints), strict=True)
        ]
    worst = next((place for place, share in enumerate(apart) if not share <= _AGREED), None)
    if worst is None:
        return ""
    names = [reading.name for reading in robot.actuators.readings]
    given = ", ".join(f"{name} = {float(value):.6g}" for name, value in zip(names, found[0], strict=True))
    joint = robot.variables[worst]
    unit = robot.units.length if joint.type is JointType.PRISMATIC else "rad"
    return (
        f"actuators: inverse does not undo the values of the joints: for {joint.name} = {joints[worst]:.6g} {unit} "
        f"it gives {given}, at which {joint.name} is {float(back[worst]):.6g} {unit}"
    )
