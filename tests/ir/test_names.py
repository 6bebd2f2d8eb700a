"""Temporaries have the names that people read, and the same ones in every quantity."""

from __future__ import annotations

from pathlib import Path

import pytest

from kinegen.derive.dispatch import derive
from kinegen.io.load import load
from kinegen.ir.lower import lower
from kinegen.ir.program import Operator, Program
from kinegen.model.outputs import USUAL, Quantity

ROBOTS = Path(__file__).parents[2] / "robots"


def program(name: str, quantity: Quantity = Quantity.POSE) -> Program:
    return lower(derive(load(ROBOTS / f"{name}.yaml"), quantity))


@pytest.mark.parametrize("quantity", list(USUAL))
def test_angles_that_are_no_plain_sum_are_numbered_in_their_order(quantity: Quantity) -> None:
    angles = program("calibrated_2r", quantity).angles

    assert [(angle.label, angle.text) for angle in angles] == [
        ("u1", "tilt"),
        ("u2", "skew"),
        ("1", "q1"),
        ("u3", "q2 + zero_2"),
    ]


def test_from_ten_joints_on_sums_are_joined_by_an_underscore() -> None:
    labels = [angle.label for angle in program("hand").angles]

    assert "10_11" in labels
    assert "4_5" in labels
    assert "45" not in labels


@pytest.mark.parametrize("name", ["puma560", "ur5", "panda", "human_body", "scara"])
def test_sums_of_joints_come_first_then_sines_and_cosines_then_the_rest(name: str) -> None:
    statements = program(name).statements
    places = [
        1 if statement.operator is Operator.SINCOS else 0 if statement.name.startswith("q") else 2
        for statement in statements
    ]

    assert places == sorted(places)
    assert 1 in places


def test_temporaries_are_numbered_without_gaps() -> None:
    names = [name for statement in program("ur5").statements for name in statement.results]
    numbers = [int(name[1:]) for name in names if name.startswith("t")]

    assert numbers == list(range(len(numbers)))
