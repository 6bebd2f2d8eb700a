"""The bounds on groups of values hold for whatever is computed, and are tight for turns."""

from __future__ import annotations

import itertools
import math
import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kinegen.ir.fixed_point.ranges import Copy, Extent, Extents, Given, Product, Sum, Trigonometric, Value

ANGLES = 3
ROUNDING = 0.01
SLACK = 1.0 + 1e-12


def leaves(draw: st.DrawFn) -> list[Value]:
    """Constants with errors, an input, and sines and cosines."""
    constants = draw(st.lists(st.sampled_from([0.5, -0.5, 0.75**0.5, 1.0, -2.0, 0.3]), min_size=1, max_size=4))
    found: list[Value] = [Given(Extent(abs(value), ROUNDING / 2), value) for value in constants]
    found.append(Given(Extent(3.0, 0.0)))
    found += [Trigonometric(angle, ROUNDING, 1.2 * ROUNDING) for angle in range(ANGLES) for _ in range(2)]
    return found


@st.composite
def computations(draw: st.DrawFn) -> list[Value]:
    """Values made of earlier ones, turns among them."""
    values = leaves(draw)
    for _ in range(draw(st.integers(1, 12))):
        places = st.integers(0, len(values) - 1)
        left, right, sign = draw(places), draw(places), draw(st.sampled_from([1, -1]))
        match draw(st.sampled_from(["product", "sum", "copy", "turn", "turn", "line"])):
            case "product":
                values.append(Product(left, right, ROUNDING, sign))
            case "sum":
                values.append(Sum(left, right, ROUNDING, sign))
            case "copy":
                values.append(Copy(left, ROUNDING))
            case "turn":
                base = next(place for place, value in enumerate(values) if isinstance(value, Trigonometric))
                sine = base + 2 * draw(st.integers(0, ANGLES - 1))
                values += _turn(len(values), (sine, sine + 1), (left, right), sign)
            case "line":
                constants = [place for place, value in enumerate(values) if isinstance(value, Given) and value.value]
                factor, offset = draw(st.sampled_from(constants)), draw(st.sampled_from(constants))
                values.append(Product(factor, left, ROUNDING, sign))
                values.append(Sum(len(values) - 1, offset, ROUNDING, draw(st.sampled_from([1, -1]))))
    return values


def _turn(first: int, pair: tuple[int, int], vector: tuple[int, int], sign: int) -> list[Value]:
    """c*x - s*y and s*x + c*y."""
    sine, cosine = pair
    products: list[Value] = [
        Product(cosine, vector[0], ROUNDING),
        Product(sine, vector[1], ROUNDING),
        Product(sine, vector[0], ROUNDING),
        Product(cosine, vector[1], ROUNDING),
    ]
    return [*products, Sum(first, first + 1, ROUNDING, -sign), Sum(first + 2, first + 3, ROUNDING, sign)]


def computed(values: list[Value], source: random.Random) -> list[tuple[float, float]]:
    """Exact and computed values, with errors as large as they may be."""
    angles = [source.uniform(-math.pi, math.pi) for _ in range(ANGLES)]
    found: list[tuple[float, float]] = []
    for place, value in enumerate(values):
        match value:
            case Given(extent, constant):
                exact = source.uniform(-extent.size, extent.size) if constant is None else constant
                found.append((exact, exact + source.choice([-1, 1]) * extent.error))
            case Trigonometric(angle):
                is_sine = not any(isinstance(other, Trigonometric) and other.angle == angle for other in values[:place])
                exact = math.sin(angles[angle]) if is_sine else math.cos(angles[angle])
                found.append((exact, exact + source.choice([-1, 1]) * 0.8 * ROUNDING))
            case Copy(other, rounding):
                a, b = found[other]
                found.append((-a, -b + source.choice([-1, 1]) * rounding))
            case Product(left, right, rounding, sign):
                pairs = zip(found[left], found[right], strict=True)
                a, b = (sign * x * y for x, y in pairs)
                found.append((a, b + source.choice([-1, 1]) * rounding))
            case Sum(left, right, rounding, sign):
                pairs = zip(found[left], found[right], strict=True)
                a, b = (x + sign * y for x, y in pairs)
                found.append((a, b + source.choice([-1, 1]) * rounding))
    return found


@given(values=computations(), seed=st.integers(0, 2**32))
@settings(max_examples=150)
def test_no_computation_leaves_its_bounds(values: list[Value], seed: int) -> None:
    source = random.Random(seed)
    extents = Extents(values)
    groups = [tuple(source.choices(range(len(values)), k=size)) for size in (2, 2, 2, 3, 3, 3, 4)]
    groups += [(place,) for place in range(len(values))] + [(place - 1, place) for place in range(1, len(values))]
    for _ in range(20):
        found = computed(values, source)
        for group in groups:
            bound = extents.extent(*group)
            size = math.sqrt(sum(found[place][0] ** 2 for place in group))
            error = math.sqrt(sum((found[place][1] - found[place][0]) ** 2 for place in group))

            assert size <= bound.size * SLACK
            assert error <= bound.error * SLACK


def chain(turns: int) -> tuple[Extents, tuple[int, int]]:
    """A unit vector, turned again and again by different angles."""
    values: list[Value] = [Given(Extent(1.0, 0.0), 1.0), Given(Extent(0.0, 0.0), 0.0)]
    vector = (0, 1)
    for angle in range(turns):
        pair = (len(values), len(values) + 1)
        values += [Trigonometric(angle, 1e-9, 1.2e-9)] * 2
        values += _turn(len(values), pair, vector, 1)
        vector = (len(values) - 2, len(values) - 1)
    return Extents([_fine(value) for value in values]), vector


def _fine(value: Value) -> Value:
    match value:
        case Product(left, right):
            return Product(left, right, 1e-9)
        case Sum(left, right, _, sign):
            return Sum(left, right, 0.0, sign)
        case _:
            return value


@pytest.mark.parametrize("turns", [1, 7, 21, 300])
def test_a_turned_vector_keeps_its_length_and_gathers_errors_one_by_one(turns: int) -> None:
    extents, vector = chain(turns)
    bound = extents.extent(*vector)

    assert 1.0 <= bound.size < 1.0 + 1e-5
    # Each turn adds the error of its pair, and two rounded products in each of two entries.
    assert bound.error <= turns * (1.2e-9 + 2 * math.sqrt(2) * 1e-9) * (1 + 1e-5)


def test_two_signs_that_make_no_turn_are_not_taken_for_one() -> None:
    """c*x + s*y and s*x + c*y are longer than (x, y) by up to the root of two."""
    values: list[Value] = [Trigonometric(0, 0.0, 0.0), Trigonometric(0, 0.0, 0.0)]
    values += [Given(Extent(1.0, 0.0)), Given(Extent(1.0, 0.0))]
    for left, right in itertools.product((1, 0), (2, 3)):
        values.append(Product(left, right, 0.0))
    values += [Sum(4, 7, 0.0, 1), Sum(6, 5, 0.0, 1)]

    assert Extents(values).extent(8, 9).size >= 2.0


def test_a_value_that_stands_twice_counts_twice() -> None:
    values: list[Value] = [Given(Extent(1.0, 0.5))]
    bound = Extents(values).extent(0, 0)

    assert bound.size == pytest.approx(math.sqrt(2))
    assert bound.error == pytest.approx(math.sqrt(0.5))
