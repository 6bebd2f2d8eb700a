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
from kinegen.model.outputs import Array, Kind, Quantity, Signature
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


Q, QD, NONE = Array("q", (2,)), Array("qd", (2,)), Array("none", (0,))
TWIST = Signature(Quantity(Kind.TWIST), ("tool",), 2, (Q, NONE, QD), (Array("twist", (1,)),))


def twist(*statements: Statement, last: Operand) -> Program:
    return Program(TWIST, ("a2",), (), statements, (last,))


@pytest.mark.parametrize(
    ("index", "read"), [(0, {"q"}), (1, {"q"}), (2, {"qd"}), (3, {"qd"})], ids=["q1", "q2", "qd1", "qd2"]
)
def test_an_input_is_read_where_a_statement_or_a_result_has_one_of_its_numbers(index: int, read: set[str]) -> None:
    stored = twist(last=Variable(index))
    computed = twist(Statement(("t0",), Operator.NEG, (Variable(index),)), last=Temporary("t0"))

    for one in (stored, computed):
        assert {array.name for array in TWIST.inputs if one.reads(array)} == read


def test_an_array_that_is_not_an_input_is_not_asked_for() -> None:
    with pytest.raises(ValueError, match="not in tuple"):
        twist(last=ZERO).reads(TWIST.results[0])


def test_parameters_are_read_by_statements_and_by_results() -> None:
    half = Statement(("t0",), Operator.MUL, (RuntimeParameter("a2"), Variable(0)))

    assert twist(half, last=Temporary("t0")).reads_parameters
    assert twist(last=RuntimeParameter("a2")).reads_parameters
    assert not twist(last=Variable(0)).reads_parameters


def test_numbers_of_one_type_alone_are_noticed() -> None:
    assert twist(last=Constant(Fraction(1), Fraction(2))).asks_type
    assert not twist(last=Constant(Fraction(1))).asks_type


def test_operators_are_found_in_statements() -> None:
    one = twist(pair("s1", "c1"), last=Temporary("c1"))

    assert one.uses(Operator.SQRT, Operator.SINCOS)
    assert not one.uses(Operator.SQRT, Operator.ATAN2)
    assert not one.uses()
