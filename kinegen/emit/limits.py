"""The limits of the joints as numbers of a type, rounded outwards: a joint exactly at its limit is within."""

from __future__ import annotations

import math
import struct
from fractions import Fraction

from kinegen.emit.reals import Real
from kinegen.robot.expressions import Expression, Number
from kinegen.robot.model import Robot
from kinegen.robot.values import checked_value, is_zero

LARGEST = {Real.DOUBLE: Fraction(1.7976931348623157e308), Real.FLOAT: Fraction(2**128 - 2**104)}
"""The largest finite number of each type, which stands for no limit."""

_DIGITS = Fraction(1, 10**40)
"""Far above the rounding of a value with 50 digits, and far below the distance of two numbers of a type, relatively."""


def joint_limits(robot: Robot, real: Real) -> tuple[tuple[float, float] | None, ...]:
    """The limits of the joints.

    Args:
        robot: The robot.
        real: A number type.

    Returns:
        For each joint the largest number of the type that is not above its lower limit, and the least one that is not
        below its upper limit, in rad or the file's length unit; None where the file has no limits.
    """
    return tuple(
        None if each.limits is None else (_rounded(real, each.limits[0], -1), _rounded(real, each.limits[1], 1))
        for each in robot.variables
    )


def limit_literals(robot: Robot, real: Real) -> tuple[tuple[str, str], ...]:
    """The same as C literals, the largest numbers of the type where there is no limit."""
    largest = LARGEST[real]
    found = (each or (-largest, largest) for each in joint_limits(robot, real))
    return tuple((real.literal(Fraction(low)), real.literal(Fraction(high))) for low, high in found)


def _rounded(real: Real, limit: Expression, side: int) -> float:
    """The number of a type next to a limit, on its lower or upper side (-1 or 1), or the limit itself."""
    exact = _value(limit)
    nearest = real.round(exact)
    if abs(Fraction(nearest) - exact) <= abs(exact) * _DIGITS:
        return nearest  # the root of a square, for example, which is a number of the type but for its last digits
    if side * (Fraction(nearest) - exact) >= 0:
        return nearest
    if real is Real.DOUBLE:
        return math.nextafter(nearest, side * math.inf)
    if nearest == 0:
        return side * math.ldexp(1.0, -149)
    (bits,) = struct.unpack("<i", struct.pack("<f", nearest))
    moved: float = struct.unpack("<f", struct.pack("<i", bits + (side if nearest > 0 else -side)))[0]
    return moved


def _value(limit: Expression) -> Fraction:
    """The value of a limit: exact if it is a number, as most are in metres, else to 50 digits."""
    if isinstance(limit, Number):
        return limit.value
    value = checked_value(limit, {})
    return Fraction(0) if is_zero(value) else Fraction(value)
