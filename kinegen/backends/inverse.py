"""What files say of a closed-form inverse, and the numbers by which its nearest solution is chosen."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterator
from fractions import Fraction

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.limits import LARGEST, joint_limits
from kinegen.backends.scalar_types import ScalarType
from kinegen.ir.program import Program
from kinegen.model.branches import Allowance, Branches, OnAxis
from kinegen.model.dh_conversion.elementary_transforms import chain_of
from kinegen.model.joint_bounds import joint_box
from kinegen.model.outputs import Array, Kind, Quantity, Signature
from kinegen.model.robot import Robot
from kinegen.support.dataclass import dataclass

_TEXTS = """\
Rows of solutions:
  0  tilt forward: the second rotary joint, counted from the workpiece, is 0 to 180 deg in its positive direction, measured from where the tool is nearest to the first rotary axis
  1  tilt backward: it is 0 to 180 deg in its negative direction
The z axis of the tool gets the direction, which may have any length from 1e-6 to 1e6. valid is 1 if the direction is within reach, all numbers are finite and all joints are within their limits, else 0; then the row is arbitrary and may be NaN. Targets:
  with the tool along the first rotary axis, that joint keeps its value in q_near (or is at its limit nearest to that), and both rows are the same
  a rotary joint with a range of a whole turn or more is moved by whole turns as near to its value in q_near as its limits allow; without limits, or with more than 12 turns, into the turn about 0
  q_near is a joint vector, such as the current one; values of prismatic joints are not used, but must be finite
"""  # noqa: E501


def aim_lines(width: int) -> tuple[str, ...]:
    """Return the words as lines of a comment, of at most so many characters."""
    texts = _TEXTS.splitlines()
    return tuple(part for text in texts for part in textwrap.wrap(text, width, subsequent_indent="    "))


def inverse_of(kernels: RobotPrograms) -> tuple[Program, Branches] | None:
    """Return the program of a robot's inverse and its branches, or None where there is no such kernel."""
    found = ((program, program.signature.branches) for program in kernels.programs)
    return next(((program, branches) for program, branches in found if branches), None)


def solved_chain(kernels: RobotPrograms) -> Robot:
    """Return the chain for which the inverse is solved: the robot, or the way between two frames of a tree."""
    found = inverse_of(kernels)
    return kernels.robot if found is None else chain_of(kernels.robot, found[0].quantity)


def branches_of(kernels: RobotPrograms) -> Branches | None:
    """Return the branches of a robot's inverse, or None where there is no such kernel."""
    found = inverse_of(kernels)
    return None if found is None else found[1]


def allowed(allowance: Allowance, real: ScalarType) -> float:
    """Return how far off a number of one type may be."""
    return allowance.of(real is ScalarType.FLOAT)


def notes_of(kernels: RobotPrograms, program: Program, width: int, reals: tuple[ScalarType, ...]) -> tuple[str, ...]:
    """Return what is said of the solutions of an inverse, as lines of a comment; nothing of other kernels."""
    if program.quantity.kind is Kind.AXIS_INVERSE:
        return aim_lines(width)
    branches = branches_of(kernels) if program.quantity.kind is Kind.INVERSE else None
    return () if branches is None else branch_lines(solved_chain(kernels), branches, width, reals)


def branch_lines(robot: Robot, branches: Branches, width: int, reals: tuple[ScalarType, ...]) -> tuple[str, ...]:
    """Return the words as lines of a comment, of at most so many characters.

    `robot`: the chain that is solved.
    """
    lines = (
        f"Kinematic class: {branches.family}. Rows of solutions:",
        *(f"  {index}  {name}" for index, name in enumerate(branches.names)),
        *branches.meanings,
        "valid is 1 for a solution within the limits, else 0; then its row is arbitrary. Valid rows are finite.",
        *_room_lines(robot, branches, reals),
        "Targets:",
        *_rigid_lines(branches, reals),
        *(f"  {condition}" for condition in branches.conditions),
    )
    return tuple(part for line in lines for part in textwrap.wrap(line, width, subsequent_indent="    "))


