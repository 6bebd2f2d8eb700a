"""The invariants of a program, on programs written by hand."""

from __future__ import annotations

from fractions import Fraction

import pytest

from kinegen.ir.program import (
    Constant,
    Operand,
    Operator,
    Program,
    RuntimeParameter,
    Statement,
    Temporary,
    Variable,
    count,
)
from tests.signatures import positions

ZERO = Constant(Fraction(0))


def program(*statements: Statement, last: Operand = ZERO, parameters: tuple[str, ...] = ()) -> Program:
    return Program(positions(1), parameters, (), statements, (ZERO, ZERO, last))


def pair(sine: str, cosine: str) -> Statement:
    return Statement((sine, cosine), Operator.SINCOS, (Variable(0),))


def test_a_sound_program_is_accepted() -> None:
    double = Statement(("t0",), Operator.ADD, (Variable(0), Variable(0)))

    assert program(double, last=Temporary("t0")).statements == (double,)


@pytest.mark.parametrize("used", ["s1", "c1"])
def test_one_half_of_a_pair_may_be_unused(used: str) -> None:
    one = program(pair("s1", "c1"), last=Temporary(used))

    assert count(one).sine_cosines == 1
    assert one.used == {Variable(0), ZERO, Temporary(used)}


def test_an_angle_has_one_pair() -> None:
    half = Statement(("t0",), Operator.ADD, (Temporary("s1"), Temporary("s2")))

    with pytest.raises(ValueError, match="sine and cosine of one angle are taken twice"):
        program(pair("s1", "c1"), pair("s2", "c2"), half, last=Temporary("t0"))


def test_a_pair_has_no_single_name() -> None:
    with pytest.raises(ValueError, match="too many values"):
        _ = pair("s1", "c1").name


@pytest.mark.parametrize(
    ("statements", "last", "message"),
    [
        ([Statement(("t0",), Operator.SQRT, (Variable(0),))] * 2, Temporary("t0"), "defined twice"),
        ([pair("s1", "s1")], Temporary("s1"), "defined twice"),
        ([pair("s1", "c1")], ZERO, r"\['c1', 's1'\] are never used"),
        ([pair("s1", "c1"), pair("s2", "c2")], Temporary("s1"), "never used"),
        ([Statement(("s1",), Operator.SINCOS, (Variable(0),))], Temporary("s1"), "s1: sincos has 2 results"),
        ([Statement(("t0", "t1"), Operator.NEG, (Variable(0),))], Temporary("t0"), "t0 and t1: neg has 1 results"),
        ([Statement(("t0",), Operator.NEG, (Temporary("t1"),))], Temporary("t0"), "before it is defined"),
        ([Statement(("t0",), Operator.NEG, (Variable(0),))], ZERO, "never used"),
        ([Statement(("t0",), Operator.NEG, (Variable(1),))], Temporary("t0"), "no input 1"),
        ([Statement(("t0",), Operator.ADD, (Variable(0),))], Temporary("t0"), "takes 2 operands"),
        ([], RuntimeParameter("a2"), "no runtime parameter a2"),
    ],
)
def test_an_unsound_program_is_refused(statements: list[Statement], last: Operand, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        program(*statements, last=last)


def test_the_number_of_outputs_must_fit_the_results() -> None:
    with pytest.raises(ValueError, match="1 outputs for results of 3 numbers"):
        Program(positions(0), (), (), (), (ZERO,))
