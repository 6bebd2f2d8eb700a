"""What groups of values have in common, read off the graph: it is the same for all ranges and number types.

A group is any one, two or three values in ascending order; its latest value is taken apart. A program is analysed for
several ranges and number types, so that what is found of a group is kept.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, field

from kinegen.ir.bounds.graph import Graph
from kinegen.ir.bounds.rows import Row, turns
from kinegen.ir.program import Operator

Group = tuple[int, ...]

Shape = tuple[int | None, tuple[tuple[tuple[int, int, int], ...], ...]]
"""An angle, and for each row its factors with their signs and the places of the operands: what decides a matrix."""

_LARGEST_GROUP = 3
"""Vectors have three entries; larger groups would cost more than they ever gain."""

_SUMS = (Operator.ADD, Operator.SUB)


@dataclass(frozen=True, slots=True)
class Image:
    """Part of a group as the product of a matrix with other values.

    Attributes:
        rows: The one or two values that are the product.
        shape: Of their matrix.
        operands: The one or two values that are multiplied.
        rest: The other values of the group.
    """

    rows: tuple[Row, ...]
    shape: Shape
    operands: Group
    rest: Group


@dataclass(frozen=True, slots=True, eq=False)
class Groups:
    """What groups have in common, found when it is asked for; equal to itself alone.

    Attributes:
        graph: The values.
        rows: The ways in which each value is a row.
    """

    graph: Graph
    rows: tuple[tuple[Row, ...], ...]
    _images: dict[Group, tuple[Image, ...]] = field(default_factory=dict)
    _splits: dict[Group, tuple[tuple[Group, Group, Group], ...]] = field(default_factory=dict)
    _factors: dict[Group, tuple[tuple[int, Group], ...]] = field(default_factory=dict)

    def images(self, group: Group) -> tuple[Image, ...]:
        """The ways to see the latest value of a group, alone or with another one, as a product with a matrix."""
        if (known := self._images.get(group)) is None:
            known = self._images[group] = tuple(self._find_images(group))
        return known

    def splits(self, group: Group) -> tuple[tuple[Group, Group, Group], ...]:
        """The ways to split sums that are no rows: what is kept, what is added to it, and the sums."""
        if (known := self._splits.get(group)) is None:
            known = self._splits[group] = tuple(self._find_splits(group))
        return known

    def common_factors(self, group: Group) -> tuple[tuple[int, Group], ...]:
        """The factors that all values of a group share, each with what it multiplies."""
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
    """What decides the matrix of some rows, whatever they multiply."""
    places = {operand: place for place, operand in enumerate(dict.fromkeys(o for row in rows for o in row.operands))}
    shape = tuple(tuple((term.factor, term.sign, places[term.operand]) for term in row.terms) for row in rows)
    return rows[0].angle, shape
