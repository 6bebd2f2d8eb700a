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
        return scale(substitute(expression, in_degrees, HALF_TURN))
    terms = [multiply(substitute(factor, {}, HALF_TURN), Name(name)) for name, factor in factors.items()]
    return add(*terms, scale(substitute(rest, {}, HALF_TURN)))


def scale(expression: Expression) -> Expression:
    """A number of degrees in radians; the terms of a sum are converted one by one."""
    if isinstance(expression, Sum):
        return add(*(multiply(DEGREE, term) for term in expression.terms))
    return multiply(DEGREE, expression)


def join(factors: Mapping[str, Expression], offset: Expression) -> Expression:
    """A linear function of variables: the sum of its factors times them, and its offset."""
    terms = [multiply(factor, Name(name)) for name, factor in factors.items()]
    return add(*terms, offset) if terms else add(offset, ZERO)
