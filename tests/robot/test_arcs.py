"""`asin`, `acos`, `atan` and `atan2` of constants: exact from the file to the kernels and to every printout."""

from __future__ import annotations

import math
from decimal import Decimal
from fractions import Fraction
from pathlib import Path

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kinegen.derive.transforms import SYMPY
from kinegen.errors import KinegenError, RobotFileError
from kinegen.ir.lower import exact_number
from kinegen.model.expression_parser import (
    PI,
    Atan2,
    Call,
    Expression,
    ExpressionError,
    arcs,
    evaluate,
    multiply,
    number,
    parse,
    substitute,
    without_arcs,
)
from kinegen.model.expression_values import FLOAT64, Dimension, checked_value, radians
from kinegen.model.robot import Robot
from kinegen.model.runtime_entries import with_runtime_entries
from kinegen.ui.cli import main
from kinegen.verify import reference
from tests.robot.files import HEAD, entry, robot, row_of

UNARY = ("asin", "acos", "atan")
XARM = """
parameters: {rise: 284.5, forward: 53.5}
joints:
  - {name: joint1, a: 0, alpha: 0, d: 267, theta: q}
  - {name: joint2, a: 0, alpha: -90, d: 0, theta: q, offset: "-atan2(rise, forward)"}
  - {name: joint3, a: sqrt(rise**2 + forward**2), alpha: 0, d: 0, theta: q, offset: atan(rise/forward)}
  - {name: joint4, a: 77.5, alpha: -90, d: 342.5, theta: q}
  - {name: joint5, a: 0, alpha: 90, d: 0, theta: q}
  - {name: joint6, a: 76, alpha: -90, d: 97, theta: q}
"""
"""UFACTORY's xArm 6, whose data sheet prints atan(284.5/53.5)."""


def xarm(folder: Path) -> Path:
    """The file of the arm."""
    path = folder / "xarm.yaml"
    path.write_text(HEAD.format(convention="modified", angle="deg").replace("length: m", "length: mm") + XARM, "utf-8")
    return path


def share(text: str) -> Expression:
    """A rational share of pi."""
    return multiply(number(text), PI)


@pytest.mark.parametrize(
    ("text", "tree"),
    [
        ("atan(1/2)", Call("atan", number("1/2"))),
        ("atan2(1, 2)", Atan2(number(1), number(2))),
        ("asin(0)", number(0)),
        ("asin(-1/2)", share("-1/6")),
        ("acos(0)", share("1/2")),
        ("acos(-0.5)", share("2/3")),
        ("acos(-1)", PI),
        ("atan(-1)", share("-1/4")),
        ("atan2(0, 5)", number(0)),
        ("atan2(0, -5)", PI),
        ("atan2(3, 0)", share("1/2")),
        ("atan2(-0.1, 0)", share("-1/2")),
        ("atan2(2, -2)", share("3/4")),
        ("atan2(-7, -7)", share("-3/4")),
    ],
)
def test_text_becomes_an_exact_tree(text: str, tree: Expression) -> None:
    assert parse(text) == tree


@pytest.mark.parametrize("name", [*UNARY, "atan2"])
@given(values=st.tuples(*[st.fractions(-1, 1, max_denominator=12)] * 2))
def test_what_is_folded_has_the_value_of_the_function(name: str, values: tuple[Fraction, Fraction]) -> None:
    given_values = values if name == "atan2" else values[:1]
    if name == "atan2" and values == (0, 0):
        return
    tree = parse(f"{name}({', '.join(map(str, given_values))})")

    expected = getattr(math, name)(*map(float, given_values))
    assert evaluate(tree, {}, FLOAT64) == pytest.approx(expected, abs=1e-15)
    with mpmath.workdps(60):
        exact = getattr(mpmath, name)(*(mpmath.mpf(value.numerator) / value.denominator for value in given_values))
        assert abs(mpmath.mpf(str(checked_value(tree, {}))) - exact) < 1e-45
        lowered = exact_number(evaluate(tree, {}, SYMPY))
        assert abs(mpmath.mpf(lowered.numerator) / lowered.denominator - exact) < 1e-55


