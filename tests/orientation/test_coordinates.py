"""Coordinates of every rotation, singular ones too: they give the rotation back, and keep to their ranges."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings

from kinegen.derive.orientation import FORMS
from kinegen.model.outputs import Kind
from tests.orientation.rotations import (
    ANGLES,
    Floats,
    about,
    coordinates,
    of_quaternion,
    quarter_turns,
    rates,
    rotations,
    rx,
    ry,
    rz,
    skew,
    velocities,
)

ROUNDING = 4e-15
FLIPPED = np.diag([1.0, -1.0, -1.0])
three_angles = pytest.mark.parametrize("kind", ANGLES)


@given(rotations)
@example(np.eye(3))
@example(FLIPPED)
@settings(max_examples=120)
def test_quaternion_gives_the_rotation_back(R: Floats) -> None:
    q = coordinates(Kind.QUATERNION_WXYZ, R)

    np.testing.assert_allclose(of_quaternion(q), R, atol=ROUNDING)
    assert abs(q @ q - 1) < ROUNDING
    assert q[0] >= 0
    if q[0] == 0:
        assert q[np.flatnonzero(q)[0]] > 0
    np.testing.assert_array_equal(coordinates(Kind.QUATERNION_XYZW, R), q[[1, 2, 3, 0]])


@given(rotations)
@settings(max_examples=120)
def test_rotation_vector_gives_the_rotation_back(R: Floats) -> None:
    v = coordinates(Kind.AXIS_ANGLE, R)
    angle = np.linalg.norm(v)

    np.testing.assert_allclose(about(v, angle) if angle > 1e-150 else np.eye(3), R, atol=ROUNDING)
    assert angle <= np.pi * (1 + 1e-15)


def test_rotation_vector_of_no_rotation_is_zero() -> None:
    assert coordinates(Kind.AXIS_ANGLE, np.eye(3)).tolist() == [0, 0, 0]


@three_angles
@given(R=rotations)
@settings(max_examples=120)
def test_three_angles_give_the_rotation_back_everywhere(kind: Kind, R: Floats) -> None:
    angles = coordinates(kind, R)
    low, high = (0, np.pi) if kind is Kind.EULER_ZYZ else (-np.pi / 2, np.pi / 2)

    np.testing.assert_allclose(ANGLES[kind](angles), R, atol=ROUNDING)
    assert low <= angles[1] <= high
    assert np.all(np.abs(angles) <= np.pi)


@three_angles
@given(R=quarter_turns())
@settings(max_examples=60)
def test_at_a_singularity_the_last_angle_is_zero(kind: Kind, R: Floats) -> None:
    last, length = {
        Kind.RPY_ZYX: (0, R[2, 1:]),
        Kind.RPY_XYZ: (2, R[0, :2]),
        Kind.EULER_ZYZ: (2, R[2, :2]),
    }[kind]

    if not np.any(length):
        assert coordinates(kind, R)[last] == 0


# What angles a turn of 0.3 shows where the middle angle is singular: the first factor of the product takes it all.
SINGULAR = (
    (Kind.RPY_ZYX, ry(np.pi / 2).round() @ rx(0.3), (0, np.pi / 2, -0.3)),
    (Kind.RPY_ZYX, ry(-np.pi / 2).round() @ rx(0.3), (0, -np.pi / 2, 0.3)),
    (Kind.RPY_XYZ, ry(np.pi / 2).round() @ rz(0.3), (0.3, np.pi / 2, 0)),
    (Kind.RPY_XYZ, ry(-np.pi / 2).round() @ rz(0.3), (-0.3, -np.pi / 2, 0)),
    (Kind.EULER_ZYZ, rz(0.3), (0.3, 0, 0)),
    (Kind.EULER_ZYZ, ry(np.pi).round() @ rz(0.3), (-0.3, np.pi, 0)),
)


@pytest.mark.parametrize(("kind", "R", "angles"), SINGULAR)
def test_at_a_singularity_the_first_angle_takes_the_whole_turn(kind: Kind, R: Floats, angles: list[float]) -> None:
    np.testing.assert_allclose(coordinates(kind, R), angles, atol=1e-15)


# Rates ----------------------------------------------------------------------------------------------------------------


def velocity(kind: Kind, values: Floats, speeds: Floats) -> Floats:
    """The angular velocity in the axes of the base that coordinates and their rates mean, from the definitions."""
    x, y, z = np.eye(3)
    match kind:
        case Kind.RPY_ZYX:
            yaw, pitch = rz(values[2]), ry(values[1])
            return z * speeds[2] + yaw @ y * speeds[1] + yaw @ pitch @ x * speeds[0]
        case Kind.RPY_XYZ:
            roll, pitch = rx(values[0]), ry(values[1])
            return x * speeds[0] + roll @ y * speeds[1] + roll @ pitch @ z * speeds[2]
        case Kind.EULER_ZYZ:
            phi, theta = rz(values[0]), ry(values[1])
            return z * speeds[0] + phi @ y * speeds[1] + phi @ theta @ z * speeds[2]
        case Kind.AXIS_ANGLE:
            angle = np.linalg.norm(values)
            if angle < 1e-5:
                return speeds + np.cross(values, speeds) / 2
            turn, versed = 2 * (np.sin(angle / 2) / angle) ** 2, (angle - np.sin(angle)) / angle**3
            return speeds + turn * skew(values) @ speeds + versed * skew(values) @ skew(values) @ speeds
        case Kind.QUATERNION_XYZW:
            return velocity(Kind.QUATERNION_WXYZ, values[[3, 0, 1, 2]], speeds[[3, 0, 1, 2]])
    (w, v), (dw, dv) = (values[0], values[1:]), (speeds[0], speeds[1:])
    return 2 * (w * dv - dw * v + np.cross(v, dv))


def distance(kind: Kind, R: Floats) -> float:
    """How far from its singularity a rotation is: 0 there, at most 1."""
    entries = {Kind.RPY_ZYX: R[2, 1:], Kind.RPY_XYZ: R[0, :2], Kind.EULER_ZYZ: R[2, :2]}
    return float(np.hypot(*entries[kind])) if kind in entries else 1.0


@pytest.mark.parametrize("kind", FORMS)
@given(R=rotations, omega=velocities)
@settings(max_examples=80)
def test_rates_mean_the_angular_velocity(kind: Kind, R: Floats, omega: Floats) -> None:
    values, speeds = coordinates(kind, R), rates(kind, R, omega)
    near = distance(kind, R)

    assert np.all(np.isfinite(speeds))
    if near > 1e-12:
        np.testing.assert_allclose(velocity(kind, values, speeds), omega, atol=2e-14 / near)


@three_angles
@given(R=quarter_turns(), omega=velocities)
@settings(max_examples=60)
def test_at_a_singularity_only_what_three_angles_cannot_show_is_left_out(kind: Kind, R: Floats, omega: Floats) -> None:
    if distance(kind, R) == 0:
        values, speeds = coordinates(kind, R), rates(kind, R, omega)
        first, middle = velocity(kind, values, np.eye(3)[1]), velocity(kind, values, np.eye(3)[_first(kind)])
        lost = np.cross(first, middle)

        np.testing.assert_allclose(velocity(kind, values, speeds), omega - (omega @ lost) * lost, atol=1e-14)


def _first(kind: Kind) -> int:
    """Where the angle of the first turn of the product stands."""
    return 2 if kind is Kind.RPY_ZYX else 0


def test_unit_quaternions_stay_unit_quaternions() -> None:
    R, omega = about(np.array([1.0, 2.0, -0.5]), 1.9), np.array([0.3, -1.0, 0.7])

    assert abs(coordinates(Kind.QUATERNION_WXYZ, R) @ rates(Kind.QUATERNION_WXYZ, R, omega)) < 1e-16
