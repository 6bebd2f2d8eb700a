"""Sums as products of powers, numbers and brackets, and the sums that the addition theorems merge."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import field
from fractions import Fraction
from itertools import permutations
from math import gcd, lcm
from typing import TypeAlias

import sympy as sp

from kinegen.backends.textbook.trees import finite_decimal, is_small_part
from kinegen.support.dataclass import dataclass

UNIT = "length "
"""What the symbols of numeric lengths begin with; the place along the chain follows. No file can spell such a name."""


@dataclass(frozen=True, slots=True)
class Wave:
    """A sine or cosine.

    `is_sine`: which of them. `angle`: its angle; the first joint variable in it is positive. `variables`: name and
    number of the joint variables in it, in the order of their numbers.
    """

    is_sine: bool
    angle: sp.Expr
    variables: tuple[tuple[str, int], ...]

    @property
    def joints(self) -> tuple[int, ...]:
        """Numbers of the joint variables in the angle."""
        return tuple(number for _, number in self.variables)

    @property
    def other(self) -> Wave:
        """The cosine of the angle of a sine, and the other way round."""
        return Wave(not self.is_sine, self.angle, self.variables)


@dataclass(frozen=True, slots=True)
class Bracket:
    """A sum of two terms or more that stands in a product."""

    terms: Terms = field(compare=False)
    same: frozenset[Product] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "same", frozenset(self.terms))


@dataclass(frozen=True, slots=True)
class Product:
    """A term.

    Attributes:
        number: The exact number that multiplies the factors.
        factors: Bases with their exponents, in the order in which they were met.
        place: Where along the chain its numeric length stands; None if the number is no length.
    """

    number: sp.Expr
    factors: tuple[tuple[Base, sp.Rational], ...] = field(default=(), compare=False)
    place: int | None = None
    same: frozenset[tuple[Base, sp.Rational]] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "same", frozenset(self.factors))


Base: TypeAlias = "sp.Expr | Wave | Bracket"
Terms: TypeAlias = "tuple[Product, ...]"
ONE = Product(sp.S.One)

_NESTED = 3
"""Operations that are worth while to be rid of `sqrt(2)*(sqrt(2)*...)`."""


def times(left: Product, right: Product) -> Product:
    """Multiply two terms."""
    exponents = dict(left.factors)
    for base, exponent in right.factors:
        exponents[base] = exponents.get(base, sp.S.Zero) + exponent
    factors = tuple((base, exponent) for base, exponent in exponents.items() if exponent != 0)
    return Product(multiplied(left.number, right.number), factors, first(left.place, right.place))


def power(base: Base, exponent: sp.Rational | int) -> Product:
    """Return a factor alone."""
    return Product(sp.S.One, ((base, sp.sympify(exponent)),))


def multiplied(left: sp.Expr, right: sp.Expr) -> sp.Expr:
    """Return the product of two exact numbers."""
    return sp.expand(left * right) if left.has(sp.Add) or right.has(sp.Add) else left * right


def over(term: Product, number: sp.Expr) -> Product:
    """Return a term divided by a number that is no length."""
    return Product(multiplied(term.number, 1 / number), term.factors, term.place)


def content(rationals: Iterable[sp.Rational]) -> sp.Rational:
    """Return the number that some have in common, such as 1/4 of 1/2 and 3/4."""
    found = tuple(rationals)
    return sp.Rational(gcd(*(int(number.p) for number in found)), lcm(*(int(number.q) for number in found)))


def first(left: int | None, right: int | None) -> int | None:
    """Return the place of two numbers that become one."""
    return min((place for place in (left, right) if place is not None), default=None)


def wave(is_sine: bool, angle: sp.Expr, numbers: Mapping[str, int]) -> Product:
    """Return a sine or cosine of the angle or of its negative, whichever has its first joint variable positive.

    `is_sine`: which of them. `numbers`: number of each joint variable by its name.
    """
    joints = coefficients(angle, numbers)
    turned = bool(joints) and joints[min(joints)] < 0
    names = {number: name for name, number in numbers.items()}
    base = Wave(is_sine, -angle if turned else angle, tuple((names[number], number) for number in joints))
    return times(Product(sp.Integer(-1 if turned and is_sine else 1)), power(base, 1))


def coefficients(angle: sp.Expr, numbers: Mapping[str, int]) -> dict[int, Fraction]:
    """Return the coefficient of each joint variable of an angle by its number, ascending."""
    parts = (part.as_coeff_Mul() for part in sp.Add.make_args(angle))
    found = {
        numbers[symbol.name]: Fraction(int(coefficient.p), int(coefficient.q))
        for coefficient, symbol in parts
        if symbol.is_Symbol and symbol.name in numbers
    }
    return dict(sorted(found.items()))


def bracketed(terms: Terms) -> Product:
    """Return a sum as a factor; a single term is that term."""
    if not terms:
        return Product(sp.S.Zero)
    return terms[0] if len(terms) == 1 else power(Bracket(terms), 1)


def spread(terms: Terms) -> Terms:
    """Return the terms, without brackets around a sum that nothing multiplies."""
    ways = (opened(term) if abs(term.number) == 1 and term.place is None else (term,) for term in terms)
    return tuple(part for way in ways for part in way)


def opened(term: Product) -> Terms:
    """Return a number times a sum as the terms of that sum."""
    if len(term.factors) != 1 or term.factors[0][1] != 1 or not isinstance(term.factors[0][0], Bracket):
        return (term,)
    number = Product(term.number, place=term.place)
    return tuple(times(number, part) for part in term.factors[0][0].terms)


def cost(terms: Terms) -> int:
    """Count the multiplications, divisions and additions of a sum as it is printed."""
    return max(0, len(terms) - 1) + sum(map(_product_cost, terms))


def _product_cost(product: Product) -> int:
    above, below = number_pieces(product.number, is_length=product.place is not None)
    inside = 0
    for base, exponent in product.factors:
        pieces = int(abs(exponent)) if exponent.is_Integer else 1
        above, below = (above + pieces, below) if exponent > 0 else (above, below + pieces)
        if isinstance(base, Bracket):
            inside += cost(base.terms) + _NESTED * _repeats_root(product.number, base.terms)
    return max(0, max(1, above) + below - 1) + inside


def _repeats_root(number: sp.Expr, terms: Terms) -> bool:
    """Return whether a root stands before a bracket with the same root in it."""
    roots = [part for part in sp.Mul.make_args(number) if part.is_Pow]
    return any(root in sp.Mul.make_args(term.number) for root in roots for term in terms)


def number_pieces(number: sp.Expr, *, is_length: bool = False) -> tuple[int, int]:
    """How many factors and divisors a number is printed as: none for 1, one factor for 0.8, both for `sqrt(2)/2`."""
    above = below = 0
    parts = sp.Mul.make_args(number)
    for part in parts:
        if part.is_Rational:
            value = Fraction(int(abs(part.p)), int(part.q))
            is_decimal = is_length or (len(parts) == 1 and is_printed_as_decimal(value))
            above += int(value != 1) if is_decimal else int(value.numerator != 1)
            below += int(value.denominator != 1 and not is_decimal)
        else:
            above += len(part.args) if part.is_Add else 1
    return above, below


def is_printed_as_decimal(value: Fraction) -> bool:
    """Whether a number that is no length is better written as 0.8 than as a fraction; a half and quarters are not."""
    return not is_small_part(value) and bool(finite_decimal(value))


@dataclass(frozen=True, slots=True)
class Reading:
    """Holds how expressions are read.

    `numbers`: number of each joint variable by its name. `shorten`: what is done with the terms of every sum, also
    those in brackets.
    """

    numbers: Mapping[str, int]
    shorten: Callable[[Terms], Terms] = lambda terms: terms

    def terms(self, expression: sp.Expr) -> Terms:
        """Return the terms of an expression."""
        read = (self.product(part) for part in sp.Add.make_args(expression))
        return self.shorten(tuple(term for term in read if term.number != 0))

    def product(self, expression: sp.Expr) -> Product:
        """Return a term."""
        result = ONE
        for part in sp.Mul.make_args(expression):
            result = times(result, self._factor(part))
        return result

    def _factor(self, part: sp.Expr) -> Product:
        if part.is_Symbol:
            is_unit = part.name.startswith(UNIT)
            return Product(sp.S.One, place=int(part.name[len(UNIT) :])) if is_unit else power(part, 1)
        if isinstance(part, (sp.sin, sp.cos)) and part.free_symbols:
            return wave(isinstance(part, sp.sin), part.args[0], self.numbers)
        if part.is_Add:
            return bracketed(self.terms(part))
        if part.is_number and not part.has(sp.sin, sp.cos):
            return Product(part)
        if part.is_Pow and part.exp.is_Rational:
            return self._power(part)
        return power(part, 1)

    def _power(self, part: sp.Pow) -> Product:
        """Return a power of a factor; a power of anything else is a factor by itself."""
        base = self._factor(part.base) if part.exp.is_Integer or part.base.is_Symbol else ONE
        if base.number != 1 or base.place is not None or len(base.factors) != 1:
            return power(part, 1)
        ((inside, exponent),) = base.factors
        return power(inside, exponent * part.exp)

    def joints(self, angle: sp.Expr) -> dict[int, Fraction]:
        """Return the coefficient of each joint variable of an angle by its number, ascending."""
        return coefficients(angle, self.numbers)


def merged(terms: Terms) -> Terms | None:
    """Return the terms with two of them merged, or None if no two make one.

    `terms`: terms without two that have the same factors.
    """
    return next(_squares(terms), None) or next(_sums(terms), None)


def _squares(terms: Terms) -> Iterator[Terms]:
    """By `c**2 + s**2 = 1`: `c**2*x + s**2*x` is `x`, and `x - c**2*x` is `s**2*x`."""
    for index, term in enumerate(terms):
        for base, exponent in term.factors:
            if not isinstance(base, Wave) or exponent < 2:
                continue
            rest = times(term, power(base, -2))
            other = times(rest, power(base.other, 2))
            for place, partner in enumerate(terms):
                kept = tuple(each for at, each in enumerate(terms) if at not in (index, place))
                if partner.same == other.same and partner.number == term.number:
                    yield (*kept, rest)
                elif partner.same == rest.same and partner.number == -term.number:
                    yield (*kept, Product(partner.number, other.factors, partner.place))


def _sums(terms: Terms) -> Iterator[Terms]:
    """By the addition theorems: the sine or cosine of a sum or difference of two angles in place of four."""
    known = {term.same: term for term in terms}
    for term in terms:
        waves = [base for base, exponent in term.factors if isinstance(base, Wave) and exponent >= 1]
        for left, right in permutations(waves, 2):
            if right.is_sine or left.angle == right.angle:
                continue
            rest = times(times(term, power(left, -1)), power(right, -1))
            partner = known.get(times(times(rest, power(left.other, 1)), power(right.other, 1)).same)
            if partner is None or partner.number not in (term.number, -term.number):
                continue
            is_sum = (partner.number == term.number) == left.is_sine
            angle = left.angle + right.angle if is_sum else left.angle - right.angle
            if angle.free_symbols:
                one = times(rest, wave(left.is_sine, angle, dict(left.variables + right.variables)))
                one = Product(one.number, one.factors, first(term.place, partner.place))
                yield tuple(one if each is term else each for each in terms if each is not partner)
