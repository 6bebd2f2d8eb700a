"""The ranges of a redundancy: the numbers that its search needs, and where it looks.

C and Python search alike: both have these numbers.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction

from kinegen.emit.limits import LARGEST, joint_limits
from kinegen.emit.nearest import turnings
from kinegen.emit.reals import Real
from kinegen.outputs import Branches
from kinegen.robot.extent import reach
from kinegen.robot.model import Robot
from kinegen.robot.redundancy import ARM_ANGLE

ANY = "inverse_nearest_any"
"""The function in C, after the robot's prefix, that chooses the redundancy too."""

RANGES = 16
"""Intervals of a branch that are stored. An arm angle has 15 at most: twelve limits with two crossings each and four
jumps are 28 ends, and -pi and pi part one more."""

BRANCHES = 8
"""Branches at most of an inverse with a redundancy: two choices each of three kinds."""

PARTS = 64
"""Equal parts of the range of a joint that is given; each is looked at in its ends and its middle."""

BUDGET = 8192
"""Halvings of parts for one target."""

SWEEP = 0.3
"""A part is halved while a joint moves by more in it, in rad."""

SAMPLES, STEPS = 17, 48
"""For the nearest solution: values that are tried in each interval, and steps of the golden section between them."""

GOLDEN = (3 - math.sqrt(5)) / 2

BESIDE = 0.1
"""How far beside the redundancy of the joint vector itself is looked for the nearest solution, in part of the range."""


@dataclass(frozen=True, slots=True)
class Fineness:
    """What depends on the number type.

    Attributes:
        depth: How often a part is halved.
        least_off: A solution is off its target if it is off by more, lengths as parts of the reach.
        shortest: Below this length the line from shoulder to wrist has no direction.
    """

    depth: int
    least_off: float
    shortest: float


FINENESS = {Real.DOUBLE: Fineness(26, 1e-9, 1e-10), Real.FLOAT: Fineness(14, 1e-4, 1e-6)}


@dataclass(frozen=True, slots=True)
class Range:
    """Where a redundancy is looked for.

    Attributes:
        low: Its least value.
        high: Its greatest value.
        given: Index of the joint that is given; -1 for an arm angle.
    """

    low: float
    high: float
    given: int


def range_of(robot: Robot, branches: Branches, real: Real) -> Range:
    """Where the redundancy of a robot is looked for, in numbers of a type.

    Args:
        robot: A robot that has the ranges.
        branches: The words of its inverse.
        real: The number type.
    """
    half = real.round(Fraction(math.pi))
    if robot.redundancy == ARM_ANGLE:
        return Range(-half, half, -1)
    given = next(each.index for each in robot.variables if each.name == robot.redundancy)
    limits = joint_limits(robot, real)[given]
    if limits is None:
        half = real.round(Fraction(branches.turns[given] / 2))
        return Range(-half, half, given)
    return Range(*limits, given)


def bounds_of(robot: Robot, branches: Branches, real: Real) -> tuple[tuple[float, float] | None, ...]:
    """The limits of each joint with the room that the inverse leaves beside them.

    Args:
        robot: The robot.
        branches: The words of its inverse.
        real: The number type.

    Returns:
        None for a joint whose limits make no solution invalid: it has none, or they leave room for a whole turn; and
        for the joint that is given.
    """
    given, largest = range_of(robot, branches, real).given, float(LARGEST[real])
    exact = joint_limits(robot, Real.DOUBLE)
    found: list[tuple[float, float] | None] = []
    for index, (each, turn) in enumerate(zip(turnings(robot, branches, real), branches.turns, strict=True)):
        limits = exact[index]
        is_free = limits is None or limits[1] - limits[0] >= turn or index == given or each.highest == largest
        found.append(None if is_free else (each.lowest, each.highest))
    return tuple(found)


def sweeps_of(robot: Robot, branches: Branches) -> tuple[float, ...]:
    """How far each joint may move in a part: for one that shifts a third of the reach counts as 1 rad."""
    size = reach(robot, robot.tips)
    return tuple(SWEEP * (turn / (2 * math.pi) if math.isfinite(turn) else size / 3) for turn in branches.turns)
