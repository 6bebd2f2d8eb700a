"""Units are exact: degrees in angle slots alone, lengths never, `pi` half a turn where degrees count."""

from __future__ import annotations

import math

import pytest

from kinegen.model.expression_parser import PI as PI_NODE
from kinegen.model.expression_parser import Arithmetic, Expression, Name, Product, Sum, evaluate, number
from kinegen.model.expression_values import Dimension
from tests.robot.files import entry, exact, robot, row_of

FLOATS = Arithmetic(float, math.pi, {"sqrt": math.sqrt})


def value(expression: Expression, **names: float) -> float:
    """A float, to compare forms that are written differently."""
    return float(evaluate(expression, names, FLOATS))


def test_decimals_are_exact() -> None:
    assert entry("a", "0.4318") == number("4318/10000")
    assert entry("a", "1e-3") == number("1/1000")
    assert entry("d", "-.5") == number("-1/2")


@pytest.mark.parametrize(
    ("text", "radians"),
    [
        ("90", "1/2*pi"),
        ("-90", "-1/2*pi"),
        ("pi/2", "1/2*pi"),
        ("-pi", "-1*pi"),
        ("180/2 + pi/2", "pi"),
        ("89.9999", "899999/1800000*pi"),
        ("sqrt(2)", "1/180*pi*sqrt(2)"),
        ("0", "0"),
    ],
)
def test_constant_angles_of_a_file_in_degrees(text: str, radians: str) -> None:
    assert value(entry("alpha", text)) == pytest.approx(value(exact(radians)), rel=1e-15)
    assert isinstance(entry("alpha", "90"), Product)


def test_a_half_turn_and_pi_are_the_same_expression() -> None:
    assert (
        entry("theta", "q - pi/2")
        == entry("theta", "q - 90")
        == Sum((Name("last"), Product((number("-1/2"), PI_NODE))))
    )


def test_radians_stay_as_they_are() -> None:
    assert entry("theta", "q - pi/2", angle="rad") == entry("theta", "q - 90")
    assert entry("alpha", "1.5", angle="rad") == number("3/2")


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("90 - q", "-1*last + pi/2"),
        ("q/2 + 10", "1/2*last + pi/18"),
        ("2*(q + 45)", "2*last + pi/2"),
        ("0.5*one + 10", "0.5*one + pi/18"),
        ("q + one - 2*two", "last + one - 2*two"),
        ("100*slide", "5/9*pi*slide"),
    ],
)
def test_revolute_variables_keep_their_coefficients(text: str, expected: str) -> None:
    names = {"last": 0.3, "one": 0.7, "two": 1.1, "slide": 0.2}

    assert value(entry("theta", text), **names) == pytest.approx(value(exact(expected), **names), rel=1e-15)


def test_nothing_is_converted_in_a_length_slot() -> None:
    assert entry("d", "q") == Name("last")
    assert entry("d", "0.1*one") == Product((number("1/10"), Name("one")))
    assert entry("d", "2*pi") == Product((number(2), PI_NODE))


@pytest.mark.parametrize("angle", ["deg", "rad"])
def test_the_lead_of_a_screw_is_a_length_for_each_turn_in_every_file(angle: str) -> None:
    row = row_of("a: 0, alpha: 0, d: p*q/(2*pi), theta: q", angle=angle, more="parameters: {p: 0.005}")

    assert row.d is not None
    assert value(row.d, p=0.005, last=2 * math.pi) == pytest.approx(0.005, rel=1e-15)
    assert row.theta == Name("last")


def test_limits_have_the_units_of_their_joint() -> None:
    found = robot(
        "{name: turn, a: 0, alpha: 0, d: 0, theta: 90 - q, limits: [-90, pi/4]}",
        "{name: lift, a: 0, alpha: 0, d: q, theta: 0, limits: [-h, 2*h]}",
        "{name: bolt, a: 0, alpha: 0, d: 0.1*q, theta: q, limits: [0, 360 + k]}",
        more="parameters: {h: 0.5, k: 90}",
    )
    limits = [tuple(map(value, variable.limits or ())) for variable in found.variables]

    assert found.variables[0].limits == (exact("-1/2*pi"), exact("1/4*pi"))
    assert found.variables[1].limits == (exact("-1/2"), exact("1"))
    assert limits[2] == pytest.approx((0, 2.5 * math.pi))


# Parameters ---------------------------------------------------------------------------------------------------------


