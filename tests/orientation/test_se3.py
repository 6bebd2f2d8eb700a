"""What is done with a pose: inverse, points, twists; and the rate of a pose, with both signs that books print."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.python.formula import emit_formula
from kinegen.derive.frame_poses import SIGNATURES, derive_se3
from kinegen.io.load import loads
from kinegen.ir.lower import lower
from kinegen.ir.program import count
from kinegen.model.outputs import Kind, Quantity
from tests.orientation.rotations import Floats, rotations, ry, rz, skew

ANY = loads(
    """
kinegen: 1
name: any
convention: standard
units: {length: m, angle: rad}
joints:
  - {name: hip, ets: [Rz(q)]}
""",
    "any.yaml",
)
points = st.tuples(*[st.floats(-3, 3)] * 3).map(np.array)


def pose(R: Floats, p: Floats) -> Floats:
    return np.block([[R, np.reshape(p, (3, 1))], [np.zeros((1, 3)), np.ones((1, 1))]])


def evaluate(kind: Kind, T: Floats, *more: Floats) -> Floats:
    """Runs a kernel through its printed NumPy form; a pose comes back without its last row."""
    rows = formula(kind)(T[:3].reshape(12, 1), *(each.reshape(-1, 1) for each in more))
    numbers = np.array([np.ravel(row)[0] for row in rows], float)
    return numbers.reshape(-1, SIGNATURES[kind][1].shape[-1]) if kind is not Kind.TRANSFORM_POINT else numbers


@cache
def formula(kind: Kind) -> Callable[..., tuple[Any, ...]]:
    program = lower(derive_se3(ANY, Quantity(kind)))
    namespace: dict[str, Any] = {}
    exec(emit_formula(RobotPrograms(ANY, (program,), ()))["_numpy.py"], namespace)  # noqa: S102 - our own output
    return namespace[kind.value]


def adjoint(T: Floats) -> Floats:
    R, p = T[:3, :3], T[:3, 3]
    return np.block([[R, skew(p) @ R], [np.zeros((3, 3)), R]])


@given(rotations, points)
@settings(max_examples=50)
def test_inverse_pose_undoes_a_pose(R: Floats, p: Floats) -> None:
    T = pose(R, p)
    inverse = evaluate(Kind.INVERSE_POSE, T)

    np.testing.assert_allclose(T @ np.vstack([inverse, [0, 0, 0, 1]]), np.eye(4), atol=1e-14)


@given(rotations, points, points)
@settings(max_examples=50)
def test_a_point_moves_with_the_pose(R: Floats, p: Floats, point: Floats) -> None:
    np.testing.assert_allclose(evaluate(Kind.TRANSFORM_POINT, pose(R, p), point), R @ point + p, atol=1e-14)


@given(rotations, points)
@settings(max_examples=50)
def test_adjoint_has_the_velocity_first(R: Floats, p: Floats) -> None:
    np.testing.assert_allclose(evaluate(Kind.ADJOINT, pose(R, p)), adjoint(pose(R, p)), atol=1e-14)


def test_no_multiplication_is_wasted() -> None:
    operations = {kind: count(lower(derive_se3(ANY, Quantity(kind)))) for kind in (Kind.INVERSE_POSE, Kind.ADJOINT)}

    assert (operations[Kind.INVERSE_POSE].multiplications, operations[Kind.INVERSE_POSE].additions) == (9, 6)
    assert (operations[Kind.ADJOINT].multiplications, operations[Kind.ADJOINT].additions) == (18, 9)


# In print: a turn of a point, a composed reference frame, and an object moved by another frame.
def test_printed_examples() -> None:
    turn = pose(rz(np.pi / 2), np.zeros(3))
    frame = pose(np.eye(3), np.array([4, -3, 7])) @ pose(ry(np.pi / 2) @ rz(np.pi / 2), np.zeros(3))

    np.testing.assert_allclose(evaluate(Kind.TRANSFORM_POINT, turn, np.array([7.0, 3, 0])), [-3, 7, 0], atol=1e-14)
    np.testing.assert_allclose(frame, [[0, 0, 1, 4], [1, 0, 0, -3], [0, 1, 0, 7], [0, 0, 0, 1]], atol=1e-14)
    back = evaluate(Kind.INVERSE_POSE, frame)
    np.testing.assert_allclose(back, [[0, 1, 0, 3], [0, 0, 1, -7], [1, 0, 0, -4]], atol=1e-14)


# The Poisson equation -------------------------------------------------------------------------------------------------

T, W, V = sp.symbols("t w v", real=True)


def turn_z(angle: sp.Expr) -> sp.Matrix:
    c, s = sp.cos(angle), sp.sin(angle)
    return sp.Matrix([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])


def shift_x(length: sp.Expr) -> sp.Matrix:
    moved = sp.eye(4)
    moved[0, 3] = length
    return moved


def twist_matrix(omega: list[sp.Expr], velocity: list[sp.Expr]) -> sp.Matrix:
    x, y, z = omega
    return sp.Matrix([[0, -z, y, velocity[0]], [z, 0, -x, velocity[1]], [-y, x, 0, velocity[2]], [0, 0, 0, 0]])


def residue(pose_of_time: sp.Matrix, sign: int, omega: list[sp.Expr], velocity: list[sp.Expr]) -> sp.Matrix:
    """What is left of dT/dt = sign Omega T."""
    return (pose_of_time.diff(T) - sign * twist_matrix(omega, velocity) * pose_of_time).applyfunc(sp.simplify)


def test_poisson_equation_of_the_pose_of_a_moving_frame_has_a_plus() -> None:
    """The pose of a in the fixed frame b: dT/dt = Omega T with the spatial twist, as most texts have it."""
    moving = shift_x(V * T) * turn_z(W * T)

    assert residue(moving, 1, [0, 0, W], [V, -W * V * T, 0]) == sp.zeros(4)


def test_poisson_equation_of_the_map_into_a_moving_frame_has_a_minus() -> None:
    """The same motion as the map from b to a: dT/dt = -Omega T, with the velocity of a relative to b in axes of a."""
    mapping = turn_z(-W * T) * shift_x(-V * T)
    omega, velocity = [0, 0, W], [V * sp.cos(W * T), -V * sp.sin(W * T), 0]

    assert residue(mapping, -1, omega, velocity) == sp.zeros(4)
    assert residue(mapping, 1, omega, velocity) != sp.zeros(4)


def test_the_two_forms_name_the_same_motion() -> None:
    """Map and pose are inverse, and the two twists are one twist in the axes of b and of a."""
    moving, mapping = shift_x(V * T) * turn_z(W * T), turn_z(-W * T) * shift_x(-V * T)
    spatial, body = [V, -W * V * T, 0], [V * sp.cos(W * T), -V * sp.sin(W * T), 0]
    carried = mapping * twist_matrix([0, 0, W], spatial) * moving

    assert (moving * mapping).applyfunc(sp.simplify) == sp.eye(4)
    assert (carried - twist_matrix([0, 0, W], body)).applyfunc(sp.simplify) == sp.zeros(4)


@given(rotations, points, points, points)
@settings(max_examples=50)
def test_adjoint_moves_twists_between_frames(R: Floats, p: Floats, velocity: Floats, omega: Floats) -> None:
    """Omega_a = T Omega_b T^-1, written with the adjoint."""
    T_ab = pose(R, p)
    matrix = np.zeros((4, 4))
    matrix[:3, :3], matrix[:3, 3] = skew(omega), velocity
    moved = T_ab @ matrix @ np.linalg.inv(T_ab)
    twist = evaluate(Kind.ADJOINT, T_ab) @ np.concatenate([velocity, omega])

    np.testing.assert_allclose(moved[:3, 3], twist[:3], atol=1e-12)
    np.testing.assert_allclose(moved[:3, :3], skew(twist[3:]), atol=1e-12)