@pytest.mark.parametrize("x", [-3, -1, 1, 3])
@pytest.mark.parametrize("y", [-2, -1, 1, 2])
def test_values_of_the_arc_tangent_are_in_the_quadrant_of_their_point(y: int, x: int) -> None:
    assert float(checked_value(parse(f"atan2({y}, {x})"), {})) == pytest.approx(math.atan2(y, x), abs=1e-15)
    assert float(checked_value(parse(f"atan2({y}*sqrt(3), {x})"), {})) == pytest.approx(
        math.atan2(y * math.sqrt(3), x), abs=1e-15
    )


@pytest.mark.parametrize("text", ["atan2(0, 0)", "atan2(1)", "atan(1, 2)", "acos", "acos()", "1, 2", "atan2(1, 2), 3"])
def test_what_is_no_arc(text: str) -> None:
    with pytest.raises(ExpressionError):
        parse(text)


@pytest.mark.parametrize("text", ["asin(1.01)", "acos(-2)", "acos(sqrt(2))", "atan2(sqrt(2) - sqrt(2), 0)"])
def test_an_arc_without_a_value_is_refused(text: str) -> None:
    with pytest.raises(RobotFileError, match="it holds "):
        row_of(f"a: 0, alpha: '{text}', d: 0, theta: q")


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("atan2(1, 2)", "atan2(1, 2)"),
        ("-acos(1/3)/2", "-acos(1/3)/2"),
        ("90 - atan(2)", "-atan(2) + pi/2"),
        ("2*(asin(1/4) + 10)", "2*asin(1/4) + pi/9"),
        ("pi - atan(1/2)", "-atan(1/2) + pi"),
        ("atan(pi)", "atan(pi)"),
        ("atan(atan(2)/30)", "atan(atan(2)/30)"),
    ],
)
def test_an_arc_is_an_angle_in_degrees_too(text: str, expected: str) -> None:
    """Its value is an angle as it stands; what it is taken of is a plain number."""
    found = radians(parse(text), frozenset())

    assert evaluate(found, {}, FLOAT64) == pytest.approx(evaluate(parse(expected), {}, FLOAT64), abs=1e-15)
    assert arcs(found) == arcs(parse(expected))


def test_degrees_and_radians_read_the_same_arc() -> None:
    for text in ("q - atan2(1, 2)", "q*atan(2)/acos(0.1)"):
        assert entry("theta", f"'{text}'", angle="deg") == entry("theta", f"'{text}'", angle="rad")


def test_in_a_length_an_arc_is_a_number_of_radians() -> None:
    assert entry("d", "0.1*atan(2)", angle="deg") == parse("0.1*atan(2)")


def test_arcs_can_be_taken_out_and_put_back() -> None:
    whole = parse("2*a + b*atan(2) - sqrt(acos(1/3))*a**2 + atan(2)")
    hidden, found = without_arcs(whole)

    assert arcs(hidden) == ()
    assert list(found.values()) == [parse("atan(2)"), parse("acos(1/3)")]
    assert substitute(hidden, found) == whole


@pytest.mark.parametrize(
    ("entries", "dimensions"),
    [
        ("a: 0, alpha: 'atan2(m, n)', d: 0, theta: q", ("number", "number")),
        ("a: m, alpha: 'atan2(m, n)', d: 0, theta: q", ("length", "number")),
        ("a: 0, alpha: m*acos(0.3) + n, d: 0, theta: q", ("number", "angle")),
    ],
)
def test_what_stands_in_or_beside_an_arc_is_a_number(entries: str, dimensions: tuple[str, ...]) -> None:
    found = robot(f"{{name: one, {entries}}}", more="parameters: {m: 0.3, n: 0.4}")

    assert tuple(str(parameter.dimension) for parameter in found.parameters) == dimensions


def test_a_parameter_may_be_an_arc() -> None:
    found = robot("{name: one, a: 0, alpha: tilt, d: 0, theta: q}", more="parameters: {tilt: atan(2) - 10}")

    assert found.parameters[0].dimension is Dimension.ANGLE
    assert evaluate(found.parameters[0].value, {}, FLOAT64) == pytest.approx(math.atan(2) - math.pi / 18)


