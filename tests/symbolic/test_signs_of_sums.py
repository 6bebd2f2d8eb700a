"""Which of a sum and its negative gets a name: what sympy says, without the value of a single constant."""

import itertools
from typing import Any

import pytest
import sympy as sp
from sympy.core.evalf import EvalfMixin

from kinegen.derive.dispatch import derive
from kinegen.derive.expressions import has_minus_sign
from kinegen.io.load import loads
from kinegen.model.outputs import Quantity

ROWS = 30
X, Y, Z = sp.symbols("x y z", real=True)
V = sp.Dummy("v", real=True)
LENGTH = sp.Rational(4, 10) * sp.cos(1)
ATOMS = (
    X,
    -X,
    Y,
    -Y,
    V,
    -V,
    X * Y,
    -X * V,
    2 * Z,
    -3 * Z,
    X**2,
    -(Y**2),
    LENGTH * X,
    -LENGTH * Y,
    sp.sin(X),
    -sp.cos(X),
)
ATOMS += (sp.Integer(1), sp.Rational(-1, 2), sp.pi, -sp.pi, LENGTH, -LENGTH, sp.sin(1) * X, -sp.sin(1) * X)


@pytest.mark.parametrize("count", [1, 2, 3])
def test_signs_are_those_of_sympy(count: int) -> None:
    """Sums of any few terms, numbers and equal variables among them."""
    for terms in itertools.combinations(ATOMS, count):
        expression = sp.Add(*terms)

        assert has_minus_sign(expression) == expression.could_extract_minus_sign(), expression


def test_long_chains_are_derived_without_values_of_constants(monkeypatch: pytest.MonkeyPatch) -> None:
    """Sines of twists are exact numbers, whose values cost more than everything else; only lowering needs them."""
    rows = "\n".join(
        f"  - {{name: j{row}, alpha: {10 + 7 * row}, a: 0.3, d: 0.1, theta: q, limits: [-1, 1]}}" for row in range(9)
    )
    head = "kinegen: 1\nname: arm\nconvention: modified\nunits: {length: m, angle: deg}\njoints:\n"
    robot = loads(head + rows + "\n", "arm.yaml")
    asked: list[sp.Expr] = []
    evaluate = EvalfMixin.evalf

    def counted(self: sp.Expr, *given: Any, **named: Any) -> Any:
        if not self.is_Rational:
            asked.append(self)
        return evaluate(self, *given, **named)

    monkeypatch.setattr(EvalfMixin, "evalf", counted)
    derive(robot, Quantity.POSE)

    assert len(asked) < 4 * ROWS
