"""What people do with a pose: turn it round, move a point with it, move a twist with it.

These kernels take a pose as input, not a joint vector, and hold for any two frames a and b.
"""

from __future__ import annotations

import sympy as sp

from kinegen.outputs import Array, Kind, Quantity, Signature
from kinegen.robot.model import Robot
from kinegen.symbolic.coordinates import dot
from kinegen.symbolic.expressions import Expressions, Tape
from kinegen.symbolic.fold import NULL, Vector
from kinegen.symbolic.route import cross

POSE = Array("a_T_b", (4, 4), is_pose=True)
"""The pose of a frame b in a frame a."""

SIGNATURES: dict[Kind, tuple[tuple[Array, ...], Array]] = {
    Kind.INVERSE_POSE: ((POSE,), Array("b_T_a", (4, 4), is_pose=True)),
    Kind.TRANSFORM_POINT: ((POSE, Array("b_p", (3,))), Array("a_p", (3,))),
    Kind.ADJOINT: ((POSE,), Array("adjoint", (6, 6))),
}
"""Inputs and result of each; `b_p` is a point in the axes of b, from its origin."""


def derive_se3(robot: Robot, quantity: Quantity) -> Expressions:
    """The inverse of a pose, a point moved by it, or its adjoint.

    With `R` the rotation and `p` the position of `a_T_b`:

    - `inverse_pose`: `b_T_a`, which is `[R^T, -R^T p]`; never found by elimination;
    - `transform_point`: `a_p = R b_p + p`;
    - `adjoint`: the 6x6 matrix `[[R, [p]x R], [0, R]]`, which takes a twist (linear, then angular) of a body from the
      axes and the origin of b to those of a (Murray, Li and Sastry 1994, eq. 2.58).

    Args:
        robot: The robot, for whose kernels these stand; nothing of it goes in.
        quantity: Which of them.

    Returns:
        Expressions in the twelve upper entries of the pose and the three of the point.
    """
    rows = tuple(_symbols(f"r{row}") for row in "123")
    position = _symbols("p")
    pose = [entry for row, place in zip(rows, position, strict=True) for entry in (*row, place)]
    columns = tuple(zip(*rows, strict=True))
    tape = Tape()
    match quantity.kind:
        case Kind.INVERSE_POSE:
            entries = [entry for column in columns for entry in (*column, -dot(column, position))]
        case Kind.TRANSFORM_POINT:
            point = _symbols("b")
            pose += point
            entries = [dot(row, point) + place for row, place in zip(rows, position, strict=True)]
        case _:
            moments = zip(*(tape.vector(cross(position, column)) for column in columns), strict=True)
            upper = [(*row, *moment) for row, moment in zip(rows, moments, strict=True)]
            lower = [(*NULL, *row) for row in rows]
            entries = [entry for row in (*upper, *lower) for entry in row]
    inputs, result = SIGNATURES[quantity.kind]
    return Expressions(
        signature=Signature(quantity, (), robot.dof, inputs, (result,)),
        variables=tuple(pose),
        parameters=(),
        definitions=tuple(tape.definitions),
        entries=tuple(entries),
    )


def _symbols(name: str) -> Vector:
    return sp.Dummy(f"{name}x", real=True), sp.Dummy(f"{name}y", real=True), sp.Dummy(f"{name}z", real=True)
