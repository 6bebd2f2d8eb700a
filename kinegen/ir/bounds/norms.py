"""The rules: bounds of the 2-norm of groups of values, and of their errors, from those of earlier values.

A group is any one, two or three values; the rules always take its latest value apart. With e for errors and r for
what rounding adds, and Z for the rest of a group:

- a matrix K of sines and cosines or constants: `|K x| <= |K| |x|`, and the error `K e_x + (K' - K) x' + r` of its
  computed product is at most `|K| |e_x| + |K' - K| |x'| + |r|`; a turn has |K| = 1, so the norm of an error survives
  it and grows by sums alone. A single row `c x + s y` is the same with one row (Cauchy-Schwarz);
- sums: `|(a + b, Z)| <= |(a, Z)| + |b|`, also for several entries at once;
- a common factor: `|f x| <= |f| |x|`;
- scalar products, as in the entries of a cross product: `|x . y| <= |x| |y|`.

Of all rules that fit the smallest bound is kept, so a rule can help and never harm.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from decimal import Decimal

from kinegen.ir.bounds.graph import Graph
from kinegen.ir.bounds.matrices import Matrix, matrix
from kinegen.ir.bounds.numbers import ONE, ZERO, NumberType, norm
from kinegen.ir.bounds.rows import Row, turns
from kinegen.ir.program import Operator

Group = tuple[int, ...]

_Shape = tuple[int | None, tuple[tuple[tuple[int, int, int], ...], ...]]
"""An angle, and for each row its factors with their signs and the places of the operands."""

_LARGEST_GROUP = 3
"""Vectors have three entries; larger groups would cost more than they ever gain."""

_FAR = 800
"""Values with so many others between them are bounded each by itself: what they share is far behind, and all pairs of a
long chain would be as many as the square of its length."""

_DEEP = 120
"""So many groups are looked at for the sake of one; beyond that, too, each value is bounded by itself."""

_SUMS = (Operator.ADD, Operator.SUB)


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
class Image:
    """Part of a group as the product of a matrix with other values.

    Attributes:
        rows: The one or two values that are the product.
        matrix: What is known of the matrix.
        operands: The one or two values that are multiplied.
        rest: The other values of the group.
    """

    rows: tuple[Row, ...]
    matrix: Matrix
    operands: Group
    rest: Group

    @property
    def scale(self) -> Decimal:
        """How much the norm of the operands and the rest can grow."""
        return max(ONE, self.matrix.scale) if self.rest else self.matrix.scale


@dataclass(slots=True)
class Norms:
    """Bounds of groups of values, worked out when they are asked for.

    Attributes:
        graph: The values.
        rows: The ways in which each value is a row.
        real: The number type.
        singles: The values known so far; the others follow in order.
    """

    graph: Graph
    rows: tuple[tuple[Row, ...], ...]
    real: NumberType
    singles: list[Single] = field(default_factory=list)
    _exact: dict[Group, Decimal] = field(default_factory=dict)
    _error: dict[Group, Decimal] = field(default_factory=dict)
    _matrices: dict[_Shape, Matrix] = field(default_factory=dict)
    _depth: int = 0

    def exact(self, group: Group) -> Decimal:
        """Bound of the 2-norm of the exact values of a group."""
        if len(group) < 2:
            return self.singles[group[0]].exact if group else ZERO
        group = tuple(sorted(group))
        if group not in self._exact:
            self._depth += 1
            self._exact[group] = min(self._exact_bounds(group)) if self._is_near(group) else self._apart_exact(group)
            self._depth -= 1
        return self._exact[group]

    def error(self, group: Group) -> Decimal:
        """Bound of the 2-norm of the errors of a group."""
        group = tuple(sorted(number for number in group if self.singles[number].error))
        if len(group) < 2:
            return self.singles[group[0]].error if group else ZERO
        if group not in self._error:
            self._depth += 1
            self._error[group] = min(self._error_bounds(group)) if self._is_near(group) else self._apart_error(group)
            self._depth -= 1
        return self._error[group]

    def computed(self, group: Group) -> Decimal:
        """Bound of the 2-norm of the computed values of a group."""
        return min(self.exact(group) + self.error(group), norm(*(self.singles[number].computed for number in group)))

    # Rules for groups -------------------------------------------------------------------------------------------------

    def _is_near(self, group: Group) -> bool:
        """Whether it is worth looking at what the values of a group share."""
        return group[-1] - group[0] <= _FAR and self._depth <= _DEEP

    def _apart_exact(self, group: Group) -> Decimal:
        return norm(self.singles[group[-1]].exact, self.exact(group[:-1]))

    def _apart_error(self, group: Group) -> Decimal:
        return norm(self.singles[group[-1]].error, self.error(group[:-1]))

    def _exact_bounds(self, group: Group) -> Iterator[Decimal]:
        yield self._apart_exact(group)
        for image in self.images(group):
            yield image.scale * self.exact(image.operands + image.rest)
        for kept, added, _ in self._splits(group):
            yield self.exact(kept) + self.exact(added)
        for factor, others in self._common_factors(group):
            yield self.singles[factor].exact * self.exact(others)

    def _error_bounds(self, group: Group) -> Iterator[Decimal]:
        yield self._apart_error(group)
        for image in self.images(group):
            local = self.before_rounding(image)
            local += self._last_roundings(image, local)
            yield image.scale * self.error(image.operands + image.rest) + local
            if image.rest:
                yield norm(image.matrix.scale * self.error(image.operands) + local, self.error(image.rest))
        for kept, added, sums in self._splits(group):
            yield self.error(kept) + self.error(added) + self._roundings(sums)
        for factor, others in self._common_factors(group):
            known = self.singles[factor]
            grown = known.exact * self.error(others) + known.error * self.computed(others)
            yield grown + self._roundings(group)

    def images(self, group: Group) -> Iterator[Image]:
        """The ways to see the latest value of a group, alone or with another one, as a product with a matrix."""
        latest, rest = group[-1], group[:-1]
        for row in self.rows[latest]:
            paired = False
            for place, partner in enumerate(rest):
                for other in self.rows[partner]:
                    operands = tuple(dict.fromkeys(row.operands + other.operands))
                    if turns(row, other, self.graph) or (row.angle is other.angle is None and len(operands) < 3):
                        paired = True
                        others = rest[:place] + rest[place + 1 :]
                        yield Image((row, other), self._matrix(row, other), operands, others)
            multiplies = row.terms[0].product is not None or len(row.terms) > 1
            if multiplies and not paired and len(row.terms) + len(rest) <= _LARGEST_GROUP:
                yield Image((row,), self._matrix(row), row.operands, rest)

    def _matrix(self, *rows: Row) -> Matrix:
        """What is known of the matrix of some rows, worked out once for all that they may multiply."""
        places = {
            operand: place for place, operand in enumerate(dict.fromkeys(o for row in rows for o in row.operands))
        }
        shape = tuple(tuple((term.factor, term.sign, places[term.operand]) for term in row.terms) for row in rows)
        if (known := self._matrices.get((rows[0].angle, shape))) is None:
            known = self._matrices[rows[0].angle, shape] = matrix(rows, self.graph, self.singles, self.real)
        return known

    def _splits(self, group: Group) -> Iterator[tuple[Group, Group, Group]]:
        """The ways to split sums that are no rows: what is kept, what is added to it, and the sums."""
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

    def _common_factors(self, group: Group) -> Iterator[tuple[int, Group]]:
        """The factors that all values of a group share, each with what it multiplies."""
        if any(self.graph.operation(number) is not Operator.MUL for number in group):
            return
        products = [self.graph.operands(number) for number in group]
        for factor in dict.fromkeys(products[-1]):
            if all(factor in product for product in products):
                yield factor, tuple(one if other == factor else other for one, other in products)

    # Rounding ---------------------------------------------------------------------------------------------------------

    def _roundings(self, group: Sequence[int]) -> Decimal:
        return norm(*(self.singles[number].rounding for number in group))

    def before_rounding(self, image: Image) -> Decimal:
        """What a product with a matrix adds to errors before its last roundings: wrong entries, rounded products."""
        computed = self.computed(image.operands)
        added = image.matrix.wobble * computed
        sums = [row for row in image.rows if len(row.terms) > 1]
        if sums:
            products = [[term.product for term in row.terms if term.product is not None] for row in sums]
            sizes = [sum((self.singles[number].rounding for number in row), ZERO) for row in products]
            relative = self.real.unit * image.matrix.weight * computed
            added += min(norm(*sizes), relative + sum(map(len, products)) * self.real.underflow)
        return added

    def _last_roundings(self, image: Image, before: Decimal) -> Decimal:
        """The rounding of the values of an image themselves."""
        values = tuple(row.value for row in image.rows)
        absolute = self._roundings(values)
        if not absolute:
            return ZERO
        reached = self.exact(values) + image.matrix.scale * self.error(image.operands) + before
        return min(absolute, self.real.unit * reached + len(values) * self.real.underflow)
