"""What `kinegen show` prints, read back, is equal to what stands in print."""

from __future__ import annotations

import pytest
import sympy as sp

from kinegen.robot.model import Robot
from kinegen.symbolic.notation import NOTATIONS, entry_texts
from kinegen.symbolic.textbook import closed_form
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
LARGEST_DENOMINATOR = 1000
"""The list of angles rounds factors to six digits; no robot file has finer ones."""


def angle(text: str, names: dict[str, sp.Expr]) -> sp.Expr:
    """An angle of the list below a closed form, its rounded factors made exact again."""
    return sp.sympify(read(text, names, [])).replace(
        lambda part: part.is_Rational and not part.is_Integer, lambda part: part.limit_denominator(LARGEST_DENOMINATOR)
    )


def printed(arm: Robot, form: Form) -> list[list[sp.Expr]]:
    """The entries as `kinegen show` prints them, read back."""
    ours = closed_form(arm, form.start, form.end)
    names = {parameter.name: sp.Symbol(parameter.name, real=True) for parameter in arm.parameters}
    names |= {f"q{variable.index + 1}": sp.Symbol(variable.name, real=True) for variable in arm.variables}
    for label, text in ours.angles:
        names |= {f"c{label}": sp.cos(angle(text, names)), f"s{label}": sp.sin(angle(text, names))}
    return [[read(text, names, []) for text in row] for row in entry_texts(ours, NOTATIONS["text"])]


@pytest.mark.parametrize(("system", "form"), FORMS)
def test_printed_closed_form_is_the_published_one(system: System, form: Form) -> None:
    arm = robot(system.robots[0])
    ours = printed(arm, form)

    assert [(i, j) for (i, j), text in form.entries.items() if not is_zero(ours[i][j] - system.read(text, arm))] == []