def test_an_angle_parameter_is_converted_once() -> None:
    found = robot(
        "{name: one, a: 0, alpha: tilt, d: 0, theta: q + 2*tilt - 30}",
        more="parameters: {tilt: {value: 90, runtime: true}}",
    )

    assert found.parameters[0].dimension is Dimension.ANGLE
    assert found.parameters[0].value == exact("1/2*pi")
    assert found.rows[0].alpha == Name("tilt")
    assert found.rows[0].theta == exact("one + 2*tilt - 1/6*pi")


def test_parameters_are_built_from_earlier_ones() -> None:
    found = robot(
        "{name: one, a: b, alpha: v, d: a, theta: q + u + k*2}",
        more="parameters: {a: 0.5, b: sqrt(2)*a, u: pi/3, v: 2*u - 90, k: {value: 10, dimension: angle}}",
    )
    values = {parameter.name: value(parameter.value) for parameter in found.parameters}

    assert values == pytest.approx(
        {"a": 0.5, "b": math.sqrt(0.5), "u": math.pi / 3, "v": math.pi / 6, "k": math.pi / 18}, rel=1e-15
    )


def test_a_number_may_scale_an_angle() -> None:
    found = robot(
        "{name: one, a: 0, alpha: k*tilt, d: 0, theta: q}",
        "{name: two, a: 0, alpha: 0, d: 0, theta: k*one}",
        more="parameters: {k: 0.5, tilt: 60}",
    )

    assert [p.dimension for p in found.parameters] == [Dimension.NUMBER, Dimension.ANGLE]
    assert value(found.rows[0].alpha, k=0.5, tilt=math.pi / 3) == pytest.approx(math.pi / 6)  # type: ignore[arg-type]


def test_a_declared_number_in_an_angle_slot_counts_degrees() -> None:
    found = robot(
        "{name: one, a: 0, alpha: 90 + k, d: 0, theta: q}",
        more="parameters: {k: {value: 10, runtime: true, dimension: number}}",
    )

    assert found.parameters[0].value == number(10)
    assert value(found.rows[0].alpha, k=10) == pytest.approx(math.radians(100), rel=1e-15)  # type: ignore[arg-type]


def test_an_angle_in_a_length_slot_is_in_radians() -> None:
    """An arc is its radius times its angle, so no factor of 180 over pi may creep in."""
    found = robot(
        "{name: one, a: 0, alpha: phi, d: r*phi, theta: q}",
        "{name: two, a: r, alpha: 0, d: 0, theta: q}",
        more="parameters: {r: 2, phi: {value: 90, dimension: angle}}",
    )

    assert value(found.rows[0].d, r=2, phi=math.pi / 2) == pytest.approx(math.pi)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("entries", "dimension"),
    [
        ("a: p, alpha: 0, d: 0, theta: q", Dimension.LENGTH),
        ("a: 0, alpha: 0, d: q - p/2, theta: 0", Dimension.LENGTH),
        ("a: sqrt(p*p + 1), alpha: 0, d: 0, theta: q", Dimension.LENGTH),
        ("a: 0, alpha: p, d: 0, theta: q", Dimension.ANGLE),
        ("a: 0, alpha: 0, d: 0, theta: q - 2*(p + 10)", Dimension.ANGLE),
        ("a: 0, alpha: 0, d: 0, theta: p*q", Dimension.NUMBER),
        ("a: 0, alpha: 0, d: 0, theta: (1 + p)*q", Dimension.NUMBER),
        ("a: 0, alpha: 90/p, d: 0, theta: q", Dimension.NUMBER),
        ("a: 0, alpha: p*pi, d: 0, theta: q", Dimension.NUMBER),
        ("a: 0, alpha: 0, d: 0, theta: p*one", Dimension.NUMBER),
        ("a: 0.1/p, alpha: 0, d: 0, theta: q", Dimension.NUMBER),
        ("ets: [Rz(q), Ry(p)]", Dimension.ANGLE),
        ("ets: [Rz(q), Ty(p)]", Dimension.LENGTH),
        ("a: 0*p, alpha: 0, d: 0, theta: q", Dimension.NUMBER),
    ],
)
def test_the_use_of_a_parameter_tells_what_it_measures(entries: str, dimension: Dimension) -> None:
    found = robot(
        "{name: one, a: 0, alpha: 0, d: 0, theta: q}",
        f"{{name: last, {entries}}}",
        more="parameters: {p: 2}",
    )

    assert found.parameters[0].dimension is dimension
