"""The families one by one: the conditions on the axes of the joints, and the constants."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field

import sympy as sp

from kinegen.symbolic.fold import NULL, Vector
from kinegen.symbolic.inverse.axes import Axes, JointAxis
from kinegen.symbolic.inverse.exact import combined, cross, dot, is_null, minus, tidy
from kinegen.symbolic.inverse.family import (
    Aim,
    Arm,
    ColumnArm,
    ElbowArm,
    Family,
    FlatArm,
    GantryArm,
    PointArm,
    StrokeArm,
    TripleArm,
    WristArm,
)
from kinegen.symbolic.inverse.geometry import (
    Wrist,
    are_parallel,
    are_square,
    feet,
    flat_frame,
    foot,
    in_frame,
    waist_of,
    wrist_of,
)
from kinegen.symbolic.inverse.names import branch_names, conditions_of, meanings_of

_SHOWN = 1e-4
"""Radians from which on six digits of an angle show that it is not the one wanted."""


class Refusal(Exception):  # noqa: N818 - an answer, not an error
    """An arm is not of the family that was tried.

    Args:
        reasons: The conditions that fail, one line each.
    """

    def __init__(self, *reasons: str) -> None:
        super().__init__(*reasons)
        self.reasons = reasons


@dataclass(slots=True)
class _Conditions:
    """Collects what fails."""

    axes: Axes
    failed: list[str] = field(default_factory=list)

    def parallel(self, left: JointAxis, right: JointAxis) -> None:
        if not are_parallel(left, right):
            self.failed.append(
                f"axes {left.number} and {right.number} are not parallel: {_off(left, right, sp.Integer(0))}"
            )

    def square(self, left: JointAxis, right: JointAxis) -> None:
        if not are_square(left, right):
            self.failed.append(
                f"axes {left.number} and {right.number} are not at right angles: {_off(left, right, sp.pi / 2)}"
            )

    def turned(self, left: JointAxis, right: JointAxis) -> None:
        if are_parallel(left, right):
            self.failed.append(f"axes {left.number} and {right.number} are parallel")

    def apart(self, left: JointAxis, right: JointAxis) -> None:
        if are_parallel(left, right) and is_null(minus(foot(left, right.point), right.point)):
            self.failed.append(f"axes {left.number} and {right.number} are the same line")

    def meet(self, joints: tuple[JointAxis, ...]) -> Vector:
        """Where lines meet, of which the first two are not parallel."""
        numbers = ", ".join(str(joint.number) for joint in joints)
        near, far = feet(joints[0], joints[1])
        gaps = [(joints[0], joints[1], minus(far, near))]
        gaps += [(joints[0], joint, minus(foot(joint, near), near)) for joint in joints[2:]]
        for left, right, gap in gaps:
            if not is_null(gap):
                distance = sum(self.axes.value(entry) ** 2 for entry in gap) ** 0.5
                where = f"axes {left.number} and {right.number} pass at {distance:.4g}"
                if right is not joints[1]:
                    where = f"axis {right.number} misses the other two by {distance:.4g}"
                self.failed.append(f"joints {numbers} do not meet in one point: {where}")
                break
        return near

    def check(self) -> None:
        if self.failed:
            raise Refusal(*self.failed)


def _off(left: JointAxis, right: JointAxis, wanted: sp.Expr) -> str:
    """The angle between two axes, or what it lacks where rounding would hide that."""
    angle = sp.acos(abs(dot(left.direction, right.direction)))
    deviation = abs(float(sp.N(angle - wanted, 30)))
    if deviation < _SHOWN:
        return f"off by {deviation:.2g} rad"
    return f"they are at {float(sp.N(angle * 180 / sp.pi)):.6g} deg"


def _alike(joint: JointAxis, axis: Vector) -> JointAxis:
    """A joint directed like an axis that is parallel to its own."""
    return joint if dot(joint.direction, axis) > 0 else joint.flipped()


# Arms that put a point in its place -----------------------------------------------------------------------------------


def _arm_of(axes: Axes, end: Vector) -> Arm:
    """The first three joints, carrying a point."""
    joints = axes.joints[:3]
    letters = "".join("R" if joint.turns else "P" for joint in joints)
    match letters:
        case "RRR":
            return _elbow_arm(axes, end)
        case "RRP":
            return _stroke_arm(axes, end)
        case "RPP" | "PRP":
            return _column_arm(axes, end)
        case "PPP":
            return _gantry_arm(axes, end)
    raise Refusal(f"no family of closed forms begins with the joints {letters}")


def _elbow_arm(axes: Axes, end: Vector) -> ElbowArm:
    first, second, third = axes.joints[:3]
    conditions = _Conditions(axes)
    conditions.parallel(second, third)
    conditions.turned(first, second)
    conditions.apart(second, third)
    conditions.check()
    waist, turned = waist_of(axes, first, second, end)
    second = second.flipped() if turned else second
    third = _alike(third, second.direction)
    upper = waist.way(minus(third.point, waist.shoulder))
    lower = waist.way(minus(end, third.point))
    if is_null(lower[:2]):
        raise Refusal("the point that joint 3 is to carry lies on its axis")
    depth = tidy(upper[2] + lower[2])
    return ElbowArm(waist, second, third, end, upper[:2], lower[:2], depth)


def _stroke_arm(axes: Axes, end: Vector) -> StrokeArm:
    first, second, third = axes.joints[:3]
    conditions = _Conditions(axes)
    conditions.turned(first, second)
    conditions.square(second, third)
    conditions.check()
    waist, turned = waist_of(axes, first, second, end)
    second = second.flipped() if turned else second
    start, heading = waist.place(end), waist.way(third.direction)
    return StrokeArm(waist, second, third, end, start[:2], heading[:2], start[2])


def _column_arm(axes: Axes, end: Vector) -> ColumnArm:
    turn = next(joint for joint in axes.joints[:3] if joint.turns)
    shifts = [joint for joint in axes.joints[:3] if not joint.turns]
    lifts = [joint for joint in shifts if are_parallel(joint, turn)]
    conditions = _Conditions(axes)
    if not lifts:
        raise Refusal(f"neither joint {shifts[0].number} nor joint {shifts[1].number} shifts along axis {turn.number}")
    lift = lifts[0]
    stroke = next(joint for joint in shifts if joint is not lift)
    conditions.square(turn, stroke)
    if stroke.number < turn.number:
        conditions.failed.append(f"joint {stroke.number} shifts across axis {turn.number} before it turns")
    conditions.check()
    frame = flat_frame(turn)
    start, heading = in_frame(frame, minus(end, turn.point)), in_frame(frame, stroke.direction)
    return ColumnArm(turn, _alike(lift, turn.direction), stroke, frame, end, start, heading[:2])


def _gantry_arm(axes: Axes, end: Vector) -> GantryArm:
    first, second, third = axes.joints[:3]
    volume = dot(cross(first.direction, second.direction), third.direction)
    if volume == 0:
        raise Refusal("the directions of joints 1, 2, 3 lie in one plane")
    one, two, three = (
        combined((1 / volume, cross(left.direction, right.direction)))
        for left, right in ((second, third), (third, first), (first, second))
    )
    return GantryArm((first, second, third), end, (one, two, three))


_ARM_NAMES = {
    ElbowArm: ("anthropomorphic arm", "arm with parallel axes 2, 3 and spherical wrist"),
    StrokeArm: ("spherical arm", "Stanford type: spherical arm with spherical wrist"),
    ColumnArm: ("cylindrical arm", "cylindrical arm with spherical wrist"),
    GantryArm: ("Cartesian arm", "Cartesian arm with spherical wrist"),
}


def point_arm(axes: Axes) -> Family:
    """Three joints that put the tool in its place."""
    arm = _arm_of(axes, axes.position)
    build = PointArm(arm)
    return Family(
        _ARM_NAMES[type(arm)][0],
        build,
        axes,
        Aim.POSITION,
        branch_names(build),
        meanings_of(build),
        conditions_of(build),
    )


def wrist_arm(axes: Axes) -> Family:
    """Three joints and a spherical wrist."""
    wrist = _spherical_wrist(axes)
    arm = _arm_of(axes, wrist.centre)
    build = WristArm(arm, wrist)
    return Family(
        _ARM_NAMES[type(arm)][1], build, axes, Aim.POSE, branch_names(build), meanings_of(build), conditions_of(build)
    )


def _spherical_wrist(axes: Axes) -> Wrist:
    roll, bend, flange = axes.joints[3:]
    conditions = _Conditions(axes)
    conditions.square(roll, bend)
    conditions.square(bend, flange)
    centre = NULL if are_parallel(roll, bend) else conditions.meet((roll, bend, flange))
    conditions.check()
    return wrist_of(roll, bend, flange, centre)


# Arms of parallel axes ------------------------------------------------------------------------------------------------


def flat_arm(axes: Axes) -> Family:
    """Two or three parallel axes, and possibly a shift along them."""
    turns = [joint for joint in axes.joints if joint.turns]
    lifts = [joint for joint in axes.joints if not joint.turns]
    conditions = _Conditions(axes)
    for joint in (*turns[1:], *lifts):
        conditions.parallel(turns[0], joint)
    for left, right in itertools.pairwise(turns):
        conditions.apart(left, right)
    conditions.check()
    frame = flat_frame(turns[0])
    end = turns[2].point if len(turns) == 3 else axes.position
    upper = in_frame(frame, minus(turns[1].point, turns[0].point))
    lower = in_frame(frame, minus(end, turns[1].point))
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
    return Family(name, build, axes, aim, branch_names(build), meanings_of(build), conditions_of(build))


def triple_arm(axes: Axes) -> Family:
    """A waist, three parallel axes, and a hand of one or two joints."""
    first, second, third, fourth, fifth = axes.joints[:5]
    conditions = _Conditions(axes)
    conditions.turned(first, second)
    for joint in (third, fourth):
        conditions.parallel(second, joint)
    conditions.apart(second, third)
    conditions.apart(third, fourth)
    conditions.square(fourth, fifth)
    if len(axes.joints) == 6:
        conditions.square(fifth, axes.joints[5])
        end = fifth.point if are_parallel(fifth, axes.joints[5]) else conditions.meet(axes.joints[4:])
    else:
        end = fifth.point if are_parallel(fourth, fifth) else feet(fourth, fifth)[1]
    conditions.check()
    waist, turned = waist_of(axes, first, second, end)
    second = second.flipped() if turned else second
    third, fourth = _alike(third, second.direction), _alike(fourth, second.direction)
    upper = waist.way(minus(third.point, waist.shoulder))
    lower = waist.way(minus(fourth.point, third.point))
    hand = waist.way(minus(end, fourth.point))
    depth = tidy(upper[2] + lower[2] + hand[2])
    wrist = wrist_of(fourth, fifth, axes.joints[5], end) if len(axes.joints) == 6 else None
    build = TripleArm(
        waist, (second, third, fourth), upper[:2], lower[:2], hand[:2], depth, end, None if wrist else fifth, wrist
    )
    name = "UR type: parallel axes 2, 3, 4" if wrist else "AL5D type: waist, parallel axes 2, 3, 4, roll"
    return Family(name, build, axes, Aim.POSE, branch_names(build), meanings_of(build), conditions_of(build))