def _room_lines(robot: Robot, branches: Branches, reals: tuple[ScalarType, ...]) -> Iterator[str]:
    """Yield how far outside its limits each joint may be found, in words; nothing where no joint has any."""
    joints: dict[str, list[str]] = {}
    if robot.strict_limits:
        yield "Limits are strict: a joint at its limit that rounding moved beyond it is not valid."
        return
    for variable, (low, high), room, turn in zip(
        robot.variables, joint_box(robot), branches.rooms, branches.turns, strict=True
    ):
        if variable.limits is not None and high - low < turn:
            unit = "rad" if math.isfinite(turn) else robot.units.length
            text = _by_type([f"{allowed(room, real):.1e} {unit}" for real in reals], reals)
            joints.setdefault(text, []).append(variable.name)
    if joints:
        yield "Rounding may move a joint at its limit outside it; within_limits reports that. It is valid up to"
        yield from (f"  {text}: {', '.join(names)}" for text, names in joints.items())


def _rigid_lines(branches: Branches, reals: tuple[ScalarType, ...]) -> tuple[str, ...]:
    """Return what the rotation of a target must be; nothing where it is not read."""
    if not branches.reads_attitude:
        return ()
    bound = _by_type([f"{allowed(branches.rigid, real):.0e}" for real in reals], reals)
    return (
        "  the rotation must have orthonormal, right-handed columns, or no solution is valid: their deviation, as the",
        f"  root of a sum of squares, must be less than {bound}",
    )


def _by_type(texts: list[str], reals: tuple[ScalarType, ...]) -> str:
    """Return one text for one number type, or both of them."""
    return (
        texts[0] if len(reals) == 1 or texts[0] == texts[1] else f"{texts[0]} in {reals[0]}, {texts[1]} in {reals[1]}"
    )


NEAREST_FUNCTION = f"{Quantity(Kind.INVERSE).function}_nearest"
"""The function in C, after the robot's prefix."""

MOST_TURNS = {ScalarType.DOUBLE: 10_000, ScalarType.FLOAT: 100}
"""A joint value further from zero than so many whole turns has lost the digits that the choice is to keep."""

FARTHEST_STROKE = 10**15
"""The same for a joint that shifts, in the file's length unit."""


@dataclass(frozen=True, slots=True)
class Turning:
    """Holds what whole turns of a joint need, as numbers of one type.

    `turn`: a whole turn in the joint's variable; 0 for a joint that shifts. `lowest`: its lower limit, with the room
    that a valid solution has beside it. `highest`: its upper limit likewise. Without limits both are the largest
    numbers of the type.
    """

    turn: float
    lowest: float
    highest: float


@dataclass(frozen=True, slots=True)
class Sharing:
    """Two joints that share one angle where the joint between them has some value, as numbers of one type.

    Both have the same whole turn. The limits are those of the file, without any room; that of the sum has what rounding
    adds.

    `first`: index of the first joint. `middle`: index of the joint between. `last`: index of the last joint, which
    counts with its sign changed where the joints are opposed. `are_opposed`: whether they are. `at`: value of the joint
    between, to which its whole turns may be added. `near`: how near to that it must be. `low`: lower limits of the
    first joint, of the last one as it counts, and of their sum. `high`: upper limits likewise.
    """

    first: int
    middle: int
    last: int
    are_opposed: bool
    at: float
    near: float
    low: tuple[float, float, float]
    high: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class End:
    """The first or last joint, where a pose may leave it free, as numbers of one type.

    `joint`: its index. `is_first`: whether it is the first one; else the last one. `direction`: its axis, in the base
    frame, or in the frame of the tool. `point`: a point of the axis, likewise. `rate`: how far the axis is turned for
    one unit of the variable, in radians. `rest`: its value at rest. `limits`: its lower and upper limit. `met`: the
    point of the tool that leaves it free on its axis; empty where joints before it do that. `near`: how near to the
    axis that must be: a squared distance. `places`: for each place that leaves it free the joint before it, its value,
    and how near to that it must be.
    """

    joint: int
    is_first: bool
    direction: tuple[float, ...]
    point: tuple[float, ...]
    rate: float
    rest: float
    limits: tuple[float, float]
    met: tuple[float, ...]
    near: float
    places: tuple[tuple[int, float, float], ...]


def nearest_signature(inverse: Signature) -> tuple[tuple[Array, ...], tuple[Array, ...]]:
    """Return inputs and results of the choice among the results of an inverse, as callers from Python see them."""
    shape = (inverse.dof,)
    return (*inverse.inputs, Array("q0", shape)), (Array("q", shape), Array("exists", (), is_truth=True))


