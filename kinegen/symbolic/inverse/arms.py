"""The families one by one: the conditions on the axes of the joints, and the constants."""

from __future__ import annotations

import itertools

from kinegen.symbolic.fold import NULL, Vector
from kinegen.symbolic.inverse.axes import Axes, JointAxis
from kinegen.symbolic.inverse.conditions import Conditions, Refusal
from kinegen.symbolic.inverse.exact import combined, cross, dot, is_null, minus, tidy
from kinegen.symbolic.inverse.family import (
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
from kinegen.symbolic.inverse.geometry import (
    Wrist,
    are_parallel,
    feet,
    flat_frame,
    in_frame,
    waist_of,
    wrist_of,
)
from kinegen.symbolic.inverse.names import branch_names, conditions_of, meanings_of


def _alike(joint: JointAxis, axis: Vector) -> JointAxis:
    """A joint directed like an axis that is parallel to its own."""
    return joint if dot(joint.direction, axis) > 0 else joint.flipped()


# Arms that put a point in its place -----------------------------------------------------------------------------------


def _arm_of(axes: Axes, end: Vector) -> Arm:
    """The first three joints, carrying a point."""
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
    raise Refusal(f"no family of closed forms begins with the joints {letters}")


def _elbow_arm(axes: Axes, end: Vector) -> ElbowArm:
    first, second, third = axes.joints[:3]
    conditions = Conditions(axes)
    conditions.turned(first, second)
    conditions.apart(second, third)
    conditions.check()
    waist, turned = waist_of(axes, first, second, end)
    second = second.flipped() if turned else second
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
    waist, turned = waist_of(axes, first, second, end)
    second = second.flipped() if turned else second
    third = third if third.rate > 0 else third.flipped()
    frame = flat_frame(third)
    upper = in_frame(frame, minus(third.point, waist.origin))
    lower = in_frame(frame, minus(end, third.point))
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
    waist, turned = waist_of(axes, first, second, end)
    second = second.flipped() if turned else second
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
    start, heading = in_frame(frame, minus(end, turn.point)), in_frame(frame, stroke.direction)
    return ColumnArm(turn, _alike(lift, turn.direction), stroke, frame, end, start, heading[:2])


def _gantry_arm(axes: Axes, end: Vector) -> GantryArm:
    first, second, third = axes.joints[:3]
    volume = dot(cross(first.direction, second.direction), third.direction)
    if volume == 0:
        numbers = ", ".join(str(joint.number) for joint in (first, second, third))
        raise Refusal(f"the directions of joints {numbers} lie in one plane")
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
    """A family with what people call its solutions."""
    described = branch_names(build, axes), meanings_of(build, axes), conditions_of(build, axes)
    return Family(name, build, axes, aim, *described)


def point_arm(axes: Axes) -> Family:
    """Three joints that put the tool in its place."""
    arm = _arm_of(axes, axes.position)
    build = PointArm(arm)
    return _family(_arm_name(arm, 0, axes), build, axes, Aim.POSITION)


def wrist_arm(axes: Axes) -> Family:
    """Three joints and a spherical wrist."""
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
    """Two or three parallel axes, and possibly a shift along them."""
    turns = [joint for joint in axes.joints if joint.turns]
    lifts = [joint for joint in axes.joints if not joint.turns]
    conditions = Conditions(axes)
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
    return _family(name, build, axes, aim)


def triple_arm(axes: Axes) -> Family:
    """A waist, three parallel axes, and a hand of one or two joints."""
    first, second, third, fourth, fifth = axes.joints[:5]
    conditions = Conditions(axes)
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
    parallel = f"parallel axes {_listed(second.number, third.number, fourth.number)}"
    name = f"UR type: {parallel}" if wrist else f"AL5D type: waist, {parallel}, roll"
    return _family(name, build, axes, Aim.POSE)
