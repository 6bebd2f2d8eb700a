"""Constants are exact to 150 digits, by sympy's own evaluation, also where terms cancel."""

from __future__ import annotations

from fractions import Fraction

import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from kinegen.derive.expressions import exact_number

DIGITS = 150

fractions = st.fractions(-1000, 1000, max_denominator=1000).map(lambda f: sp.Rational(f.numerator, f.denominator))
turns = fractions.map(lambda turn: turn * sp.pi / 7)
factors = st.one_of(fractions, turns.map(sp.sin), turns.map(sp.cos), st.integers(2, 99).map(sp.sqrt), st.just(sp.pi))
products = st.lists(factors, min_size=1, max_size=4).map(lambda parts: sp.Mul(*parts))
constants = st.lists(products, min_size=1, max_size=3).map(lambda parts: sp.Add(*parts))


@settings(max_examples=150)
@given(constants)
def test_sympy_finds_the_same_digits(constant: sp.Expr) -> None:
    exact = Fraction(str(sp.N(constant, DIGITS + 20, maxn=4 * DIGITS)))

    found = exact_number(constant)

    assert abs(found - exact) <= Fraction(1, 10 ** (DIGITS - 1)) * abs(exact) or abs(exact) < Fraction(1, 10**120)


@pytest.mark.parametrize("power", [20, 60, 130])
def test_digits_that_cancel_are_found_again(power: int) -> None:
    small = sp.Rational(1, 10**power)
    constant = sp.Add(sp.sqrt(2), small * sp.sqrt(3), -sp.sqrt(2 + small), evaluate=False)
    exact = Fraction(str(sp.N(constant, DIGITS + 20, maxn=1000)))

    found = exact_number(constant)

    assert found == 0 if abs(exact) < Fraction(1, 10**120) else abs(found / exact - 1) < Fraction(1, 10**140)


@pytest.mark.parametrize(
    ("constant", "value"),
    [
        (sp.Rational(-7, 3), Fraction(-7, 3)),
        (sp.sin(1) ** 2 + sp.cos(1) ** 2 - 1, Fraction(0)),
        (sp.sqrt(2) * sp.sqrt(8), Fraction(4)),
    ],
)
def test_what_is_a_fraction_is_found_as_one(constant: sp.Expr, value: Fraction) -> None:
    assert exact_number(constant) == value


def test_other_functions_are_left_to_sympy() -> None:
    assert exact_number(sp.atan2(1, 2)) == Fraction(str(sp.N(sp.atan2(1, 2), DIGITS)))
    assert exact_number((-sp.sqrt(2)) ** 3) == -Fraction(str(sp.N(2 * sp.sqrt(2), DIGITS)))
