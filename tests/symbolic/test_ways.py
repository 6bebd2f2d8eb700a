"""Every way to compute a quantity that is handed on gives what the reference gives, also those that are not kept."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import sympy as sp

from kinegen.derive.dispatch import derive
from kinegen.derive.expressions import LetBindings
from kinegen.io.load import loads
from kinegen.ir.lower import lower
from kinegen.ir.program import count
from kinegen.model.outputs import Kind, Quantity
from kinegen.model.robot import Robot
from kinegen.verify import reference
from tests.evaluation import Floats, run

POSES = 3
ROUNDING = 1e-13

ROWS = {
    "lengths along axes that are inclined by 45 degrees": (
        "theta: q, d: 0.22, a: 0, alpha: 45",
        "theta: q, d: 0.32, a: 0, alpha: -45",
        "theta: q, d: 0.42, a: 0, alpha: 45",
        "theta: q, d: 0.52, a: 0, alpha: 0",
    ),
    "a slide between inclined axes": (
        "theta: q, d: 0.2, a: 0.1, alpha: 30",
        "theta: q + 20, d: 0, a: 0, alpha: -50",
        "theta: 15, d: q, a: 0.3, alpha: 40",
        "theta: -q, d: 0.1, a: 0.2, alpha: 0",
        "theta: q, d: 0.4, a: 0.3, alpha: 0",
    ),
    "a mount inclined about three axes": (
        "ets: [Tx(0.1), Ty(0.2), Rz(10), Ry(20), Rx(30), Rz(q), Tz(0.3)]",
        "theta: q, d: 0, a: 0.1, alpha: 90",
        "theta: q, d: 0.2, a: 0.3, alpha: 0",
    ),
    "slides between twists that are inclined and quarter turns": (
        "theta: q, d: 0.2, a: 0.1, alpha: 30",
        "theta: 0, d: q, a: 0, alpha: 90",
        "theta: q, d: 0.1, a: 0.3, alpha: -60",
        "theta: 0, d: q, a: 0.2, alpha: -90",
        "theta: q, d: 0.4, a: 0.3, alpha: 20",
    ),
    "shifts along and across between parallel axes": (
        "theta: q, d: 0.1, a: 0.2, alpha: 0",
        "theta: 90, d: 0, a: 0.1, alpha: 0",
        "theta: 20 - q, d: 0, a: 0.3, alpha: 90",
        "theta: 90, d: q, a: 0.4, alpha: -90",
        "theta: q, d: 0.1, a: 0, alpha: 90",
        "theta: q, d: 0.3, a: 0.2, alpha: 0",
    ),
    "quarter turns": (
        "theta: q, d: 0.4, a: 0.1, alpha: 90",
        "theta: q, d: 0, a: 0.5, alpha: 0",
        "theta: q, d: 0.1, a: 0, alpha: -90",
        "theta: q, d: 0.3, a: 0, alpha: 90",
    ),
    "a spherical shoulder, elbow and wrist": (
        "theta: q, d: 0.36, a: 0, alpha: -90",
        "theta: q, d: 0, a: 0, alpha: 90",
        "theta: q, d: 0.42, a: 0, alpha: 90",
        "theta: q, d: 0, a: 0, alpha: -90",
        "theta: q, d: 0.4, a: 0, alpha: -90",
        "theta: q, d: 0, a: 0, alpha: 90",
        "theta: q, d: 0.126, a: 0, alpha: 0",
    ),
}

FOLDINGS = {
    "a slide between inclined axes": 3,
    "a mount inclined about three axes": 6,
    "slides between twists that are inclined and quarter turns": 3,
    "shifts along and across between parallel axes": 3,
}
"""Ways to compute a position, where there are several."""

each_arm = pytest.mark.parametrize("arm", ROWS)


def arm_of(name: str) -> Robot:
    joints = [f"  - {{name: j{number}, {row}}}" for number, row in enumerate(ROWS[name], 1)]
    head = ["kinegen: 1", "name: arm", "convention: standard", "units: {length: m, angle: deg}", "joints:"]
    return loads("\n".join([*head, *joints]), "arm.yaml")


def results(robot: Robot, quantity: Quantity, *inputs: Floats) -> dict[str, Floats]:
    """What each way gives, by its name."""
    expressions = derive(robot, quantity)
    return {
        way.name: run(robot, lower(replace(expressions, ways=(way,))), inputs[0], (), inputs[1:])
        for way in expressions.ways
    }


@each_arm
def test_every_way_to_compute_a_pose_gives_that_of_the_reference(arm: str) -> None:
    robot = arm_of(arm)
    q = np.random.default_rng(5).uniform(-2, 2, (POSES, robot.dof))
    expected = reference.pose(robot, q)[:, 0, :3].reshape(POSES, 12)

    for name, found in results(robot, Quantity.POSE, q).items():
        np.testing.assert_allclose(found, expected, atol=ROUNDING, rtol=0, err_msg=name)


@each_arm
def test_every_way_to_compute_a_position_gives_that_of_the_reference(arm: str) -> None:
    robot = arm_of(arm)
    q = np.random.default_rng(5).uniform(-2, 2, (POSES, robot.dof))
    expected = reference.pose(robot, q)[:, 0, :3, 3]

    ways = results(robot, Quantity.POSITION, q)

    assert len(ways) == FOLDINGS.get(arm, 1)
    for name, found in ways.items():
        np.testing.assert_allclose(found, expected, atol=ROUNDING, rtol=0, err_msg=name)


@each_arm
def test_every_way_to_compute_a_jacobian_gives_that_of_the_reference(arm: str) -> None:
    robot = arm_of(arm)
    q = np.random.default_rng(5).uniform(-2, 2, (POSES, robot.dof))
    tip = robot.tips[0]
    expected = reference.Kinematics(robot, q).jacobian(tip).reshape(POSES, -1)

    alone = results(robot, Quantity(Kind.JACOBIAN), q).items()
    with_pose = results(robot, Quantity(Kind.FK_JACOBIAN), q).items()

    for name, entries in (*alone, *((name, both[:, 12:]) for name, both in with_pose)):
        np.testing.assert_allclose(entries, expected, atol=ROUNDING, rtol=0, err_msg=name)


@each_arm
def test_every_way_to_compute_a_twist_gives_that_of_the_reference(arm: str) -> None:
    robot = arm_of(arm)
    q, qd = np.random.default_rng(5).uniform(-2, 2, (2, POSES, robot.dof))
    expected = reference.Kinematics(robot, q).twist(robot.tips[0], qd)

    found = results(robot, Quantity(Kind.TWIST), q, qd)

    assert ("from the base outwards" in found) == ("inclined" in arm)
    for name, entries in found.items():
        np.testing.assert_allclose(entries, expected, atol=ROUNDING, rtol=0, err_msg=name)


def test_shifts_along_axes_are_added_by_the_rows_of_the_rotation() -> None:
    """58 multiplications; with columns turned from the tip it would be 61."""
    robot = arm_of("a spherical shoulder, elbow and wrist")

    found = count(lower(derive(robot, Quantity.POSE)))

    assert (found.multiplications, found.additions, found.sine_cosines) == (58, 29, 7)


def test_levers_may_be_multiples_of_axes_that_a_jacobian_has_anyway() -> None:
    """Where all lengths are along axes of joints, nothing else has fewer operations."""
    expressions = derive(arm_of("lengths along axes that are inclined by 45 degrees"), Quantity(Kind.JACOBIAN))

    assert [way.name for way in expressions.ways] == ["no rotation first; column by column, levers by axes"]


def test_tapes_that_share_names_have_definitions_of_their_own() -> None:
    x, y = sp.symbols("x y")
    names: dict[sp.Expr, sp.Symbol] = {}
    one, other = LetBindings(names=names), LetBindings(names=names)

    product, total = one.name(x * y), one.name(x + y)

    assert other.name(x + y) == total
    assert other.definitions == [(total, x + y)]
    assert one.definitions == [(product, x * y), (total, x + y)]
