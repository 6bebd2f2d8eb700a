"""The Hessian of any robot is the derivative of the Jacobian, in the layout of the Robotics Toolbox."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings

from kinegen.derive.dispatch import derive
from kinegen.errors import KinegenError
from kinegen.io.load import load
from kinegen.ir.lower import lower, runtime_defaults
from kinegen.model.outputs import Kind, Quantity
from kinegen.model.robot import Robot
from kinegen.verify import reference
from tests.chains import robots
from tests.evaluation import run

ROBOTS = Path(__file__).parents[2] / "robots"
POSES = 3
ROUNDING = 1e-11


def joint_vectors(robot: Robot) -> np.ndarray:
    return np.random.default_rng(17).uniform(-3, 3, (POSES, robot.dof))


def kernel(robot: Robot, q: np.ndarray, kind: Kind, frame: str = "") -> np.ndarray:
    """What a kernel gives for each frame, shape (N, frames, ...)."""
    program = lower(derive(robot, Quantity(kind, frame=frame)))
    joints, frames = (robot.dof,) * (kind is Kind.HESSIAN), len(program.signature.frames)
    found = run(robot, program, q, runtime_defaults(robot)) if robot.dof else np.zeros((len(q), 0))
    return found.reshape(len(q), frames, *joints, 6, robot.dof)


@given(robots())
@settings(max_examples=12)
def test_hessian_of_any_chain_or_tree_is_the_derivative_of_the_jacobian(robot: Robot) -> None:
    q = joint_vectors(robot)
    judge = reference.Kinematics(robot, q)
    expected = np.stack([judge.hessian(tip) for tip in robot.tips], axis=1)

    np.testing.assert_allclose(kernel(robot, q, Kind.HESSIAN), expected, atol=ROUNDING, rtol=0)


@given(robots(most_rows=4))
@settings(max_examples=6)
def test_hessian_of_a_frame_is_the_derivative_of_its_jacobian(robot: Robot) -> None:
    q = joint_vectors(robot)
    for frame in (robot.frame_names[0], "station"):
        expected = reference.Kinematics(robot, q).hessian(frame)
        np.testing.assert_allclose(kernel(robot, q, Kind.HESSIAN, frame)[:, 0], expected, atol=ROUNDING, rtol=0)


def test_layout_and_formula_are_those_of_the_robotics_toolbox() -> None:
    robot = load(ROBOTS / "panda.yaml")
    q = joint_vectors(robot)[:1]
    jacobian, found = kernel(robot, q, Kind.JACOBIAN)[0, 0], kernel(robot, q, Kind.HESSIAN)[0, 0]

    # Robotics Toolbox for Python, ETS.hessian0: joint j is nearer to the base than joint i, or the same.
    expected = np.zeros((7, 6, 7))
    for j in range(7):
        for i in range(j, 7):
            expected[j, :3, i] = expected[i, :3, j] = np.cross(jacobian[3:, j], jacobian[:3, i])
            expected[j, 3:, i] = np.cross(jacobian[3:, j], jacobian[3:, i])
    np.testing.assert_allclose(found, expected, atol=1e-14)


def test_linear_rows_are_symmetric_and_a_joint_does_not_turn_axes_before_it() -> None:
    entries = np.array(derive(load(ROBOTS / "iiwa14.yaml"), Quantity(Kind.HESSIAN)).entries).reshape(7, 6, 7)

    assert (entries[:, :3] == entries[:, :3].transpose(2, 1, 0)).all()
    for by in range(7):
        assert not entries[by, 3:, : by + 1].any()


def test_a_fixed_frame_has_zeros() -> None:
    assert set(derive(load(ROBOTS / "ur5.yaml"), Quantity(Kind.HESSIAN, frame="base")).entries) == {0}


def test_a_frame_that_does_not_exist_lists_those_that_do() -> None:
    with pytest.raises(KinegenError, match=r"unknown frame 'elbw' \(expected base, base_turn, shoulder, elbow, "):
        derive(load(ROBOTS / "ur5.yaml"), Quantity(Kind.HESSIAN, frame="elbw"))
