"""Degrees to radians, exactly.

In an angle slot of a file in degrees every quantity counts in degrees and `pi` is half a turn, so `pi/2`, `90` and a
quarter turn are the same; `atan2(1, 2)` is the angle itself, whose two values are plain numbers. In a length slot
nothing is converted: a revolute variable there is in radians, as the kernels have it, and `pi` is the number.
"""

from __future__ import annotations

from collections.abc import Mapping

from kinegen.robot.expressions import (
    PI,
    ZERO,
    Expression,
    ExpressionError,
    Name,
    Sum,
    add,
    linear,
    multiply,
    number,
    power,
    substitute,
    without_arcs,
)
from kinegen.robot.model import Dimension, JointType
from kinegen.robot.slots import Slot

HALF_TURN = number(180)
DEGREE = multiply(number("1/180"), PI)
RADIAN = multiply(HALF_TURN, power(PI, -1))
"""One radian in degrees."""


def radians(expression: Expression, angles: frozenset[str]) -> Expression:
    """Convert what counts in degrees, and holds no joint variable, to radians.

    Args:
        expression: In degrees.
        angles: Names in it whose values are angles, in radians from now on.

    Returns:
        The same angle in radians; the terms of a sum are converted one by one, so that `90 + p` becomes `p + pi/2`.
    """
    hidden, found = without_arcs(expression)
    return substitute(_radians(hidden, angles.union(found)), found)


def _radians(expression: Expression, angles: frozenset[str]) -> Expression:
    try:
        factors, rest = linear(expression, angles)
    except ExpressionError:
        in_degrees = {name: multiply(RADIAN, Name(name)) for name in angles}
        return _scale(substitute(expression, in_degrees, HALF_TURN))
    terms = [multiply(substitute(factor, {}, HALF_TURN), Name(name)) for name, factor in factors.items()]
    return add(*terms, _scale(substitute(rest, {}, HALF_TURN)))


def _in_degrees(factor: Expression, angles: frozenset[str]) -> Expression:
    """The same number of degrees, with every name and arc in radians."""
    hidden, found = without_arcs(factor)
    in_degrees = {name: multiply(RADIAN, Name(name)) for name in angles.union(found)}
    return substitute(substitute(hidden, in_degrees, HALF_TURN), found)


def _scale(expression: Expression) -> Expression:
    if isinstance(expression, Sum):
        return add(*(multiply(DEGREE, term) for term in expression.terms))
    return multiply(DEGREE, expression)


def split(
    slot: Slot, types: Mapping[str, JointType], angles: frozenset[str], *, degrees: bool
) -> tuple[dict[str, Expression], Expression]:
    """Convert a slot to kernel units, as a linear function of the joint variables.

    Args:
        slot: Any slot.
        types: Type of each joint.
        angles: The parameters that are angles.
        degrees: Whether the angles of the file count in degrees.

    Returns:
        The coefficient of each joint variable, and the offset.

    Raises:
        ExpressionError: If a variable does not stand linearly.
    """
    factors, offset = linear(slot.expression, frozenset(types))
    if not degrees or slot.dimension is not Dimension.ANGLE:
        return factors, offset
    converted = {name: _in_degrees(factor, angles) for name, factor in factors.items()}
    for name, factor in converted.items():
        if types[name] is JointType.PRISMATIC:
            converted[name] = _scale(factor)
    return converted, radians(offset, angles)


def join(factors: Mapping[str, Expression], offset: Expression) -> Expression:
    """Put the two halves of `split` together again."""
    terms = [multiply(factor, Name(name)) for name, factor in factors.items()]
    return add(*terms, offset) if terms else add(offset, ZERO)