def test_a_runtime_parameter_cannot_stand_in_an_arc() -> None:
    more = "parameters: {m: {value: 0.3, runtime: true}}"
    with pytest.raises(RobotFileError, match="alpha: 'm' is set at run time and is not allowed in asin, acos"):
        robot("{name: one, a: 0, alpha: 'atan2(m, 2)', d: 0, theta: q}", more=more)

    fixed = robot("{name: one, a: 0, alpha: 'atan2(m, 2)', d: 0, theta: q}", more="parameters: {m: 0.3}")
    with pytest.raises(KinegenError, match="parameter 'm' is in asin, acos, atan or atan2"):
        with_runtime_entries(fixed, ("m",))
    assert with_runtime_entries(fixed, ("alpha_one",)).runtime_parameters[0].value == parse("atan2(0.3, 2)")


@pytest.mark.parametrize("name", ["atan", "acos", "atan2"])
def test_a_function_is_no_name(name: str) -> None:
    with pytest.raises(RobotFileError, match="function; choose another name"):
        robot("{name: one, a: 0, alpha: 0, d: 0, theta: q}", more=f"parameters: {{{name}: 1}}")
    with pytest.raises(RobotFileError, match="function; choose another name"):
        robot(f"{{name: {name}, a: 0, alpha: 0, d: 0, theta: q}}")


@pytest.mark.parametrize(
    "rows",
    [
        "joints:\n  - {name: one, a: 0, alpha: 0, d: 0, theta: q - atan2(1, 2)}",
        "joints:\n  - {name: one, ets: [Rz(atan2(1, 2))]}",
        "joints: []\nbase: {rpy: [0, 0, atan2(1, 2)]}",
        "joints: []\nparameters: {tilt: atan2(1, 2)}",
    ],
)
def test_a_comma_that_yaml_takes_for_its_own_is_explained(rows: str) -> None:
    from kinegen.io.load import loads

    with pytest.raises(RobotFileError, match=r"such as atan2\(y, x\), must be quoted between braces"):
        loads(HEAD.format(convention="standard", angle="deg") + rows + "\n", "arm.yaml")


def arm(folder: Path) -> Robot:
    """The arm, loaded."""
    from kinegen.io.load import load

    return load(xarm(folder))


def test_the_pose_is_the_one_of_the_data_sheet(tmp_path: Path) -> None:
    """Its zero position is given as x 207 mm, z 112 mm, roll 180 degrees."""
    found = reference.pose(arm(tmp_path), np.zeros(6))[0, 0]

    assert found == pytest.approx(np.array([[1, 0, 0, 207], [0, -1, 0, 0], [0, 0, -1, 112], [0, 0, 0, 1]]), abs=1e-12)


@pytest.mark.parametrize(
    ("notation", "printed"),
    [
        ("text", "q2 - atan2(rise, forward)"),
        ("latex", r"q_{2} - \operatorname{atan2}(\mathrm{rise}, \mathrm{forward})"),
        ("latex", r"q_{3} + \arctan\left(\frac{\mathrm{rise}}{\mathrm{forward}}\right)"),
        ("mathml", "<mi>atan2</mi><mo>\u2061</mo><mrow><mo>(</mo><mi>rise</mi><mo>,</mo><mi>forward</mi><mo>)</mo>"),
    ],
)
def test_it_is_printed_as_it_was_written(
    notation: str, printed: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["show", str(xarm(tmp_path)), "--format", notation]) == 0

    assert printed in capsys.readouterr().out


def test_printed_python_gives_the_pose(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    q = [0.1, -0.2, 0.3, -0.4, 0.5, -0.6]
    assert main(["show", str(xarm(tmp_path)), "--format", "python"]) == 0
    module: dict[str, object] = {}
    exec(capsys.readouterr().out, module)  # noqa: S102 - the printout is a module

    function = module["base_T_tool"]
    assert callable(function)
    assert np.array(function(q)) == pytest.approx(reference.pose(arm(tmp_path), q)[0, 0], abs=1e-12)


def test_decimals_have_the_digits_they_need() -> None:
    assert checked_value(parse("4*atan(1/5) - atan(1/239) - pi/4"), {}).copy_abs() < Decimal("1e-47")
    assert checked_value(parse("asin(3/5) - atan(3/4)"), {}).copy_abs() < Decimal("1e-47")
