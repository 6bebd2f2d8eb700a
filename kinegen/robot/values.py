"""Values of closed expressions with 50 digits, to refuse what no robot can have: roots of negatives, huge numbers.

Nothing computed here goes into the frames of a robot; the exact expressions do. Limits of joints are printed from it.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from decimal import Context, Decimal, DecimalException, localcontext
from fractions import Fraction

from kinegen.robot.expressions import Arithmetic, Expression, ExpressionError, evaluate, names, roots

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
    """By Taylor's series, after half-angle steps to a small value."""
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
        raise ExpressionError("it holds the asin or acos of a number beyond 1 or -1")
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
    """Evaluate an expression and see that it is a number of sensible size.

    Args:
        expression: Any expression.
        values: A value for each name in it.

    Raises:
        ExpressionError: If it has no value or a huge one.
    """
    try:
        with localcontext(_CONTEXT):
            value = Decimal(evaluate(expression, values, _DECIMALS))
            huge = abs(value) > MAX_VALUE
    except DecimalException:
        raise ExpressionError("it has no finite value (division by zero?)") from None
    if huge:
        raise ExpressionError(f"the value {value:.3g} is too large (at most {MAX_VALUE:.0e})")
    return value


def check_roots(expression: Expression, values: Mapping[str, Decimal], varied: Collection[str]) -> None:
    """See that no square root with a varied parameter is zero, where it has no derivative.

    Args:
        expression: Any expression.
        values: A value for each parameter.
        varied: The parameters that are set at run time.

    Raises:
        ExpressionError: If there is such a root.
    """
    for root in roots(expression):
        inside = [name for name in names(root) if name in varied]
        if inside and is_zero(checked_value(root, values)):
            raise ExpressionError(
                f"'{inside[0]}' is set at run time and is in a square root that is zero with the values of the file, "
                "where it has no derivative; give the parameter another value, or make the root the parameter"
            )


def is_zero(value: Decimal) -> bool:
    """Whether a value is zero, but for the rounding of its last digits."""
    return abs(value) < _ZERO
