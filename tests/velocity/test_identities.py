"""The Poisson equation dT/dt = Omega T with both signs that books print, for the reference and for generated kernels.

A frame a turns about the z axis of the fixed frame b with rate w, while its origin moves with speed v along the x axis
of b. Seen as the pose of a in b, T = Tx(v t) Rz(w t), the sign is plus and Omega holds the spatial twist; most texts on
robots mean that. Seen as the map from b to a, T = Rz(-w t) Tx(-v t), the sign is minus and Omega holds the velocity of
a relative to b in the axes of a. Both are true of one motion: the map is the inverse of the pose, and -Omega in the
axes of a is the rate of that inverse.
"""

from __future__ import annotations

from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings

from kinegen.backends.scalar_types import ScalarType
from kinegen.io.load import loads
from kinegen.model.joint_bounds import joint_box, reach
from kinegen.model.outputs import Reference, parse_quantity
from kinegen.model.robot import Robot
from kinegen.runtime.extension import load_package
from kinegen.verify import reference
from kinegen.verify.reference import Kinematics
from tests.builds.workshop import make, write_robot
from tests.chains import robots

Numbers = np.ndarray[Any, Any]

MOTION = """\
kinegen: 1
name: motion
convention: standard
units: {length: m, angle: rad}
joints:
  - {name: drive, ets: [Tx(q)]}
  - {name: turn, ets: [Rz(q)]}
"""
W, V, TIME = 0.7, 0.4, 1.3
Q, QD = np.array([V * TIME, W * TIME]), np.array([V, W])

POSE_FORM = [V, -W * V * TIME, 0, 0, 0, W]
"""Twist of the pose of a in b, linear, then angular."""

DOCUMENT_FORM = [V * np.cos(W * TIME), -V * np.sin(W * TIME), 0, 0, 0, W]
"""Twist of the map from b to a, in the axes of a."""


def omega(twist: Numbers) -> Numbers:
    """The 4x4 matrix of a twist."""
    (vx, vy, vz), (x, y, z) = np.asarray(twist)[:3], np.asarray(twist)[3:]
    return np.array([[0, -z, y, vx], [z, 0, -x, vy], [-y, x, 0, vz], [0, 0, 0, 0]])


def pose_of(q: Numbers) -> Numbers:
    """The pose of a in b, as it is printed."""
    x, turn = q
    c, s = np.cos(turn), np.sin(turn)
    return np.array([[c, -s, 0, x], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])


def rate(function: Any, q: Numbers, qd: Numbers) -> Numbers:
    """The time derivative along a motion, by central differences."""
    step = 1e-6
    return (function(q + step * qd) - function(q - step * qd)) / (2 * step)


def test_the_reference_says_what_books_print() -> None:
    motion = Kinematics(loads(MOTION, "motion.yaml"), Q[None])

    np.testing.assert_allclose(motion.pose("tool")[0], pose_of(Q), atol=1e-15)
    np.testing.assert_allclose(motion.twist("tool", QD[None], Reference.WORLD)[0], POSE_FORM, atol=1e-15)
    np.testing.assert_allclose(motion.twist("tool", QD[None], Reference.LOCAL)[0], DOCUMENT_FORM, atol=1e-15)


def test_both_signs_hold_and_only_these() -> None:
    moving, mapping = rate(pose_of, Q, QD), rate(lambda q: np.linalg.inv(pose_of(q)), Q, QD)
    T_ba, T_ab = pose_of(Q), np.linalg.inv(pose_of(Q))

    np.testing.assert_allclose(moving, omega(np.array(POSE_FORM)) @ T_ba, atol=1e-9)
    np.testing.assert_allclose(mapping, -omega(np.array(DOCUMENT_FORM)) @ T_ab, atol=1e-9)
    assert np.abs(mapping - omega(np.array(DOCUMENT_FORM)) @ T_ab).max() > 1
    assert np.abs(moving - omega(np.array(DOCUMENT_FORM)) @ T_ba).max() > 0.1


@given(robots(most_rows=5))
@settings(max_examples=25, deadline=None)
def test_poses_of_any_robot_obey_the_equation(arm: Robot) -> None:
    """dT/dt = Omega T with the spatial twist, T Omega with that of the body; minus for the inverse."""
    box = np.array(joint_box(arm)).reshape(arm.dof, 2)
    generator = np.random.default_rng(7)
    q, qd = generator.uniform(box[:, 0], box[:, 1]), generator.uniform(-1, 1, arm.dof)
    motion = Kinematics(arm, q[None])
    for index, tip in enumerate(arm.tips):
        world, local = (motion.twist(tip, qd[None], axes)[0] for axes in (Reference.WORLD, Reference.LOCAL))
        place = reference.pose(arm, q)[0, index]
        moving = rate(lambda q, index=index: reference.pose(arm, q)[0, index], q, qd)
        back = rate(lambda q, index=index: np.linalg.inv(reference.pose(arm, q)[0, index]), q, qd)
        bound = 1e-7 * max(1, reach(arm))

        np.testing.assert_allclose(moving, omega(world) @ place, atol=bound)
        np.testing.assert_allclose(moving, place @ omega(local), atol=bound)
        np.testing.assert_allclose(back, -omega(local) @ np.linalg.inv(place), atol=bound)


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    """The motion as generated kernels."""
    folder = tmp_path_factory.mktemp("motion")
    names = ("pose", "twist_world", "twist_local", "inverse_pose", "adjoint")
    quantities = tuple(parse_quantity(name) for name in names)
    path = write_robot(folder, MOTION, "motion.yaml")
    make(path, folder / "out", quantities=quantities, compile=False, reals=(ScalarType.DOUBLE,))
    return load_package(Path(folder) / "out" / "motion")


def test_kernels_say_what_books_print(package: ModuleType) -> None:
    np.testing.assert_allclose(package.fk(Q), pose_of(Q), atol=1e-15)
    np.testing.assert_allclose(package.twist_world(Q, QD), POSE_FORM, atol=1e-15)
    np.testing.assert_allclose(package.twist_local(Q, QD), DOCUMENT_FORM, atol=1e-15)


def test_kernels_obey_the_equation_with_both_signs(package: ModuleType) -> None:
    moving = rate(package.fk, Q, QD)
    mapping = rate(lambda q: package.inverse_pose(package.fk(q)), Q, QD)
    T_ba = package.fk(Q)
    T_ab = package.inverse_pose(T_ba)

    np.testing.assert_allclose(moving, omega(package.twist_world(Q, QD)) @ T_ba, atol=1e-9)
    np.testing.assert_allclose(mapping, -omega(package.twist_local(Q, QD)) @ T_ab, atol=1e-9)
    np.testing.assert_allclose(
        package.adjoint(T_ba) @ package.twist_local(Q, QD), package.twist_world(Q, QD), atol=1e-15
    )
