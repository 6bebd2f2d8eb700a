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

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from decimal import Decimal

from kinegen.ir.bounds.groups import Group, Groups, Image, Shape
from kinegen.ir.bounds.matrices import Matrix, matrix
from kinegen.ir.bounds.numbers import ONE, ZERO, NumberType, norm

_FAR = 800
"""Values with so many others between them are bounded each by itself: what they share is far behind, and all pairs of a
long chain would be as many as the square of its length."""

_DEEP = 120
"""So many groups are looked at for the sake of one; beyond that, too, each value is bounded by itself."""


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


@dataclass(slots=True)
class Norms:
    """Bounds of groups of values, worked out when they are asked for.

    Attributes:
        groups: The values, and what groups of them have in common.
        real: The number type.
        exact_norms: Bounds of the 2-norm of exact values that are known, single ones among them.
        singles: The values known so far; the others follow in order.
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
        """The same of values in ascending order that all have an error."""
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
        """Whether it is worth looking at what the values of a group share."""
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
        """What is known of the matrix of an image, worked out once for all that it may multiply."""
        if (known := self._matrices.get(image.shape)) is None:
            known = self._matrices[image.shape] = matrix(image.rows, self.groups.graph, self.singles, self.real)
        return known

    def _scale(self, image: Image) -> Decimal:
        """How much the norm of the operands and the rest can grow."""
        scale = self.matrix(image).scale
        return max(ONE, scale) if image.rest else scale

    # Rounding ---------------------------------------------------------------------------------------------------------

    def _roundings(self, group: Sequence[int]) -> Decimal:
        return norm(*(self.singles[number].rounding for number in group))

    def before_rounding(self, image: Image) -> Decimal:
        """What a product with a matrix adds to errors before its last roundings: wrong entries, rounded products."""
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
        """The rounding of the values of an image themselves."""
        values = tuple(row.value for row in image.rows)
        absolute = self._roundings(values)
        if not absolute:
            return ZERO
        reached = self.exact(values) + self.matrix(image).scale * self.error(image.operands) + before
        return min(absolute, self.real.unit * reached + len(values) * self.real.underflow)
