"""Orientation outputs of any robot, as kernels compute them, against the reference."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given, settings

from kinegen.derive.dispatch import derive
from kinegen.derive.orientation import FORMS, JACOBIANS
from kinegen.io.load import load
from kinegen.ir.lower import lower
from kinegen.ir.program import count
from kinegen.model.outputs import Kind, Quantity
from kinegen.model.robot import Robot
from kinegen.verify.reference import Kinematics, Orientation, pose
from kinegen.verify.reference import rotations as rotations_of
from tests.chains import exact_defaults, robots
from tests.evaluation import run

POSES = 8
ROUNDING = 2e-13

FORM_OF = {jacobian: form for jacobian in JACOBIANS for form in FORMS if jacobian.value == f"{form.value}_jacobian"}


def joint_vectors(robot: Robot) -> np.ndarray:
    """Random ones, and two at which robots are often singular."""
    random = np.random.default_rng(11).uniform(-4, 4, (POSES - 2, robot.dof))
    return np.vstack([random, np.zeros((1, robot.dof)), np.full((1, robot.dof), np.pi / 2)])


@pytest.mark.parametrize("form", FORMS)
@given(robot=robots(most_rows=3))
@settings(max_examples=5)
def test_coordinates_of_every_tip_are_its_rotation(form: Kind, robot: Robot) -> None:
    q = joint_vectors(robot)
    entries = run(robot, lower(derive(robot, Quantity(form))), q, exact_defaults(robot))
    found = entries.reshape(len(q) * len(robot.tips), -1)
    known = pose(robot, q)[..., :3, :3].reshape(-1, 3, 3)

    np.testing.assert_allclose(rotations_of(form, found), known, atol=ROUNDING)


@pytest.mark.parametrize("kind", JACOBIANS)
@given(robot=robots(most_rows=3))
@settings(max_examples=5)
def test_jacobians_of_coordinates_are_those_of_the_reference(kind: Kind, robot: Robot) -> None:
    assume(robot.dof)
    q = joint_vectors(robot)
    entries = run(robot, lower(derive(robot, Quantity(kind))), q, exact_defaults(robot))
    found = entries.reshape(len(q), len(robot.tips), -1, robot.dof)
    judge, form = Kinematics(robot, q), FORM_OF[kind]

    assert np.all(np.isfinite(found))
    for index, tip in enumerate(robot.tips):
        orientation = Orientation(judge.pose(tip)[:, :3, :3])
        expected = orientation.jacobian(form, judge.jacobian(tip)[:, 3:])
        margin = np.abs(orientation.margin(form)).astype(float)
        far = margin > 1e-3
        room = ROUNDING / margin[far, None, None] ** 2
        assert np.all(np.abs(found[far, index] - expected[far]) <= room)


def test_a_wrist_is_its_own_euler_angles() -> None:
    """The three joints of a spherical wrist are the zyz angles of its last frame, wherever the second is positive."""
    wrist = load("robots/spherical_wrist.yaml")
    q = np.random.default_rng(3).uniform([-3, 0.01, -3], [3, 3.1, 3], (POSES, 3))
    found = run(wrist, lower(derive(wrist, Quantity(Kind.EULER_ZYZ))), q)

    np.testing.assert_allclose(found, q, atol=1e-13)
    jacobian = run(wrist, lower(derive(wrist, Quantity(Kind.EULER_ZYZ_JACOBIAN))), q)
    np.testing.assert_allclose(jacobian.reshape(-1, 3, 3), np.broadcast_to(np.eye(3), (POSES, 3, 3)), atol=1e-12)


def test_shifts_cost_nothing() -> None:
    """A tool and an arm's lengths turn nothing: the quaternion of a PUMA 560 takes six angles and no length."""
    found = count(lower(derive(load("robots/puma560.yaml"), Quantity(Kind.QUATERNION_WXYZ))))

    assert found.sine_cosines == 5
    assert (found.divisions, found.roots, found.arc_tangents) == (1, 1, 0)


def test_a_robot_that_only_shifts_has_no_rotation() -> None:
    robot = load("robots/cartesian.yaml")
    program = lower(derive(robot, Quantity(Kind.QUATERNION_WXYZ)))

    assert program.statements == ()
