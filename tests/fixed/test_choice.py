"""Integer kernels have the operations that the search saves, where no result loses anything."""

from __future__ import annotations

from pathlib import Path

import pytest

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.fixed_point.kernels import fixed_kernels
from kinegen.io.load import load
from kinegen.ir.fixed_point.plan import plan_fixed
from kinegen.ir.lower import as_derived, program_of, runtime_defaults
from kinegen.model.outputs import Quantity

ROBOTS = Path(__file__).resolve().parents[2] / "robots"


@pytest.mark.parametrize(
    ("name", "quantity", "is_searched"),
    [
        ("hanging_arm", Quantity.POSE, True),
        ("gen3_lite", Quantity.POSITION, True),
        ("human_arm", Quantity.POSE, False),
        ("puma560", Quantity.POSITION, False),
    ],
)
def test_the_search_is_taken_where_no_bound_grows(name: str, quantity: Quantity, is_searched: bool) -> None:
    robot = load(ROBOTS / f"{name}.yaml")
    searched, plain = program_of(robot, quantity), as_derived(robot, quantity)

    kernels = fixed_kernels(RobotPrograms(robot, (searched,), runtime_defaults(robot)))
    (found,) = kernels.programs
    before, (kept,) = plan_fixed(robot, (plain,))

    assert searched != plain
    assert found.program == (searched if is_searched else plain)
    assert kernels.scales == before
    assert all(new <= old for new, old in zip(found.errors, kept.errors, strict=True))
