"""The tree of an exact expression, and what can be done to it without leaving the exact numbers.

Numbers that stand together are folded, so `-90/180*pi` is one number times pi; nothing else is rearranged. Import
these names from `expressions`, which adds reading and evaluation.
"""

from __future__ import annotations

from collections.abc import Mapping
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
    """One of `FUNCTIONS` applied to its argument."""

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


def names(expression: Expression) -> tuple[str, ...]:
    """The names in an expression, in order of appearance, each once."""
    found: dict[str, None] = {}
    _gather(expression, found)
    return tuple(found)


def _gather(expression: Expression, found: dict[str, None]) -> None:
    match expression:
        case Name(name):
            found[name] = None
        case Sum(parts) | Product(parts):
            for part in parts:
                _gather(part, found)
        case Power(inner, _) | Call(_, inner):
            _gather(inner, found)
        case Atan2(y, x):
            _gather(y, found)
            _gather(x, found)
        case _:
            pass


def largest_number(expression: Expression) -> int:
    """The largest numerator or denominator, without its sign, that an expression holds."""
    match expression:
        case Number(value):
            return max(abs(value.numerator), value.denominator)
        case Sum(parts) | Product(parts):
            return max(largest_number(part) for part in parts)
        case Power(inner, _) | Call(_, inner):
            return largest_number(inner)
        case Atan2(y, x):
            return max(largest_number(y), largest_number(x))
        case _:
            return 1


def size(expression: Expression) -> int:
    """The number of nodes of an expression."""
    match expression:
        case Sum(parts) | Product(parts):
            return 1 + sum(size(part) for part in parts)
        case Power(inner, _) | Call(_, inner):
            return 1 + size(inner)
        case Atan2(y, x):
            return 1 + size(y) + size(x)
        case _:
            return 1


def depth(expression: Expression) -> int:
    """The number of levels of an expression."""
    match expression:
        case Sum(parts) | Product(parts):
            return 1 + max(depth(part) for part in parts)
        case Power(inner, _) | Call(_, inner):
            return 1 + depth(inner)
        case Atan2(y, x):
            return 1 + max(depth(y), depth(x))
        case _:
            return 1


def substitute(expression: Expression, values: Mapping[str, Expression], pi: Expression = PI) -> Expression:
    """Replace names, and `pi` where another value is given, keeping everything exact."""
    match expression:
        case Name(name):
            return values.get(name, expression)
        case Pi():
            return pi
        case Sum(parts):
            return add(*(substitute(part, values, pi) for part in parts))
        case Product(parts):
            return multiply(*(substitute(part, values, pi) for part in parts))
        case Power(base, exponent):
            return power(substitute(base, values, pi), exponent)
        case Call(function, argument):
            return Call(function, substitute(argument, values, pi))
        case Atan2(y, x):
            return Atan2(substitute(y, values, pi), substitute(x, values, pi))
        case _:
            return expression


def linear(expression: Expression, variables: frozenset[str]) -> tuple[dict[str, Expression], Expression]:
    """Split an expression into the coefficients of some variables and the rest.

    Args:
        expression: The tree.
        variables: Names that may stand in it linearly only.

    Returns:
        The coefficient of each variable that occurs, in order of appearance, and the remaining offset.

    Raises:
        ExpressionError: If a variable stands in a product with another, under a power or in a function.
    """
    match expression:
        case Name(name) if name in variables:
            return {name: ONE}, ZERO
        case Sum(parts):
            halves = [linear(part, variables) for part in parts]
            found: dict[str, list[Expression]] = {}
            for coefficients, _ in halves:
                for name, coefficient in coefficients.items():
                    found.setdefault(name, []).append(coefficient)
            return {name: add(*values) for name, values in found.items()}, add(*(rest for _, rest in halves))
        case Product(parts):
            return _linear_product(parts, variables)
        case _:
            inside = [name for name in names(expression) if name in variables]
            if inside:
                raise ExpressionError(f"joint variable '{inside[0]}' must stand linearly, as in '2*{inside[0]} + 1'")
            return {}, expression


def _linear_product(
    parts: tuple[Expression, ...], variables: frozenset[str]
) -> tuple[dict[str, Expression], Expression]:
    moving = [part for part in parts if variables.intersection(names(part))]
    fixed = multiply(*(part for part in parts if part not in moving), ONE)
    if not moving:
        return {}, fixed
    if len(moving) > 1:
        raise ExpressionError("a product of two joint variables is not linear")
    coefficients, offset = linear(moving[0], variables)
    return {name: multiply(fixed, value) for name, value in coefficients.items()}, multiply(fixed, offset)
