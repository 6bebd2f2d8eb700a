"""Literals read back as the nearest number of their type, however the exact number looks."""

from __future__ import annotations

import math
import re
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st

from kinegen.backends.scalar_types import ScalarType

LARGEST = {
    ScalarType.DOUBLE: Fraction(np.finfo(np.float64).max),
    ScalarType.FLOAT: Fraction(float(np.finfo(np.float32).max)),
}
TYPES = {ScalarType.DOUBLE: np.float64, ScalarType.FLOAT: np.float32}
FORM = {
    ScalarType.DOUBLE: re.compile(r"-?\d+(\.\d+)?(e[+-]?\d+)?"),
    ScalarType.FLOAT: re.compile(r"-?\d+(\.\d+)?(e[+-]?\d+)?F"),
}

exact = st.one_of(
    st.fractions(max_denominator=10**40),
    st.builds(lambda m, e: Fraction(m) * Fraction(10) ** e, st.integers(-(10**20), 10**20), st.integers(-60, 18)),
    st.builds(lambda m, e: Fraction(m) * Fraction(2) ** e, st.integers(-(2**60), 2**60), st.integers(-1200, 60)),
)
reals = st.sampled_from(list(ScalarType))


def is_nearest(real: ScalarType, candidate: Fraction, wanted: Fraction) -> bool:
    """Whether no neighbour of a number is nearer; of two equally near ones, the one whose last bit is 0."""
    number = TYPES[real](float(candidate))
    if Fraction(float(number)) != candidate:
        return False
    distance = abs(candidate - wanted)
    for side in (-math.inf, math.inf):
        neighbour = np.nextafter(number, TYPES[real](side))
        if math.isinf(neighbour):
            continue
        other = abs(Fraction(float(neighbour)) - wanted)
        bits = int(np.abs(number).view(np.uint64 if real is ScalarType.DOUBLE else np.uint32))
        if other < distance or (other == distance and bits & 1):
            return False
    return True


def half_way(real: ScalarType, number: float) -> Fraction:
    """The exact middle between a number and the next one up."""
    low = TYPES[real](number)
    return (Fraction(float(low)) + Fraction(float(np.nextafter(low, TYPES[real](math.inf))))) / 2


@given(reals, exact)
@example(ScalarType.FLOAT, Fraction(1, 10**40))  # subnormal
@example(ScalarType.FLOAT, Fraction(1, 10**60))  # vanishes
@example(ScalarType.DOUBLE, Fraction(1, 10**320))
@example(ScalarType.FLOAT, Fraction(2**24 + 1))  # a tie
@example(
    ScalarType.FLOAT, Fraction(16777217) + Fraction(1, 10**30)
)  # nearly a tie: rounding to double first is one off
@example(ScalarType.FLOAT, Fraction(16777217) - Fraction(1, 10**30))
@example(ScalarType.FLOAT, -(Fraction(16777217) + Fraction(1, 10**30)))
@example(ScalarType.DOUBLE, Fraction(2**53 + 1))
@example(ScalarType.FLOAT, Fraction(0))
def test_a_number_becomes_the_nearest_one(real: ScalarType, wanted: Fraction) -> None:
    assume(abs(wanted) <= LARGEST[real])

    assert is_nearest(real, Fraction(real.round(wanted)), wanted)


@given(reals, exact)
@example(ScalarType.FLOAT, Fraction(1, 10**45))
@example(ScalarType.FLOAT, Fraction(2) ** -149)
@example(ScalarType.DOUBLE, Fraction(2) ** -1074)
@example(ScalarType.FLOAT, Fraction(123456789, 10**17))
def test_a_literal_reads_back_as_that_number(real: ScalarType, wanted: Fraction) -> None:
    """Read exactly, as a C compiler reads it: no double stands in between."""
    assume(abs(wanted) <= LARGEST[real])
    text = real.literal(wanted)
    rounded = Fraction(real.round(wanted))

    assert FORM[real].fullmatch(text), text
    assert is_nearest(real, rounded, Fraction(text.removesuffix("F")))


@given(reals, st.floats(2.0**-120, 2.0**120, width=32))
def test_ties_go_to_the_even_number(real: ScalarType, number: float) -> None:
    middle = half_way(real, number)

    assert is_nearest(real, Fraction(real.round(middle)), middle)
    assert is_nearest(real, Fraction(real.round(-middle)), -middle)


@given(st.floats(allow_nan=False, allow_infinity=False, width=32))
def test_a_float_is_written_with_no_more_digits_than_it_needs(number: float) -> None:
    text = ScalarType.FLOAT.literal(Fraction(number))
    digits = text.removesuffix("F").split("e")[0].replace("-", "").replace(".", "").strip("0")

    assert len(digits) <= 9
    assert np.float32(text.removesuffix("F")) == np.float32(number)


@pytest.mark.parametrize(
    ("real", "value", "text"),
    [
        (ScalarType.DOUBLE, Fraction(0), "0.0"),
        (ScalarType.DOUBLE, Fraction(1), "1.0"),
        (ScalarType.DOUBLE, Fraction(3, 10), "0.3"),
        (ScalarType.DOUBLE, Fraction(1, 3), "0.3333333333333333"),
        (ScalarType.DOUBLE, -Fraction(203, 10000), "-0.0203"),
        (ScalarType.FLOAT, Fraction(0), "0.0F"),
        (ScalarType.FLOAT, Fraction(1), "1.0F"),
        (ScalarType.FLOAT, Fraction(3, 10), "0.3F"),
        (ScalarType.FLOAT, Fraction(1, 3), "0.33333334F"),
        (ScalarType.FLOAT, Fraction(10**10), "1e+10F"),
    ],
)
def test_literals_look_as_people_write_them(real: ScalarType, value: Fraction, text: str) -> None:
    assert real.literal(value) == text


def test_literals_of_floats_read_back_whatever_digits_they_need() -> None:
    """Some floats need nine digits, of which the last is no decimation of eight."""
    bits = np.random.default_rng(5).integers(0x00800000, 0x7F7FFFFF, 400, dtype=np.uint32)
    digits = set()
    for value in bits.view(np.float32):
        text = ScalarType.FLOAT.literal(Fraction(float(value)))
        assert text.endswith("F")
        assert np.float32(text[:-1]) == value
        digits.add(len(text[:-1].partition("e")[0].replace(".", "").strip("0")))

    assert max(digits) == 9
