"""The prover proves what is equal, and nothing else."""

from __future__ import annotations

import pytest
import sympy as sp

from tests.textbook.prove import NotDecidableError, are_equal, is_zero

a, b, c, x = sp.symbols("a b c x", real=True)

ZEROS = [
    sp.sin(a) ** 2 + sp.cos(a) ** 2 - 1,
    sp.sin(a + b) - sp.sin(a) * sp.cos(b) - sp.cos(a) * sp.sin(b),
    sp.cos(a + b + c) - sp.cos(c + b + a),
    sp.cos(a - sp.pi / 2, evaluate=False) - sp.sin(a),
    sp.sin(2 * a) - 2 * sp.sin(a) * sp.cos(a),
    sp.cos(a / 2) ** 2 - (1 + sp.cos(a)) / 2,
    sp.sin(sp.Rational(1, 3) * a) * 3 - 4 * sp.sin(a / 3) ** 3 - sp.sin(a),
    sp.cos(a + sp.pi / 3) - sp.cos(a) / 2 + sp.sqrt(3) / 2 * sp.sin(a),
    sp.sqrt(6) - sp.sqrt(2) * sp.sqrt(3),
    (sp.sqrt(2) + 1) * (sp.sqrt(2) - 1) - 1,
    x / (2 * sp.pi) * 4 * sp.pi - 2 * x,
    sp.cos(a + sp.Rational(3, 10)) - sp.cos(a) * sp.cos(sp.Rational(3, 10)) + sp.sin(a) * sp.sin(sp.Rational(3, 10)),
    sp.sin(-a, evaluate=False) + sp.sin(a),
    sp.S.Zero,
]
NOT_ZEROS = [
    sp.sin(a) ** 2 + sp.cos(b) ** 2 - 1,
    sp.sin(a + b) - sp.sin(a - b),
    sp.sqrt(2) + sp.sqrt(3) - sp.sqrt(5),
    sp.sin(a) - a,
    sp.cos(a) * x - sp.cos(a),
    sp.pi - sp.Rational(22, 7),
    sp.Rational(1, 10**40),
    sp.sin(a + sp.Rational(1, 10**12)) - sp.sin(a),
]


@pytest.mark.parametrize("expression", ZEROS, ids=str)
def test_zero_is_found(expression: sp.Expr) -> None:
    assert is_zero(expression)


@pytest.mark.parametrize("expression", NOT_ZEROS, ids=str)
def test_nothing_else_is_zero(expression: sp.Expr) -> None:
    assert not is_zero(expression)


@pytest.mark.parametrize(
    "expression", [sp.sin(a * b), sp.tan(a), sp.sin(sp.sqrt(2) * a), sp.sin(a) ** sp.Rational(1, 3)]
)
def test_what_it_cannot_decide_it_refuses(expression: sp.Expr) -> None:
    with pytest.raises(NotDecidableError):
        is_zero(expression)


def test_the_places_that_differ_are_named() -> None:
    left = sp.Matrix([[sp.sin(a + b), 0], [1, sp.cos(a)]])
    right = sp.Matrix([[sp.sin(a) * sp.cos(b) + sp.cos(a) * sp.sin(b), x], [1, sp.sin(a)]])

    assert are_equal(left, right) == [(0, 1), (1, 1)]
