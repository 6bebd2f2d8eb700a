"""The invariants of a program, on programs written by hand."""

from __future__ import annotations

from fractions import Fraction

import pytest

from kinegen.ir.program import Constant, Operand, Operator, Program, RuntimeParameter, Statement, Temporary, Variable
from tests.signatures import positions

ZERO = Constant(Fraction(0))


def program(*statements: Statement, last: Operand = ZERO, parameters: tuple[str, ...] = ()) -> Program:
    return Program(positions(1), parameters, (), statements, (ZERO, ZERO, last))


def test_a_sound_program_is_accepted() -> None:
    double = Statement("t0", Operator.ADD, (Variable(0), Variable(0)))

    assert program(double, last=Temporary("t0")).statements == (double,)


@pytest.mark.parametrize(
    ("statements", "last", "message"),
    [
        ([Statement("t0", Operator.SIN, (Variable(0),))] * 2, Temporary("t0"), "defined twice"),
        ([Statement("t0", Operator.NEG, (Temporary("t1"),))], Temporary("t0"), "before it is defined"),
        ([Statement("t0", Operator.NEG, (Variable(0),))], ZERO, "never used"),
        ([Statement("t0", Operator.NEG, (Variable(1),))], Temporary("t0"), "no input 1"),
        ([Statement("t0", Operator.ADD, (Variable(0),))], Temporary("t0"), "takes 2 operands"),
        ([], RuntimeParameter("a2"), "no runtime parameter a2"),
    ],
)
def test_an_unsound_program_is_refused(statements: list[Statement], last: Operand, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        program(*statements, last=last)


def test_the_number_of_outputs_must_fit_the_results() -> None:
    with pytest.raises(ValueError, match="1 outputs for results of 3 numbers"):
        Program(positions(0), (), (), (), (ZERO,))
