"""The limits of joints and the ranges of readings, as numbers of a type and in words."""

from __future__ import annotations

import math
import struct
from fractions import Fraction

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.scalar_types import ScalarType
from kinegen.model.actuator_limits import reading_ranges
from kinegen.model.expression_parser import Expression, Number
from kinegen.model.expression_values import Dimension, checked_value, is_zero
from kinegen.model.robot import Robot

LARGEST = {ScalarType.DOUBLE: Fraction(1.7976931348623157e308), ScalarType.FLOAT: Fraction(2**128 - 2**104)}
"""The largest finite number of each type, which stands for no limit."""

_DIGITS = Fraction(1, 10**40)
"""Far above the rounding of a value with 50 digits, and far below the distance of two numbers of a type, relatively."""


def joint_limits(robot: Robot, real: ScalarType) -> tuple[tuple[float, float] | None, ...]:
    """Return the limits of the joints.

    Returns for each joint the largest number of the type that is not above its lower limit, and the least one that is
    not below its upper limit, in rad or the file's length unit; None where the file has no limits.
    """
    return tuple(
        None if each.limits is None else (_rounded(real, each.limits[0], -1), _rounded(real, each.limits[1], 1))
        for each in robot.variables
    )


def limit_literals(robot: Robot, real: ScalarType) -> tuple[tuple[str, str], ...]:
    """Return the same as C literals, the largest numbers of the type where there is no limit."""
    largest = LARGEST[real]
    found = (each or (-largest, largest) for each in joint_limits(robot, real))
    return tuple((real.literal(Fraction(low)), real.literal(Fraction(high))) for low, high in found)


def reading_limits(robot: Robot, real: ScalarType) -> tuple[tuple[float, float], ...]:
    """The lowest and highest reading of each actuator, in the same way; the largest numbers where nothing is known."""
    largest = float(LARGEST[real])
    found = []
    for low, high in reading_ranges(robot):
        least = -largest if math.isinf(low) else _rounded(real, Number(Fraction(low)), -1)
        most = largest if math.isinf(high) else _rounded(real, Number(Fraction(high)), 1)
        found.append((least, most))
    return tuple(found)


def reading_literals(robot: Robot, real: ScalarType) -> tuple[tuple[str, str], ...]:
    """Return the same as C literals."""
    found = reading_limits(robot, real)
    return tuple((real.literal(Fraction(low)), real.literal(Fraction(high))) for low, high in found)


def _rounded(real: ScalarType, limit: Expression, side: int) -> float:
    """Return the number of a type next to a limit, on its lower or upper side (-1 or 1), or the limit itself."""
    exact = _value(limit)
    nearest = real.round(exact)
    if abs(Fraction(nearest) - exact) <= abs(exact) * _DIGITS:
        return nearest  # the root of a square, for example, which is a number of the type but for its last digits
    if side * (Fraction(nearest) - exact) >= 0:
        return nearest
    if real is ScalarType.DOUBLE:
        return math.nextafter(nearest, side * math.inf)
    if nearest == 0:
        return side * math.ldexp(1.0, -149)
    (bits,) = struct.unpack("<i", struct.pack("<f", nearest))
    moved: float = struct.unpack("<f", struct.pack("<i", bits + (side if nearest > 0 else -side)))[0]
    return moved


def _value(limit: Expression) -> Fraction:
    """Return the value of a limit: exact if it is a number, as most are in metres, else to 50 digits."""
    if isinstance(limit, Number):
        return limit.value
    value = checked_value(limit, {})
    return Fraction(0) if is_zero(value) else Fraction(value)


ARRAY = "actuators"
"""What kernels call the actuator vector."""


def has_actuators(kernels: RobotPrograms) -> bool:
    """Return whether a kernel takes or gives readings of actuators."""
    signatures = (program.signature for program in kernels.programs)
    return any(array.name == ARRAY for each in signatures for array in (*each.inputs, *each.results))


def actuator_names(kernels: RobotPrograms) -> tuple[str, ...]:
    """Return the actuators in the order of their vector; none where no kernel has to do with them."""
    return tuple(reading.name for reading in kernels.robot.actuators.readings) if has_actuators(kernels) else ()


def actuator_limits(kernels: RobotPrograms, real: ScalarType) -> tuple[tuple[float, float], ...]:
    """The range of each actuator as numbers of a type, rounded outwards; none where no kernel has to do with them."""
    return reading_limits(kernels.robot, real) if has_actuators(kernels) else ()


def actuator_units(robot: Robot) -> tuple[str, ...]:
    """Return the unit of each reading; empty for a bare number."""
    units = {Dimension.LENGTH: robot.units.length, Dimension.ANGLE: "rad", Dimension.NUMBER: ""}
    return tuple(units[reading.dimension] for reading in robot.actuators.readings)


def actuator_lines(kernels: RobotPrograms) -> tuple[str, ...]:
    """Return one line for each entry of the actuator vector: place, name, unit, range."""
    names = actuator_names(kernels)
    width = max(map(len, names), default=0)
    lines = []
    for index, (name, unit, (low, high)) in enumerate(
        zip(names, actuator_units(kernels.robot), reading_ranges(kernels.robot), strict=True) if names else ()
    ):
        bounds = f"{low:.6g} to {high:.6g}" if low > float("-inf") or high < float("inf") else "no limits"
        lines.append(f"{ARRAY}[{index}]  {name:<{width}}  {unit or '1':<3}  {bounds}")
    return tuple(lines)
