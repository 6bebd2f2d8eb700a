"""The families one by one: conditions on the axes of the joints, which of them fail, in words, and constants."""

from __future__ import annotations

import itertools
import math
from dataclasses import field

import sympy as sp

from kinegen.derive.folding import NULL, Vector
from kinegen.derive.inverse.axes import Axes, JointAxis
from kinegen.derive.inverse.exact_geometry import combined, cross, dot, is_null, minus, tidy, turned
from kinegen.derive.inverse.family import (
    Aim,
    Arm,
    ColumnArm,
    ElbowArm,
    Family,
    FlatArm,
    GantryArm,
    GimbalArm,
    PlainBuild,
    PointArm,
    StrokeArm,
    TripleArm,
    WristArm,
)
from kinegen.derive.inverse.family_words import branch_names, conditions_of, meanings_of
from kinegen.derive.inverse.geometry import (
    Wrist,
    are_parallel,
    are_square,
    feet,
    flat_frame,
    foot,
    waist_of,
    wrist_of,
)
from kinegen.support.dataclass import dataclass

_SHOWN = 1e-4
"""Radians from which on six digits of an angle show that it is not the one wanted."""


class Refusal(Exception):  # noqa: N818 - an answer, not an error
    """An arm is not of the family that was tried; its reasons are the conditions that fail, one line each."""

    def __init__(self, *reasons: str) -> None:
        super().__init__(*reasons)
        self.reasons = reasons


@dataclass(slots=True)
class Conditions:
    """Collects which conditions on a chain fail, one line each; the chain has the values of runtime parameters."""

    axes: Axes
    failed: list[str] = field(default_factory=list)

    def parallel(self, left: JointAxis, right: JointAxis) -> None:
        """Require two axes to be parallel."""
        if not are_parallel(left, right):
            self.failed.append(
                f"axes {left.number} and {right.number} are not parallel: {_off(left, right, sp.Integer(0))}"
            )

    def square(self, left: JointAxis, right: JointAxis) -> None:
        """Require two axes to be at right angles."""
        if not are_square(left, right):
            self.failed.append(
                f"axes {left.number} and {right.number} are not at right angles: {_off(left, right, sp.pi / 2)}"
            )

    def turned(self, left: JointAxis, right: JointAxis) -> None:
        """Require two axes not to be parallel."""
        if are_parallel(left, right):
            self.failed.append(f"axes {left.number} and {right.number} are parallel")

    def apart(self, left: JointAxis, right: JointAxis) -> None:
        """Require two axes not to be the same line."""
        if are_parallel(left, right) and is_null(minus(foot(left, right.point), right.point)):
            self.failed.append(f"axes {left.number} and {right.number} are the same line")

    def meet(self, joints: tuple[JointAxis, ...]) -> Vector:
        """Require lines, of which the first two are not parallel, to meet, and return where."""
        numbers = ", ".join(str(joint.number) for joint in joints)
        near, far = feet(joints[0], joints[1])
        gaps = [(joints[0], joints[1], minus(far, near))]
        gaps += [(joints[0], joint, minus(foot(joint, near), near)) for joint in joints[2:]]
        for left, right, gap in gaps:
            if not is_null(gap):
                distance = math.hypot(*map(self.axes.value, gap))
                where = f"axes {left.number} and {right.number} pass at {distance:.4g}"
                if right is not joints[1]:
                    where = f"axis {right.number} misses the other two by {distance:.4g}"
                pair = f"axes {left.number} and {right.number} do not meet: they pass at {distance:.4g}"
                several = f"joints {numbers} do not meet in one point: {where}"
                self.failed.append(pair if len(joints) == 2 else several)
                break
        return near

    def check(self) -> None:
        """Raise `Refusal` if anything failed."""
        if self.failed:
            raise Refusal(*self.failed)


def _off(left: JointAxis, right: JointAxis, wanted: sp.Expr) -> str:
    """Return the angle between two axes, or what it lacks where rounding would hide that."""
    angle = sp.acos(abs(dot(left.direction, right.direction)))
    deviation = abs(float(sp.N(angle - wanted, 30)))
    if deviation < _SHOWN:
        return f"off by {deviation:.2g} rad"
    return f"they are at {float(sp.N(angle * 180 / sp.pi)):.6g} deg"


def _alike(joint: JointAxis, axis: Vector) -> JointAxis:
    """Return a joint directed like an axis that is parallel to its own."""
    return joint if dot(joint.direction, axis) > 0 else joint.flipped()


# Arms that put a point in its place -----------------------------------------------------------------------------------


