"""Of programs that take the same products and sums, one is kept whose rotations the bounds recognise."""

from __future__ import annotations

from pathlib import Path

from kinegen.backends.accuracy import error_bound
from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.scalar_types import ScalarType
from kinegen.io.load import load
from kinegen.ir.lower import as_derived, program_of
from kinegen.ir.program import Program, count
from kinegen.model.outputs import Quantity
from kinegen.model.robot import Robot

ROBOTS = Path(__file__).resolve().parents[2] / "robots"
KR5, HUMAN = load(ROBOTS / "kr5.yaml"), load(ROBOTS / "human_arm.yaml")


def largest(robot: Robot, program: Program) -> float:
    return float(max(error_bound(RobotPrograms(robot, (program,), ()), program, ScalarType.DOUBLE).entries))


def test_one_change_of_sign_is_paid_for_a_bound_that_is_three_times_smaller() -> None:
    """41 products and 23 sums with 2 changes of sign have a bound of 9.8e-15, with 3 one of 3.2e-15."""
    kept, plain = program_of(KR5, Quantity.POSE), as_derived(KR5, Quantity.POSE)

    assert count(kept).weight < count(plain).weight
    assert (count(kept).multiplications, count(kept).additions) == (41, 23)
    assert largest(KR5, kept) == largest(KR5, plain)


def test_so_are_two_for_one_that_is_nearly_half() -> None:
    """76 products and 37 sums without a change of sign have a bound of 1.1e-14, with 2 one of 6.0e-15."""
    kept = program_of(HUMAN, Quantity.POSE)

    assert (count(kept).multiplications, count(kept).additions, count(kept).negations) == (76, 37, 2)
    assert largest(HUMAN, kept) < 6.1e-15
