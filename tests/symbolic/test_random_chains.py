"""Random chains: what comes out of the symbolic stage and lowering is what the reference says."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings

from kinegen.derive.dispatch import derive
from kinegen.ir.lower import lower
from kinegen.model.outputs import Quantity
from kinegen.model.robot import Robot
from kinegen.verify import reference
from tests.chains import exact_defaults, robots
from tests.evaluation import as_poses, run

POSES = 8
ROUNDING = 2e-13  # six links of about a metre, angles of a few radians, twenty operations each


def joint_vectors(robot: Robot) -> np.ndarray:
    return np.random.default_rng(7).uniform(-4, 4, (POSES, robot.dof))


@pytest.mark.parametrize("examples", [30, pytest.param(100, marks=pytest.mark.long)])
def test_pose_of_any_chain_or_tree_equals_the_reference(examples: int) -> None:
    """The search for the shortest form takes seconds for angles that are no multiples of 30 or 45 degrees."""
    settings(max_examples=examples, deadline=None)(given(robots())(require_pose))()


def require_pose(robot: Robot) -> None:
    q = joint_vectors(robot)
    program = lower(derive(robot, Quantity.POSE))
    found = as_poses(run(robot, program, q, exact_defaults(robot)), len(robot.tips))

    np.testing.assert_allclose(found, reference.pose(robot, q)[:, :, :3], atol=ROUNDING, rtol=0)


@given(robots())
@settings(max_examples=60, deadline=None)
def test_frames_of_any_chain_or_tree_equal_the_reference(robot: Robot) -> None:
    q = joint_vectors(robot)
    program = lower(derive(robot, Quantity.FRAMES))
    found = as_poses(run(robot, program, q, exact_defaults(robot)), len(robot.frame_names))
    known = reference.frames(robot, q)

    for index, frame in enumerate(robot.frame_names):
        np.testing.assert_allclose(found[:, index], known[frame][:, :3], atol=ROUNDING, rtol=0, err_msg=frame)


@given(robots())
@settings(max_examples=40, deadline=None)
def test_position_is_the_last_column_of_the_pose(robot: Robot) -> None:
    q = joint_vectors(robot)
    program = lower(derive(robot, Quantity.POSITION))
    found = run(robot, program, q, exact_defaults(robot)).reshape(POSES, len(robot.tips), 3)

    np.testing.assert_allclose(found, reference.pose(robot, q)[:, :, :3, 3], atol=ROUNDING, rtol=0)
