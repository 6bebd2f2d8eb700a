"""How large values get and how far they are from the exact ones, for arithmetic whose rounding errors are known.

In: values in the order of their computation, each a constant or input, a sum, a product, a sine or a cosine. Out:
bounds, for every joint vector whatsoever, on the Euclidean length of a group of values and on that of their errors.

Groups are what makes the bounds tight. Turning a vector changes neither its length nor that of its error, so a chain of
turns adds up what each turn loses; taken one by one, values would seem to grow by half at every turn. Sound by
construction: each bound is the smallest of several, all of which hold by the triangle inequality or that of Cauchy and
Schwarz. Every one is widened by 2^-45, far more than the rounding of the few operations that it takes.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from kinegen.support.dataclass import dataclass

OUTWARD = 1.0 + 2.0**-45
"""By this much every bound is widened: far more than the rounding of the few operations that make it."""


@dataclass(frozen=True, slots=True)
class Extent:
    """What is known of a group of values.

    `size`: bound on the Euclidean length of the exact values. `error`: bound on the Euclidean length of the differences
    between the computed values and the exact ones.
    """

    size: float
    error: float

    @property
    def largest(self) -> float:
        """Bound on the length of the computed values."""
        return (self.size + self.error) * OUTWARD


@dataclass(frozen=True, slots=True)
class Given:
    """A constant or an input; of a constant also the value, next to the exact one."""

    extent: Extent
    value: float | None = None


@dataclass(frozen=True, slots=True)
class Trigonometric:
    """The sine or the cosine of an angle.

    `angle`: tells the angle from others; of each there is at most one sine and one cosine. `pair_error`: bound on the
    length of the errors of both.
    """

    angle: object
    error: float
    pair_error: float


@dataclass(frozen=True, slots=True)
class Copy:
    """Another value or minus that, rounded anew: the place of the other one, and a bound on the rounding error."""

    source: int
    rounding: float


@dataclass(frozen=True, slots=True)
class Product:
    """A product of two values, or minus that: their places, a bound on the rounding error, and the sign."""

    left: int
    right: int
    rounding: float
    sign: int = 1


@dataclass(frozen=True, slots=True)
class Sum:
    """A sum of two values, or a difference (sign -1): their places, and a bound on the rounding error."""

    left: int
    right: int
    rounding: float
    sign: int = 1


Value = Given | Trigonometric | Copy | Product | Sum


_UNIT = 1.0 + 2.0**-30
"""What still counts as 1: constants are rounded."""

_LARGEST_GROUP = 3
_LARGEST_TABLE = 20_000
_DEEPEST = 100
"""Beyond these, groups are taken apart into single values; a robot has vectors of three, and needs few of them."""

Places = tuple[int, ...]

_NOTHING = Extent(0.0, 0.0)


@dataclass(frozen=True, slots=True)
class _Row:
    """A sum of two products read as a row times a vector.

    `rounding`: all rounding errors of the two products and their sum.
    """

    row: Places
    vector: Places
    rounding: float


@dataclass(frozen=True, slots=True)
class _Line:
    """A sum read as a constant times a value, plus another constant.

    `slope`: the factor, next to its exact value. `offset`: what is added, next to its exact value. `error`: what the
    computed sum loses besides the error of the value times the slope.
    """

    slope: float
    place: int
    offset: float
    error: float


def _length(one: float, other: float) -> float:
    """Return the Euclidean length, by operations that every machine rounds alike, which `math.hypot` is not."""
    return math.sqrt(one * one + other * other)


def _each(places: Places) -> Iterator[tuple[int, Places]]:
    return ((place, places[:index] + places[index + 1 :]) for index, place in enumerate(places))


def _offset(beside: Extent, scale: float, offset: float, error: float) -> Extent:
    """Values multiplied by no more than a scale, and a constant vector at right angles to them."""
    factor = max(1.0, scale * OUTWARD)
    return Extent(_length(factor * beside.size, offset) * OUTWARD, factor * beside.error + error)


def _join(one: Extent, other: Extent) -> Extent:
    return Extent(_length(one.size, other.size), _length(one.error, other.error))


class Extents:
    """Bounds on the values of one computation.

    Args:
        values: The values; each refers to earlier ones by their places.
    """

    def __init__(self, values: Sequence[Value]) -> None:
        self._values = tuple(values)
        self._known: dict[Places, Extent] = {(): _NOTHING}
        self._depth = 0
        for place in range(len(self._values)):
            self.extent(place)  # later ones then find it ready, however deep the computation is

    def extent(self, *places: int) -> Extent:
        """Bounds on one value, or on several together; one that is named twice counts twice."""
        group = tuple(sorted(places))
        if group not in self._known:
            self._depth += 1
            bounds = tuple(self._bounds(group))
            self._depth -= 1
            self._known[group] = Extent(
                min(bound.size for bound in bounds) * OUTWARD, min(bound.error for bound in bounds) * OUTWARD
            )
        return self._known[group]

    def _bounds(self, group: Places) -> Iterator[Extent]:
        last, rest = group[-1], group[:-1]
        is_far = len(group) > _LARGEST_GROUP or len(self._known) > _LARGEST_TABLE or self._depth > _DEEPEST
        traced = () if rest and is_far else tuple(self._traced(last, rest))
        yield from traced
        # three entries of a vector are seldom bounded better one by one
        if rest and (len(group) < _LARGEST_GROUP or not traced):
            yield _join(self.extent(last), self.extent(*rest))

    def _traced(self, last: int, rest: Places) -> Iterator[Extent]:
        """Yield the last value of a group traced to what it was made of."""
        match self._values[last]:
            case Given(extent) if not rest:
                yield extent
            case Trigonometric() as value:
                yield from self._trigonometric(value, last, rest)
            case Copy(source, rounding):
                extent = self.extent(*rest, source)
                yield Extent(extent.size, extent.error + rounding)
            case Product() as value:
                yield from self._product(value, rest)
            case Sum() as value:
                yield from self._sum(value, rest)

    def _trigonometric(self, value: Trigonometric, place: int, rest: Places) -> Iterator[Extent]:
        if not rest:
            yield Extent(1.0, value.error)
        for other, others in _each(rest):
            if other != place and self._is_pair((place, other)):
                yield _join(Extent(1.0, value.pair_error), self.extent(*others))

    def _product(self, value: Product, rest: Places) -> Iterator[Extent]:
        for factor, shared in ((value.left, value.right), (value.right, value.left)):
            # a*x and b*x are as long as x times the vector (a, b)
            for other, others in _each(rest):
                partner = self._values[other]
                if isinstance(partner, Product) and shared in (partner.left, partner.right):
                    second = partner.right if partner.left == shared else partner.left
                    rounding = _length(value.rounding, partner.rounding)
                    yield from self._turned(_Row((factor, second), (shared,), rounding), others)
            # of a sine and something longer, only the sine is left out: other values may have the rest in common
            if not rest or self._is_simple(factor) or not self._is_simple(shared):
                yield from self._turned(_Row((factor,), (shared,), value.rounding), rest)

    def _sum(self, value: Sum, rest: Places) -> Iterator[Extent]:
        rows = tuple(self._rows(value))
        turns = tuple(row for row in rows if self._is_turn(row.row))
        # a*x - b*y and b*x + a*y: the vector (x, y), turned, and multiplied by the length of (a, b)
        is_vector = False
        for row in turns or rows:
            for other, others in _each(rest):
                if self._completes(value, row, other):
                    is_vector = True
                    rounding = _length(row.rounding, next(self._rows(self._values[other])).rounding)
                    yield from self._turned(_Row(row.row, row.vector, rounding), others)
        if turns and is_vector:
            return  # nothing better can be found
        for row in turns or rows:
            yield from self._turned(row, rest)
        if not turns or not rest:
            yield from self._terms(value, rest)
            yield from self._beside_constant(value, rest)

    def _terms(self, value: Sum, rest: Places) -> Iterator[Extent]:
        for kept, added in ((value.left, value.right), (value.right, value.left)):
            extent, extra = self.extent(*rest, kept), self.extent(added)
            yield Extent(extent.size + extra.size, extent.error + extra.error + value.rounding)

    def _beside_constant(self, value: Sum, rest: Places) -> Iterator[Extent]:
        """a*x + k for constants a and k, alone or with a second such value of the same x.

        Alone it is read as a*x + b*(k/b) with a vector (a, b) of length 1. Two of them are x times the vector (a, b)
        and the vector (k, l); these are at right angles where a constant turn stands behind them.
        """
        for line in self._lines(value):
            if abs(line.slope) < 1.0:
                beside = self.extent(*rest, line.place)
                yield _offset(beside, 1.0, line.offset / math.sqrt(1.0 - line.slope * line.slope), line.error)
            for other, others in _each(rest):
                for second in self._lines(self._values[other]):
                    scale = _length(line.slope, second.slope)
                    if second.place == line.place and scale <= _UNIT:
                        square = line.offset * line.offset + second.offset * second.offset
                        skew = abs(line.slope * line.offset + second.slope * second.offset) + square * 2.0**-50
                        square += 2.0 * skew * self.extent(line.place).size
                        beside = self.extent(*others, line.place)
                        yield _offset(beside, scale, math.sqrt(square), _length(line.error, second.error))

    def _lines(self, value: Value) -> Iterator[_Line]:
        """Yield the ways to read a sum as a constant times a value, plus another constant."""
        if not isinstance(value, Sum):
            return
        for term, place, sign in ((value.left, value.right, 1), (value.right, value.left, value.sign)):
            product, offset = self._values[term], self._values[place]
            if isinstance(product, Product) and isinstance(offset, Given) and offset.value is not None:
                for factor, other in ((product.left, product.right), (product.right, product.left)):
                    slope = self._values[factor]
                    if isinstance(slope, Given) and slope.value is not None:
                        error = slope.extent.error * self.extent(other).largest + offset.extent.error
                        yield _Line(
                            slope=sign * product.sign * slope.value,
                            place=other,
                            offset=sign * value.sign * offset.value,
                            error=error + product.rounding + value.rounding,
                        )

    def _turned(self, row: _Row, rest: Places) -> Iterator[Extent]:
        """Yield a row, or a turn of which it is one row, times a vector; and the rest."""
        scale, moved = self.extent(*row.row), self.extent(*row.vector)
        error = scale.error * moved.largest + row.rounding
        if not rest:
            yield Extent(scale.size * moved.size, scale.size * moved.error + error)
        elif scale.size <= _UNIT:
            beside, factor = self.extent(*rest, *row.vector), max(1.0, scale.size)
            yield Extent(factor * beside.size, factor * beside.error + error)

    def _rows(self, value: Value) -> Iterator[_Row]:
        if not isinstance(value, Sum):
            return
        first, second = self._values[value.left], self._values[value.right]
        if isinstance(first, Product) and isinstance(second, Product):
            rounding = first.rounding + second.rounding + value.rounding
            for p, q in ((first.left, first.right), (first.right, first.left)):
                for r, s in ((second.left, second.right), (second.right, second.left)):
                    yield _Row((p, r), (q, s), rounding)

    def _completes(self, value: Sum, row: _Row, other: int) -> bool:
        """Tell whether another value is the second entry of the vector that a sum is the first entry of."""
        partner = self._values[other]
        if not isinstance(partner, Sum) or self._handedness(partner) == self._handedness(value):
            return False
        wanted = ((row.row[::-1], row.vector), (row.row, row.vector[::-1]))
        return any((found.row, found.vector) in wanted for found in self._rows(partner))

    def _handedness(self, value: Sum) -> int:
        """Return the sign of the second product in a sum relative to that of the first."""
        terms = (self._values[value.left], self._values[value.right])
        return value.sign * math.prod(term.sign for term in terms if isinstance(term, Product))

    def _is_simple(self, place: int) -> bool:
        return isinstance(self._values[place], (Given, Trigonometric))

    def _is_pair(self, places: Places) -> bool:
        first, second = (self._values[place] for place in places)
        if isinstance(first, Trigonometric) and isinstance(second, Trigonometric):
            return first.angle == second.angle and places[0] != places[1]
        return False

    def _is_turn(self, places: Places) -> bool:
        """Tell whether two values are a sine and a cosine, of a constant angle perhaps: no better row can be found."""
        first, second = (self._values[place] for place in places)
        if isinstance(first, Given) and isinstance(second, Given):
            return 1.0 / _UNIT <= self.extent(*places).size <= _UNIT
        return self._is_pair(places)
