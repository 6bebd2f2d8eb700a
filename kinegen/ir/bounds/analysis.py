"""Goes through the values of a program in order and bounds each with the rules of `norms`.

Ranges count only through the values that need no sine or cosine, and through the first sines and cosines. Most joints
turn so far that these reach one, in their limits as in the box of the test vectors: what follows is bounded once.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from decimal import Decimal
from fractions import Fraction
from functools import lru_cache

from kinegen.ir.bounds.graph import UNITY, Graph, Interval, Ranges, graph_of, intervals
from kinegen.ir.bounds.groups import Group, Groups
from kinegen.ir.bounds.norms import Norms, Single
from kinegen.ir.bounds.numbers import ONE, ZERO, NumberType, UnboundedError, largest_cosine, largest_sine, lower, upper
from kinegen.ir.bounds.rows import all_rows
from kinegen.ir.program import Operator, Program, Variable
from kinegen.ir.values import Half, Node

_INFINITE = Decimal("Infinity")

_UNKNOWN = Single(_INFINITE, _INFINITE, _INFINITE, _INFINITE)
"""Of a value that nothing is known of, or that nobody asks about."""


def analyse(program: Program, ranges: Ranges, real: NumberType) -> tuple[Single, ...]:
    """Bound the results of a program.

    Args:
        program: The program.
        ranges: Where its inputs lie.
        real: The number type it is evaluated in.

    Returns:
        What is known of each output.

    Raises:
        UnboundedError: If a result may overflow or a divisor vanish.
    """
    groups = _groups(program)
    return _beyond(groups, _edge(groups, intervals(groups.graph, program, ranges), real), real)


@lru_cache(maxsize=16)
def _groups(program: Program) -> Groups:
    """The values of a program and the rows among them, which are the same for all ranges and number types."""
    graph = graph_of(program)
    return Groups(graph, all_rows(graph))


def _edge(groups: Groups, ranges: tuple[Interval | None, ...], real: NumberType) -> tuple[Single | None, ...]:
    """What is known of the values that ranges say something about, as far as others see it; None for all others."""
    graph, known = groups.graph, Norms(groups, real)
    analysis, is_edge = _Analysis(graph, ranges, real, known), _edge_numbers(graph, ranges)
    for number in range(len(graph.nodes)):
        known.singles.append(analysis.single(number) if number in is_edge else _UNKNOWN)
    seen = _seen(graph)
    return tuple(
        None
        if number not in is_edge
        else single
        if number in seen
        else replace(_UNKNOWN, error=single.error if number in graph.angles else _INFINITE)
        for number, single in enumerate(known.singles)
    )


def _seen(graph: Graph) -> set[int]:
    """All values but those that only matter as angles, and what these are made of."""
    seen = {UNITY, *graph.outputs}
    for number in reversed(range(len(graph.nodes))):
        if number in seen and not isinstance(graph.operation(number), Half):
            seen.update(graph.operands(number))
    return seen


def _edge_numbers(graph: Graph, ranges: tuple[Interval | None, ...]) -> frozenset[int]:
    """The values with a range, and the sines and cosines of such values."""
    return frozenset(
        number
        for number, interval in enumerate(ranges)
        if interval is not None
        or (isinstance(graph.operation(number), Half) and ranges[graph.operands(number)[0]] is not None)
    )


@lru_cache(maxsize=32)
def _beyond(groups: Groups, edge: tuple[Single | None, ...], real: NumberType) -> tuple[Single, ...]:
    """Bound the results from what is known of the first values."""
    first = tuple(single and (single.exact, not single.error, not single.computed) for single in edge)
    known = Norms(groups, real, _exact_norms(groups, first))
    analysis = _Analysis(groups.graph, (None,) * len(edge), real, known)
    for number, single in enumerate(edge):
        known.singles.append(single or analysis.single(number))
    return tuple(known.singles[number] for number in groups.graph.outputs)


@lru_cache(maxsize=4)
def _exact_norms(_groups: Groups, _first: tuple[object, ...]) -> dict[Group, Decimal]:
    """Bounds of exact values, filled by the first analysis and used by those in other number types.

    They follow from the first exact values. What else goes into them is which groups are asked for, and in which order,
    since a long chain has groups that are not looked into: that depends on errors and computed values that are zero.
    """
    return {}


class _Analysis:
    """Bounds one value after the other; those before it are in `known`."""

    def __init__(self, graph: Graph, ranges: tuple[Interval | None, ...], real: NumberType, known: Norms) -> None:
        self.graph = graph
        self.ranges = ranges
        self.real = real
        self.known = known

    def single(self, number: int) -> Single:
        """Bound the next value."""
        node = self.graph.nodes[number]
        if not isinstance(node, Node):
            return self._leaf(number)
        operator, operands = node.operator, node.operands
        if isinstance(operator, Half):
            return self._trigonometric(operator, operands[0])
        if operator is Operator.DIV:
            return self._quotient(*operands)
        exact = self._size(number) or self._exact(number)
        error = min(self._error_bounds(number))
        first, second = (self.known.singles[operand].computed for operand in operands)
        largest = min(exact + error, first * second if operator is Operator.MUL else first + second)
        if number in self.graph.angles:
            # The bound is for inputs with which angles stay in the range of the sine and cosine.
            largest = min(largest, Decimal(self.real.angle_limit))
        return self._rounded(exact, error, largest, operands if operator is Operator.MUL else ())

    def _exact(self, number: int) -> Decimal:
        """The same of any sum or product."""
        if (known := self.known.exact_norms.get((number,))) is None:
            known = self.known.exact_norms[number,] = min(self._exact_bounds(number))
        return known

    def _rounded(self, exact: Decimal, error: Decimal, largest: Decimal, factors: Group = ()) -> Single:
        """A value from its error before rounding and a bound of the number that is rounded."""
        rounding = self.real.half_ulp(largest)
        if any(_is_power_of_two(self.graph.constant(factor)) for factor in factors):
            rounding = self.real.underflow
        total = error + rounding
        return Single(exact, total, min(self.real.rounded(largest), exact + total), rounding)

    # Leaves and functions ---------------------------------------------------------------------------------------------

    def _size(self, number: int) -> Decimal | None:
        """The largest magnitude of a value that needs no sine or cosine."""
        interval = self.ranges[number]
        return None if interval is None else upper(max(abs(end) for end in interval))

    def _leaf(self, number: int) -> Single:
        low, high = self.ranges[number] or (Fraction(0), Fraction(0))
        size = upper(max(abs(low), abs(high)))
        if isinstance(self.graph.nodes[number], Variable):
            return Single(size, ZERO, size, ZERO)
        # A constant, or a runtime parameter with the value of the file.
        rounded = Fraction(self.real.nearest(high))
        return Single(size, upper(abs(rounded - high)), upper(abs(rounded)), ZERO)

    def _trigonometric(self, half: Half, angle: int) -> Single:
        interval = self.ranges[angle]
        largest = largest_sine if half is Half.SIN else largest_cosine
        exact = ONE if interval is None else largest(*interval)
        error = Decimal(self.real.sine_error)
        # No number lies between one and the next above it.
        computed = ONE if error < 2 * self.real.unit else ONE + error
        error = min(error + self.known.singles[angle].error, ONE + computed)
        return Single(exact, error, min(computed, exact + error), ZERO)

    def _quotient(self, dividend: int, divisor: int) -> Single:
        """A quotient of runtime parameters, the only one there is."""
        interval = self.ranges[divisor]
        if interval is None:
            raise UnboundedError
        over, under = self.known.singles[dividend], self.known.singles[divisor]
        smallest = lower(min(abs(end) for end in interval))
        # Minus an upper bound is a lower bound.
        left = -(under.error - smallest)
        if left <= 0:
            raise UnboundedError
        exact = over.exact / smallest
        error = (over.error + exact * under.error) / left
        return self._rounded(exact, error, over.computed / left)

    # Sums and products ------------------------------------------------------------------------------------------------

    def _exact_bounds(self, number: int) -> Iterator[Decimal]:
        operands = self.graph.operands(number)
        first, second = (self.known.singles[operand].exact for operand in operands)
        if self.graph.operation(number) is Operator.MUL:
            yield first * second
            return
        yield first + second
        for image in self.known.groups.images((number,)):
            yield self.known.matrix(image).scale * self.known.exact(image.operands)
        for left, right in self._scalar_products(number):
            yield self.known.exact(left) * self.known.exact(right)

    def _error_bounds(self, number: int) -> Iterator[Decimal]:
        """Bounds of the error of a sum or product before its own rounding."""
        operands = self.graph.operands(number)
        first, second = (self.known.singles[operand] for operand in operands)
        if self.graph.operation(number) is Operator.MUL:
            yield first.exact * second.error + second.computed * first.error
            yield first.computed * second.error + second.exact * first.error
            return
        yield first.error + second.error
        for image in self.known.groups.images((number,)):
            yield self.known.matrix(image).scale * self.known.error(image.operands) + self.known.before_rounding(image)
        for left, right in self._scalar_products(number):
            reached = self.known.computed(left)
            grown = self.known.error(left) * self.known.exact(right) + reached * self.known.error(right)
            relative = self.real.unit * reached * self.known.computed(right) + 2 * self.real.underflow
            yield grown + min(first.rounding + second.rounding, relative)

    def _scalar_products(self, number: int) -> Iterator[tuple[Group, Group]]:
        """The vectors whose scalar product a sum of two products is, in both ways to form them."""
        first, second = self.graph.operands(number)
        both = (self.graph.operation(first), self.graph.operation(second))
        if both == (Operator.MUL, Operator.MUL) and not self.known.groups.rows[number]:
            (a, b), (c, d) = self.graph.operands(first), self.graph.operands(second)
            yield (a, c), (b, d)
            yield (a, d), (b, c)


def _is_power_of_two(constant: Fraction | None) -> bool:
    """Whether multiplying by a constant is exact, but for underflow."""
    if constant is None or not constant:
        return False
    return all(number & (number - 1) == 0 for number in (constant.numerator, constant.denominator))
