"""The choice of the solution nearest to a joint vector: the numbers that it needs of each joint.

C and Python choose alike: both have these numbers, and the same operations in the same order.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction

from kinegen.emit.inverse import allowed
from kinegen.emit.limits import LARGEST, joint_limits
from kinegen.emit.reals import Real
from kinegen.outputs import Array, Branches, Kind, Quantity, Signature
from kinegen.robot.model import Robot

NAME = f"{Quantity(Kind.INVERSE).function}_nearest"
"""The function in C, after the robot's prefix."""

MOST_TURNS = {Real.DOUBLE: 10_000, Real.FLOAT: 100}
"""A joint value further from zero than so many whole turns has lost the digits that the choice is to keep."""

FARTHEST_STROKE = 10**15
"""The same for a joint that shifts, in the file's length unit."""


@dataclass(frozen=True, slots=True)
class Turning:
    """What whole turns of a joint need, as numbers of one type.

    Attributes:
        turn: A whole turn in the joint's variable; 0 for a joint that shifts.
        lowest: Its lower limit, with the room that a valid solution has beside it.
        highest: Its upper limit likewise. Without limits both are the largest numbers of the type.
    """

    turn: float
    lowest: float
    highest: float


def nearest_signature(inverse: Signature) -> tuple[tuple[Array, ...], tuple[Array, ...]]:
    """Inputs and results of the choice among the results of an inverse, as callers from Python see them."""
    shape = (inverse.dof,)
    return (*inverse.inputs, Array("q0", shape)), (Array("q", shape), Array("exists", (), is_truth=True))


def turnings(robot: Robot, branches: Branches, real: Real) -> tuple[Turning, ...]:
    """What whole turns of each joint need.

    Args:
        robot: The robot.
        branches: The words of its inverse.
        real: A number type.
    """
    largest = float(LARGEST[real])
    found = []
    for limits, turn, room in zip(joint_limits(robot, real), branches.turns, branches.rooms, strict=True):
        low, high, beside = -largest, largest, Fraction(allowed(room, real))
        if limits is not None:
            low = real.round(Fraction(limits[0]) - beside)
            high = real.round(Fraction(limits[1]) + beside)
        found.append(Turning(0.0 if math.isinf(turn) else real.round(Fraction(turn)), low, high))
    return tuple(found)
