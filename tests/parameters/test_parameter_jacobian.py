"""The derivative of the pose by parameters, against the reference and by what has to hold."""

from __future__ import annotations

from functools import cache

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kinegen.derive.dispatch import derive
from kinegen.errors import KinegenError
from kinegen.io.load import load, loads
from kinegen.ir.lower import lower, runtime_defaults
from kinegen.ir.program import Program, count
from kinegen.model.outputs import Kind, Quantity
from kinegen.model.robot import ROW_ENTRIES, Robot
from kinegen.model.runtime_entries import DH, with_runtime_entries
from kinegen.verify import reference
from tests.chains import robots
from tests.evaluation import run

QUANTITY = Quantity(Kind.PARAMETER_JACOBIAN)
POSES = 4
ROUNDING = 1e-12


@cache
def program(robot: Robot, quantity: Quantity) -> Program:
    return lower(derive(robot, quantity))


def kernel(robot: Robot, q: np.ndarray, quantity: Quantity = QUANTITY) -> np.ndarray:
    """Columns for each parameter, shape (N, frames, 6, p)."""
    found = run(robot, program(robot, quantity), q, runtime_defaults(robot))
    return found.reshape(len(q), -1, 6, len(robot.varied_parameters))


def expected(robot: Robot, q: np.ndarray, frames: tuple[str, ...]) -> np.ndarray:
    names = [parameter.name for parameter in robot.varied_parameters]
    judge = reference.Kinematics(robot, q)
    return np.stack([judge.parameter_jacobian(frame, names) for frame in frames], axis=1)


def joint_vectors(robot: Robot) -> np.ndarray:
    return np.random.default_rng(5).uniform(-4, 4, (POSES, robot.dof))


@given(robots(most_rows=3), st.booleans())
@settings(max_examples=12)
def test_columns_of_any_robot_are_those_of_the_reference(robot: Robot, named: bool) -> None:
    words = [parameter.name for parameter in robot.parameters if parameter.name == "a"] * named
    words += [DH] * any(ROW_ENTRIES[row.convention] for row in robot.rows)
    try:
        varied = with_runtime_entries(robot, tuple(words)) if words else robot
    except KinegenError:
        varied = with_runtime_entries(robot, ("a",))
    if varied.varied_parameters:
        q = joint_vectors(varied)
        np.testing.assert_allclose(kernel(varied, q), expected(varied, q, varied.tips), atol=ROUNDING)


def test_a_named_frame_does_not_depend_on_what_comes_after_it() -> None:
    robot = with_runtime_entries(load("robots/ur5.yaml"), (DH,))
    q = joint_vectors(robot)
    found = kernel(robot, q, Quantity(Kind.PARAMETER_JACOBIAN, frame="elbow"))

    np.testing.assert_allclose(found, expected(robot, q, ("elbow",)), atol=ROUNDING)
    after = [entry.name.endswith(("wrist_1", "wrist_2", "wrist_3")) for entry in robot.varied_parameters]
    assert not found[..., after].any()


def test_columns_are_the_derivative_of_the_pose_to_many_digits() -> None:
    """Central differences with 50 digits leave the square of the step."""
    robot = with_runtime_entries(load("robots/calibrated_2r.yaml"), (DH,))
    q = np.array([0.7, -1.1])
    found = kernel(robot, q[None])[0, 0]
    step = mpmath.mpf(10) ** -15

    with mpmath.workdps(reference.DIGITS):
        values = {entry.name: mpmath.mpf(value.numerator) / value.denominator for entry, value in defaults(robot)}
        (pose,) = reference.pose_mp(robot, q, values)
        for column, name in enumerate(values):
            (ahead,) = reference.pose_mp(robot, q, {**values, name: values[name] + step})
            (behind,) = reference.pose_mp(robot, q, {**values, name: values[name] - step})
            rate = (ahead - behind) / (2 * step)
            turning = rate[:3, :3] * pose[:3, :3].T
            twist = [rate[0, 3], rate[1, 3], rate[2, 3], turning[2, 1], turning[0, 2], turning[1, 0]]
            np.testing.assert_allclose(found[:, column], [float(entry) for entry in twist], atol=1e-15)


def defaults(robot: Robot) -> list[tuple[object, object]]:
    return list(zip(robot.varied_parameters, runtime_defaults(robot), strict=True))


def test_an_offset_moves_the_arm_as_its_joint_does() -> None:
    robot = with_runtime_entries(load("robots/ur5.yaml"), (DH,))
    q = joint_vectors(robot)
    offsets = [index for index, entry in enumerate(robot.varied_parameters) if entry.name.startswith("theta_")]
    joints = reference.Kinematics(robot, q).jacobian("tool")

    np.testing.assert_allclose(kernel(robot, q)[:, 0][..., offsets], joints, atol=ROUNDING)


def test_lengths_of_any_size_have_columns_of_the_unit_that_they_are_measured_in() -> None:
    """A length moves the tip by as much as it grows along its axis, in metres as in millimetres."""
    metres = with_runtime_entries(load("robots/ur5.yaml"), (DH,))
    q = joint_vectors(metres)
    lengths = [index for index, entry in enumerate(metres.varied_parameters) if entry.name.startswith(("a_", "d_"))]
    columns = kernel(metres, q)[:, 0][..., lengths]

    np.testing.assert_allclose(np.linalg.norm(columns[:, :3], axis=1), 1, atol=ROUNDING)
    assert not columns[:, 3:].any()


def test_one_parameter_costs_little() -> None:
    """One length of a PUMA 560 is one axis: what lies beyond it is not computed."""
    robot = with_runtime_entries(load("robots/puma560.yaml"), ("a2",))
    found = count(lower(derive(robot, QUANTITY)))

    assert (found.multiplications, found.additions, found.sine_cosines) == (2, 0, 2)


def test_without_parameters_there_is_nothing_to_derive_by() -> None:
    with pytest.raises(KinegenError, match="name some with --wrt"):
        derive(load("robots/ur5.yaml"), QUANTITY)


def test_a_tree_has_columns_for_each_tip() -> None:
    robot = with_runtime_entries(
        loads(
            """
kinegen: 1
name: fork
convention: standard
units: {length: m, angle: deg}
parameters: {trunk: 0.4, left_length: 0.2}
joints:
  - {name: hip, theta: q, d: trunk, a: 0, alpha: 90}
  - {name: left, theta: q, d: 0, a: left_length, alpha: 0}
  - {name: right, parent: hip, theta: q, d: 0, a: 0.3, alpha: 0}
""",
            "fork.yaml",
        ),
        ("left_length", "trunk"),
    )
    q = joint_vectors(robot)
    found = kernel(robot, q)

    np.testing.assert_allclose(found, expected(robot, q, ("left", "right")), atol=ROUNDING)
    assert not found[:, 1, :, 1].any()
