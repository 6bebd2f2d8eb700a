"""The rules: bounds of the 2-norm of groups of values, and of their errors, from those of earlier values.

A group is any one, two or three values in ascending order; the rules always take its latest value apart. With e for
errors and r for what rounding adds, and Z for the rest of a group:

- a matrix K of sines and cosines or constants: `|K x| <= |K| |x|`, and the error `K e_x + (K' - K) x' + r` of its
  computed product is at most `|K| |e_x| + |K' - K| |x'| + |r|`; a turn has |K| = 1, so the norm of an error survives
  it and grows by sums alone. A single row `c x + s y` is the same with one row (Cauchy-Schwarz);
- sums: `|(a + b, Z)| <= |(a, Z)| + |b|`, also for several entries at once;
- a common factor: `|f x| <= |f| |x|`;
- scalar products, as in the entries of a cross product: `|x . y| <= |x| |y|`.

Of all rules that fit the smallest bound is kept, so a rule can help and never harm. What groups have in common is the
same for all ranges and number types, and is kept.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import field
from decimal import Decimal
from fractions import Fraction

from kinegen.ir.error_analysis.directed_rounding import ONE, ZERO, NumberType, norm, root, upper
from kinegen.ir.error_analysis.value_graph import Graph, Row, turns
from kinegen.ir.program import Operator
from kinegen.support.dataclass import dataclass

Group = tuple[int, ...]

Shape = tuple[int | None, tuple[tuple[tuple[int, int, int], ...], ...]]
"""An angle, and for each row its factors with their signs and the places of the operands: what decides a matrix."""

_LARGEST_GROUP = 3
"""Vectors have three entries; larger groups would cost more than they ever gain."""

_SUMS = (Operator.ADD, Operator.SUB)


@dataclass(frozen=True, slots=True)
class Image:
    """Part of a group as the product of a matrix with other values.

    `rows`: the one or two values that are the product. `operands`: the one or two values that are multiplied. `rest`:
    the other values of the group.
    """

    rows: tuple[Row, ...]
    shape: Shape
    operands: Group
    rest: Group


@dataclass(frozen=True, slots=True, eq=False)
class Groups:
    """What groups have in common, found when it is asked for; equal to itself alone.

    `rows`: the ways in which each value is a row.
    """

    graph: Graph
    rows: tuple[tuple[Row, ...], ...]
    _images: dict[Group, tuple[Image, ...]] = field(default_factory=dict)
    _splits: dict[Group, tuple[tuple[Group, Group, Group], ...]] = field(default_factory=dict)
    _factors: dict[Group, tuple[tuple[int, Group], ...]] = field(default_factory=dict)

    def images(self, group: Group) -> tuple[Image, ...]:
        """Return the ways to see the latest value of a group, alone or with another one, as a product with a matrix."""
        if (known := self._images.get(group)) is None:
            known = self._images[group] = tuple(self._find_images(group))
        return known

    def splits(self, group: Group) -> tuple[tuple[Group, Group, Group], ...]:
        """Return the ways to split sums that are no rows: what is kept, what is added to it, and the sums."""
        if (known := self._splits.get(group)) is None:
            known = self._splits[group] = tuple(self._find_splits(group))
        return known

    def common_factors(self, group: Group) -> tuple[tuple[int, Group], ...]:
        """Return the factors that all values of a group share, each with what it multiplies."""
        if (known := self._factors.get(group)) is None:
            known = self._factors[group] = tuple(self._find_factors(group))
        return known

    def _find_images(self, group: Group) -> Iterator[Image]:
        latest, rest = group[-1], group[:-1]
        for row in self.rows[latest]:
            paired = False
            for place, partner in enumerate(rest):
                for other in self.rows[partner]:
                    operands = tuple(dict.fromkeys(row.operands + other.operands))
                    if turns(row, other, self.graph) or (row.angle is other.angle is None and len(operands) < 3):
                        paired = True
                        others = rest[:place] + rest[place + 1 :]
                        yield Image((row, other), _shape(row, other), operands, others)
            multiplies = row.terms[0].product is not None or len(row.terms) > 1
            if multiplies and not paired and len(row.terms) + len(rest) <= _LARGEST_GROUP:
                yield Image((row,), _shape(row), row.operands, rest)

    def _find_splits(self, group: Group) -> Iterator[tuple[Group, Group, Group]]:
        if not self._is_plain_sum(group[-1]):
            return
        choices: list[list[tuple[Group, Group]]] = []
        for number in group:
            choices.append([] if number == group[-1] else [((number,), ())])
            if self._is_plain_sum(number):
                first, second = self.graph.operands(number)
                choices[-1] += [((first,), (second,)), ((second,), (first,))]
        for choice in itertools.product(*choices):
            kept = tuple(itertools.chain.from_iterable(part for part, _ in choice))
            added = tuple(itertools.chain.from_iterable(part for _, part in choice))
            yield kept, added, tuple(number for number, (_, part) in zip(group, choice, strict=True) if part)

    def _is_plain_sum(self, number: int) -> bool:
        return self.graph.operation(number) in _SUMS and not self.rows[number]

    def _find_factors(self, group: Group) -> Iterator[tuple[int, Group]]:
        if any(self.graph.operation(number) is not Operator.MUL for number in group):
            return
        products = [self.graph.operands(number) for number in group]
        for factor in dict.fromkeys(products[-1]):
            if all(factor in product for product in products):
                yield factor, tuple(one if other == factor else other for one, other in products)


def _shape(*rows: Row) -> Shape:
    """Return what decides the matrix of some rows, whatever they multiply."""
    places = {operand: place for place, operand in enumerate(dict.fromkeys(o for row in rows for o in row.operands))}
    shape = tuple(tuple((term.factor, term.sign, places[term.operand]) for term in row.terms) for row in rows)
    return rows[0].angle, shape


@dataclass(frozen=True, slots=True)
class Single:
    """What is known of one value.

    Attributes:
        exact: Bound of its exact magnitude.
        error: Bound of its error.
        computed: Bound of its computed magnitude.
        rounding: Bound of what its own rounding adds to its error.
    """

    exact: Decimal
    error: Decimal
    computed: Decimal
    rounding: Decimal


@dataclass(frozen=True, slots=True)
class Matrix:
    """Bounds for a matrix of sines and cosines, or of constants.

    `scale`: spectral norm of the exact matrix. `wobble`: spectral norm of its error. `weight`: spectral norm of the
    matrix of the computed magnitudes.
    """

    scale: Decimal
    wobble: Decimal
    weight: Decimal


def matrix(rows: Sequence[Row], graph: Graph, singles: Sequence[Single], real: NumberType) -> Matrix:
    """Return the matrix of one row, of two rows that turn, or of two rows of constants."""
    factors = [singles[term.factor] for row in rows for term in row.terms]
    size, error, computed = (
        norm(*(factor.exact for factor in factors)),
        norm(*(factor.error for factor in factors)),
        norm(*(factor.computed for factor in factors)),
    )
    if rows[0].angle is None:
        return Matrix(_spectral(rows, graph) if len(rows) > 1 else size, error, computed)
    if len(factors) == 1:
        return Matrix(size, error, computed)
    # Errors of a cosine and a sine: a vector of the plane that adds to their own, and the same turned by a right angle
    # in the other row. An error of the angle moves the pair along the circle, by no more than itself.
    pair = real.pair_error + singles[rows[0].angle].error
    columns = len(rows[0].terms) if len(rows) > 1 else 1
    return Matrix(ONE, min(pair, error), (ONE + pair) * (root(Decimal(columns))))


def _spectral(rows: Sequence[Row], graph: Graph) -> Decimal:
    """Return the spectral norm of two rows of constants over at most two operands, from its closed form."""
    operands = list(dict.fromkeys(operand for row in rows for operand in row.operands))
    entries = [[Fraction(0), Fraction(0)] for _ in rows]
    for row, line in zip(rows, entries, strict=True):
        for term in row.terms:
            line[operands.index(term.operand)] += term.sign * (graph.constant(term.factor) or 0)
    (a, b), (c, d) = entries
    squares = a * a + b * b + c * c + d * d
    determinant = abs(a * d - b * c)
    spread = root(upper((squares - 2 * determinant) * (squares + 2 * determinant)))
    return root((upper(squares) + spread) / 2) if squares else ZERO


_FAR = 800
"""Values with so many others between them are bounded each by itself: what they share is far behind, and all pairs of a
long chain would be as many as the square of its length."""

_DEEP = 120
"""So many groups are looked at for the sake of one; beyond that, too, each value is bounded by itself."""


@dataclass(slots=True)
class Norms:
    """Bounds of groups of values, worked out when they are asked for.

    `exact_norms`: bounds of the 2-norm of exact values that are known, single ones among them. `singles`: the values
    known so far; the others follow in order.
    """

    groups: Groups
    real: NumberType
    exact_norms: dict[Group, Decimal] = field(default_factory=dict)
    singles: list[Single] = field(default_factory=list)
    _error: dict[Group, Decimal] = field(default_factory=dict)
    _matrices: dict[Shape, Matrix] = field(default_factory=dict)
    _depth: int = 0

    def exact(self, group: Group) -> Decimal:
        """Bound of the 2-norm of the exact values of a group."""
        if len(group) < 2:
            return self.singles[group[0]].exact if group else ZERO
        known = self.exact_norms.get(group)
        if known is None:
            group = tuple(sorted(group))
            known = self.exact_norms.get(group)
        if known is None:
            self._depth += 1
            known = min(self._exact_bounds(group)) if self._is_near(group) else self._apart_exact(group)
            self.exact_norms[group] = known
            self._depth -= 1
        return known

    def error(self, group: Group) -> Decimal:
        """Bound of the 2-norm of the errors of a group."""
        known = self._error.get(group)
        if known is None:
            present = tuple(sorted([number for number in group if self.singles[number].error]))
            known = self._error[group] = self._error_of(present)
        return known

    def _error_of(self, group: Group) -> Decimal:
        """Return the same of values in ascending order that all have an error."""
        if len(group) < 2:
            return self.singles[group[0]].error if group else ZERO
        known = self._error.get(group)
        if known is None:
            self._depth += 1
            bounds = self._error_bounds(group) if self._is_near(group) else (self._apart_error(group),)
            known = self._error[group] = min(bounds)
            self._depth -= 1
        return known

    def computed(self, group: Group) -> Decimal:
        """Bound of the 2-norm of the computed values of a group."""
        return min(self.exact(group) + self.error(group), norm(*(self.singles[number].computed for number in group)))

    # Rules for groups -------------------------------------------------------------------------------------------------

    def _is_near(self, group: Group) -> bool:
        """Tell whether it is worth looking at what the values of a group share."""
        return group[-1] - group[0] <= _FAR and self._depth <= _DEEP

    def _apart_exact(self, group: Group) -> Decimal:
        return norm(self.singles[group[-1]].exact, self.exact(group[:-1]))

    def _apart_error(self, group: Group) -> Decimal:
        return norm(self.singles[group[-1]].error, self.error(group[:-1]))

    def _exact_bounds(self, group: Group) -> Iterator[Decimal]:
        yield self._apart_exact(group)
        for image in self.groups.images(group):
            yield self._scale(image) * self.exact(image.operands + image.rest)
        for kept, added, _ in self.groups.splits(group):
            yield self.exact(kept) + self.exact(added)
        for factor, others in self.groups.common_factors(group):
            yield self.singles[factor].exact * self.exact(others)

    def _error_bounds(self, group: Group) -> Iterator[Decimal]:
        yield self._apart_error(group)
        for image in self.groups.images(group):
            local = self.before_rounding(image)
            local += self._last_roundings(image, local)
            yield self._scale(image) * self.error(image.operands + image.rest) + local
            if image.rest:
                yield norm(self.matrix(image).scale * self.error(image.operands) + local, self.error(image.rest))
        for kept, added, sums in self.groups.splits(group):
            yield self.error(kept) + self.error(added) + self._roundings(sums)
        for factor, others in self.groups.common_factors(group):
            known = self.singles[factor]
            grown = known.exact * self.error(others) + known.error * self.computed(others)
            yield grown + self._roundings(group)

    def matrix(self, image: Image) -> Matrix:
        """Return what is known of the matrix of an image, worked out once for all that it may multiply."""
        if (known := self._matrices.get(image.shape)) is None:
            known = self._matrices[image.shape] = matrix(image.rows, self.groups.graph, self.singles, self.real)
        return known

    def _scale(self, image: Image) -> Decimal:
        """Return how much the norm of the operands and the rest can grow."""
        scale = self.matrix(image).scale
        return max(ONE, scale) if image.rest else scale

    # Rounding ---------------------------------------------------------------------------------------------------------

    def _roundings(self, group: Sequence[int]) -> Decimal:
        return norm(*(self.singles[number].rounding for number in group))

    def before_rounding(self, image: Image) -> Decimal:
        """Return what a matrix product adds to errors before its last roundings: wrong entries, rounded products."""
        computed, known = self.computed(image.operands), self.matrix(image)
        added = known.wobble * computed
        sums = [row for row in image.rows if len(row.terms) > 1]
        if sums:
            products = [[term.product for term in row.terms if term.product is not None] for row in sums]
            sizes = [sum((self.singles[number].rounding for number in row), ZERO) for row in products]
            relative = self.real.unit * known.weight * computed
            added += min(norm(*sizes), relative + sum(map(len, products)) * self.real.underflow)
        return added

    def _last_roundings(self, image: Image, before: Decimal) -> Decimal:
        """Return the rounding of the values of an image themselves."""
        values = tuple(row.value for row in image.rows)
        absolute = self._roundings(values)
        if not absolute:
            return ZERO
        reached = self.exact(values) + self.matrix(image).scale * self.error(image.operands) + before
        return min(absolute, self.real.unit * reached + len(values) * self.real.underflow)
