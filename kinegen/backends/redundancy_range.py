"""The ranges of a redundancy: the numbers that its search needs, and where it looks.

C and Python search alike: both have these numbers.
"""

from __future__ import annotations

import math
from fractions import Fraction

from kinegen.backends.inverse import turnings
from kinegen.backends.limits import LARGEST, joint_limits
from kinegen.backends.scalar_types import ScalarType
from kinegen.model.branches import Branches
from kinegen.model.joint_bounds import reach
from kinegen.model.robot import Robot
from kinegen.model.variants import ARM_ANGLE
from kinegen.support.dataclass import dataclass

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
"""For the nearest solution: values that are tried in each interval of a turn, and steps of the golden section between
the neighbours of each that is nearer than both."""

GOLDEN = (3 - math.sqrt(5)) / 2

BESIDE = 0.1
"""How far beside the redundancy of the joint vector itself is looked for the nearest solution, in part of the range."""


@dataclass(frozen=True, slots=True)
class Fineness:
    """Holds what depends on the number type.

    `depth`: how often a part is halved. `least_off`: a solution is off its target if it is off by more, lengths as
    parts of the reach: a few times what a target may be beyond reach. The band of redundancies below that is halved to
    the end. `shortest`: below this length the line from shoulder to wrist has no direction. `gap`: intervals that are
    nearer to each other, in part of the range of a joint, are one: the root of the unit roundoff. Where a joint touches
    its limit and turns back, rounding makes single values valid and others not.
    """

    depth: int
    least_off: float
    shortest: float
    gap: float


FINENESS = {ScalarType.DOUBLE: Fineness(26, 1e-9, 1e-10, 1e-8), ScalarType.FLOAT: Fineness(14, 1e-5, 1e-6, 2.4e-4)}


@dataclass(frozen=True, slots=True)
class Range:
    """Where a redundancy is looked for.

    `low`: its least value. `high`: its greatest value. `given`: index of the joint that is given; -1 for an arm angle.
    """

    low: float
    high: float
    given: int


def range_of(robot: Robot, branches: Branches, real: ScalarType) -> Range:
    """Return where the redundancy of a robot is looked for, in numbers of a type."""
    half = real.round(Fraction(math.pi))
    if robot.redundancy == ARM_ANGLE:
        return Range(-half, half, -1)
    given = next(each.index for each in robot.variables if each.name == robot.redundancy)
    limits = joint_limits(robot, real)[given]
    if limits is None:
        half = real.round(Fraction(branches.turns[given] / 2))
        return Range(-half, half, given)
    return Range(*limits, given)


def gap_of(found: Range, real: ScalarType) -> float:
    """Return how near intervals are to each other that are one; 0 for an arm angle, whose ends are in closed form."""
    return 0.0 if found.given < 0 else FINENESS[real].gap * (found.high - found.low)


def finest_part(low: float, high: float, real: ScalarType) -> float:
    """Return how wide the parts of a range are between whose ends and middles a search does not look."""
    return (high - low) / PARTS / float(2 ** (FINENESS[real].depth + 1))


def samples_of(robot: Robot, branches: Branches, real: ScalarType) -> int:
    """Return values that are tried in each interval: as many for each turn of the range of a joint, and no fewer."""
    found = range_of(robot, branches, real)
    turn = 2 * math.pi if found.given < 0 else branches.turns[found.given]
    turns = (found.high - found.low) / turn  # none for a joint that shifts, of which a turn is infinite
    return max(SAMPLES, math.ceil((SAMPLES - 1) * turns - 1e-3) + 1)


def bounds_of(robot: Robot, branches: Branches, real: ScalarType) -> tuple[tuple[float, float] | None, ...]:
    """Return the limits of each joint with the room that the inverse leaves beside them.

    Returns None for a joint whose limits make no solution invalid: it has none, or they leave room for a whole turn;
    and for the joint that is given.
    """
    given, largest = range_of(robot, branches, real).given, float(LARGEST[real])
    exact = joint_limits(robot, ScalarType.DOUBLE)
    found: list[tuple[float, float] | None] = []
    for index, (each, turn) in enumerate(zip(turnings(robot, branches, real), branches.turns, strict=True)):
        limits = exact[index]
        is_free = limits is None or limits[1] - limits[0] >= turn or index == given or each.highest == largest
        found.append(None if is_free else (each.lowest, each.highest))
    return tuple(found)


def sweeps_of(robot: Robot, branches: Branches) -> tuple[float, ...]:
    """Return how far each joint may move in a part: for one that shifts a third of the reach counts as 1 rad."""
    size = reach(robot, robot.tips)
    return tuple(SWEEP * (turn / (2 * math.pi) if math.isfinite(turn) else size / 3) for turn in branches.turns)