def _arm_of(axes: Axes, end: Vector) -> Arm:
    """Return the first three joints, carrying a point."""
    joints = axes.joints[:3]
    letters = "".join("R" if joint.turns else "P" for joint in joints)
    match letters:
        case "RRR" if are_parallel(joints[1], joints[2]):
            return _elbow_arm(axes, end)
        case "RRR":
            return _gimbal_arm(axes, end)
        case "RRP":
            return _stroke_arm(axes, end)
        case "RPP" | "PRP":
            return _column_arm(axes, end)
        case "PPP":
            return _gantry_arm(axes, end)
    raise Refusal(f"no closed form begins with the joints {letters}")


def _elbow_arm(axes: Axes, end: Vector) -> ElbowArm:
    first, second, third = axes.joints[:3]
    conditions = Conditions(axes)
    conditions.turned(first, second)
    conditions.apart(second, third)
    conditions.check()
    # Frames of the waist decide how axis 2 is directed, and axis 3 follows.
    waist, second = waist_of(axes, first, second, end)
    third = _alike(third, second.direction)
    upper = waist.way(minus(third.point, waist.shoulder))
    lower = waist.way(minus(end, third.point))
    if is_null(lower[:2]):
        raise Refusal(f"the point that joint {third.number} is to carry lies on its axis")
    depth = tidy(upper[2] + lower[2])
    return ElbowArm(waist, second, third, end, upper[:2], lower[:2], depth)


def _gimbal_arm(axes: Axes, end: Vector) -> GimbalArm:
    first, second, third = axes.joints[:3]
    conditions = Conditions(axes)
    conditions.turned(first, second)
    conditions.check()
    conditions.meet((first, second))
    if conditions.failed:
        # Either condition would do.
        conditions.parallel(second, third)
        conditions.check()
    waist, second = waist_of(axes, first, second, end)
    third = third.forward
    frame = flat_frame(third)
    upper = turned(frame, minus(third.point, waist.origin))
    lower = turned(frame, minus(end, third.point))
    if is_null(upper[:2]):
        raise Refusal(f"axis {third.number} passes through where axes {first.number} and {second.number} meet")
    if is_null(lower[:2]):
        raise Refusal(f"the point that joint {third.number} is to carry lies on its axis")
    depth = tidy(upper[2] + lower[2])
    return GimbalArm(waist, second, third, end, frame, upper[:2], lower[:2], depth)


def _stroke_arm(axes: Axes, end: Vector) -> StrokeArm:
    first, second, third = axes.joints[:3]
    conditions = Conditions(axes)
    conditions.turned(first, second)
    conditions.square(second, third)
    conditions.check()
    waist, second = waist_of(axes, first, second, end)
    start, heading = waist.place(end), waist.way(third.direction)
    return StrokeArm(waist, second, third, end, start[:2], heading[:2], start[2])


def _column_arm(axes: Axes, end: Vector) -> ColumnArm:
    turn = next(joint for joint in axes.joints[:3] if joint.turns)
    shifts = [joint for joint in axes.joints[:3] if not joint.turns]
    lifts = [joint for joint in shifts if are_parallel(joint, turn)]
    conditions = Conditions(axes)
    if not lifts:
        raise Refusal(f"neither joint {shifts[0].number} nor joint {shifts[1].number} shifts along axis {turn.number}")
    lift = lifts[0]
    stroke = next(joint for joint in shifts if joint is not lift)
    conditions.square(turn, stroke)
    if axes.joints.index(stroke) < axes.joints.index(turn):
        conditions.failed.append(f"joint {stroke.number} shifts across axis {turn.number} before it turns")
    conditions.check()
    frame = flat_frame(turn)
    start, heading = turned(frame, minus(end, turn.point)), turned(frame, stroke.direction)
    return ColumnArm(turn, _alike(lift, turn.direction), stroke, frame, end, start, heading[:2])


def _gantry_arm(axes: Axes, end: Vector) -> GantryArm:
    first, second, third = axes.joints[:3]
    volume = dot(cross(first.direction, second.direction), third.direction)
    if volume == 0:
        numbers = ", ".join(str(joint.number) for joint in (first, second, third))
        raise Refusal(f"the directions of joints {numbers} lie in one plane")
    # Rows of the inverse matrix are cross products of the directions.
    one, two, three = (
        combined((1 / volume, cross(left.direction, right.direction)))
        for left, right in ((second, third), (third, first), (first, second))
    )
    return GantryArm((first, second, third), end, (one, two, three))


_ARM_NAMES: dict[type[Arm], tuple[str, str]] = {
    ElbowArm: ("anthropomorphic arm", "arm with parallel axes {parallel} and spherical wrist"),
    GimbalArm: ("arm whose axes {meeting} meet", "arm whose axes {meeting} meet, with spherical wrist"),
    StrokeArm: ("spherical arm", "Stanford type: spherical arm with spherical wrist"),
    ColumnArm: ("cylindrical arm", "cylindrical arm with spherical wrist"),
    GantryArm: ("Cartesian arm", "Cartesian arm with spherical wrist"),
}


