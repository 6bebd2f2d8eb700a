"""Arms of three joints that put a point in its place: all ways, and what attitude each leaves to the wrist."""

from __future__ import annotations

from collections.abc import Iterator

import sympy as sp

from kinegen.symbolic.fold import Vector
from kinegen.symbolic.inverse.cranks import bend_to, swing_to
from kinegen.symbolic.inverse.exact import IDENTITY, Rotation, tidy
from kinegen.symbolic.inverse.family import Arm, ColumnArm, ElbowArm, GantryArm, GimbalArm, StrokeArm
from kinegen.symbolic.inverse.geometry import Planar
from kinegen.symbolic.inverse.solutions import rest_angle
from kinegen.symbolic.inverse.solve_gimbal import gimbal_ways
from kinegen.symbolic.inverse.steps import Steps, fixed
from kinegen.symbolic.inverse.thresholds import ALIGNED
from kinegen.symbolic.inverse.waists import (
    Vectors,
    Way,
    arm_size,
    minus_named,
    seen_from_waist,
    turn_waist,
    turned_back,
)


def last_frame(arm: Arm) -> Rotation:
    """Columns of the frame in which an arm leaves vectors, in the base frame at q = 0."""
    match arm:
        case ElbowArm(waist) | StrokeArm(waist):
            return waist.second
        case ColumnArm() | GimbalArm():
            return arm.frame
        case GantryArm():
            return IDENTITY


def ways(steps: Steps, arm: Arm, point: Vector, vectors: Vectors) -> Iterator[Way]:
    """Find all ways, in the order of the branches.

    Args:
        steps: The tape.
        arm: The arm.
        point: Where the point that it carries has to be, in the base frame.
        vectors: Vectors of the base frame that are to be turned back by the arm.

    Yields:
        The ways.
    """
    match arm:
        case ElbowArm():
            yield from _elbow_ways(steps, arm, point, vectors)
        case GimbalArm():
            yield from gimbal_ways(steps, arm, point, vectors)
        case StrokeArm():
            yield from _stroke_ways(steps, arm, point, vectors)
        case ColumnArm():
            yield from _column_ways(steps, arm, point, vectors)
        case GantryArm():
            apart = minus_named(steps, point, arm.end)
            amounts = steps.turned(arm.inverse, apart)
            yield Way(tuple(zip(arm.joints, amounts, strict=True)), (), vectors)


def _elbow_ways(steps: Steps, arm: ElbowArm, point: Vector, vectors: Vectors) -> Iterator[Way]:
    waist = arm.waist
    near = ALIGNED * arm_size(waist.offset, arm.depth, *arm.upper, *arm.lower)
    seen, rest = seen_from_waist(steps, waist, point), steps.unit(rest_angle(waist.joint))
    sides = turn_waist(steps, waist, seen, arm.depth, near, vectors, rest)
    for turned, is_left in zip(sides, (True, False), strict=True):
        bends = bend_to(steps, turned.across, arm.upper, arm.lower, rest_angle(arm.shoulder))
        # Behind the waist the arm is seen in a mirror.
        for bend in bends if is_left else reversed(bends):
            amounts = ((waist.joint, turned.swing.angle), (arm.shoulder, bend.first), (arm.elbow, bend.second))
            yield Way(amounts, (turned.swing.valid, bend.valid), turned_back(steps, bend.direction, turned.left))


def _stroke_ways(steps: Steps, arm: StrokeArm, point: Vector, vectors: Vectors) -> Iterator[Way]:
    waist = arm.waist
    near = ALIGNED * arm_size(waist.offset, arm.depth, *arm.start)
    ahead, aside = _along(arm.heading, arm.start)
    seen, rest = seen_from_waist(steps, waist, point), steps.unit(rest_angle(waist.joint))
    lowered = steps.times(steps.unit(rest_angle(arm.shoulder)), arm.heading)
    for turned in turn_waist(steps, waist, seen, arm.depth, near, vectors, rest):
        for swing in swing_to(steps, turned.across, aside, near, lowered):
            direction = steps.back(arm.heading, swing.direction)
            amounts = (
                (waist.joint, turned.swing.angle),
                (arm.shoulder, swing.angle - fixed(sp.atan2(arm.heading[1], arm.heading[0]))),
                (arm.stroke, steps.name(swing.along - ahead)),
            )
            yield Way(amounts, (turned.swing.valid, swing.valid), turned_back(steps, direction, turned.left))


def _column_ways(steps: Steps, arm: ColumnArm, point: Vector, vectors: Vectors) -> Iterator[Way]:
    x, y, z = steps.turned(arm.frame, minus_named(steps, point, arm.turn.point))
    ahead, aside = _along(arm.heading, arm.start[:2])
    rest = steps.times(steps.unit(rest_angle(arm.turn)), arm.heading)
    level = tuple(steps.turned(arm.frame, vector) for vector in vectors)
    for swing in swing_to(steps, (x, y), aside, ALIGNED * arm_size(*arm.start), rest):
        direction = steps.back(arm.heading, swing.direction)
        amounts = (
            (arm.turn, swing.angle - fixed(sp.atan2(arm.heading[1], arm.heading[0]))),
            (arm.lift, steps.name(z - arm.start[2])),
            (arm.stroke, steps.name(swing.along - ahead)),
        )
        yield Way(amounts, (swing.valid,), turned_back(steps, direction, level))


def _along(heading: Planar, vector: Planar) -> Planar:
    """A planar vector along a direction and across it."""
    return (
        tidy(heading[0] * vector[0] + heading[1] * vector[1]),
        tidy(heading[0] * vector[1] - heading[1] * vector[0]),
    )
