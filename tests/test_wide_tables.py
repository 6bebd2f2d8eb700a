"""Entries of a table in the reference have twice the digits of its floats, so that nothing is lost of large angles."""

from __future__ import annotations

import random
from fractions import Fraction
from typing import Any

import mpmath
import numpy as np
import pytest

from kinegen.io.load import loads
from kinegen.verify.reference import DIGITS, WIDE_UNIT, Kinematics
from kinegen.verify.reference.number_types import WIDE, Pair, cosine, pair_of, sine, single

HEAD = "kinegen: 1\nname: arm\nconvention: standard\nunits: {length: m, angle: deg}\njoints:\n"


def fraction(value: Any) -> Fraction:
    """The exact number that a pair or a float is."""
    if isinstance(value, Pair):
        return fraction(value.high) + fraction(value.low)
    return Fraction(*WIDE(value).as_integer_ratio())


def apart(wide: Any, exact: Any) -> float:
    """The largest difference of numbers, which has the digits that wide floats do not."""
    with mpmath.workdps(DIGITS):
        numbers = (fraction(number) for number in np.ravel(wide))
        pairs = zip(numbers, np.ravel(exact), strict=True)
        return max(float(abs(mpmath.mpf(one.numerator) / one.denominator - other)) for one, other in pairs)


def test_sums_products_and_quotients_have_twice_the_digits() -> None:
    draw = random.Random(1)
    for _ in range(200):
        a, b = (Fraction(draw.randint(1, 10**9), draw.randint(1, 10**9)) * draw.choice((-1, 1)) for _ in range(2))
        one, other, number = pair_of(a), pair_of(b), WIDE(draw.uniform(-1e5, 1e5))
        c = fraction(number)
        found = {
            a: one,
            -a: -one,
            a + b: one + other,
            a - b: one - other,
            a * b: one * other,
            a / b: one / other,
            a**3: one**3,
            a + c: number + one,
            a * c: number * one,
            c - a: number - one,
            c / a: number / one,
            1 / b: 1 / other,
        }
        scale = max(abs(a), abs(b), abs(c))
        for wanted, given in found.items():
            assert isinstance(given, Pair)
            assert abs(fraction(given) - wanted) <= 16 * Fraction(WIDE_UNIT) ** 2 * max(abs(wanted), scale)


def test_arrays_are_computed_with_as_single_numbers_are() -> None:
    q = np.array([0.25, 43669.7, -1e5], WIDE)
    quarter = pair_of(Fraction(1, 3))
    together = q * 2 + quarter

    for place, each in enumerate(q):
        alone = each * 2 + quarter
        assert (together.high[place], together.low[place]) == (alone.high, alone.low)
        assert single(together)[place] == single(alone)
        assert sine(together)[place] == sine(alone)
        assert cosine(together)[place] == cosine(alone)


@pytest.mark.parametrize("theta", ["q + 90", "180 - q", "q - 270", "2*q + 90", "-q - 90"])
def test_a_quarter_turn_beside_ten_thousand_turns_loses_nothing(theta: str) -> None:
    """Kernels exchange sine and cosine for a quarter turn, and so are right to the last digit."""
    arm = loads(f"{HEAD}  - {{name: j1, theta: {theta}, d: 0, a: 1, alpha: 90}}\n", "arm.yaml")
    q = np.array([[-43669.7], [49_999.3], [12_345.6], [0.5]])
    wide, exact = Kinematics(arm, q, wide=True), Kinematics(arm, q, exact=True)

    assert apart(wide.pose("tool"), exact.pose("tool")) < 8 * WIDE_UNIT
    assert apart(wide.jacobian("tool"), exact.jacobian("tool")) < 16 * WIDE_UNIT
