"""The operations that the arms of the design table cost, counted on the statements that are emitted."""

from __future__ import annotations

from pathlib import Path

import pytest

from kinegen.derive.dispatch import derive
from kinegen.io.load import load, loads
from kinegen.ir.from_expressions import plain_count
from kinegen.ir.lower import lower
from kinegen.ir.program import count
from kinegen.model.outputs import Quantity
from kinegen.model.robot import Robot

ROBOTS = Path(__file__).parents[2] / "robots"

# Robot, parameters kept, multiplications, additions (the sums of joint angles included).
TABLE = [
    ("puma560", "a2 a3 d3 d4", 40, 20),
    ("ur5", "d1 a2 a3 d4 d5 d6", 36, 21),
    ("panda", "d1 d3 a4 d5 a7 d7", 68, 36),
    ("iiwa14", "d1 d3 d5 d7", 66, 32),
]


def with_runtime_parameters(name: str) -> Robot:
    """A robot file with all its parameters kept as arguments."""
    text = (ROBOTS / f"{name}.yaml").read_text(encoding="utf-8")
    lines = []
    inside = False
    for line in text.splitlines():
        inside = line.startswith("parameters:") or (inside and line.startswith("  "))
        key, _, value = line.partition("#")[0].partition(":")
        kept = inside and line.startswith("  ") and bool(value.strip())
        lines.append(f"{key}: {{value: {value.strip()}, runtime: true}}" if kept else line)
    return loads("\n".join(lines), f"{name}.yaml")


@pytest.mark.parametrize(("name", "parameters", "multiplications", "additions"), TABLE)
def test_pose_costs_no_more_than_the_design_allows(
    name: str, parameters: str, multiplications: int, additions: int
) -> None:
    robot = with_runtime_parameters(name)
    program = lower(derive(robot, Quantity.POSE))
    counted = count(program)

    assert len(program.parameters) >= len(parameters.split()) - 1
    assert counted.multiplications <= multiplications
    assert counted.additions <= additions
    assert counted.sine_cosines <= robot.dof
    assert counted.divisions == 0


INCLINED = {"nutating_mill": 1}
"""What a fixed angle before and after a joint costs a tree, where the plain product forms that link by itself."""


@pytest.mark.parametrize("name", sorted(path.stem for path in ROBOTS.glob("*.yaml")))
def test_folding_never_costs_more_than_the_plain_product(name: str) -> None:
    robot = load(ROBOTS / f"{name}.yaml")
    folded, plain = count(lower(derive(robot, Quantity.POSE))), plain_count(robot)

    assert folded.multiplications + folded.additions - INCLINED.get(name, 0) <= plain.multiplications + plain.additions
    assert folded.sine_cosines <= plain.sine_cosines + folded.additions


def test_puma_needs_one_sine_and_cosine_for_the_sum_of_its_parallel_joints() -> None:
    program = lower(derive(load(ROBOTS / "puma560.yaml"), Quantity.POSE))

    assert [angle.label for angle in program.angles] == ["1", "2", "23", "4", "5", "6"]
    assert [angle.text for angle in program.angles if angle.is_sum] == ["q2 + q3"]


def test_an_output_of_constants_costs_nothing() -> None:
    program = lower(derive(load(ROBOTS / "blocks.yaml"), Quantity.POSE))

    assert program.statements == ()
