"""An arm whose followers keep its tool level costs what is left when the turns have cancelled, in every velocity."""

from __future__ import annotations

import numpy as np
import pytest

from kinegen.derive.dispatch import derive
from kinegen.io.load import loads
from kinegen.ir.lower import lower
from kinegen.ir.program import count
from kinegen.model.outputs import Kind, Quantity, Reference
from kinegen.model.robot import Robot
from kinegen.verify import reference
from tests.evaluation import run

POSES = 5
ROUNDING = 1e-13

LEVELLED = """\
kinegen: 1
name: levelled
convention: standard
units: {length: m, angle: deg}
joints:
  - {name: waist, theta: q, d: 0.22, a: 0.13, alpha: 90}
  - {name: shoulder, theta: q, d: 0, a: 0.23, alpha: 0}
  - {name: elbow, theta: q, d: 0, a: 0.33, alpha: 0}
"""
FOLLOWERS = """\
  - {name: level_1, theta: -shoulder, d: 0, a: 0, alpha: 0}
  - {name: level_2, theta: -elbow, d: 0, a: 0.43, alpha: -90}
"""
APART = """\
  - {name: level_1, theta: -elbow, d: 0, a: 0.1, alpha: 0}
  - {name: level_2, theta: -shoulder, d: 0.05, a: 0.43, alpha: -90}
"""
TURN = "  - {{name: turn, theta: q, d: {length}, a: {offset}, alpha: 0}}\n"
LAST = "  - {name: last, theta: q, d: 0.1, a: 0.2, alpha: 90}\n"


def arm(length: str = "0.62", offset: str = "0", followers: str = FOLLOWERS, more: str = "") -> Robot:
    """A palletiser; `length` is that of its tool, `offset` how far it is from the axis of the last joint."""
    return loads(LEVELLED + followers + TURN.format(length=length, offset=offset) + more, "levelled.yaml")


def values(robot: Robot, quantity: Quantity) -> np.ndarray:
    """What a kernel gives, shape (N, entries)."""
    q, *rates = np.random.default_rng(5).uniform(-2, 2, (3, POSES, robot.dof))
    further = {Kind.TWIST: 1, Kind.BIAS_ACCELERATION: 1, Kind.ACCELERATION: 2}.get(quantity.kind, 0)
    return run(robot, lower(derive(robot, quantity)), q, (), tuple(rates[:further]))


def expected(robot: Robot, quantity: Quantity) -> np.ndarray:
    """The same by the reference."""
    q, qd, qdd = np.random.default_rng(5).uniform(-2, 2, (3, POSES, robot.dof))
    judge, tip = reference.Kinematics(robot, q), robot.tips[0]
    match quantity.kind:
        case Kind.JACOBIAN:
            found = judge.jacobian(tip, quantity.reference)
        case Kind.HESSIAN:
            found = judge.hessian(tip)
        case Kind.TWIST:
            found = judge.twist(tip, qd, reference=quantity.reference)
        case Kind.BIAS_ACCELERATION:
            found = judge.bias_acceleration(tip, qd, reference=quantity.reference)
        case _:
            found = judge.acceleration(tip, qd, qdd, reference=quantity.reference)
    return found.reshape(POSES, -1)


# Quantity; multiplications and additions. The Jacobian: four products of a length and a sine or cosine, three numbers
# turned by the waist; q2 + q3, two sums of links, the offset.
COSTS = [
    (Kind.JACOBIAN, Reference.LOCAL_WORLD_ALIGNED, 10, 4),
    (Kind.JACOBIAN, Reference.LOCAL, 10, 4),
    (Kind.JACOBIAN, Reference.WORLD, 10, 4),
    (Kind.TWIST, Reference.LOCAL_WORLD_ALIGNED, 13, 9),
    (Kind.TWIST, Reference.LOCAL, 13, 9),
    (Kind.TWIST, Reference.WORLD, 13, 9),
    (Kind.BIAS_ACCELERATION, Reference.LOCAL_WORLD_ALIGNED, 20, 10),
    (Kind.ACCELERATION, Reference.LOCAL_WORLD_ALIGNED, 25, 17),
    (Kind.HESSIAN, Reference.LOCAL_WORLD_ALIGNED, 14, 4),
]


@pytest.mark.parametrize(("kind", "seen", "multiplications", "additions"), COSTS)
def test_what_cancels_costs_nothing(kind: Kind, seen: Reference, multiplications: int, additions: int) -> None:
    counted = count(lower(derive(arm(), Quantity(kind, seen))))

    assert (counted.multiplications, counted.additions, counted.sine_cosines) == (multiplications, additions, 3)


@pytest.mark.parametrize("seen", Reference)
@pytest.mark.parametrize("kind", [Kind.JACOBIAN, Kind.TWIST, Kind.BIAS_ACCELERATION, Kind.ACCELERATION])
def test_velocities_are_those_of_the_reference(kind: Kind, seen: Reference) -> None:
    arms = (arm(), arm(offset="0.3"), arm(followers=APART), arm(followers=APART, offset="-0.2", more=LAST))
    for robot in arms:
        quantity = Quantity(kind, seen)
        np.testing.assert_allclose(values(robot, quantity), expected(robot, quantity), atol=100 * ROUNDING, rtol=0)


SLIDE = "  - {name: rail, theta: 0, d: 0.5*elbow, a: 0.1, alpha: 90}\n"
HESSIAN = {
    "level": arm(),
    "offset": arm(offset="0.3"),
    "one joint after the other": arm(followers=APART, offset="-0.2", more=LAST),
    "elbow alone": arm(followers=FOLLOWERS.replace("theta: -shoulder", "theta: 30"), offset="0.1"),
    "a slide that follows": arm(offset="0.1", more=SLIDE + LAST),
}


@pytest.mark.parametrize("robot", HESSIAN.values(), ids=HESSIAN)
def test_second_derivatives_are_those_of_the_reference(robot: Robot) -> None:
    quantity = Quantity(Kind.HESSIAN)
    np.testing.assert_allclose(values(robot, quantity), expected(robot, quantity), atol=10 * ROUNDING, rtol=0)


@pytest.mark.parametrize("kind", [Kind.JACOBIAN, Kind.TWIST, Kind.ACCELERATION, Kind.HESSIAN])
def test_a_tool_that_stays_level_does_not_enter_its_velocity(kind: Kind) -> None:
    short, long = (values(arm(length), Quantity(kind)) for length in ("0.62", "1e9"))

    np.testing.assert_array_equal(short, long)


def test_the_row_of_the_waist_has_no_error_that_grows_with_the_tool() -> None:
    robot = arm("1e5")
    found = values(robot, Quantity(Kind.JACOBIAN))
    exact = expected(arm("0"), Quantity(Kind.JACOBIAN))

    np.testing.assert_allclose(found, exact, atol=1e-15, rtol=0)
