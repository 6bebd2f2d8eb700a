"""Poses of many frames at once, evaluated from the base outwards so that frames share what lies before them."""

from __future__ import annotations

from dataclasses import dataclass, field

import sympy as sp

from kinegen.outputs import Quantity
from kinegen.robot.model import Robot
from kinegen.symbolic.chain import transforms_between
from kinegen.symbolic.expressions import Definition, Expressions, Tape
from kinegen.symbolic.fold import NULL, Leg, Vector, cosine_sine, total, trace
from kinegen.symbolic.signatures import joint_array, joint_symbols, parameter_symbols, pose_array, signature
from kinegen.symbolic.transforms import Turn, Values, symbols

Rows = tuple[Vector, Vector, Vector]


@dataclass(slots=True)
class _Outwards:
    """Rotations by folded turns, and positions by legs, each computed once."""

    tape: Tape = field(default_factory=Tape)
    _rotations: dict[tuple[Turn, ...], Rows] = field(default_factory=dict)
    _positions: dict[tuple[Leg, ...], Vector] = field(default_factory=dict)

    def rotation(self, turns: tuple[Turn, ...]) -> Rows:
        """The rows of the rotation by a sequence of turns."""
        if not turns:
            one, zero = sp.S.One, sp.S.Zero
            return (one, zero, zero), (zero, one, zero), (zero, zero, one)
        if turns not in self._rotations:
            before = self.rotation(turns[:-1])
            turned = [self.tape.vector(_turn_row(turns[-1], row)) for row in before]
            self._rotations[turns] = (turned[0], turned[1], turned[2])
        return self._rotations[turns]

    def position(self, legs: tuple[Leg, ...]) -> Vector:
        """Where a sequence of shifts leads."""
        if not legs:
            return NULL
        if legs not in self._positions:
            rows = self.rotation(legs[-1].turns)
            x, y, z = (sum((a * b for a, b in zip(row, legs[-1].shift, strict=True)), sp.S.Zero) for row in rows)
            self._positions[legs] = self.tape.vector(total(self.position(legs[:-1]), (x, y, z)))
        return self._positions[legs]


def _turn_row(turn: Turn, row: Vector) -> Vector:
    """A row of a rotation, multiplied on the right by one more turn."""
    cosine, sine = cosine_sine(turn.angle)
    i, j = (turn.axis + 1) % 3, (turn.axis + 2) % 3
    turned = list(row)
    turned[i] = cosine * row[i] + sine * row[j]
    turned[j] = cosine * row[j] - sine * row[i]
    return turned[0], turned[1], turned[2]


def forward_poses(
    robot: Robot, frames: tuple[str, ...], values: Values
) -> tuple[tuple[Definition, ...], tuple[sp.Expr, ...]]:
    """The poses of some frames in the base frame.

    Args:
        robot: The robot.
        frames: Names of frames.
        values: A sympy value for each name of the file.

    Returns:
        Definitions, and twelve entries for each frame: the upper three rows of `base_T_frame`, row by row.
    """
    outwards = _Outwards()
    entries: list[sp.Expr] = []
    for frame in frames:
        trail = trace(transforms_between(robot, robot.root, frame, values))
        rows = outwards.rotation(trail.turns)
        position = outwards.position(trail.legs)
        for row, place in zip(rows, position, strict=True):
            entries += [sign * row[axis] for axis, sign in trail.attitude]
            entries.append(place)
    return tuple(outwards.tape.definitions), tuple(entries)


def derive_frames(robot: Robot) -> Expressions:
    """The pose of every link, the tool and every named frame in the base frame.

    Args:
        robot: The robot; parameters that are not runtime parameters become exact numbers.

    Returns:
        Twelve entries for each frame of `robot.frame_names`.
    """
    values = symbols(robot, keep_parameters=False)
    definitions, entries = forward_poses(robot, robot.frame_names, values)
    quantity = Quantity.FRAMES
    return Expressions(
        signature=signature(robot, quantity, (joint_array(robot),), pose_array(robot, quantity)),
        variables=joint_symbols(robot, values),
        parameters=parameter_symbols(robot, values),
        definitions=definitions,
        entries=entries,
    )
