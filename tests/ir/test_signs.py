"""Signs are absorbed without changing what a program computes, and angles keep the names that people expect."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from kinegen.derive.dispatch import derive
from kinegen.io.load import load, loads
from kinegen.ir.lower import lower
from kinegen.ir.program import count
from kinegen.model.outputs import Quantity
from kinegen.model.robot import Robot
from kinegen.verify import reference
from tests.evaluation import as_poses, run

ROBOTS = Path(__file__).parents[2] / "robots"
ROUNDING = 1e-14


def robot(*rows: str) -> Robot:
    head = ["kinegen: 1", "name: arm", "convention: standard", "units: {length: m, angle: rad}", "joints:"]
    return loads("\n".join([*head, *(f"  - {row}" for row in rows)]), "arm.yaml")


# In each, an angle or its negative is also a length, so the sign of one value is wanted both ways.
SHARED = [
    ["{name: a, theta: 2*q, d: -2*q, a: 0, alpha: 0}"],
    ["{name: a, theta: -q, d: q, a: 0, alpha: 0}"],
    [
        "{name: a, theta: q, d: 0, a: 0, alpha: 0}",
        "{name: b, theta: -q, d: 0, a: 0, alpha: pi/2}",
        "{name: c, ets: [Tx(b - a), Ty(a - b), Tz(a - b)]}",
    ],
    [
        "{name: a, theta: q, d: 0, a: 0, alpha: pi/2}",
        "{name: b, theta: a - pi/3, d: 0, a: 0, alpha: 0}",
        "{name: c, ets: [Tx(pi/3 - a), Ry(-a), Tz(a - pi/3)]}",
    ],
]


@pytest.mark.parametrize("rows", SHARED)
@pytest.mark.parametrize("quantity", [Quantity.POSE, Quantity.FRAMES])
def test_an_angle_that_is_also_a_length_keeps_both_signs(rows: list[str], quantity: Quantity) -> None:
    arm = robot(*rows)
    q = np.random.default_rng(3).uniform(-2, 2, (20, arm.dof))
    known = reference.frames(arm, q)
    frames = arm.frame_names if quantity == Quantity.FRAMES else arm.tips
    found = as_poses(run(arm, lower(derive(arm, quantity)), q), len(frames))

    for index, frame in enumerate(frames):
        np.testing.assert_allclose(found[:, index], known[frame][:, :3], atol=ROUNDING, rtol=0, err_msg=frame)


def test_angles_are_not_turned_round_to_save_a_negation() -> None:
    program = lower(derive(robot(*SHARED[2]), Quantity.POSE))

    assert [angle.label for angle in program.angles] == ["1m2"]


@pytest.mark.parametrize("name", ["gen3_lite", "iiwa14"])
def test_the_search_for_signs_starts_with_all_differences_either_way_round(name: str) -> None:
    """One of the two starts leaves a negation in the pose of each of these arms."""
    program = lower(derive(load(ROBOTS / f"{name}.yaml"), Quantity.POSE))

    assert count(program).negations == 0
