"""Twists and accelerations of any robot are the derivatives by time of what the reference evaluates."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kinegen.derive.dispatch import derive
from kinegen.errors import KinegenError
from kinegen.io.load import load, loads
from kinegen.ir.lower import lower, runtime_defaults
from kinegen.ir.program import count
from kinegen.model.outputs import Kind, Quantity, Reference
from kinegen.model.robot import Robot
from kinegen.verify import reference
from tests.chains import robots
from tests.evaluation import run

ROBOTS = Path(__file__).parents[2] / "robots"
POSES = 4
ROUNDING = 1e-11  # accelerations of up to a hundred, some hundreds of operations

kinds = st.sampled_from([Kind.TWIST, Kind.BIAS_ACCELERATION, Kind.ACCELERATION])
references = st.sampled_from(Reference)


def motions(robot: Robot) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Joint vectors, their rates and accelerations."""
    q, qd, qdd = np.random.default_rng(13).uniform(-2, 2, (3, POSES, robot.dof))
    return q, qd, qdd


def kernel(robot: Robot, quantity: Quantity, *inputs: np.ndarray) -> np.ndarray:
    """What a kernel gives, shape (N, frames, 6)."""
    found = run(robot, lower(derive(robot, quantity)), inputs[0], runtime_defaults(robot), inputs[1:])
    return found.reshape(len(inputs[0]), -1, 6)


def compare(robot: Robot, kind: Kind, seen: Reference, frames: tuple[str, ...], frame: str = "") -> None:
    q, qd, qdd = motions(robot)
    judge = reference.Kinematics(robot, q)
    rates = (qd, qdd) if kind is Kind.ACCELERATION else (qd,)
    known = {
        Kind.TWIST: judge.twist,
        Kind.BIAS_ACCELERATION: judge.bias_acceleration,
        Kind.ACCELERATION: judge.acceleration,
    }
    expected = np.stack([known[kind](each, *rates, reference=seen) for each in frames], axis=1)

    found = kernel(robot, Quantity(kind, seen, frame), q, *rates)
    np.testing.assert_allclose(found, expected, atol=ROUNDING, rtol=0)


@given(robots(), kinds, references)
@settings(max_examples=40)
def test_motion_of_any_chain_or_tree_is_that_of_the_reference(robot: Robot, kind: Kind, seen: Reference) -> None:
    compare(robot, kind, seen, robot.tips)


@given(robots(most_rows=4), kinds, references, st.data())
@settings(max_examples=20)
def test_motion_of_any_frame_is_that_of_the_reference(
    robot: Robot, kind: Kind, seen: Reference, data: st.DataObject
) -> None:
    frame = data.draw(st.sampled_from(robot.frame_names))
    compare(robot, kind, seen, (frame,), frame)


@pytest.mark.parametrize("seen", Reference)
def test_accelerations_are_the_jacobian_times_those_of_the_joints_and_the_bias(seen: Reference) -> None:
    robot = load(ROBOTS / "iiwa14.yaml")
    q, qd, qdd = motions(robot)
    jacobian = kernel(robot, Quantity(Kind.JACOBIAN, seen), q).reshape(POSES, 6, robot.dof)
    bias = kernel(robot, Quantity(Kind.BIAS_ACCELERATION, seen), q, qd)[:, 0]
    whole = kernel(robot, Quantity(Kind.ACCELERATION, seen), q, qd, qdd)[:, 0]
    twist = kernel(robot, Quantity(Kind.TWIST, seen), q, qd)[:, 0]

    np.testing.assert_allclose(twist, np.einsum("nij,nj->ni", jacobian, qd), atol=ROUNDING, rtol=0)
    np.testing.assert_allclose(whole, np.einsum("nij,nj->ni", jacobian, qdd) + bias, atol=ROUNDING, rtol=0)


def test_a_point_on_a_turntable_is_drawn_to_the_axis() -> None:
    robot = load(ROBOTS / "planar_3r.yaml")
    q, qd = np.zeros((1, 3)), np.array([[2.0, 0, 0]])
    reach = reference.pose(robot, q)[0, 0, 0, 3]

    twist = kernel(robot, Quantity(Kind.TWIST), q, qd)[0, 0]
    bias = kernel(robot, Quantity(Kind.BIAS_ACCELERATION), q, qd)[0, 0]
    np.testing.assert_allclose(twist, [0, 2 * reach, 0, 0, 0, 2], atol=1e-15)
    np.testing.assert_allclose(bias, [-4 * reach, 0, 0, 0, 0, 0], atol=1e-15)
    for seen in (Reference.LOCAL, Reference.WORLD):
        assert not kernel(robot, Quantity(Kind.BIAS_ACCELERATION, seen), q, qd).any()


