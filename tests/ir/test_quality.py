"""Programs hold no work that could have been left out."""

from __future__ import annotations

from collections import Counter
from fractions import Fraction
from pathlib import Path

import pytest

from kinegen.derive.dispatch import derive
from kinegen.io.load import load, loads
from kinegen.ir.lower import lower
from kinegen.ir.program import Constant, Operator, Program, Variable, count
from kinegen.model.outputs import USUAL, Quantity
from kinegen.model.robot import Robot

ROBOTS = Path(__file__).parents[2] / "robots"
NAMES = sorted(path.stem for path in ROBOTS.glob("*.yaml"))


def robot(*rows: str, more: str = "", units: str = "{length: m, angle: deg}") -> Robot:
    head = ["kinegen: 1", "name: arm", "convention: standard", f"units: {units}", more, "joints:"]
    return loads("\n".join([*head, *(f"  - {row}" for row in rows)]), "arm.yaml")


def pose(arm: Robot) -> Program:
    return lower(derive(arm, Quantity.POSE))


@pytest.mark.parametrize("name", NAMES)
def test_no_statement_does_what_could_have_been_known(name: str) -> None:
    """No product with 0, 1 or -1, no sum with 0, no arithmetic among numbers, no operation twice."""
    arm = load(ROBOTS / f"{name}.yaml")
    for quantity in USUAL:
        program = lower(derive(arm, quantity))
        for statement in program.statements:
            constants = [operand.value for operand in statement.operands if isinstance(operand, Constant)]

            assert len(constants) < len(statement.operands), statement
            assert not (statement.operator is Operator.MUL and set(map(abs, constants)) & {0, 1}), statement
            assert 0 not in constants, statement
        repeated = Counter((statement.operator, statement.operands) for statement in program.statements)

        assert max(repeated.values(), default=1) == 1


@pytest.mark.parametrize("name", NAMES)
def test_a_sum_and_its_negative_are_one_value(name: str) -> None:
    """`a - b` and `b - a` are both computed only where one is an angle, whose sign is kept for its name."""
    program = pose(load(ROBOTS / f"{name}.yaml"))
    differences = {
        statement.operands: statement.name for statement in program.statements if statement.operator is Operator.SUB
    }

    assert [pair for pair in differences if pair[::-1] in differences and not differences[pair].startswith("q")] == []


@pytest.mark.parametrize(
    ("rows", "angles"),
    [
        (["a: 1, alpha: 0, d: 0, theta: q"] * 3, ["1", "12", "123"]),
        (["a: 1, alpha: 180, d: 0, theta: q", "a: 1, alpha: 0, d: 0, theta: q"], ["1", "1m2"]),
        (["a: 1, alpha: 90, d: 0, theta: q", "a: 1, alpha: 0, d: 0, theta: q"], ["1", "2"]),
        (["a: 1, alpha: 0, d: 0, theta: q + 90", "a: 1, alpha: 0, d: 0, theta: 180 - q"], ["1", "1m2"]),
        (["a: 0, alpha: 0, d: 0, theta: q", "a: 0, alpha: 0, d: 1, theta: q"], ["12"]),
        (["a: 1, alpha: 0, d: q, theta: 0", "a: 1, alpha: 0, d: 0, theta: q"], ["2"]),
    ],
    ids=["parallel", "anti-parallel", "at right angles", "offsets", "coaxial", "past a slide"],
)
def test_joints_about_one_axis_share_their_angle(rows: list[str], angles: list[str]) -> None:
    program = pose(robot(*(f"{{name: j{number}, {row}}}" for number, row in enumerate(rows))))

    assert [angle.label for angle in program.angles] == angles


@pytest.mark.parametrize("offset", ["90", "-90", "180", "270", "-450"])
def test_a_quarter_turn_costs_nothing(offset: str) -> None:
    plain, turned = (
        count(pose(robot(f"{{name: j1, a: 0.5, alpha: 90, d: 0.25, theta: {theta}}}")))
        for theta in ("q", f"q + {offset}")
    )

    assert turned.multiplications == plain.multiplications
    assert turned.additions == plain.additions
    assert turned.sine_cosines == plain.sine_cosines == 1


def test_a_sine_and_a_cosine_of_one_angle_are_one_pair() -> None:
    arm = robot("{name: j1, a: 1, alpha: 0, d: 0, theta: q}", "{name: j2, a: 1, alpha: 90, d: 0, theta: 2*j1 + 30}")

    assert count(pose(arm)).sine_cosines == 2


def test_nothing_is_snapped_to_a_nearby_value() -> None:
    """89.9999 degrees is no right angle, and says so in what the pose costs."""
    right, nearly = (
        count(pose(robot(f"{{name: j1, a: 1, alpha: {alpha}, d: 0, theta: q}}"))) for alpha in ("90", "89.9999")
    )

    assert nearly.multiplications > right.multiplications


def test_exact_numbers_are_rounded_once() -> None:
    """A product of three decimals is one constant, with the value that exact arithmetic gives."""
    program = pose(robot("{name: j1, a: 0, alpha: 0, d: 0.1*0.2*0.3*q, theta: 0}"))
    (statement,) = program.statements

    assert statement.operands == (Variable(0), Constant(Fraction(6, 1000)))


def test_an_output_that_is_left_out_costs_nothing() -> None:
    arm = load(ROBOTS / "puma560.yaml")
    costs = {quantity: count(lower(derive(arm, quantity))) for quantity in USUAL}

    assert costs[Quantity.POSITION].sine_cosines == 3
    assert costs[Quantity.POSITION].multiplications < costs[Quantity.POSE].multiplications
    assert costs[Quantity.FRAMES].multiplications < 2 * costs[Quantity.POSE].multiplications
