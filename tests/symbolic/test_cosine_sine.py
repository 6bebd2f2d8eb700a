"""The sines and cosines that a chain is folded with are those of sympy, found sooner."""

from __future__ import annotations

import pytest
import sympy as sp
from hypothesis import example, given, settings
from hypothesis import strategies as st

from kinegen.symbolic.fold import cosine_sine

q = sp.Symbol("q", real=True)


@settings(max_examples=300)
@example(1, 120)
@example(1, 121)
@example(60, 121)
@example(61, 121)
@example(121, 122)
@example(-182, 121)
@example(242, 121)
@example(300, 121)
@given(st.integers(-4000, 4000), st.one_of(st.integers(1, 130), st.integers(121, 10**9), st.sampled_from([900, 1800])))
def test_parts_of_a_turn(numerator: int, denominator: int) -> None:
    angle = sp.Rational(numerator, denominator) * sp.pi

    assert list(map(sp.srepr, cosine_sine(angle))) == [sp.srepr(sp.cos(angle)), sp.srepr(sp.sin(angle))]


@pytest.mark.parametrize("angle", [q, -q, q + sp.pi / 1800, sp.pi * q / 7, sp.Rational(1, 200), sp.S.Zero, sp.sqrt(2)])
def test_other_angles(angle: sp.Expr) -> None:
    assert cosine_sine(angle) == (sp.cos(angle), sp.sin(angle))
