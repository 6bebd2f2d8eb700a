"""The sines and cosines that a chain is folded with: in roots as books have them, or of small angles."""

from __future__ import annotations

import pytest
import sympy as sp
from hypothesis import example, given, settings
from hypothesis import strategies as st

from kinegen.derive.expressions import exact_number
from kinegen.derive.folding import cosine_sine

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

    cosine, sine = cosine_sine(angle)

    assert exact_number(cosine) == exact_number(sp.cos(angle))
    assert exact_number(sine) == exact_number(sp.sin(angle))
    for found in (cosine, sine):
        core = found.as_coeff_Mul()[1]
        assert not found.has(sp.sin, sp.cos) or 0 < core.args[0] < sp.pi / 4
        assert not found.atoms(sp.Pow) or found**2 in (sp.Rational(1, 2), sp.Rational(3, 4))


@pytest.mark.parametrize("numerator", range(-16, 17))
def test_sevenths_have_the_signs_of_their_octant(numerator: int) -> None:
    angle = sp.Rational(numerator, 7) * sp.pi
    cosine, sine = cosine_sine(angle)

    assert exact_number(cosine) == exact_number(sp.cos(angle))
    assert exact_number(sine) == exact_number(sp.sin(angle))


@pytest.mark.parametrize("degrees", range(-720, 720, 15))
def test_multiples_of_30_and_45_degrees_are_in_roots_and_no_others(degrees: int) -> None:
    angle = degrees * sp.pi / 180

    is_in_roots = degrees % 30 == 0 or degrees % 45 == 0
    assert any(each.has(sp.sin, sp.cos) for each in cosine_sine(angle)) is not is_in_roots
    assert not is_in_roots or cosine_sine(angle) == (sp.cos(angle), sp.sin(angle))


@pytest.mark.parametrize("angle", [q, -q, q + sp.pi / 1800, sp.pi * q / 7, sp.Rational(1, 200), sp.S.Zero, sp.sqrt(2)])
def test_other_angles(angle: sp.Expr) -> None:
    assert cosine_sine(angle) == (sp.cos(angle), sp.sin(angle))
