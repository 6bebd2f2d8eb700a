"""Bounds each value of a program with the rules, and sums up its results for each frame.

Ranges count only through the values that need no sine or cosine, and through the first sines and cosines. Most joints
turn so far that these reach one, in their limits as in the box of the test vectors: what follows is bounded once.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from decimal import Decimal, localcontext
from fractions import Fraction
from functools import lru_cache

from kinegen.ir.error_analysis.directed_rounding import (
    ONE,
    UPWARDS,
    ZERO,
    NumberType,
    UnboundedError,
    largest_cosine,
    largest_sine,
    lower,
    upper,
)
from kinegen.ir.error_analysis.rules import Group, Groups, Norms, Single
from kinegen.ir.error_analysis.value_graph import UNITY, Graph, Interval, Ranges, all_rows, graph_of, intervals
from kinegen.ir.program import Operator, Program, Variable
from kinegen.ir.value_numbering import Node, SinOrCos
from kinegen.model.outputs import Kind, Quantity
from kinegen.support.dataclass import dataclass

_INFINITE = Decimal("Infinity")

_UNKNOWN = Single(_INFINITE, _INFINITE, _INFINITE, _INFINITE)
"""Of a value that nothing is known of, or that nobody asks about."""


def analyse(program: Program, ranges: Ranges, real: NumberType) -> tuple[Single, ...]:
    """Bound the results of a program.

    Raises UnboundedError if a result may overflow or a divisor vanish.
    """
    groups = _groups(program)
    return _beyond(groups, _edge(groups, intervals(groups.graph, program, ranges), real), real)


@lru_cache(maxsize=16)
def _groups(program: Program) -> Groups:
    """Return the values of a program and the rows among them, which are the same for all ranges and number types."""
    graph = graph_of(program)
    return Groups(graph, all_rows(graph))


def _edge(groups: Groups, ranges: tuple[Interval | None, ...], real: NumberType) -> tuple[Single | None, ...]:
    """Return what is known of values with ranges, as far as others see it; None for all others."""
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
    """Return all values but those that only matter as angles, and what these are made of."""
    seen = {UNITY, *graph.outputs}
    for number in reversed(range(len(graph.nodes))):
        if number in seen and not isinstance(graph.operation(number), SinOrCos):
            seen.update(graph.operands(number))
    return seen


def _edge_numbers(graph: Graph, ranges: tuple[Interval | None, ...]) -> frozenset[int]:
    return frozenset(
        number
        for number, interval in enumerate(ranges)
        if interval is not None
        or (isinstance(graph.operation(number), SinOrCos) and ranges[graph.operands(number)[0]] is not None)
    )


@lru_cache(maxsize=32)
def _beyond(groups: Groups, edge: tuple[Single | None, ...], real: NumberType) -> tuple[Single, ...]:
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
        node = self.graph.nodes[number]
        if not isinstance(node, Node):
            return self._leaf(number)
        operator, operands = node.operator, node.operands
        if isinstance(operator, SinOrCos):
            return self._trigonometric(operator, operands[0])
        if operator is Operator.DIV:
            return self._quotient(*operands)
        # The smallest of all bounds that hold, each for the exact value and for its error.
        exact = self._size(number) or self._exact(number)
        error = min(self._error_bounds(number))
        first, second = (self.known.singles[operand].computed for operand in operands)
        largest = min(exact + error, first * second if operator is Operator.MUL else first + second)
        if number in self.graph.angles:
            # The bound is for inputs with which angles stay in the range of the sine and cosine.
            largest = min(largest, Decimal(self.real.angle_limit))
        return self._rounded(exact, error, largest, operands if operator is Operator.MUL else ())

    def _exact(self, number: int) -> Decimal:
        """Return the same of any sum or product."""
        if (known := self.known.exact_norms.get((number,))) is None:
            known = self.known.exact_norms[number,] = min(self._exact_bounds(number))
        return known

    def _rounded(self, exact: Decimal, error: Decimal, largest: Decimal, factors: Group = ()) -> Single:
        """Return a value from its error before rounding and a bound of the number that is rounded."""
        rounding = self.real.half_ulp(largest)
        if any(_is_power_of_two(self.graph.constant(factor)) for factor in factors):
            rounding = self.real.underflow
        total = error + rounding
        return Single(exact, total, min(self.real.rounded(largest), exact + total), rounding)

    # Leaves and functions ---------------------------------------------------------------------------------------------

    def _size(self, number: int) -> Decimal | None:
        """Return the largest magnitude of a value that needs no sine or cosine."""
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

    def _trigonometric(self, half: SinOrCos, angle: int) -> Single:
        interval = self.ranges[angle]
        largest = largest_sine if half is SinOrCos.SIN else largest_cosine
        exact = ONE if interval is None else largest(*interval)
        error = Decimal(self.real.sine_error)
        # No number lies between one and the next above it.
        computed = ONE if error < 2 * self.real.unit else ONE + error
        error = min(error + self.known.singles[angle].error, ONE + computed)
        return Single(exact, error, min(computed, exact + error), ZERO)

    def _quotient(self, dividend: int, divisor: int) -> Single:
        """Return a quotient of runtime parameters, the only one there is."""
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
        """Yield the vectors whose scalar product a sum of two products is, in both ways to form them."""
        first, second = self.graph.operands(number)
        both = (self.graph.operation(first), self.graph.operation(second))
        if both == (Operator.MUL, Operator.MUL) and not self.known.groups.rows[number]:
            (a, b), (c, d) = self.graph.operands(first), self.graph.operands(second)
            yield (a, c), (b, d)
            yield (a, d), (b, c)


def _is_power_of_two(constant: Fraction | None) -> bool:
    """Tell whether multiplying by a constant is exact, but for underflow."""
    if constant is None or not constant:
        return False
    return all(number & (number - 1) == 0 for number in (constant.numerator, constant.denominator))


_PLACES = (Kind.POSE, Kind.FRAMES, Kind.POSITION)
"""Kinds of results that say where frames are."""

_WITHOUT_RULES = (Operator.SQRT, Operator.ATAN2, Operator.SELECT_LT)


@dataclass(frozen=True, slots=True)
class FrameBound:
    """How far the result for one frame can be off.

    Attributes:
        position: Error of x, y and z, in the length unit of the program.
        rotation: Largest error of an entry of the rotation; None where the program computes positions alone.
    """

    frame: str
    position: tuple[float, float, float]
    rotation: float | None


@dataclass(frozen=True, slots=True)
class ErrorBound:
    """How far the results of a program can be off; infinite if they may overflow, or if there are no rules for it.

    Attributes:
        frames: The same summed up for each frame, where poses or positions are computed.
    """

    quantity: Quantity
    entries: tuple[float, ...]
    frames: tuple[FrameBound, ...]

    @property
    def position(self) -> tuple[float, float, float]:
        """The largest errors of x, y and z among all frames."""
        x, y, z = (max(column) for column in zip(*(frame.position for frame in self.frames), strict=True))
        return x, y, z

    @property
    def rotation(self) -> float | None:
        """The largest error of an entry of a rotation among all frames."""
        return max((frame.rotation for frame in self.frames if frame.rotation is not None), default=None)


def has_rules(program: Program) -> bool:
    """Tell whether there are rules for all operations of a program; roots, arc tangents and selections have none."""
    return not program.uses(*_WITHOUT_RULES)


def bound(program: Program, ranges: Ranges, real: NumberType) -> ErrorBound:
    """Prove bounds on the errors of a program.

    Returns:
        Bounds that hold for all inputs in the ranges for which no angle leaves the range of the sine and cosine; see
        the package for what exactly is proven.
    """
    with localcontext(UPWARDS):
        try:
            entries = tuple(_float(output.error) for output in analyse(program, ranges, real))
        except UnboundedError:
            entries = (math.inf,) * len(program.outputs)
    frames = tuple(_frames(program, entries)) if program.quantity.kind in _PLACES else ()
    return ErrorBound(program.quantity, entries, frames)


def _frames(program: Program, entries: tuple[float, ...]) -> Iterator[FrameBound]:
    size = len(entries) // len(program.frames)
    for index, name in enumerate(program.frames):
        yield _frame(name, entries[index * size : (index + 1) * size])


def _float(number: Decimal) -> float:
    """Return the nearest double that is not smaller."""
    nearest = float(number)
    return nearest if Decimal(nearest) >= number else math.nextafter(nearest, math.inf)


def _frame(name: str, entries: tuple[float, ...]) -> FrameBound:
    if len(entries) == 3:
        return FrameBound(name, (entries[0], entries[1], entries[2]), None)
    rotation = max(entry for place, entry in enumerate(entries) if place % 4 != 3)
    return FrameBound(name, (entries[3], entries[7], entries[11]), rotation)
