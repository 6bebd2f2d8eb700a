"""Parts of binary angles: the stated error holds for every angle, and is no more than what rounding makes."""

from __future__ import annotations

from fractions import Fraction

import pytest

from kinegen.io.load import loads
from kinegen.ir.fixed_point.binary_angles import TURN, Turns
from kinegen.ir.fixed_point.program import Integer, nearest_integer
from kinegen.ir.program import Constant, Operator, Statement, Variable

ARM = (
    "kinegen: 1\nname: arm\nconvention: standard\nunits: {length: m, angle: rad}\njoints:\n"
    "  - {name: a, theta: q, d: 0, a: 1, alpha: 0, limits: [-3, 3]}\n"
)


@pytest.mark.parametrize("factor", [Fraction(1, 3), Fraction(-2, 7), Fraction(1, 2), Fraction(355, 226)])
def test_a_part_of_an_angle_is_off_by_what_is_stated(factor: Fraction) -> None:
    turns = Turns(loads(ARM, "arm.yaml"))
    found = turns.statement(Statement(("t0",), Operator.MUL, (Variable(0), Constant(factor))))
    _, part = found.operands
    assert isinstance(part, Integer)
    angles = [*range(-TURN // 2, TURN // 2, 100_000_007), TURN // 2 - 1, *range(-9, 9)]
    exact = [angle * factor for angle in angles]
    made = [nearest_integer(Fraction(angle * part.value, 2**found.shift)) for angle in angles]
    worst = max(abs(one - other) for one, other in zip(made, exact, strict=True))

    assert 0.9 * turns.errors["t0"] - 0.1 < worst <= turns.errors["t0"]
