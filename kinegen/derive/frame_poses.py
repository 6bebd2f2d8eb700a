"""Poses of many frames at once, and what people do with a pose: invert it, move a point or a twist with it.

Poses are evaluated from the base outwards, so that frames share what is before them. The kernels that take a pose as
input, not a joint vector, hold for any two frames a and b.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import field

import sympy as sp

from kinegen.derive.chain_forms import forms
from kinegen.derive.expressions import (
    Candidate,
    Definition,
    Expressions,
    LetBindings,
    by_joints,
    chains_of,
    pose_array,
)
from kinegen.derive.folding import (
    NULL,
    UNITS,
    Columns,
    OffsetSegment,
    Vector,
    cosine_sine,
    cross,
    dot,
    fold_prefixes,
    total,
)
from kinegen.derive.transforms import Elementary, Turn, symbols
from kinegen.model.outputs import Array, Kind, Quantity, Signature
from kinegen.model.robot import Robot
from kinegen.support.dataclass import dataclass


@dataclass(slots=True)
class _Outwards:
    """Rotations by folded turns, and positions by legs, each computed once."""

    bindings: LetBindings = field(default_factory=LetBindings)
    _rotations: dict[tuple[Turn, ...], Columns] = field(default_factory=dict)
    _positions: dict[tuple[OffsetSegment, ...], Vector] = field(default_factory=dict)

    def rotation(self, turns: tuple[Turn, ...]) -> Columns:
        if not turns:
            return UNITS
        if turns not in self._rotations:
            before = self.rotation(turns[:-1])
            turned = [self.bindings.vector(_turn_row(turns[-1], row)) for row in before]
            self._rotations[turns] = (turned[0], turned[1], turned[2])
        return self._rotations[turns]

    def position(self, legs: tuple[OffsetSegment, ...]) -> Vector:
        if not legs:
            return NULL
        if legs not in self._positions:
            rows = self.rotation(legs[-1].turns)
            x, y, z = (dot(row, legs[-1].shift) for row in rows)
            self._positions[legs] = self.bindings.vector(total(self.position(legs[:-1]), (x, y, z)))
        return self._positions[legs]


def _turn_row(turn: Turn, row: Vector) -> Vector:
    cosine, sine = cosine_sine(turn.angle)
    i, j = (turn.axis + 1) % 3, (turn.axis + 2) % 3
    turned = list(row)
    turned[i] = cosine * row[i] + sine * row[j]
    turned[j] = cosine * row[j] - sine * row[i]
    return turned[0], turned[1], turned[2]


def forward_poses(chains: Iterable[Sequence[Elementary]]) -> tuple[tuple[Definition, ...], tuple[sp.Expr, ...]]:
    """Return the poses of the ends of some chains.

    Returns definitions, and twelve entries for each end: the upper three rows of its pose, row by row.
    """
    outwards = _Outwards()
    entries: list[sp.Expr] = []
    for steps in chains:
        trail = fold_prefixes(steps)
        rows = outwards.rotation(trail.turns)
        position = outwards.position(trail.legs)
        for row, place in zip(rows, position, strict=True):
            entries += [sign * row[axis] for axis, sign in trail.attitude]
            entries.append(place)
    return tuple(outwards.bindings.definitions), tuple(entries)


def derive_frames(robot: Robot) -> Expressions:
    """Return the pose of every link, the tool and every named frame in the base frame.

    Returns twelve entries for each frame of `robot.frame_names`.
    """
    values = symbols(robot, keep_parameters=False)
    quantity = Quantity.FRAMES
    ways = (
        Candidate("", *forward_poses(form), number)
        for number, form in enumerate(forms(chains_of(robot, quantity, values)))
    )
    return by_joints(robot, quantity, values, ways, pose_array(robot, quantity))


POSE = Array("a_T_b", (4, 4), is_pose=True)
"""The pose of a frame b in a frame a."""

SIGNATURES: dict[Kind, tuple[tuple[Array, ...], Array]] = {
    Kind.INVERSE_POSE: ((POSE,), Array("b_T_a", (4, 4), is_pose=True)),
    Kind.TRANSFORM_POINT: ((POSE, Array("b_p", (3,))), Array("a_p", (3,))),
    Kind.ADJOINT: ((POSE,), Array("adjoint", (6, 6))),
}
"""Inputs and result of each; `b_p` is a point in the axes of b, from its origin."""


def derive_se3(robot: Robot, quantity: Quantity) -> Expressions:
    """Derive the inverse of a pose, a point moved by it, or its adjoint; of the robot nothing goes in.

    With `R` the rotation and `p` the position of `a_T_b`:

    - `inverse_pose`: `b_T_a`, which is `[R^T, -R^T p]`; never found by elimination;
    - `transform_point`: `a_p = R b_p + p`;
    - `adjoint`: the 6x6 matrix `[[R, [p]x R], [0, R]]`, which takes a twist (linear, then angular) of a body from the
      axes and the origin of b to those of a (Murray, Li and Sastry 1994, eq. 2.58).

    Returns expressions in the twelve upper entries of the pose and the three of the point.
    """
    # The twelve entries of the pose are the inputs.
    rows = tuple(_symbols(f"r{row}") for row in "123")
    position = _symbols("p")
    pose = [entry for row, place in zip(rows, position, strict=True) for entry in (*row, place)]
    columns = tuple(zip(*rows, strict=True))
    bindings = LetBindings()
    match quantity.kind:
        case Kind.INVERSE_POSE:
            entries = [entry for column in columns for entry in (*column, -dot(column, position))]
        case Kind.TRANSFORM_POINT:
            point = _symbols("b")
            pose += point
            entries = [dot(row, point) + place for row, place in zip(rows, position, strict=True)]
        case _:
            moments = zip(*(bindings.vector(cross(position, column)) for column in columns), strict=True)
            upper = [(*row, *moment) for row, moment in zip(rows, moments, strict=True)]
            lower = [(*NULL, *row) for row in rows]
            entries = [entry for row in (*upper, *lower) for entry in row]
    inputs, result = SIGNATURES[quantity.kind]
    return Expressions(
        signature=Signature(quantity, (), robot.dof, inputs, (result,)),
        variables=tuple(pose),
        parameters=(),
        ways=(bindings.way(entries),),
    )


def _symbols(name: str) -> Vector:
    return sp.Dummy(f"{name}x", real=True), sp.Dummy(f"{name}y", real=True), sp.Dummy(f"{name}z", real=True)
