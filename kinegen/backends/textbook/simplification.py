"""Shorter sums: constants folded, common factors in front, and numbers moved into brackets and out of them."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache

import sympy as sp

from kinegen.backends.textbook.products import (
    Base,
    Bracket,
    Product,
    Terms,
    Wave,
    bracketed,
    content,
    cost,
    first,
    merged,
    multiplied,
    opened,
    over,
    power,
    spread,
    times,
)


@lru_cache(maxsize=4096)
def shortened(terms: Terms) -> Terms:
    """Return the same sum with fewer operations, if there is a way.

    `terms`: the terms; the sums in their brackets are short already. Returns the terms, a single one with a bracket
    where all of them have something in common.
    """
    collected = _collected(spread(terms))
    ways = [collected, tuple(part for term in collected for part in opened(term))]
    ways += [(*collected[:at], *opened(term), *collected[at + 1 :]) for at, term in enumerate(collected)]
    angles = _squared(collected)
    if angles:
        ways.append(tuple(part for term in collected for part in _opened_at(term, angles)))
    ways += _gathered(collected)
    ways += _unfolded(collected)
    best = min((_factored(_collected(way)) for way in dict.fromkeys(ways)), key=cost)
    return shortened(best) if len(best) > 1 and cost(best) < cost(collected) else best


def _squared(terms: Terms) -> frozenset[sp.Expr]:
    """Return the angles whose sines or cosines are multiplied by such of the same angle."""
    angles = set()
    for term in terms:
        for base, exponent in term.factors:
            if isinstance(base, Wave) and (exponent > 1 or base.angle in _angles_inside(term)):
                angles.add(base.angle)
    return frozenset(angles)


def _unfolded(terms: Terms) -> Iterator[Terms]:
    """Yield the sums without the brackets behind sine and cosine of one angle, if terms make one then.

    `c23*(a2*c3 + a3) + s23*(a2*s3 + d4)` is `a2*c2 + a3*c23 + d4*s23`.
    """
    for angle in dict.fromkeys(angle for term in terms for angle in _angles_of(term)):
        parts = tuple(
            part for term in terms for part in (_multiplied_out(term) if angle in _angles_of(term) else (term,))
        )
        collected = _collected(parts)
        if len(terms) < len(parts) > len(collected):
            yield collected


def _angles_inside(term: Product) -> set[sp.Expr]:
    """Return the angles of the sines and cosines that stand directly in the brackets of a term."""
    brackets = [base for base, exponent in term.factors if isinstance(base, Bracket) and exponent == 1]
    factors = [base for bracket in brackets for part in bracket.terms for base, _ in part.factors]
    return {base.angle for base in factors if isinstance(base, Wave)}


def _opened_at(term: Product, angles: frozenset[sp.Expr]) -> Terms:
    """Return a term whose bracket is multiplied out if it has the squares of some sines and cosines in it."""
    outside, inside = _angles_of(term), _angles_inside(term)
    return (term,) if angles.isdisjoint(outside) or angles.isdisjoint(inside) else _multiplied_out(term)


def _angles_of(term: Product) -> tuple[sp.Expr, ...]:
    """Return the angles of the sines and cosines that are factors of a term."""
    return tuple(base.angle for base, _ in term.factors if isinstance(base, Wave))


def _multiplied_out(term: Product) -> Terms:
    """Return a term without its bracket; with two brackets, or powers of one, it stays."""
    brackets = [base for base, exponent in term.factors if isinstance(base, Bracket) and exponent == 1]
    if len(brackets) != 1:
        return (term,)
    rest = times(term, power(brackets[0], -1))
    return tuple(times(rest, part) for part in brackets[0].terms)


def _gathered(terms: Terms) -> Iterator[Terms]:
    """Yield the sums in which some terms make a multiple of a bracket that stands beside them."""
    known = {term.same: term for term in terms}
    for term in terms:
        for base, exponent in term.factors:
            if not isinstance(base, Bracket) or exponent != 1 or not all(part.same in known for part in base.terms):
                continue
            parts = [(known[part.same], part) for part in base.terms]
            ratios = {multiplied(found.number, 1 / part.number) for found, part in parts}
            if len(ratios) == 1:
                used = [found for found, _ in parts]
                multiple = times(Product(ratios.pop()), power(base, 1))
                yield (*(each for each in terms if each not in used), multiple)


def _collected(terms: Terms) -> Terms:
    """Like terms as one, and terms that make one by a theorem of sines and cosines."""
    found: dict[frozenset[tuple[Base, sp.Rational]], Product] = {}
    for term in terms:
        same = found.get(term.same)
        if same is None:
            found[term.same] = term
        else:
            number = _added(same.number, term.number)
            found[term.same] = Product(number, same.factors, first(same.place, term.place))
    collected = tuple(term for term in found.values() if term.number != 0)
    fewer = merged(collected)
    return collected if fewer is None else _collected(fewer)


def _added(left: sp.Expr, right: sp.Expr) -> sp.Expr:
    total = left + right
    return total if total.is_Rational else sp.expand(total)


def _factored(terms: Terms) -> Terms:
    """Return what all terms have in common in front of a bracket; else what some of them have."""
    if len(terms) < 2:
        return terms
    common = _common(terms)
    if common.factors:
        inside = shortened(tuple(times(term, _inverse(common)) for term in terms))
        return (times(common, bracketed(inside)),) if inside else ()
    ways = [(_order(base), _grouped(terms, base)) for base in _shared(terms)]
    ways += [((2, (), False), _grouped_by_root(terms, root)) for root in _shared_roots(terms)]
    better = [(cost(way), order, index) for index, (order, way) in enumerate(ways) if cost(way) <= cost(terms)]
    if better:
        return _factored(ways[min(better)[2]][1])
    return _without_content(terms)


def _common(terms: Terms) -> Product:
    """Return the factors that stand in every term."""
    exponents = [dict(term.factors) for term in terms]
    factors = []
    for base, exponent in terms[0].factors:
        powers = [each.get(base, sp.S.Zero) for each in exponents]
        least = min(powers) if exponent > 0 else max(powers)
        factors += [(base, least)] if least * exponent > 0 else []
    return Product(sp.S.One, tuple(factors))


def _inverse(product: Product) -> Product:
    return Product(sp.S.One, tuple((base, -exponent) for base, exponent in product.factors))


def _shared(terms: Terms) -> list[Base]:
    """The sines, cosines and brackets that stand in two terms or more, and lengths such as that of `a - a*c1`."""
    counts: dict[Base, int] = {}
    for term in terms:
        for base, exponent in term.factors:
            if exponent > 0:
                counts[base] = counts.get(base, 0) + 1
    alone = {term.factors[0][0] for term in terms if len(term.factors) == 1}
    lengths = [base for base in alone if not isinstance(base, (Wave, Bracket))]
    found = [base for base, count in counts.items() if count > 1]
    return [base for base in found if isinstance(base, (Wave, Bracket)) or base in lengths]


def _grouped(terms: Terms, base: Base) -> Terms:
    """Return the terms with a base in front of one bracket, where the first of them stood."""
    inside = [term for term in terms if dict(term.factors).get(base, 0) > 0]
    grouped = shortened(tuple(times(term, power(base, -1)) for term in inside))
    place = terms.index(inside[0])
    product = (times(power(base, 1), bracketed(grouped)),) if grouped else ()
    before = tuple(term for term in terms[:place] if term not in inside)
    return (*before, *product, *(term for term in terms[place:] if term not in inside))


def _shared_roots(terms: Terms) -> list[sp.Expr]:
    """Return the irrational parts of numbers that stand in two terms or more, but not in all."""
    roots = [_root(term) for term in terms]
    return [root for root in dict.fromkeys(roots) if root != 1 and 1 < roots.count(root) < len(roots)]


def _root(term: Product) -> sp.Expr:
    return term.number.as_coeff_Mul()[1]


def _grouped_by_root(terms: Terms, root: sp.Expr) -> Terms:
    """Return the terms with an irrational number in front of one bracket."""
    inside = [term for term in terms if _root(term) == root]
    grouped = shortened(tuple(over(term, root) for term in inside))
    product = (times(Product(root), bracketed(grouped)),) if grouped else ()
    return (*(term for term in terms if term not in inside), *product)


def _order(base: Base) -> tuple[int, tuple[int, ...], bool]:
    """Sines and cosines of the first joints come before others, and brackets last."""
    if isinstance(base, Wave):
        return 0, base.joints, base.is_sine
    return 1, (), False


def _without_content(terms: Terms) -> Terms:
    """Return the number that all terms have in common in front of a bracket, where that is no longer."""
    for number, place in _contents(terms):
        divided = [over(term, number) for term in terms]
        if place is not None:
            divided = [Product(term.number, term.factors) for term in divided]
        inside = spread(tuple(divided))
        outside = Product(number, ((Bracket(inside), sp.S.One),), place)
        if cost((outside,)) < cost(terms) + _is_everywhere(terms):
            return (times(Product(number, place=place), bracketed(shortened(inside))),)
    return terms


def _is_everywhere(terms: Terms) -> bool:
    """Whether every term is multiplied by the same number or divided by one, so that a bracket is easier to read."""
    rationals = [abs(term.number).as_coeff_Mul()[0] for term in terms]
    return len(set(rationals)) == 1 or not any(rational.is_Integer for rational in rationals)


def _contents(terms: Terms) -> Iterator[tuple[sp.Expr, int | None]]:
    """Yield numbers that could stand in front, the longest first; with a place if they are a length."""
    rationals, roots = zip(*(abs(term.number).as_coeff_Mul() for term in terms), strict=True)
    places = [term.place for term in terms if term.place is not None]
    root = roots[0] if len(set(roots)) == 1 else sp.S.One
    shared: sp.Expr = sp.S.One
    if len(places) == len(terms) and len(set(rationals)) == 1:
        yield rationals[0] * root, min(places)
    if not places and all(rational.is_Rational for rational in rationals):
        shared = content(rationals)
    for number in dict.fromkeys((shared * root, shared, root)):
        if number != 1:
            yield number, None


def met(terms: Terms) -> Terms:
    """Return the terms with numbers multiplied into the brackets behind them, where the sum is shorter then.

    `terms`: the terms of a short sum.
    """
    return tuple(part for term in terms for part in _met(term))


def _met(term: Product) -> Terms:
    """Return a term, or what it is a sum of."""
    own = Product(term.number, place=term.place)
    for base, exponent in term.factors:
        inside = bracketed(met(base.terms)) if isinstance(base, Bracket) and exponent == 1 else power(base, exponent)
        own = times(own, inside)
    best = min(_ways(own), key=cost, default=(own,))
    if cost(best) < cost((own,)):
        return best
    return (min((*_divided(own), own), key=lambda each: cost((each,))),)


def _divided(term: Product) -> Iterator[Product]:
    """Yield a root times a bracket with a divisor behind it: `sqrt(2)*(a3/2 + 0.04)` is `sqrt(2)*(a3 + 0.08)/2`."""
    if not (term.number.is_Rational or term.number.has(sp.Add)):
        for base, exponent in term.factors:
            if isinstance(base, Bracket) and exponent == 1:
                rest = times(term, power(base, -1))
                for divisor in sorted(_divisors(base.terms)):
                    yield times(over(rest, divisor), bracketed(_multiplied(base.terms, divisor)))


def _divisors(terms: Terms) -> set[sp.Integer]:
    """Return what is divided by in a sum and in its brackets, lengths aside."""
    found = {sp.Integer(term.number.as_coeff_Mul()[0].q) for term in terms if term.place is None} - {sp.S.One}
    brackets = (base for term in terms for base, _ in term.factors if isinstance(base, Bracket))
    return found.union(*(_divisors(bracket.terms) for bracket in brackets))


def _ways(term: Product) -> Iterator[Terms]:
    """Yield the term with its number, or a factor of that, in one of its brackets."""
    numbers = (term.number, *sp.Mul.make_args(term.number))
    for number in dict.fromkeys(abs(each) for each in numbers if term.place is None and not each.has(sp.Add)):
        for base, exponent in term.factors:
            if number != 1 and isinstance(base, Bracket) and exponent == 1:
                rest = times(over(term, number), power(base, -1))
                inside = _multiplied(base.terms, number)
                yield spread((times(rest, bracketed(inside)),))


def _multiplied(terms: Terms, number: sp.Expr) -> Terms:
    """Return a sum times a number, which goes into deeper brackets where the sum is shorter then."""
    return spread(tuple(min(_products(term, number), key=lambda each: cost((each,))) for term in terms))


def _products(term: Product, number: sp.Expr) -> Iterator[Product]:
    """Yield the ways to multiply a term by a number."""
    yield Product(multiplied(term.number, number), term.factors, term.place)
    for base, exponent in term.factors:
        if isinstance(base, Bracket) and exponent == 1:
            yield times(times(term, power(base, -1)), bracketed(_multiplied(base.terms, number)))


def shared(terms: Terms) -> Terms:
    """Return the terms with what some of their numbers have in common before a bracket, where the sum is shorter then.

    `terms`: the terms; what all of them have in common stands before a bracket already.
    """
    inside = tuple(_inside(term) for term in terms)
    best = min(_shared_ways(inside), key=cost, default=inside)
    return shared(best) if cost(best) < cost(inside) else inside


def _inside(term: Product) -> Product:
    """Return a term with its brackets made shorter."""
    result = Product(term.number, place=term.place)
    for base, exponent in term.factors:
        short = Bracket(shared(base.terms)) if isinstance(base, Bracket) else base
        result = times(result, power(short, exponent))
    return result


def _shared_ways(terms: Terms) -> Iterator[Terms]:
    """The sums in which some terms, but not all, stand in a bracket behind the number that they have in common."""
    numbers = [abs(term.number).as_coeff_Mul()[0] if term.place is None else sp.S.One for term in terms]
    groups = [tuple(number.q != 1 for number in numbers)]
    groups += [tuple(number.q == each.q for number in numbers) for each in numbers]
    groups += [tuple(number == each for number in numbers) for each in numbers]
    for chosen in dict.fromkeys(group for group in groups if any(group) and not all(group)):
        common = content(number for number, is_chosen in zip(numbers, chosen, strict=True) if is_chosen)
        group = tuple(over(term, common) for term, is_chosen in zip(terms, chosen, strict=True) if is_chosen)
        place = chosen.index(True)
        rest = tuple(term for term, is_chosen in zip(terms, chosen, strict=True) if not is_chosen)
        yield (*rest[:place], times(Product(common), bracketed(group)), *rest[place:])
