"""What the file says of actuators becomes exact records, and counts in the robot's hash."""

from __future__ import annotations

import dataclasses
import re
from fractions import Fraction

import pytest

from kinegen.errors import RobotFileError
from kinegen.model.actuators import NO_ACTUATORS, Coupling, Formula, FourBar, Triangle
from kinegen.model.expression_parser import (
    ACTUATOR_FUNCTIONS,
    PI,
    Atan2,
    Call,
    ExpressionError,
    Name,
    multiply,
    number,
    parse,
)
from kinegen.model.expression_values import Dimension
from kinegen.model.variants import digest
from tests.actuators.machines import machine, one


def test_gears_are_exact() -> None:
    (gear,) = one("form: gear, actuator: m, ratio: 131072/360, sign: -1, offset: 10", "number").actuators.drives

    assert isinstance(gear, Coupling)
    assert gear.matrix == ((multiply(number(Fraction(-360, 131072)), number("1/180"), PI),),)
    assert gear.offsets == (multiply(number("1/18"), PI),)


def test_linkages_keep_their_parameters() -> None:
    (wire,) = one(
        'form: linear_actuator, actuator: m, sides: [a, 0.5], length: k*m + a, offset: "atan2(0.1, b) - 90"',
        "number",
        parameters="{a: 0.3, k: 0.002, b: {value: 0.4, runtime: true}}",
    ).actuators.drives

    assert isinstance(wire, Triangle)
    assert wire.sides == (Name("a"), number("1/2"))
    assert wire.length == (Name("k"), Name("a"))
    assert wire.offset == parse("atan2(0.1, b) - pi/2", ACTUATOR_FUNCTIONS)


def test_a_linkage_knows_how_it_stands() -> None:
    entry = "form: four_bar, actuator: m, ground: 0.4, crank: 0.1, coupler: 0.3, rocker: 0.25"
    (ahead,) = one(entry, "{dimension: angle, limits: [40, 200]}").actuators.drives
    (behind,) = one(f"{entry}, branch: crossed", "{dimension: angle, limits: [-200, -40]}").actuators.drives

    assert isinstance(ahead, FourBar)
    assert isinstance(behind, FourBar)
    assert (ahead.ahead, ahead.crossed, ahead.parallelogram) == (1, False, False)
    assert (behind.ahead, behind.crossed, behind.parallelogram) == (-1, True, False)


def test_parameters_of_actuators_find_their_dimension() -> None:
    robot = machine(
        "{m1: angle, m2: number, m3: angle}",
        "{joint: waist, value: k*m1 + c}",
        "{joint: shoulder, form: linear_actuator, actuator: m2, sides: [a, a], length: s*m2 + a}",
        "{joint: elbow, value: m3 + 2*acos(f*sin(g + m3))}",
        parameters="{k: 2, c: 10, a: 0.3, s: 0.01, f: 0.5, g: 30}",
    )
    found = {parameter.name: parameter.dimension for parameter in robot.parameters}
    length, angle, plain = Dimension.LENGTH, Dimension.ANGLE, Dimension.NUMBER

    assert found == {"k": plain, "c": angle, "a": length, "s": plain, "f": plain, "g": angle}


def test_a_formula_knows_its_readings() -> None:
    robot = machine(
        "{m1: angle, m2: angle, m3: angle}",
        "{joint: waist, value: m1}",
        "{joint: shoulder, value: m2 - waist}",
        "{joint: elbow, value: 2*m3 + m1 - shoulder}",
    )

    assert [drive.actuators for drive in robot.actuators.drives] == [("m1",), ("m2",), ("m3", "m1")]
    assert all(isinstance(drive, Formula) for drive in robot.actuators.drives)


def test_actuators_count_in_the_hash_and_their_absence_does_not() -> None:
    robot = one("form: gear, actuator: m, ratio: 100")
    other = one("form: gear, actuator: m, ratio: 101")
    without = dataclasses.replace(robot, actuators=NO_ACTUATORS)

    assert robot.digest != other.digest
    assert digest(without) == digest(dataclasses.replace(other, actuators=NO_ACTUATORS))
    assert digest(without) != robot.digest


@pytest.mark.parametrize(
    ("text", "tree"),
    [
        ("acos(m)", Call("acos", Name("m"))),
        ("atan(m)", Call("atan", Name("m"))),
        ("atan2(y, x)", Atan2(Name("y"), Name("x"))),
        ("sin(cos(2))", Call("sin", Call("cos", number(2)))),
    ],
)
def test_functions_of_actuators(text: str, tree: object) -> None:
    assert parse(text, ACTUATOR_FUNCTIONS) == tree


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("acos", "acos needs a value, as in acos"),
        ("atan2", "atan2 needs two values"),
        ("atan2(1)", "atan2 takes 2 values, found 1"),
        ("acos()", "acos takes 1 value, found 0"),
        ("tan(1)", "unknown function 'tan'"),
        ("m, 2", "',' is not allowed in an expression"),
        ("m[2]", r"'\[' is not allowed in an expression"),
        ("(m).real", "only numbers, names, pi, sqrt, asin, acos, atan, atan2, sin, cos"),
    ],
)
def test_what_is_no_function_of_actuators(text: str, message: str) -> None:
    with pytest.raises(ExpressionError, match=message):
        parse(text, ACTUATOR_FUNCTIONS)


def test_the_table_keeps_its_own_language() -> None:
    with pytest.raises(ExpressionError, match=r"unknown function 'cos' \(expected sqrt, asin, acos, atan, atan2\)"):
        parse("cos(1)")


@pytest.mark.parametrize(
    ("entry", "reading", "message"),
    [
        (
            "form: linear_actuator, actuator: m, sides: [0.3, 0.5]",
            "{dimension: length, limits: [0.19999999, 0.7]}",
            "the actuator is 0.2000 long, 1e-8 beyond its triangle: sides of 0.3 and 0.5 close a triangle only",
        ),
        (
            "form: four_bar, actuator: m, ground: 1.00000001, crank: 0.5, coupler: 0.3, rocker: 0.2",
            "{dimension: angle, limits: [0, 10]}",
            "the ground, 1.000, is 1e-8 longer than the other three together",
        ),
        (
            "form: four_bar, actuator: m, ground: 1, crank: 0.5, coupler: 0.3, rocker: 0.2",
            "{dimension: angle, limits: [0, 10]}",
            "the ground, 1, is as long as the other three together",
        ),
    ],
)
def test_what_misses_by_a_hair_says_by_how_much(entry: str, reading: str, message: str) -> None:
    with pytest.raises(RobotFileError, match=re.escape(message)):
        one(entry, reading)
