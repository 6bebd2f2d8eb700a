"""The tree of an exact expression: how trees are made of trees, what can be asked of one, and what replaced in it.

Numbers that stand together are folded, so `-90/180*pi` is one number times pi; nothing else is rearranged. Import
these names from `expression_parser`, which adds reading and evaluation.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from fractions import Fraction
from functools import lru_cache
from typing import NamedTuple

from kinegen.support.dataclass import dataclass

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
    """Return the angle of the point (x, y); on an axis or a diagonal it is folded.

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


def parts_of(expression: Expression) -> tuple[Expression, ...]:
    """Return the expressions of which another one is made directly; none for a number, pi or a name."""
    match expression:
        case Sum(parts) | Product(parts):
            return parts
        case Power(inner, _) | Call(_, inner):
            return (inner,)
        case Atan2(y, x):
            return (y, x)
    return ()


def rebuilt(expression: Expression, change: Callable[[Expression], Expression]) -> Expression:
    """Make an expression again of its parts after a change, folding numbers that come together."""
    match expression:
        case Sum(parts):
            return add(*map(change, parts))
        case Product(parts):
            return multiply(*map(change, parts))
        case Power(base, exponent):
            return power(change(base), exponent)
        case Call(function, argument):
            return call(function, change(argument))
        case Atan2(y, x):
            return arc_tangent(change(y), change(x))
    return expression


def is_arc(expression: Expression) -> bool:
    """Tell whether an expression is one of the functions that give an angle."""
    return isinstance(expression, Atan2) or (isinstance(expression, Call) and expression.function in ARCS)


def arcs(expression: Expression) -> tuple[Expression, ...]:
    """Return the outermost functions that give an angle, in order of appearance, each once."""
    if is_arc(expression):
        return (expression,)
    return tuple(dict.fromkeys(arc for part in parts_of(expression) for arc in arcs(part)))


def roots(expression: Expression) -> tuple[Expression, ...]:
    """Return what stands under each square root, those within others too."""
    inside = tuple(root for part in parts_of(expression) for root in roots(part))
    return (expression.argument, *inside) if isinstance(expression, Call) and expression.function == "sqrt" else inside


def divisors(expression: Expression) -> tuple[Expression, ...]:
    """Return what is divided by, those within others first."""
    inside = tuple(divisor for part in parts_of(expression) for divisor in divisors(part))
    return (*inside, expression.base) if isinstance(expression, Power) and expression.exponent < 0 else inside


def without_arcs(expression: Expression) -> tuple[Expression, dict[str, Expression]]:
    """Put names that no file can spell in place of the outermost arcs; return the arc of each name too."""
    found = {arc: f"arc {place}" for place, arc in enumerate(arcs(expression))}

    def hidden(part: Expression) -> Expression:
        return Name(found[part]) if part in found else rebuilt(part, hidden)

    return hidden(expression), {name: arc for arc, name in found.items()}


def names(expression: Expression) -> tuple[str, ...]:
    """Return the names in an expression, in order of appearance, each once."""
    found: dict[str, None] = {}
    _gather(expression, found)
    return tuple(found)


def _gather(expression: Expression, found: dict[str, None]) -> None:
    if isinstance(expression, Name):
        found[expression.name] = None
    for part in parts_of(expression):
        _gather(part, found)


def largest_number(expression: Expression) -> int:
    """Return the largest numerator or denominator, without its sign, that an expression holds."""
    if isinstance(expression, Number):
        return max(abs(expression.value.numerator), expression.value.denominator)
    return max(map(largest_number, parts_of(expression)), default=1)


def size(expression: Expression) -> int:
    """Return the number of nodes of an expression."""
    return 1 + sum(map(size, parts_of(expression)))


def depth(expression: Expression) -> int:
    """Return the number of levels of an expression."""
    return 1 + max(map(depth, parts_of(expression)), default=0)


def substitute(expression: Expression, values: Mapping[str, Expression], pi: Expression = PI) -> Expression:
    """Replace names, and `pi` where another value is given, keeping everything exact."""
    match expression:
        case Name(name):
            return values.get(name, expression)
        case Pi():
            return pi
    return rebuilt(expression, lambda part: substitute(part, values, pi))


class Linear(NamedTuple):
    """A linear function of variables: the factor of each that occurs, in order of appearance, and the rest."""

    factors: Mapping[str, Expression]
    offset: Expression


def linear(expression: Expression, variables: Iterable[str]) -> Linear:
    """Split an expression that is linear in some variables; it is found once, for all stages that ask.

    Raises:
        ExpressionError: If a variable stands in a product with another, under a power or in a function.
    """
    return _linear(expression, frozenset(variables))


@lru_cache(maxsize=4096)
def _linear(expression: Expression, variables: frozenset[str]) -> Linear:
    match expression:
        case Name(name) if name in variables:
            return Linear({name: ONE}, ZERO)
        case Sum(parts):
            halves = [_linear(part, variables) for part in parts]
            found: dict[str, list[Expression]] = {}
            for factors, _ in halves:
                for name, factor in factors.items():
                    found.setdefault(name, []).append(factor)
            return Linear(
                {name: add(*values) for name, values in found.items()}, add(*(half.offset for half in halves))
            )
        case Product(parts) if moving := [part for part in parts if variables.intersection(names(part))]:
            if len(moving) > 1:
                raise ExpressionError("a product of two joint variables is not linear")
            fixed = multiply(*(part for part in parts if part not in moving), ONE)
            factors, offset = _linear(moving[0], variables)
            return Linear({name: multiply(fixed, value) for name, value in factors.items()}, multiply(fixed, offset))
        case Product(parts):
            return Linear({}, multiply(*parts, ONE))
    if inside := [name for name in names(expression) if name in variables]:
        raise ExpressionError(f"joint variable '{inside[0]}' must be linear, as in '2*{inside[0]} + 1'")
    return Linear({}, expression)
