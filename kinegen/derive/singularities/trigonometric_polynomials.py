"""Polynomials in lengths, sines and cosines of single angles, modulo c^2 + s^2 = 1, and how people write them.

A sum of angles is expanded to the sines and cosines of its terms, so that every factor is a factor of polynomials.
Written again, products such as c2*c3 - s2*s3 of joints with parallel axes become c23, and of the forms of a factor the
one with the fewest operations is kept.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator, Sequence
from fractions import Fraction

import sympy as sp
from sympy.polys.polyutils import parallel_dict_from_expr
from sympy.polys.rings import PolyElement, PolyRing

from kinegen.derive.folding import cosine_sine, quarter_turns
from kinegen.derive.transforms import Elementary, Turn
from kinegen.support.dataclass import dataclass

MOST_TERMS = 200
"""A determinant with a longer factor is not computed."""


class TooLongError(Exception):
    """A polynomial has too many terms to be computed or printed."""


@dataclass(frozen=True, slots=True)
class Unit:
    """An angle of which other angles are multiples and sums.

    `angle`: such as `q2`, `q1 + phi`, `q1/2`. `cosine`: place of its cosine among the generators of the ring. `sine`:
    place of its sine.
    """

    angle: sp.Expr
    cosine: int
    sine: int


class Algebra:
    """The ring of a chain of elementary transforms.

    Args:
        rates: Factors with which joints move transforms; they belong to the ring too.
    """

    def __init__(self, steps: Sequence[Elementary], rates: Iterable[sp.Expr], joints: Sequence[sp.Symbol]) -> None:
        self._joints = frozenset(joints)
        # Angles that several turns share are split into the terms of which all are multiples.
        turned = [quarter_turns(step.angle)[0] for step in steps if isinstance(step, Turn)]
        parts = [part for angle in turned for part in self._split(angle, turned)]
        shares: dict[sp.Expr, list[sp.Rational]] = {}
        for share, base in parts:
            shares.setdefault(base, []).append(share)
        # Constant angles with roots become numbers; the others get a sine and a cosine.
        angles = {base: _divisor(each) for base, each in shares.items() if not _is_number(base)}
        numbers = [value for base in shares if _is_number(base) for value in cosine_sine(base)]
        lengths = [step.length for step in steps if not isinstance(step, Turn)]
        atoms = _atoms([*lengths, *rates, *numbers])
        names = [sp.Dummy(f"{kind}{index}") for index in range(len(angles)) for kind in "cs"]
        self.ring = PolyRing([*atoms, *names], sp.QQ, sp.lex)
        self.units = tuple(
            Unit(base * share, len(atoms) + 2 * index, len(atoms) + 2 * index + 1)
            for index, (base, share) in enumerate(angles.items())
        )
        self._bases = {base: (unit, angles[base]) for base, unit in zip(angles, self.units, strict=True)}
        self._turned = turned
        # Square roots are generators too, whose squares are replaced.
        self._roots = {
            place: self.ring.ground_new(sp.QQ.from_sympy(atom**2))
            for place, atom in enumerate(atoms)
            if atom.is_Pow and (atom**2).is_Rational and atom.exp > 0
        }
        self.atoms = tuple(atoms)
        self.lengths = frozenset(abs(length) for length in lengths if length.is_Rational)

    def element(self, expression: sp.Expr) -> PolyElement:
        """Return a length or a rate."""
        return self.ring.from_expr(sp.expand(expression))

    def cosine_sine(self, angle: sp.Expr) -> tuple[PolyElement, PolyElement]:
        """Return the cosine and the sine of the angle of a turn."""
        rest, quarters = quarter_turns(angle)
        cosine, sine = self.ring.one, self.ring.zero
        for share, base in self._split(rest, self._turned):
            for _ in range(1 if _is_number(base) else abs(share / self._bases[base][1])):
                c, s = self._pair(share, base)
                cosine, sine = self.reduced(cosine * c - sine * s), self.reduced(sine * c + cosine * s)
        for _ in range(quarters):
            cosine, sine = -sine, cosine
        return cosine, sine

    def units_of(self, angle: sp.Expr) -> tuple[Unit, ...]:
        """Return the units of the angle of a turn, constants left out."""
        parts = self._split(quarter_turns(angle)[0], self._turned)
        return tuple(self._bases[base][0] for _, base in parts if not _is_number(base))

    def _pair(self, share: sp.Rational, base: sp.Expr) -> tuple[PolyElement, PolyElement]:
        if _is_number(base):
            c, s = cosine_sine(base)
            return self.element(c), self.element(s)
        unit = self._bases[base][0]
        sine = self.ring.gens[unit.sine]
        return self.ring.gens[unit.cosine], -sine if share < 0 else sine

    def _split(self, angle: sp.Expr, turned: Sequence[sp.Expr]) -> list[tuple[sp.Rational, sp.Expr]]:
        """Return an angle as multiples of units: whole if its joint turns nothing else, otherwise term by term."""
        if angle == 0:
            return []
        moving = angle.free_symbols & self._joints
        if len(moving) == 1 and sum(bool(other.free_symbols & moving) for other in turned) == 1:
            backwards = angle.coeff(*moving).could_extract_minus_sign()
            return [(sp.S.NegativeOne, -angle) if backwards else (sp.S.One, angle)]
        fixed = sp.Add(*(term for term in sp.Add.make_args(angle) if not term.free_symbols))
        terms = [term.as_coeff_Mul() for term in sp.Add.make_args(angle) if term.free_symbols]
        return [*terms, *([(sp.S.One, fixed)] if fixed != 0 else [])]

    def reduced(self, p: PolyElement, by_cosine: bool = False) -> PolyElement:
        """Return a polynomial with sines (or cosines) and square roots in the first power at most."""
        for unit in self.units:
            place, other = (unit.cosine, unit.sine) if by_cosine else (unit.sine, unit.cosine)
            if any(monomial[place] > 1 for monomial in p):
                p = _replaced(p, place, 1 - self.ring.gens[other] ** 2)
        for place, square in self._roots.items():
            if any(monomial[place] > 1 for monomial in p):
                p = _replaced(p, place, square)
        return p

    def product(self, p: PolyElement, q: PolyElement) -> PolyElement:
        """Return a product, reduced.

        Raises TooLongError if it has too many terms.
        """
        if len(p) * len(q) > MOST_TERMS**2 / 4:
            raise TooLongError
        found = self.reduced(p * q)
        if len(found) > MOST_TERMS:
            raise TooLongError
        return found


def _is_number(base: sp.Expr) -> bool:
    """Tell whether an angle is constant, with a cosine and a sine that are sums of square roots of rational numbers."""
    return not base.free_symbols and all(
        part.is_Rational or (part.is_Pow and (part**2).is_Rational)
        for value in cosine_sine(base)
        for term in sp.Add.make_args(sp.expand(value))
        for part in sp.Mul.make_args(term)
    )


def _divisor(shares: Sequence[sp.Rational]) -> sp.Rational:
    """Return the largest number of which all given ones are whole multiples."""
    bottom = math.lcm(*(int(share.q) for share in shares))
    return sp.Rational(math.gcd(*(int(share * bottom) for share in shares)), bottom)


def _atoms(expressions: Sequence[sp.Expr]) -> list[sp.Expr]:
    """Return what polynomials that equal the expressions are made of."""
    wanted = [sp.expand(each) for each in expressions if not each.is_Rational]
    return list(parallel_dict_from_expr(wanted)[1]) if wanted else []


def _replaced(p: PolyElement, place: int, square: PolyElement) -> PolyElement:
    """Return a polynomial in which the square of a generator is another polynomial."""
    ring = p.ring
    by_power: dict[int, dict[tuple[int, ...], object]] = {}
    for monomial, coefficient in p.items():
        power, left = divmod(monomial[place], 2)
        by_power.setdefault(power, {})[(*monomial[:place], left, *monomial[place + 1 :])] = coefficient
    found = ring.zero
    for power, terms in by_power.items():
        found += ring.from_dict(terms) * square**power
    return found


Wave = tuple[tuple[int, ...], bool]
"""A sine (or else a cosine) of a sum of angles, with the multiple of each."""

Product = tuple[tuple[sp.Expr, ...], sp.Rational]
"""Symbols, sines and cosines, with powers written out, and a number."""

Terms = dict[tuple[sp.Expr, ...], sp.Rational]
"""A sum of products."""

Merge = tuple[sp.Expr, tuple[sp.Expr, ...], tuple[sp.Expr, ...], list[Product]]
"""A sine or cosine of a sum of two angles, its two products, and what stands beside them."""


def shortened(p: PolyElement, algebra: Algebra, groups: Sequence[Sequence[Unit]] = ()) -> sp.Expr:
    """Write a polynomial with few operations.

    Returns an expression in sines and cosines of angles and of sums of them, nested, not expanded. `groups`: angles
    about parallel axes, in the order of the joints.
    """
    forms = [algebra.reduced(p), algebra.reduced(p, by_cosine=True)]
    plain = [_products(form, algebra, ()) for form in forms]
    ways = [_merged(way, groups) for way in plain] if groups else []
    ways += [_products(forms[0], algebra, each) for each in _choices(groups)]
    ways += plain
    return min((_collected(way) for way in ways), key=operations)


def operations(expression: sp.Expr) -> int:
    """Multiplications and additions, where a power is a multiplication."""
    own = max(0, len(expression.args) - 1) if expression.is_Add or expression.is_Mul else int(expression.is_Pow)
    if expression.is_Mul and expression.args[0] == -1:
        own -= 1
    inside = () if isinstance(expression, (sp.sin, sp.cos)) else expression.args
    return own + sum(map(operations, inside))


def _choices(groups: Sequence[Sequence[Unit]]) -> list[tuple[Unit, ...]]:
    """Return all runs of parallel neighbours, each written with sums of angles by itself, and all together."""
    runs = [tuple(group[i:j]) for group in groups for i in range(len(group)) for j in range(i + 2, len(group) + 1)]
    return [*runs, *([tuple(unit for group in groups for unit in group)] if len(groups) > 1 else [])]


def _products(p: PolyElement, algebra: Algebra, group: Sequence[Unit]) -> list[Product]:
    """Return the terms of a polynomial, with the sines and cosines of a group of angles as those of sums."""
    # Products of sines and cosines of the group become sines and cosines of sums.
    inside = {place for unit in group for place in (unit.cosine, unit.sine)}
    atoms = dict(enumerate(algebra.atoms))
    for unit in algebra.units:
        atoms |= {unit.cosine: sp.cos(unit.angle), unit.sine: sp.sin(unit.angle)}
    found: dict[tuple[tuple[sp.Expr, ...], Wave], Fraction] = {}
    for monomial, coefficient in p.items():
        others = tuple(
            atoms[place] for place, power in enumerate(monomial) if place not in inside for _ in range(power)
        )
        waves: dict[Wave, Fraction] = {
            ((0,) * len(group), False): Fraction(int(coefficient.numerator), int(coefficient.denominator))
        }
        for index, unit in enumerate(group):
            for sine, power in ((False, monomial[unit.cosine]), (True, monomial[unit.sine])):
                for _ in range(power):
                    waves = _times(waves, index, sine)
        for wave, share in waves.items():
            found[others, wave] = found.get((others, wave), Fraction(0)) + share
    # Equal waves were added up; those that cancelled are gone.
    products = []
    for (others, (multiples, sine)), share in found.items():
        if share:
            angle = sp.Add(*(multiple * unit.angle for multiple, unit in zip(multiples, group, strict=True)))
            wave = (sp.sin if sine else sp.cos)(angle) if angle != 0 else sp.S.One
            products.append(
                ((*others, *([wave] if wave != 1 else [])), sp.Rational(share.numerator, share.denominator))
            )
    return products


def _times(waves: dict[Wave, Fraction], index: int, sine: bool) -> dict[Wave, Fraction]:
    found: dict[Wave, Fraction] = {}
    for (multiples, is_sine), share in waves.items():
        for step in (1, -1):
            place = tuple(value + step * (at == index) for at, value in enumerate(multiples))
            # cos a cos b, sin a cos b, cos a sin b and sin a sin b as halves of sums of two terms.
            sign = -step if is_sine and sine else step if sine else 1
            kind = is_sine != sine
            if next((value for value in place if value), 0) < 0:
                place, sign = tuple(-value for value in place), -sign if kind else sign
            if kind and not any(place):
                continue
            found[place, kind] = found.get((place, kind), Fraction(0)) + sign * share / 2
    return found


def _merged(products: Sequence[Product], groups: Sequence[Sequence[Unit]]) -> list[Product]:
    """Return the same with pairs of terms such as c2*c3 and -s2*s3 as one, as long as there are such pairs."""
    terms = {tuple(sorted(factors, key=str)): number for factors, number in products}
    for group in groups:
        angles = [unit.angle for unit in group]
        while pair := _mergeable(terms, angles):
            value, one, other, found = pair
            for rest, number in found:
                del terms[_key(rest, one)], terms[_key(rest, other)]
                key = _key(rest, (value,))
                terms[key] = terms.get(key, sp.S.Zero) + number
            # sympy writes sin(-x) as -sin(x).
            angles += [each.args[0] for each in value.atoms(sp.sin, sp.cos) if each.args[0] not in angles]
    return [(factors, number) for factors, number in terms.items() if number]


def _mergeable(terms: Terms, angles: Sequence[sp.Expr]) -> Merge | None:
    """Return the first sine or cosine of a sum with its two products, and what stands beside both of them."""
    for a, b in itertools.combinations(angles, 2):
        for value, one, other, sign in _addition(a, b):
            if found := _pairs(terms, one, other, sign):
                return value, one, other, found
    return None


def _addition(a: sp.Expr, b: sp.Expr) -> Iterator[tuple[sp.Expr, tuple[sp.Expr, ...], tuple[sp.Expr, ...], int]]:
    """Yield the sine or cosine of a sum or difference, its two products, and the sign of the second one."""
    # Sines and cosines of angles that differ by a constant may be the same, as of x and 90 deg - x.
    if (a + b).is_number or (a - b).is_number:
        return
    sines, cosines = (sp.sin(a), sp.sin(b)), (sp.cos(a), sp.cos(b))
    for sign in (1, -1):
        yield sp.cos(a + sign * b), cosines, sines, -sign
        yield sp.sin(a + sign * b), (sines[0], cosines[1]), (cosines[0], sines[1]), sign


def _pairs(terms: Terms, one: tuple[sp.Expr, ...], other: tuple[sp.Expr, ...], sign: int) -> list[Product]:
    """Return what stands beside two products wherever both occur with numbers that fit."""
    found, used = [], set[tuple[sp.Expr, ...]]()
    for factors, number in terms.items():
        if all(factor in factors for factor in one):
            rest = factors
            for factor in one:
                rest = _without(rest, factor)
            partner = _key(rest, other)
            if terms.get(partner) == sign * number and not {factors, partner} & used:
                used |= {factors, partner}
                found.append((rest, number))
    return found


def _key(rest: tuple[sp.Expr, ...], factors: tuple[sp.Expr, ...]) -> tuple[sp.Expr, ...]:
    return tuple(sorted((*rest, *factors), key=str))


def _collected(products: Sequence[Product]) -> sp.Expr:
    """Return a sum of products, with what most of them share taken out of brackets, again and again."""
    counts: dict[sp.Expr, int] = {}
    for factors, _ in products:
        for factor in dict.fromkeys(factors):
            counts[factor] = counts.get(factor, 0) + 1
    shared = max(counts, key=lambda factor: (counts[factor], isinstance(factor, (sp.sin, sp.cos))), default=None)
    if shared is None or counts[shared] < 2:
        return sp.Add(*(sp.Mul(number, *factors) for factors, number in products))
    inside = [(_without(factors, shared), number) for factors, number in products if shared in factors]
    outside = [product for product in products if shared not in product[0]]
    bracket = _collected(inside)
    number, bracket = bracket.primitive() if bracket.is_Add else (sp.S.One, bracket)
    taken = sp.Mul(number, shared, bracket) if number == 1 or not bracket.is_Add else sp.Mul(number * shared, bracket)
    return sp.Add(taken, _collected(outside)) if outside else taken


def _without(factors: tuple[sp.Expr, ...], taken: sp.Expr) -> tuple[sp.Expr, ...]:
    place = factors.index(taken)
    return factors[:place] + factors[place + 1 :]