def _arm_name(arm: Arm, place: int, axes: Axes) -> str:
    first, second, third = axes.numbers[:3]
    text = _ARM_NAMES[type(arm)][place].format(meeting=_listed(first, second), parallel=_listed(second, third))
    return text.replace("wrist", "shoulder") if axes.is_reversed else text


def _listed(*numbers: int) -> str:
    return ", ".join(str(number) for number in sorted(numbers))


def _family(name: str, build: PlainBuild, axes: Axes, aim: Aim) -> Family:
    """Return a family with what people call its solutions."""
    described = branch_names(build, axes), meanings_of(build, axes), conditions_of(build, axes)
    return Family(name, build, axes, aim, *described)


def point_arm(axes: Axes) -> Family:
    """Recognise three joints that put the tool in its place."""
    arm = _arm_of(axes, axes.position)
    build = PointArm(arm)
    return _family(_arm_name(arm, 0, axes), build, axes, Aim.POSITION)


def wrist_arm(axes: Axes) -> Family:
    """Recognise three joints and a spherical wrist."""
    wrist = _spherical_wrist(axes)
    arm = _arm_of(axes, wrist.centre)
    build = WristArm(arm, wrist)
    return _family(_arm_name(arm, 1, axes), build, axes, Aim.POSE)


def _spherical_wrist(axes: Axes) -> Wrist:
    roll, bend, flange = axes.joints[3:]
    conditions = Conditions(axes)
    conditions.square(roll, bend)
    conditions.square(bend, flange)
    centre = NULL if are_parallel(roll, bend) else conditions.meet((roll, bend, flange))
    conditions.check()
    return wrist_of(roll, bend, flange, centre)


# Arms of parallel axes ------------------------------------------------------------------------------------------------


def flat_arm(axes: Axes) -> Family:
    """Recognise two or three parallel axes, and possibly a shift along them."""
    turns = [joint for joint in axes.joints if joint.turns]
    lifts = [joint for joint in axes.joints if not joint.turns]
    conditions = Conditions(axes)
    for joint in (*turns[1:], *lifts):
        conditions.parallel(turns[0], joint)
    for left, right in itertools.pairwise(turns):
        conditions.apart(left, right)
    conditions.check()
    # All is seen in a frame across the common direction.
    frame = flat_frame(turns[0])
    end = turns[2].point if len(turns) == 3 else axes.position
    upper = turned(frame, minus(turns[1].point, turns[0].point))
    lower = turned(frame, minus(end, turns[1].point))
    if is_null(lower[:2]):
        raise Refusal(f"the tool lies on axis {turns[1].number}")
    directed = tuple(_alike(joint, turns[0].direction) for joint in turns)
    lift = _alike(lifts[0], turns[0].direction) if lifts else None
    build = FlatArm(directed, lift, frame, upper[:2], lower[:2], end)
    name = (
        f"SCARA, joints {''.join('R' if joint.turns else 'P' for joint in axes.joints)}"
        if lifts
        else f"planar {len(turns)}R"
    )
    aim = Aim.POSE if len(turns) == 3 else Aim.POSITION
    return _family(name, build, axes, aim)


def triple_arm(axes: Axes) -> Family:
    """Recognise a waist, three parallel axes, and a hand of one or two joints."""
    first, second, third, fourth, fifth = axes.joints[:5]
    conditions = Conditions(axes)
    conditions.turned(first, second)
    for joint in (third, fourth):
        conditions.parallel(second, joint)
    conditions.apart(second, third)
    conditions.apart(third, fourth)
    conditions.square(fourth, fifth)
    # The hand ends where joints 5 and 6 do not move it, or at the roll axis.
    if len(axes.joints) == 6:
        conditions.square(fifth, axes.joints[5])
        end = fifth.point if are_parallel(fifth, axes.joints[5]) else conditions.meet(axes.joints[4:])
    else:
        end = fifth.point if are_parallel(fourth, fifth) else feet(fourth, fifth)[1]
    conditions.check()
    waist, second = waist_of(axes, first, second, end)
    third, fourth = _alike(third, second.direction), _alike(fourth, second.direction)
    # Only the sum of shifts along the parallel axes matters.
    upper = waist.way(minus(third.point, waist.shoulder))
    lower = waist.way(minus(fourth.point, third.point))
    hand = waist.way(minus(end, fourth.point))
    depth = tidy(upper[2] + lower[2] + hand[2])
    wrist = wrist_of(fourth, fifth, axes.joints[5], end) if len(axes.joints) == 6 else None
    build = TripleArm(
        waist, (second, third, fourth), upper[:2], lower[:2], hand[:2], depth, end, None if wrist else fifth, wrist
    )
    parallel = f"parallel axes {_listed(second.number, third.number, fourth.number)}"
    name = f"UR type: {parallel}" if wrist else f"AL5D type: waist, {parallel}, roll"
    return _family(name, build, axes, Aim.POSE)
