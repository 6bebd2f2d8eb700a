"""Where branches meet: joints in line, a joint that a pose leaves free, the stretched and the folded arm.

Joints come to turn about one line beside a joint whose axis both of theirs meet at right angles, and as the first and
the last of three parallel ones where links of equal length are folded onto each other.

The joint at an end of the chain that a pose may leave free is the first, where the point that the arm carries is on its
axis, and in an arm of five joints the last axis along it; or the last one of a UR type, where its axis is parallel to
that of joint 4. A pose that is turned about the axis of such a joint has the same solutions but for that joint, so that
any value of it can be had from a solution with the joint at rest.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import sympy as sp

from kinegen.derive.expressions import number_of
from kinegen.derive.folding import Vector
from kinegen.derive.inverse.axes import JointAxis
from kinegen.derive.inverse.exact_geometry import cross, dot, is_null, minus, transposed, turned
from kinegen.derive.inverse.family import (
    ElbowArm,
    Family,
    FlatArm,
    GimbalArm,
    PointArm,
    SphericalArm,
    StrokeArm,
    TripleArm,
    WristArm,
    elbow_of,
)
from kinegen.derive.inverse.geometry import Planar, Wrist, are_square, arm_size, feet, foot
from kinegen.derive.inverse.joint_wrapping import rest_value
from kinegen.derive.inverse.points_on_axes import folded_angle, folds_within_limits
from kinegen.derive.inverse.solve_parallel_axes import triple_size
from kinegen.derive.inverse.tolerances import ALIGNED, FREE
from kinegen.model.branches import Allowance, FreeEnd, InLine, OnAxis, Parallel


def in_line(family: Family) -> tuple[InLine, ...]:
    """Return the joints of an arm that come in line, whatever the values of its runtime parameters.

    Joints that are given have the values that they are given, and a calibrated arm has no axes that meet.
    """
    if family.defect is not None:
        return ()
    joints = family.axes.joints
    triples = zip(joints, joints[1:], joints[2:], strict=False)
    return (*(found for triple in triples if _meet_square(*triple) for found in both_ways(*triple)), *_folded(family))


def _folded(family: Family) -> Iterator[InLine]:
    """Yield the first and the last of three parallel axes whose links, of equal length, fold onto each other."""
    match family.build:
        case FlatArm(turns=(first, middle, last), upper=upper, lower=lower):
            pass
        case TripleArm(turns=(first, middle, last), upper=upper, lower=lower):
            pass
        case _:
            return
    if abs(first.rate) != abs(last.rate) or not are_equal(upper, lower):
        return
    if not folds_within_limits(middle, upper, lower):
        return
    one, other = sorted((first.number - 1, last.number - 1))
    yield InLine(
        first=one,
        middle=middle.number - 1,
        last=other,
        at=folded_angle(upper, lower) / float(middle.rate),
        near=allowance(FREE / abs(middle.rate)),
        are_opposed=bool(first.rate * last.rate < 0),
    )


def are_equal(upper: Planar, lower: Planar) -> bool:
    """Tell whether two links are of one length, but for what leaves a direction free."""
    if any(length.free_symbols for length in (*upper, *lower)):
        return False
    first, second = (math.hypot(*map(float, link)) for link in (upper, lower))
    return abs(first - second) <= number_of(FREE, single=False) * first


def allowance(bound: sp.Expr) -> Allowance:
    """Return a bound as numbers, in double and in single precision."""
    return Allowance(*(number_of(bound, single=single) for single in (False, True)))


def _meet_square(first: JointAxis, middle: JointAxis, last: JointAxis) -> bool:
    """Tell whether three axes of joints that turn alike meet in a point, the middle one square to the others."""
    if not (first.turns and middle.turns and last.turns) or abs(first.rate) != abs(last.rate):
        return False
    if not are_square(first, middle) or not are_square(middle, last):
        return False
    on_first, point = feet(first, middle)
    return is_null(minus(on_first, point)) and is_null(minus(foot(last, point), point))


def both_ways(first: JointAxis, middle: JointAxis, last: JointAxis) -> Iterator[InLine]:
    """Yield the places where the axes on both sides of one that is square to them are alike, and then opposed.

    Only axes that also meet are in line there.
    """
    # The turn about the middle axis that brings the last direction onto the first.
    sine = dot(middle.direction, cross(last.direction, first.direction))
    begin = math.atan2(float(sine), float(dot(last.direction, first.direction)))
    turn_alike = bool(first.rate * last.rate > 0)
    one, other = sorted((first.number - 1, last.number - 1))
    for angle, are_alike in ((begin, True), (begin + math.pi, False)):
        at = angle / float(middle.rate)
        yield InLine(
            first=one,
            middle=middle.number - 1,
            last=other,
            at=at,
            near=allowance(FREE / abs(middle.rate)),
            are_opposed=are_alike != turn_alike,
        )


def free_end(family: Family) -> FreeEnd | None:
    """Return the joint at an end of the chain that a pose may leave free; None where there is none.

    Arms with runtime parameters, with joints given, solved from the tool, or only nearly of their family have none.
    """
    if family.defect is not None or family.held is not None or family.redundancy:
        return None
    if family.is_reversed or family.axes.defaults:
        return None
    match family.build:
        case PointArm(ElbowArm() | GimbalArm() | StrokeArm() as arm) | WristArm(
            ElbowArm() | GimbalArm() | StrokeArm() as arm
        ):
            return _waist(family, arm)
        case TripleArm(wrist=Wrist() as wrist):
            return _flange(family, wrist.joints)
        case TripleArm(roll=JointAxis() as roll) as arm if arm.waist.cosine == 0 and arm.depth == 0:
            along = turned(transposed(family.axes.rotation), roll.direction)
            return _first(family, arm.waist.joint, arm.end, triple_size(arm), along)
        case FlatArm(turns=(first, second)) as arm if are_equal(arm.upper, arm.lower):
            size = arm_size(*arm.upper, *arm.lower)
            return _first(family, first, arm.end, size) if folds_within_limits(second, arm.upper, arm.lower) else None
        case _:
            return None


def _waist(family: Family, arm: ElbowArm | GimbalArm | StrokeArm) -> FreeEnd | None:
    """Return the first joint, unless a depth keeps the point off its axis."""
    waist, depth = arm.waist, sp.S.Zero if isinstance(arm, GimbalArm) else arm.depth
    if waist.cosine == 0 and depth != 0:
        return None
    lengths = arm.start if isinstance(arm, StrokeArm) else (*arm.upper, *arm.lower)
    return _first(family, waist.joint, arm.end, arm_size(waist.offset, depth, *lengths))


def _first(family: Family, joint: JointAxis, point: Vector, size: sp.Expr, along: Vector | None = None) -> FreeEnd:
    """Return the first joint, free where a point that the arm carries is on its axis."""
    return FreeEnd(
        joint=joint.number - 1,
        is_first=True,
        direction=_numbers(joint.direction),
        point=_numbers(joint.point),
        rate=float(joint.rate),
        rest=float(rest_value(joint)),
        where=OnAxis(
            _numbers(_in_tool(family, point)), allowance(ALIGNED * size), None if along is None else _numbers(along)
        ),
    )


def _flange(family: Family, wrist: tuple[JointAxis, JointAxis, JointAxis]) -> FreeEnd | None:
    """Return the last joint of a UR type, if its axis can be parallel to that of joint 4.

    It is at 0 in such a solution, so that limits without 0 leave it where it is.
    """
    before, middle, joint = wrist
    low, high = joint.limits or (sp.S.Zero, sp.S.Zero)
    if not are_square(before, middle) or not are_square(middle, joint) or not low <= 0 <= high:
        return None
    back = transposed(family.axes.rotation)
    return FreeEnd(
        joint=joint.number - 1,
        is_first=False,
        direction=_numbers(turned(back, joint.direction)),
        point=_numbers(_in_tool(family, joint.point)),
        rate=float(joint.rate),
        rest=0.0,
        where=Parallel(tuple(both_ways(before, middle, joint))),
    )


def _in_tool(family: Family, point: Vector) -> Vector:
    """Return a point of the base frame at q = 0 in the frame of the tool."""
    return turned(transposed(family.axes.rotation), minus(point, family.axes.position))


def _numbers(vector: Vector) -> tuple[float, float, float]:
    x, y, z = (float(sp.N(entry)) for entry in vector)
    return x, y, z


Places = tuple[int, tuple[float, float]]
"""Index of a joint in q, and two of its values."""


def boundaries(family: Family) -> tuple[Places, ...]:
    """Return the values of the elbow at which the arm is stretched and folded; none where there is no elbow."""
    elbow = elbow_of(family.build)
    if elbow is None:
        return ()
    joint, upper, lower = elbow
    return (_places(family, joint, sp.atan2(upper[1], upper[0]) - sp.atan2(lower[1], lower[0])),)


def alignments(family: Family) -> tuple[Places, ...]:
    """Return the values of the middle joint of the wrist at which its neighbours are in line; none without a wrist."""
    match family.build:
        case WristArm(_, wrist):
            return (_bend(family, wrist),)
        case SphericalArm(shoulder, _, wrist):
            return _bend(family, shoulder), _bend(family, wrist)
        case TripleArm(wrist=Wrist() as wrist):
            return (_bend(family, wrist),)
        case _:
            return ()


def _bend(family: Family, wrist: Wrist) -> Places:
    return _places(family, wrist.joints[1], -wrist.skew)


def _places(family: Family, joint: JointAxis, angle: sp.Expr) -> Places:
    first, second = (family.axes.value(each / joint.rate) for each in (angle, angle + sp.pi))
    return joint.number - 1, (first, second)
