"""Expressions become numbered values of the same value: powers, arc tangents, selections, signs, single precision."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from fractions import Fraction

import pytest
import sympy as sp

from kinegen.ir.from_expressions import Lowering
from kinegen.ir.program import Constant, Operator, Variable
from kinegen.ir.value_numbering import Node, SinOrCos, Value, ValueTable

X, Y = sp.symbols("x y", real=True)
POINTS = [(0.75, 1.5), (2.5, 0.3), (0.3, 2.5)]
SIGNED = [(0.75, 1.5), (-2.5, 0.3), (0.3, -2.5), (-1.25, -0.5)]

OPERATORS: Mapping[Operator | SinOrCos, Callable[..., float]] = {
    Operator.ADD: lambda a, b: a + b,
    Operator.SUB: lambda a, b: a - b,
    Operator.MUL: lambda a, b: a * b,
    Operator.DIV: lambda a, b: a / b,
    Operator.NEG: lambda a: -a,
    Operator.SQRT: math.sqrt,
    Operator.ATAN2: math.atan2,
    Operator.SELECT_LT: lambda a, b, less, other: less if a < b else other,
    SinOrCos.SIN: math.sin,
    SinOrCos.COS: math.cos,
}


def number_of(values: ValueTable, number: int, inputs: tuple[float, ...]) -> float:
    """What a numbered value is for some inputs."""
    match values.nodes[number]:
        case Variable(index):
            return inputs[index]
        case Constant(value):
            return float(value)
        case Node(operator, operands):
            return OPERATORS[operator](*(number_of(values, each, inputs) for each in operands))
    raise TypeError(number)


def lowered(expression: sp.Expr, inputs: tuple[float, ...]) -> float:
    lowering = Lowering.of((X, Y), ())
    sign, number = lowering.value(expression)
    return sign * number_of(lowering.values, number, inputs)


@pytest.mark.parametrize("point", POINTS)
@pytest.mark.parametrize("power", ["1/2", "3/2", "5/2", "7/2", "-1/2", "-5/2", "2", "5", "-1", "-3"])
def test_powers_have_all_their_factors(power: str, point: tuple[float, float]) -> None:
    exponent = sp.Rational(power)

    assert lowered(X**exponent, point) == pytest.approx(point[0] ** float(exponent), rel=1e-14)
    assert lowered((X + Y) ** exponent, point) == pytest.approx(sum(point) ** float(exponent), rel=1e-14)


@pytest.mark.parametrize("point", SIGNED)
def test_an_arc_tangent_is_that_of_its_quadrant(point: tuple[float, float]) -> None:
    x, y = point

    assert lowered(sp.atan2(Y, X), point) == pytest.approx(math.atan2(y, x), rel=1e-14)
    assert lowered(sp.atan2(-Y, -X), point) == pytest.approx(math.atan2(-y, -x), rel=1e-14)
    assert lowered(sp.atan(Y), point) == pytest.approx(math.atan(y), rel=1e-14)


@pytest.mark.parametrize("point", SIGNED)
@pytest.mark.parametrize(
    "expression",
    [
        -X - Y,
        -X - Y - sp.Rational(1, 3),
        X - 2 * Y,
        -(X + Y) * (X - Y),
        -2 * X * Y / 3,
        sp.sin(-X - Y) + sp.cos(Y - X),
        sp.Abs(X) - sp.Abs(Y),
        sp.Piecewise((X, X < Y), (-Y, True)),
        sp.Piecewise((-X, -X > -Y), (-Y, True)),
    ],
    ids=str,
)
def test_signs_and_selections_keep_the_value(expression: sp.Expr, point: tuple[float, float]) -> None:
    expected = float(expression.subs(dict(zip((X, Y), point, strict=True))))

    assert lowered(expression, point) == pytest.approx(expected, rel=1e-13, abs=1e-15)


def test_constants_are_put_together_in_each_number_type_by_itself() -> None:
    """A tolerance of single precision stays one, whatever it is added to or multiplied with."""
    values = ValueTable()
    both, whole = values.constant(Fraction(2), Fraction(-5)), values.constant(Fraction(-3))

    def of(value: Value) -> tuple[Fraction, Fraction]:
        sign, number = value
        node = values.nodes[number]
        assert isinstance(node, Constant)
        return sign * node.of(False), sign * node.of(True)

    assert of(both) == (2, -5)
    assert of(values.product([both, whole])) == (-6, 15)
    assert of(values.total([both, whole])) == (-1, -8)
    assert of(values.product([whole, whole])) == (9, 9)
