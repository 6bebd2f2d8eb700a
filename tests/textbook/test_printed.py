"""What `kinegen show` prints, read back, is equal to what stands in print."""

from __future__ import annotations

from fractions import Fraction

import pytest
import sympy as sp

from kinegen.backends.textbook.closed_form import closed_form
from kinegen.backends.textbook.notation import NOTATIONS, entry_texts
from kinegen.backends.textbook.trees import finite_decimal
from kinegen.model.robot import Robot
from tests.textbook.catalog import Form, System, robot, systems
from tests.textbook.notation import read
from tests.textbook.prove import is_zero

# A form for one pose alone says nothing about the whole expression, which for 21 joints is too long to read.
FORMS = [
    pytest.param(system, form, id=f"{system.key}-{form.name}")
    for system in systems()
    for form in system.forms
    if not form.at_zero
]
TEXT = NOTATIONS["text"]


def printed(arm: Robot, form: Form) -> list[list[sp.Expr]]:
    """The entries as `kinegen show` prints them, read back."""
    ours = closed_form(arm, form.start, form.end)
    names = {parameter.name: sp.Symbol(parameter.name, real=True) for parameter in arm.parameters}
    names |= {f"q{variable.index + 1}": sp.Symbol(variable.name, real=True) for variable in arm.variables}
    for label, angle in ours.angles:
        value = read(TEXT.entry(angle), names, [])
        names |= {f"c{label}": sp.cos(value), f"s{label}": sp.sin(value)}
    return [[read(text, names, []) for text in row] for row in entry_texts(ours, TEXT)]


@pytest.mark.parametrize(("system", "form"), FORMS)
def test_printed_closed_form_is_the_published_one(system: System, form: Form) -> None:
    arm = robot(system.robots[0])
    ours = printed(arm, form)

    assert [(i, j) for (i, j), text in form.entries.items() if not is_zero(ours[i][j] - system.read(text, arm))] == []


@pytest.mark.parametrize(
    ("value", "digits"),
    [
        ("0.412", "0.412"),
        ("1.570796326589793", "1.570796326589793"),
        ("-2.044881182297852e-11", "-0.00000000002044881182297852"),
        ("1/8192", ""),
        ("1/3", ""),
        ("7", ""),
    ],
)
def test_a_long_decimal_is_not_written_as_a_longer_fraction(value: str, digits: str) -> None:
    assert finite_decimal(Fraction(value)) == digits