def turnings(robot: Robot, branches: Branches, real: ScalarType) -> tuple[Turning, ...]:
    """Return what whole turns of each joint need."""
    largest = float(LARGEST[real])
    found = []
    for limits, turn, room in zip(joint_limits(robot, real), branches.turns, branches.rooms, strict=True):
        low, high, beside = -largest, largest, Fraction(allowed(room, real))
        if limits is not None:
            low = real.round(Fraction(limits[0]) - beside)
            high = real.round(Fraction(limits[1]) + beside)
        found.append(Turning(0.0 if math.isinf(turn) else real.round(Fraction(turn)), low, high))
    return tuple(found)


def in_line_words(branches: Branches) -> str:
    """Return what is done with joints in line, as a sentence with a space before it; nothing where there are none."""
    pairs = dict.fromkeys(f"q[{each.first}] and q[{each.last}]" for each in branches.in_line)
    if not pairs:
        return ""
    return (
        f" Where the axes of two joints coincide ({', '.join(pairs)}), only their sum matters; it is divided, within "
        "their limits, so that both are nearest to q0."
    )


def free_end_words(branches: Branches) -> str:
    """What is done where a pose leaves a joint free, as a sentence with a space before it; nothing without one."""
    end = branches.free_end
    if end is None:
        return ""
    if isinstance(end.where, OnAxis) and end.where.along:
        where = f"the last axis and the point that the arm positions are on the axis of q[{end.joint}]"
    elif isinstance(end.where, OnAxis):
        where = f"the point that the arm positions is on the axis of q[{end.joint}]"
    else:
        where = f"the axis of q[{end.joint}] is parallel to that of q[{end.joint - 2}]"
    return (
        f" Where {where}, which leaves that joint free, solutions with it at q0[{end.joint}], or at its limit "
        "nearest to that, count as well."
    )


def end_of(robot: Robot, branches: Branches, real: ScalarType) -> End | None:
    """Return the joint at an end that a pose may leave free, or None."""
    end, largest = branches.free_end, float(LARGEST[real])
    if end is None:
        return None
    low, high = joint_limits(robot, real)[end.joint] or (-largest, largest)

    def rounded(*numbers: float) -> tuple[float, ...]:
        return tuple(real.round(Fraction(each)) for each in numbers)

    met: tuple[float, ...] = ()
    near, places = 0.0, list[tuple[int, float, float]]()
    if isinstance(end.where, OnAxis):
        met, near = rounded(*end.where.point), real.round(Fraction(allowed(end.where.near, real)))
    else:
        for each in end.where.places:
            at, within = rounded(each.at, allowed(each.near, real))
            places.append((each.middle, at, within))
    return End(
        joint=end.joint,
        is_first=end.is_first,
        direction=rounded(*end.direction),
        point=rounded(*end.point),
        rate=real.round(Fraction(end.rate)),
        rest=real.round(Fraction(end.rest)),
        limits=(real.round(Fraction(low)), real.round(Fraction(high))),
        met=met,
        near=near,
        places=tuple(places),
    )


def sharings(robot: Robot, branches: Branches, real: ScalarType) -> tuple[Sharing, ...]:
    """Return the joints that share one angle where axes are in line."""
    largest = float(LARGEST[real])
    limits = [each or (-largest, largest) for each in joint_limits(robot, real)]
    found = []
    for each in branches.in_line:
        first, (low, high) = limits[each.first], limits[each.last]
        last = (-high, -low) if each.are_opposed else (low, high)
        near = allowed(each.near, real)
        # Both exactly at their limits have a sum that rounding may put beyond the sum of these.
        both = (max(first[0] + last[0] - near, -largest), min(first[1] + last[1] + near, largest))
        ends = zip(first, last, both, strict=True)
        lows, highs = (tuple(real.round(Fraction(end)) for end in side) for side in ends)
        numbers = (real.round(Fraction(each.at)), real.round(Fraction(near)))
        places = (each.first, each.middle, each.last, each.are_opposed)
        found.append(Sharing(*places, *numbers, (lows[0], lows[1], lows[2]), (highs[0], highs[1], highs[2])))
    return tuple(found)
