"""Dimensions, units and values of exact expressions: degrees to radians, 50 digits, floats.

In an angle slot of a file in degrees every quantity counts in degrees and `pi` is half a turn, so `pi/2`, `90` and a
quarter turn are the same; `atan2(1, 2)` is the angle itself, whose two values are plain numbers. In a length slot
nothing is converted: a revolute variable there is in radians, as the kernels have it, and `pi` is the number.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping
from decimal import Context, Decimal, DecimalException, localcontext
from fractions import Fraction

from kinegen.model.expression_parser import (
    PI,
    ZERO,
    Arithmetic,
    Expression,
    ExpressionError,
    Name,
    Sum,
    add,
    divisors,
    evaluate,
    linear,
    multiply,
    names,
    number,
    power,
    roots,
    substitute,
    without_arcs,
)
from kinegen.support.compat import StrEnum


class Dimension(StrEnum):
    """The dimension of a parameter or a reading; an angle is in radians here."""

    LENGTH = "length"
    ANGLE = "angle"
    NUMBER = "number"


METRES = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254}
"""The units of lengths that a robot file may have, in metres."""

HALF_TURN = number(180)
DEGREE = multiply(number("1/180"), PI)
RADIAN = multiply(HALF_TURN, power(PI, -1))
"""One radian in degrees."""


def radians(expression: Expression, angles: frozenset[str]) -> Expression:
    """Convert an expression in degrees without joint variables to radians, which the names in `angles` are from now on.

    The terms of a sum are converted one by one, so that `90 + p` becomes `p + pi/2`.
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
    """Return a number of degrees in radians; the terms of a sum are converted one by one."""
    if isinstance(expression, Sum):
        return add(*(multiply(DEGREE, term) for term in expression.terms))
    return multiply(DEGREE, expression)


def join(factors: Mapping[str, Expression], offset: Expression) -> Expression:
    """Return a linear function of variables: the sum of its factors times them, and its offset."""
    terms = [multiply(factor, Name(name)) for name, factor in factors.items()]
    return add(*terms, offset) if terms else add(offset, ZERO)


_ROUNDING = 1e-12


def _arc(function: Callable[[float], float]) -> Callable[[float], float]:
    """Return an arc that takes a value beyond 1 by rounding alone for 1."""

    def arc(value: float) -> float:
        return function(math.copysign(1.0, value) if 1.0 < abs(value) < 1.0 + _ROUNDING else value)

    return arc


FLOAT64 = Arithmetic(
    number=float,
    pi=math.pi,
    functions={
        "sqrt": math.sqrt,
        "sin": math.sin,
        "cos": math.cos,
        "asin": _arc(math.asin),
        "acos": _arc(math.acos),
        "atan": math.atan,
        "atan2": math.atan2,
    },
)
"""Floats, with every function of the language; a function without a value raises ValueError."""


MAX_VALUE = Decimal("1e12")
"""Beyond this a length or angle is a slip of the pen, and single precision begins to overflow in products."""

_ZERO = Decimal("1e-40")
_SMALL, _TERMS = Decimal("0.05"), 21
"""Where Taylor's series of the arc tangent begins, and its terms for 50 digits there."""

_CONTEXT = Context(prec=50)
_PI = Decimal("3.14159265358979323846264338327950288419716939937510582097494")


def _number(value: Fraction) -> Decimal:
    return Decimal(value.numerator) / Decimal(value.denominator)


def _square_root(value: Decimal) -> Decimal:
    if value < -_ZERO:
        raise ExpressionError("it holds the square root of a negative number")
    return max(value, Decimal(0)).sqrt()


def _arc_tangent(value: Decimal) -> Decimal:
    """Add up Taylor's series, after half-angle steps to a small value."""
    halvings = 0
    while abs(value) > _SMALL:
        value /= 1 + (1 + value * value).sqrt()
        halvings += 1
    power: Decimal = value
    total: Decimal = value
    for odd in range(3, 2 * _TERMS, 2):
        power *= -value * value
        total += power / odd
    return total * Decimal(2**halvings)


def _arc_tangent2(y: Decimal, x: Decimal) -> Decimal:
    if is_zero(x) and is_zero(y):
        raise ExpressionError("it holds atan2(0, 0), which has no value")
    if abs(y) > abs(x):
        return (_PI / 2).copy_sign(y) - _arc_tangent(x / y)
    return _arc_tangent(y / x) + (0 if x > 0 else _PI.copy_sign(y))


def _arc_sine(value: Decimal) -> Decimal:
    if abs(value) > 1 + _ZERO:
        raise ExpressionError("it holds the asin or acos of a number outside -1 to 1")
    return _arc_tangent2(value, max(1 - value * value, Decimal(0)).sqrt())


def _arc_cosine(value: Decimal) -> Decimal:
    return _PI / 2 - _arc_sine(value)


_DECIMALS = Arithmetic(
    _number,
    _PI,
    {
        "sqrt": _square_root,
        "asin": _arc_sine,
        "acos": _arc_cosine,
        "atan": _arc_tangent,
        "atan2": _arc_tangent2,
    },
)


def checked_value(expression: Expression, values: Mapping[str, Decimal]) -> Decimal:
    """Evaluate an expression with 50 digits, to refuse what no robot can have; nothing of it goes into frames.

    Raises:
        ExpressionError: If it has no value or a huge one.
    """
    try:
        with localcontext(_CONTEXT):
            if any(is_zero(Decimal(evaluate(each, values, _DECIMALS))) for each in divisors(expression)):
                raise ExpressionError("it has no finite value (division by zero)")
            value = Decimal(evaluate(expression, values, _DECIMALS))
            huge = abs(value) > MAX_VALUE
    except DecimalException:
        raise ExpressionError("it has no finite value (division by zero?)") from None
    if huge:
        raise ExpressionError(f"the value {value:.3g} is too large (at most {MAX_VALUE:.0e})")
    return value


def check_roots(expression: Expression, values: Mapping[str, Decimal], varied: Collection[str]) -> None:
    """Refuse a square root with a varied parameter that is zero, where it has no derivative."""
    for root in roots(expression):
        inside = [name for name in names(root) if name in varied]
        if inside and is_zero(checked_value(root, values)):
            raise ExpressionError(
                f"'{inside[0]}' is set at run time and is in a square root that is zero with the values of the file, "
                "where it has no derivative; give the parameter another value, or make the root the parameter"
            )


def is_zero(value: Decimal) -> bool:
    """Tell whether a value is zero, but for the rounding of its last digits."""
    return abs(value) < _ZERO
