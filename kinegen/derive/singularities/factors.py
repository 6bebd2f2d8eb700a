"""Factors of a polynomial in lengths, sines and cosines, and which of them vanish together.

Modulo c^2 + s^2 = 1 a polynomial has many forms, and only some of them show its factors. Where all terms have an odd
degree in the sine and cosine of an angle, or all an even one, terms are filled up with c^2 + s^2 to the same degree:
that form is unique, and its factors are those of the expression. A sine or cosine that divides an expression is found
by its values where that sine or cosine vanishes.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import product as choices
from typing import Any

import sympy as sp
from sympy.polys.rings import PolyElement

from kinegen.derive.singularities.trigonometric_polynomials import Algebra, Unit
from kinegen.support.dataclass import dataclass

MOST_TERMS = 60
"""A polynomial with more terms is only searched for lengths, sines and cosines that divide it."""

MOST_GENERATORS = 12


@dataclass(frozen=True, slots=True)
class Factored:
    """A product.

    `factors`: polynomials with their powers, each with a positive first coefficient; none is a number. Coefficients
    that are lengths of the table but for a number are these lengths, others are integers.
    """

    constant: sp.Rational
    factors: tuple[tuple[PolyElement, int], ...]


def factored(parts: tuple[PolyElement, ...], algebra: Algebra) -> Factored:
    """Factor a product of polynomials, none of them zero.

    Returns the same, modulo c^2 + s^2 = 1. Where a long polynomial has factors that are not found, they stay together.
    """
    constant = sp.S.One
    powers: dict[PolyElement, int] = {}
    for part in parts:
        for factor in _factors(algebra.reduced(part), algebra):
            content = factor.LC / abs(factor.LC) * factor.content()
            content /= _scale([abs(value / content) for value in factor.values()], algebra)
            constant *= sp.QQ.to_sympy(content)
            primitive = factor.quo_ground(content)
            if primitive != 1:
                powers[primitive] = powers.get(primitive, 0) + 1
    return Factored(constant, tuple(powers.items()))


def _scale(coefficients: list[Any], algebra: Algebra) -> Any:
    """Return a number that turns all coefficients of a sum into lengths of the table; 1 if there is none."""
    lengths = {sp.QQ.from_sympy(length) for length in algebra.lengths}
    scales = [length / coefficients[0] for length in sorted(lengths)] if len(set(coefficients)) > 1 else []
    return next((s for s in scales if all(s * each in lengths for each in coefficients)), sp.QQ.one)


def _factors(p: PolyElement, algebra: Algebra) -> Iterator[PolyElement]:
    # Lengths that divide every term.
    shared = tuple(map(min, zip(*p, strict=True)))
    for place, power in enumerate(shared):
        yield from [algebra.ring.gens[place]] * power
    p = algebra.ring.from_dict({tuple(a - b for a, b in zip(m, shared, strict=True)): c for m, c in p.items()})
    # Sines and cosines that divide the whole.
    for unit in algebra.units:
        for place in (unit.sine, unit.cosine):
            while (quotient := _without(p, unit, place, algebra)) is not None:
                yield algebra.ring.gens[place]
                p = quotient
    yield from _searched(p, algebra)


def _without(p: PolyElement, unit: Unit, place: int, algebra: Algebra) -> PolyElement | None:
    """Return a polynomial divided by the sine or cosine of an angle, or None if that does not divide it.

    It is a(c) + s*b(c), and s divides it if a vanishes at both values that c has where s does.
    """
    ring = algebra.ring
    other = unit.cosine if place == unit.sine else unit.sine
    if all(monomial[place] == monomial[other] == 0 for monomial in p):
        return None
    p = algebra.reduced(p, by_cosine=place == unit.cosine)
    free = ring.from_dict({monomial: c for monomial, c in p.items() if not monomial[place]})
    if any(free.evaluate(ring.gens[other], value) for value in (1, -1)):
        return None
    rest = (p - free).quo(ring.gens[place])
    return algebra.reduced(rest + free.quo(1 - ring.gens[other] ** 2) * ring.gens[place])


def _searched(p: PolyElement, algebra: Algebra) -> list[PolyElement]:
    """Return the factors that a search finds in one of the forms of a polynomial."""
    best = [p]
    for by_cosine in (False, True):
        form = _homogeneous(algebra.reduced(p, by_cosine), algebra)
        used = [gen for place, gen in enumerate(algebra.ring.gens) if any(monomial[place] for monomial in form)]
        if len(form) < 2 or len(form) > MOST_TERMS or len(used) > MOST_GENERATORS:
            continue
        found = _listed(form, algebra)
        if len(found) > len(best):
            best = found
    return best


def _listed(form: PolyElement, algebra: Algebra) -> list[PolyElement]:
    """Return the factors of a polynomial in its ring, reduced, with the constant in the first."""
    ring = algebra.ring
    places = [place for place in range(ring.ngens) if any(monomial[place] for monomial in form)]
    names = [ring.symbols[place] for place in places]
    small = ring.clone(symbols=names)
    constant, factors = _irreducible(small.from_dict({tuple(m[at] for at in places): c for m, c in form.items()}))
    found = []
    for factor in factors:
        wide = {}
        for monomial, coefficient in factor.items():
            entry = [0] * ring.ngens
            for place, exponent in zip(places, monomial, strict=True):
                entry[place] = exponent
            wide[tuple(entry)] = coefficient
        found.append(algebra.reduced(ring.from_dict(wide)))
    # What is 1 modulo c^2 + s^2 = 1 is not a factor.
    found = [factor for factor in found if factor != 1]
    found[:1] = [constant * factor for factor in found[:1]]
    return found


def _irreducible(p: PolyElement) -> tuple[Any, list[PolyElement]]:
    """Return a constant, and the factors of a polynomial as such.

    Where it is a + g*b in some generator g, its only factor with g is what the common divisor of a and b leaves.
    """
    ring = p.ring
    for place, generator in enumerate(ring.gens):
        if max(monomial[place] for monomial in p) == 1:
            free = ring.from_dict({monomial: c for monomial, c in p.items() if not monomial[place]})
            if not free:
                continue
            divisor = free.gcd((p - free).exquo(generator))
            if divisor.is_ground:
                return sp.QQ.one, [p]
            constant, factors = _irreducible(divisor)
            return constant, [*factors, p.exquo(divisor)]
    constant, powers = p.factor_list()
    return constant, [factor for factor, power in powers for _ in range(power)]


def _homogeneous(p: PolyElement, algebra: Algebra) -> PolyElement:
    """Return the form in which every angle with degrees that are all odd or all even has one degree."""
    ring = algebra.ring
    for unit in algebra.units:
        degrees = {monomial[unit.cosine] + monomial[unit.sine] for monomial in p}
        if len(degrees) < 2 or len({degree % 2 for degree in degrees}) > 1:
            continue
        one = ring.gens[unit.cosine] ** 2 + ring.gens[unit.sine] ** 2
        filled = ring.zero
        for monomial, coefficient in p.items():
            missing = max(degrees) - monomial[unit.cosine] - monomial[unit.sine]
            filled += ring.from_dict({monomial: coefficient}) * one ** (missing // 2)
        p = filled
    return p


MOST_STEPS = 500
"""A search that takes more steps is given up."""

Options = dict[sp.Expr, sp.Expr]
"""The factors of a product that can vanish, as they are printed, each with what is left of it."""


def vanishing_together(
    products: Sequence[Iterable[sp.Expr]], nonzero: Iterable[sp.Expr], joints: Iterable[sp.Symbol]
) -> tuple[tuple[sp.Expr, ...], ...] | None:
    """Return the smallest sets of factors that make all products vanish.

    Returns sets of expressions that vanish together, none of them contained in another one; None if there are too many.
    Where the sine of an angle vanishes its cosine does not, and the other way round; where a sum vanishes that is
    linear in a slide, that slide has the value it has there. Other dependencies between factors are not looked for, so
    that a set may have no solution. `joints`: symbols of joint variables; what depends on none of them does not vanish
    either.
    """
    search = _Search(frozenset(nonzero), frozenset(joints))
    options = [search.options({factor: _expanded(factor) for factor in each}) for each in products]
    try:
        found = [frozenset(each) for each in search.sets([option for option in options if option is not None], ())]
    except OverflowError:
        return None
    least = [each for each in dict.fromkeys(found) if not any(other < each for other in found)]
    ordered = (tuple(sorted(each, key=sp.default_sort_key)) for each in least)
    return tuple(sorted(ordered, key=lambda each: (len(each), str(each))))


class _Search:
    def __init__(self, nonzero: frozenset[sp.Expr], joints: frozenset[sp.Symbol]) -> None:
        self.nonzero, self.joints = nonzero, joints
        self.signs: dict[sp.Expr, sp.Dummy] = {}  # for an angle, its sine or cosine where the square of that is 1
        self.steps = 0

    def options(self, factors: Options) -> Options | None:
        """Return the factors of a product that can vanish; None if one of them is zero already."""
        found: Options = {}
        for printed, left in factors.items():
            if left == 0:
                return None
            if printed in self.nonzero:
                continue
            parts = [part.base if part.is_Pow else part for part in sp.Mul.make_args(left)]
            parts = [part for part in parts if self._can_vanish(part) and part not in self.nonzero]
            if len(parts) == 1 and not isinstance(parts[0], (sp.sin, sp.cos)):
                found[printed] = parts[0]
            else:
                found |= {part if isinstance(part, (sp.sin, sp.cos)) else printed: part for part in parts}
        return found

    def sets(self, products: list[Options], zero: tuple[sp.Expr, ...]) -> Iterator[tuple[sp.Expr, ...]]:
        self.steps += 1
        if self.steps > MOST_STEPS:
            raise OverflowError
        if not products:
            yield zero
            return
        for printed, left in min(products, key=len).items():
            rest = []
            for product in products:
                if printed not in product:
                    options = self.options({name: self._where(value, left) for name, value in product.items()})
                    rest += [] if options is None else [options]
            yield from self.sets(rest, (*zero, printed))

    def _can_vanish(self, part: sp.Expr) -> bool:
        if part.free_symbols & self.joints:
            return True
        signs = [sign for sign in self.signs.values() if part.has(sign)]
        return any(part.subs(dict(zip(signs, some, strict=True))) == 0 for some in choices((1, -1), repeat=len(signs)))

    def _where(self, value: sp.Expr, zero: sp.Expr) -> sp.Expr:
        if isinstance(zero, (sp.sin, sp.cos)):
            (angle,) = zero.args
            sign = self.signs.setdefault(angle, sp.Dummy(f"sign{len(self.signs)}"))
            other = (sp.cos if isinstance(zero, sp.sin) else sp.sin)(angle)
            left = _signed(sp.expand(value.xreplace({zero: sp.S.Zero, other: sign})), sign)
        else:
            zero = sp.expand(zero)
            slide = next((joint for joint in sorted(self.joints, key=str) if _is_linear(zero, joint)), None)
            if slide is None:
                return value
            left = sp.expand(value.xreplace({slide: slide - zero / zero.coeff(slide)}))
        return sp.gcd_terms(left) if left.is_Add else left


def _expanded(factor: sp.Expr) -> sp.Expr:
    """Return a factor in sines and cosines of single joints, so that values can be put in; those of one sum stay."""
    return factor if isinstance(factor, (sp.sin, sp.cos)) else sp.expand(sp.expand_trig(factor))


def _is_linear(zero: sp.Expr, joint: sp.Symbol) -> bool:
    slope = zero.coeff(joint)
    return slope.is_Rational and slope != 0 and not (zero - slope * joint).has(joint)


def _signed(left: sp.Expr, sign: sp.Dummy) -> sp.Expr:
    """Return an expression without powers of a number whose square is 1."""
    powers = [(term, term.as_powers_dict().get(sign, 0)) for term in sp.Add.make_args(left)]
    return sp.Add(*(term / sign**power * sign ** (power % 2) for term, power in powers))
