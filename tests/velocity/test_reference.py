"""The reference differentiates rightly: against differences in 50 digits, complex steps, and the laws of motion."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings

from kinegen.io.load import load, loads
from kinegen.model.joint_bounds import joint_box, reach
from kinegen.model.outputs import Reference
from kinegen.model.robot import Robot
from kinegen.verify import reference
from kinegen.verify.reference import Kinematics
from kinegen.verify.reference.chain import chain, values_of
from kinegen.verify.reference.number_types import FLOATS
from kinegen.verify.reference.velocity import Differences
from kinegen.verify.reference_cache import adjoint
from kinegen.verify.samples import singular_samples
from tests.chains import robots

ROBOTS = Path(__file__).resolve().parents[2] / "robots"
NAMES = ("puma560", "panda", "stanford", "screw", "thumb", "calibrated_2r", "planar_joint")
HEAD = "kinegen: 1\nname: arm\nconvention: standard\nunits: {length: m, angle: rad}\n"
ROUNDING = 1e-14

Numbers = np.ndarray[Any, Any]


def poses(arm: Robot, count: int = 3) -> Numbers:
    """Random joint vectors, and singular ones."""
    box = np.array(joint_box(arm)).reshape(arm.dof, 2)
    random = np.random.default_rng(5).uniform(box[:, 0], box[:, 1], (count, arm.dof))
    return np.concatenate([random, singular_samples(arm)[:count]])


def rates(arm: Robot, count: int, seed: int) -> Numbers:
    return np.random.default_rng(seed).uniform(-1, 1, (count, arm.dof))


@pytest.fixture(params=NAMES)
def arm(request: pytest.FixtureRequest) -> Robot:
    """Robots with all kinds of joints, rows and parameters."""
    return load(ROBOTS / f"{request.param}.yaml")


@pytest.mark.parametrize("axes", Reference)
def test_jacobians_are_differences_of_poses(arm: Robot, axes: Reference) -> None:
    """To 28 of 50 digits, at random and at singular poses."""
    q = poses(arm, 1)
    exact, differences = Kinematics(arm, q, exact=True), Differences(arm, q)
    with mpmath.workdps(reference.DIGITS):
        error = np.abs(exact.jacobian(arm.tips[0], axes) - differences.jacobian(arm.tips[0], axes)).max()

        assert error < 1e-28 * max(1.0, reach(arm))


def test_jacobians_are_complex_steps(arm: Robot) -> None:
    """The chain product at q + i h: its imaginary part over h has no rounding but that of the product."""
    q, step = poses(arm), 1e-200
    complex_numbers = replace(FLOATS, matrix=lambda rows: _stacked(rows, len(q)))
    found = Kinematics(arm, q).jacobian(arm.tips[0])
    for joint in range(arm.dof):
        moved = list((q + 1j * step * np.eye(arm.dof)[joint]).T)
        place = chain(arm, values_of(arm, moved, None, complex_numbers), complex_numbers)[arm.tips[0]]
        turning = place.imag[:, :3, :3] / step @ place.real[:, :3, :3].swapaxes(1, 2)
        expected = [*(place.imag[:, :3, 3] / step).T, turning[:, 2, 1], turning[:, 0, 2], turning[:, 1, 0]]

        np.testing.assert_allclose(found[:, :, joint], np.stack(expected, axis=1), atol=ROUNDING * max(1, reach(arm)))


def _stacked(rows: Any, count: int) -> Numbers:
    entries = [np.broadcast_to(np.asarray(entry, dtype=complex), count) for row in rows for entry in row]
    return np.stack(entries, axis=-1).reshape(count, 4, 4)


def test_both_precisions_agree(arm: Robot) -> None:
    q = poses(arm, 1)
    qd, qdd = rates(arm, len(q), 1), rates(arm, len(q), 2)
    floats, exact = Kinematics(arm, q), Kinematics(arm, q, exact=True)
    scale = ROUNDING * max(1, reach(arm)) * 4 * arm.dof
    for axes in Reference:
        for name, inputs in (("jacobian", ()), ("hessian", ()), ("twist", (qd,)), ("acceleration", (qd, qdd))):
            one, other = (getattr(each, name)(arm.tips[0], *inputs, reference=axes) for each in (floats, exact))

            np.testing.assert_allclose(one, other.astype(float), rtol=0, atol=scale)


def test_hessians_are_differences_of_jacobians(arm: Robot) -> None:
    """[k, :, j] is column j, differentiated by joint k."""
    q, step = poses(arm), 1e-6
    found = Kinematics(arm, q).hessian(arm.tips[0])
    for joint in range(arm.dof):
        move = step * np.eye(arm.dof)[joint]
        ahead, behind = (Kinematics(arm, q + sign * move).jacobian(arm.tips[0]) for sign in (1, -1))

        np.testing.assert_allclose(found[:, joint], (ahead - behind) / (2 * step), atol=1e-8 * max(1, reach(arm)))


@given(robots(most_rows=5))
@settings(max_examples=25, deadline=None)
def test_velocities_obey_their_laws(arm: Robot) -> None:
    """Twist J qd, acceleration J qdd + Jdot qd, axes changed by the adjoint; of any robot, in any axes."""
    q = poses(arm, 2) if arm.dof else np.zeros((1, 0))
    qd, qdd = rates(arm, len(q), 1), rates(arm, len(q), 2)
    motion = Kinematics(arm, q)
    scale = ROUNDING * max(1, reach(arm)) * 100
    for tip in arm.tips:
        for axes in Reference:
            jacobian, hessian = motion.jacobian(tip, axes), motion.hessian(tip, axes)
            bias = np.einsum("nkij,nj,nk->ni", hessian, qd, qd)
            expected = np.einsum("nij,nj->ni", jacobian, qdd) + bias

            np.testing.assert_allclose(motion.twist(tip, qd, axes), np.einsum("nij,nj->ni", jacobian, qd), atol=scale)
            np.testing.assert_allclose(motion.bias_acceleration(tip, qd, axes), bias, atol=scale)
            np.testing.assert_allclose(motion.acceleration(tip, qd, qdd, axes), expected, atol=scale)
        world = adjoint(motion.pose(tip)) @ motion.jacobian(tip, Reference.LOCAL)

        np.testing.assert_allclose(motion.jacobian(tip, Reference.WORLD), world, atol=scale)


def test_parameter_jacobians_are_differences_of_poses() -> None:
    arm = load(ROBOTS / "calibrated_2r.yaml")
    names = [parameter.name for parameter in arm.parameters]
    values = {"L1": 0.5, "L2": 0.4, "tilt": 0.01, "skew": -0.02, "zero_2": 0.3}
    found = Kinematics(arm, [[0.3, 0.4]], values).parameter_jacobian("tool", names)[0]
    place = reference.pose(arm, [0.3, 0.4], values)[0, 0]
    for column, name in enumerate(names):
        ahead, behind = (
            reference.pose(arm, [0.3, 0.4], values | {name: values[name] + h})[0, 0] for h in (1e-6, -1e-6)
        )
        moving = (ahead - behind) / 2e-6
        turning = moving[:3, :3] @ place[:3, :3].T
        expected = [*moving[:3, 3], turning[2, 1], turning[0, 2], turning[1, 0]]

        np.testing.assert_allclose(found[:, column], expected, atol=1e-9)


def test_powers_quotients_and_roots_of_parameters_are_differentiated() -> None:
    text = HEAD + "parameters: {L: 2, M: 3}\njoints:\n  - {name: j, theta: q, d: L**3/M, a: sqrt(L*M), alpha: 0}\n"
    found = Kinematics(loads(text, "x"), [[0.0]]).parameter_jacobian("tool", ["L", "M"])[0, :3]

    np.testing.assert_allclose(found, [[3 / (2 * 6**0.5), 2 / (2 * 6**0.5)], [0, 0], [12 / 3, -8 / 9]], atol=ROUNDING)


def test_rows_are_linear_then_angular_in_the_axes_that_are_asked_for() -> None:
    """A crank of length 2 that has turned by a quarter: the tip moves along -x of the base, y of its own frame."""
    crank = loads(HEAD + "joints:\n  - {name: j, theta: q, d: 5, a: 2, alpha: 0}\n", "x")
    motion = Kinematics(crank, [[np.pi / 2]])
    columns = {axes: motion.jacobian("tool", axes)[0, :, 0] for axes in Reference}

    np.testing.assert_allclose(columns[Reference.LOCAL_WORLD_ALIGNED], [-2, 0, 0, 0, 0, 1], atol=ROUNDING)
    np.testing.assert_allclose(columns[Reference.LOCAL], [0, 2, 0, 0, 0, 1], atol=ROUNDING)
    np.testing.assert_allclose(columns[Reference.WORLD], [0, 0, 0, 0, 0, 1], atol=ROUNDING)


def test_followers_and_screws_add_to_the_columns_of_their_joints() -> None:
    first, second = "name: j, theta: q, d: 0.1*q, a: 1, alpha: 0", "name: k, theta: 0.5*j, d: 0, a: 1, alpha: 0"
    arm = loads(HEAD + f"joints:\n  - {{{first}}}\n  - {{{second}}}\n", "x")
    found = Kinematics(arm, [[0.0]]).jacobian("tool")[0]

    np.testing.assert_allclose(found, np.array([[0, 2 + 0.5, 0.1, 0, 0, 1.5]]).T, atol=ROUNDING)


def test_a_fixed_frame_has_zero_columns() -> None:
    arm = load(ROBOTS / "puma560.yaml")

    assert not Kinematics(arm, np.ones((2, 6))).jacobian("base").any()
    assert Kinematics(arm, np.ones((2, 6))).jacobian("base").shape == (2, 6, 6)


def test_the_centripetal_acceleration_points_inwards() -> None:
    crank = loads(HEAD + "joints:\n  - {name: j, theta: q, d: 0, a: 2, alpha: 0}\n", "x")
    motion = Kinematics(crank, [[0.0]])

    np.testing.assert_allclose(motion.bias_acceleration("tool", [[3.0]]), [[-18, 0, 0, 0, 0, 0]], atol=ROUNDING)
    np.testing.assert_allclose(motion.acceleration("tool", [[3.0]], [[1.0]]), [[-18, 2, 0, 0, 0, 1]], atol=ROUNDING)