def test_a_frame_that_does_not_exist_lists_those_that_do() -> None:
    with pytest.raises(KinegenError, match=r"unknown frame 'elbw' \(expected base, base_turn, shoulder, elbow, "):
        derive(load(ROBOTS / "ur5.yaml"), Quantity(Kind.TWIST, frame="elbw"))


# Robot; multiplications and additions of the twist and the acceleration, in the axes of the base.
COSTS = [("puma560", 49, 103), ("ur5", 61, 122), ("panda", 112, 236), ("iiwa14", 115, 257)]


@pytest.mark.parametrize(("name", "twist", "acceleration"), COSTS)
def test_a_motion_costs_less_than_a_jacobian_and_its_products(name: str, twist: int, acceleration: int) -> None:
    robot = load(ROBOTS / f"{name}.yaml")
    for kind, most in ((Kind.TWIST, twist), (Kind.ACCELERATION, acceleration)):
        counted = count(lower(derive(robot, Quantity(kind))))
        assert counted.multiplications + counted.additions <= most


# By the rates of sums of angles, by hand: three products of a rate and a length, six with sines and cosines; two sums
# of angles, two of rates, four of the links. A bias has three squares more.
PLANAR = [(Kind.TWIST, 9, 8), (Kind.BIAS_ACCELERATION, 12, 8), (Kind.ACCELERATION, 21, 16)]


@pytest.mark.parametrize(("kind", "multiplications", "additions"), PLANAR)
def test_links_that_parallel_joints_turn_have_the_rates_of_sums(
    kind: Kind, multiplications: int, additions: int
) -> None:
    counted = count(lower(derive(load(ROBOTS / "planar_3r.yaml"), Quantity(kind))))

    assert (counted.multiplications, counted.additions) == (multiplications, additions)


def test_the_twist_of_a_ur_is_turned_by_the_waist_once() -> None:
    counted = count(lower(derive(load(ROBOTS / "ur5.yaml"), Quantity(Kind.TWIST))))

    assert (counted.multiplications, counted.additions, counted.sine_cosines) == (35, 25, 5)


def test_a_fixed_turn_between_parallel_joints_costs_no_sine() -> None:
    lines = (
        "kinegen: 1",
        "name: bent",
        "convention: standard",
        "units: {length: m, angle: deg}",
        "joints:",
        "  - {name: j1, alpha: 0, a: 0.3, d: 0, theta: q}",
        "  - {name: bend, ets: [Tx(0.4), Rz(30), Ty(0.2)]}",
        "  - {name: j2, alpha: 0, a: 0.25, d: 0, theta: q}",
    )
    robot = loads("\n".join(lines), "bent.yaml")
    for kind in (Kind.TWIST, Kind.BIAS_ACCELERATION, Kind.ACCELERATION):
        for seen in Reference:
            compare(robot, kind, seen, robot.tips)
            counted = count(lower(derive(robot, Quantity(kind, seen))))
            assert counted.sine_cosines == (2 if seen is Reference.LOCAL_WORLD_ALIGNED else 1)


def test_what_stands_before_and_behind_a_slide_is_one_length() -> None:
    lines = (
        "kinegen: 1",
        "name: polar",
        "convention: standard",
        "units: {length: m, angle: deg}",
        "joints:",
        "  - {name: j1, ets: [Rz(q), Tx(0.13)]}",
        "  - {name: reach, ets: [Tx(q), Tx(0.2)]}",
    )
    robot = loads("\n".join(lines), "polar.yaml")
    compare(robot, Kind.ACCELERATION, Reference.LOCAL_WORLD_ALIGNED, robot.tips)
    counted = count(lower(derive(robot, Quantity(Kind.TWIST))))

    # w (0.33 + q) across and the rate of the slide along, turned once.
    assert (counted.multiplications, counted.additions) == (5, 3)
