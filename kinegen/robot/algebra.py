"""The tree of an exact expression, and how trees are made of trees.

Numbers that stand together are folded, so `-90/180*pi` is one number times pi; nothing else is rearranged. Import
these names from `expressions`, which adds reading and evaluation.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

MAX_EXPONENT = 64
MAX_BITS = 4000
"""Bits of the numerator or denominator of a power of a number."""


class ExpressionError(ValueError):
    """The text is not an expression of the language; the message says why."""


@dataclass(frozen=True, slots=True)
class Number:
    """An exact rational number."""

    value: Fraction


@dataclass(frozen=True, slots=True)
class Pi:
    """The number pi."""


@dataclass(frozen=True, slots=True)
class Name:
    """A parameter or a joint variable."""

    name: str


@dataclass(frozen=True, slots=True)
class Sum:
    """Two or more terms, added in the order written."""

    terms: tuple[Expression, ...]


@dataclass(frozen=True, slots=True)
class Product:
    """Two or more factors, a number first if there is one."""

    factors: tuple[Expression, ...]


@dataclass(frozen=True, slots=True)
class Power:
    """A base to an integer exponent."""

    base: Expression
    exponent: int


@dataclass(frozen=True, slots=True)
class Call:
    """A function of one value applied to its argument."""

    function: str
    argument: Expression


@dataclass(frozen=True, slots=True)
class Atan2:
    """The angle of the point (x, y), in (-pi, pi]."""

    y: Expression
    x: Expression


Expression = Number | Pi | Name | Sum | Product | Power | Call | Atan2

ZERO = Number(Fraction(0))
ONE = Number(Fraction(1))
PI = Pi()


def number(value: int | str | Fraction) -> Number:
    """Make an exact number from an integer, a fraction or decimal text."""
    return Number(Fraction(value))


def add(*terms: Expression) -> Expression:
    """Add terms, folding the numbers among them into one that stands last."""
    flat = [part for term in terms for part in (term.terms if isinstance(term, Sum) else (term,))]
    constant = sum((part.value for part in flat if isinstance(part, Number)), Fraction(0))
    others: list[Expression] = [part for part in flat if not isinstance(part, Number)]
    if constant or not others:
        others.append(Number(constant))
    return others[0] if len(others) == 1 else Sum(tuple(others))


def multiply(*factors: Expression) -> Expression:
    """Multiply factors, folding the numbers among them into one that stands first."""
    flat = [part for factor in factors for part in (factor.factors if isinstance(factor, Product) else (factor,))]
    constant = Fraction(1)
    for part in flat:
        if isinstance(part, Number):
            constant *= part.value
    others: list[Expression] = [part for part in flat if not isinstance(part, Number)]
    if constant == 0:
        return ZERO
    if PI in others and Power(PI, -1) in others:
        others.remove(PI)
        others.remove(Power(PI, -1))
    if constant != 1 or not others:
        others.insert(0, Number(constant))
    return others[0] if len(others) == 1 else Product(tuple(others))


def negate(term: Expression) -> Expression:
    """Change the sign."""
    if isinstance(term, Sum):
        return add(*(negate(part) for part in term.terms))
    return multiply(number(-1), term)


def power(base: Expression, exponent: int) -> Expression:
    """Raise to an integer power; a number is folded.

    Raises:
        ExpressionError: On a zero to a negative power, or an exponent beyond `MAX_EXPONENT`.
    """
    if abs(exponent) > MAX_EXPONENT:
        raise ExpressionError(f"exponent {exponent} is too large (at most {MAX_EXPONENT})")
    if exponent == 1:
        return base
    if exponent == 0:
        return ONE
    if isinstance(base, Number):
        if base.value == 0 and exponent < 0:
            raise ExpressionError("division by zero")
        # Bits, not digits: Python refuses to print an integer of more than 4300 digits.
        bits = max(base.value.numerator.bit_length(), base.value.denominator.bit_length())
        if abs(exponent) * bits > MAX_BITS:
            raise ExpressionError("the number is too long")
        return Number(base.value**exponent)
    if isinstance(base, Product):
        return multiply(*(power(factor, exponent) for factor in base.factors))
    if isinstance(base, Power):
        return power(base.base, base.exponent * exponent)
    return Power(base, exponent)


ARCS = frozenset({"asin", "acos", "atan"})
"""Functions of one value that give an angle; `atan2` is the one of two values."""

_ARC_VALUES = {
    "asin": {"0": "0", "1/2": "1/6", "1": "1/2"},
    "acos": {"-1": "1", "-1/2": "2/3", "0": "1/2", "1/2": "1/3", "1": "0"},
    "atan": {"0": "0", "1": "1/4"},
}
_SHARES = {
    (function, sign * Fraction(value)): sign * Fraction(share)
    for function, values in _ARC_VALUES.items()
    for value, share in values.items()
    for sign in ((1,) if function == "acos" else (1, -1))
}
"""The rational numbers whose arcs are a rational share of pi, with that share."""


def call(function: str, argument: Expression) -> Expression:
    """Apply a function of one value; an arc that is a share of pi is folded."""
    if isinstance(argument, Number) and (share := _SHARES.get((function, argument.value))) is not None:
        return multiply(Number(share), PI)
    return Call(function, argument)


def arc_tangent(y: Expression, x: Expression) -> Expression:
    """The angle of the point (x, y); on an axis or a diagonal it is folded.

    Raises:
        ExpressionError: At the origin, which has no angle.
    """
    if isinstance(y, Number) and isinstance(x, Number):
        if y.value == 0 == x.value:
            raise ExpressionError("atan2(0, 0) has no value")
        if 0 in (y.value, x.value) or abs(y.value) == abs(x.value):
            return multiply(Number(Fraction(_EIGHTHS[_sign(y.value), _sign(x.value)], 4)), PI)
    return Atan2(y, x)


_EIGHTHS = {(0, 1): 0, (1, 1): 1, (1, 0): 2, (1, -1): 3, (0, -1): 4, (-1, -1): -3, (-1, 0): -2, (-1, 1): -1}
"""The angle of a point on an axis or a diagonal, by the signs of y and x, in eighths of a turn."""


def _sign(value: Fraction) -> int:
    return (value > 0) - (value < 0)
