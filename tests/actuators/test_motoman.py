"""The Yasukawa Motoman L-3 behind its linkages: the formulas of the book, and what they leave unchanged."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import mpmath
import numpy as np
import pytest
import sympy as sp
import yaml

from kinegen.derive.dispatch import derive
from kinegen.derive.drivetrain import drivetrain
from kinegen.derive.transforms import SYMPY
from kinegen.io.load import load
from kinegen.ir.lower import lower
from kinegen.ir.program import Variable
from kinegen.model.expression_parser import evaluate
from kinegen.model.outputs import Kind, Quantity
from kinegen.model.robot import Robot
from tests.actuators.machines import Floats, computed, machine, samples

HERE = Path(__file__).resolve().parent
ROBOT = HERE.parents[1] / "robots" / "motoman_l3.yaml"
BOOK: dict[str, Any] = yaml.safe_load((HERE / "data" / "motoman_l3.yaml").read_text(encoding="utf-8"))

ROWS = (
    "{name: theta_1, convention: modified, alpha: 0, a: 0, d: 0, theta: q}",
    "{name: theta_2, convention: modified, alpha: -pi/2, a: 0, d: 0, theta: q}",
    "{name: theta_3, convention: modified, alpha: 0, a: 0.6, d: 0, theta: q}",
    "{name: theta_4, convention: modified, alpha: 0, a: 0.5, d: 0, theta: q}",
    "{name: theta_5, convention: modified, alpha: pi/2, a: 0, d: 0, theta: q}",
)
LINKAGES = {
    "theta_2": "form: linear_actuator, actuator: A2, sides: [alpha_2, beta_2], length: k2*A2 + lambda_2, "
    'offset: "atan2(phi_2, gamma_2) + Omega_2 - 3*pi/2"',
    "theta_3": "form: linear_actuator, actuator: A3, sides: [alpha_3, beta_3], length: k3*A3 + lambda_3, "
    'offset: "atan2(phi_3, gamma_3) - theta_2 - pi/2"',
}


@cache
def arm(*, by_forms: bool) -> Robot:
    """The book's machine in radians, its linkages as named forms or typed out as the book prints them."""
    values = {name: f'value: "{text}"' for name, text in BOOK["forward"].items()}
    entries = values | LINKAGES if by_forms else values
    limits = {"A2": "[-50, 150]", "A3": "[-40, 130]"}
    readings = ", ".join(
        f"{name}: {{dimension: number, limits: {limits.get(name, '[-100, 100]')}}}" for name in BOOK["readings"]
    )
    inverse = "" if by_forms else "{" + ", ".join(f'{name}: "{BOOK["inverse"][name]}"' for name in ("A2", "A3")) + "}"
    return machine(
        f"{{{readings}}}",
        *(f"{{joint: {name}, {text}}}" for name, text in entries.items()),
        rows=ROWS,
        angle="rad",
        inverse=inverse,
        parameters="{" + ", ".join(f"{name}: {value}" for name, value in BOOK["constants"].items()) + "}",
    )


FORMS = pytest.mark.parametrize("by_forms", [True, False], ids=["forms", "formulas"])


def printed(what: str, given: dict[str, Any], order: list[str]) -> Floats:
    """The book's formulas with 50 digits, in the order printed."""
    with mpmath.workdps(50):
        values = {name: mpmath.mpf(value) for name, value in (BOOK["constants"] | given).items()}
        functions = {name: getattr(mpmath, name) for name in ("acos", "atan2", "sqrt", "cos")} | {"pi": mpmath.pi}
        for name, text in BOOK[what].items():
            values[name] = eval(text, functions, values)  # noqa: S307 - our own data
        return np.array([float(values[name]) for name in order])


@FORMS
@pytest.mark.parametrize("point", BOOK["points"], ids=str)
def test_joints_at_the_points_of_the_book_s_data(point: dict[str, int], by_forms: bool) -> None:
    found = computed(arm(by_forms=by_forms), Kind.ACTUATORS_TO_JOINTS, np.array([point[name] for name in point]))[0]

    np.testing.assert_allclose(found, printed("forward", point, BOOK["names"]), atol=2e-15)


@FORMS
@pytest.mark.parametrize("point", BOOK["points"], ids=str)
def test_readings_are_the_derived_inverse(point: dict[str, int], by_forms: bool) -> None:
    angles = printed("forward", point, BOOK["names"])
    found = computed(arm(by_forms=by_forms), Kind.JOINTS_TO_ACTUATORS, angles)[0]
    given = dict(zip(BOOK["names"], map(str, angles), strict=True))

    np.testing.assert_allclose(found, printed("inverse", given, BOOK["readings"]), atol=2e-13)
    np.testing.assert_allclose(found, list(point.values()), atol=2e-13)


@FORMS
@pytest.mark.parametrize("invariant", BOOK["invariants"], ids=str)
def test_what_the_book_leaves_unchanged_is_unchanged_exactly(invariant: dict[str, list[str]], by_forms: bool) -> None:
    """Whatever else a reading moves, the sum does not hold it, nor any value that was made from it."""
    train = drivetrain(arm(by_forms=by_forms))
    total = sp.expand(sum(train.values[name] for name in invariant["sum"]))
    meaning = dict(train.bindings.definitions)
    reached: set[sp.Symbol] = set()
    pending = list(total.free_symbols)
    while pending:
        symbol = pending.pop()
        reached.add(symbol)
        pending += meaning[symbol].free_symbols if symbol in meaning else ()

    assert {str(symbol) for symbol in reached & set(train.readings)} == set(invariant["readings"])


def test_the_sum_of_the_three_is_the_book_s() -> None:
    train = drivetrain(arm(by_forms=True))
    A4 = train.values["A4"]
    total = sum(train.values[f"theta_{i}"] for i in (2, 3, 4))

    assert sp.expand(total - (sp.Rational("0.2") + sp.pi - sp.Rational("0.01") * A4)) == 0


@FORMS
def test_actuator_2_does_not_turn_the_hand(by_forms: bool) -> None:
    """The rotation that the pose kernel computes reads A1, A4 and A5 alone."""
    program = lower(derive(arm(by_forms=by_forms), Quantity(Kind.FK_ACTUATORS)))
    made_of = {}
    for statement in program.statements:
        found = set().union(
            *(
                {operand.index} if isinstance(operand, Variable) else made_of.get(getattr(operand, "name", ""), set())
                for operand in statement.operands
            )
        )
        made_of |= dict.fromkeys(statement.results, found)
    rotation = [entry for place, entry in enumerate(program.outputs) if place % 4 != 3]

    assert set().union(*(made_of.get(getattr(entry, "name", ""), set()) for entry in rotation)) == {0, 3, 4}


def test_the_robot_of_the_house_is_the_book_s_machine() -> None:
    """Its forms, in degrees, against the book's formulas with its constants."""
    robot = load(ROBOT)
    constants = {each.name: str(float(evaluate(each.value, {}, SYMPY))) for each in robot.parameters}
    for name in ("k1", "k4", "k5"):  # degrees for one unit of the reading
        constants[name] = str(np.radians(float(constants[name])))
    readings = samples(robot, 5)
    found = computed(robot, Kind.ACTUATORS_TO_JOINTS, readings)

    for row, angles in zip(readings, found, strict=True):
        given = constants | dict(zip(BOOK["readings"], map(str, row), strict=True))
        np.testing.assert_allclose(angles, printed("forward", given, BOOK["names"]), atol=1e-14)


@FORMS
def test_there_and_back_over_the_limits(by_forms: bool) -> None:
    robot = arm(by_forms=by_forms)
    readings = samples(robot, 500)
    angles = computed(robot, Kind.ACTUATORS_TO_JOINTS, readings)
    again = computed(robot, Kind.JOINTS_TO_ACTUATORS, angles)

    np.testing.assert_allclose(again, readings, atol=1e-11)
    np.testing.assert_allclose(computed(robot, Kind.ACTUATORS_TO_JOINTS, again), angles, atol=1e-13)


def test_forms_and_formulas_are_one_machine() -> None:
    readings = samples(arm(by_forms=True), 50)
    for kind in (Kind.ACTUATORS_TO_JOINTS, Kind.FK_ACTUATORS, Kind.JACOBIAN_ACTUATORS):
        one, other = (computed(arm(by_forms=by_forms), kind, readings) for by_forms in (True, False))
        np.testing.assert_allclose(one, other, atol=1e-12)
