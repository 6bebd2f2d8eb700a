"""The arm whose first two axes meet: its third joint from a distance, the other two from a direction."""

from __future__ import annotations

from collections.abc import Iterator

import sympy as sp

from kinegen.symbolic.fold import Vector
from kinegen.symbolic.inverse.cranks import Bend, bend_to
from kinegen.symbolic.inverse.exact import Rotation, chained, tidy, transposed
from kinegen.symbolic.inverse.family import GimbalArm
from kinegen.symbolic.inverse.geometry import Planar
from kinegen.symbolic.inverse.solutions import rest_angle
from kinegen.symbolic.inverse.steps import ONE, ZERO, Angle, Steps
from kinegen.symbolic.inverse.thresholds import ALIGNED, TARGET
from kinegen.symbolic.inverse.waists import Turned, Vectors, Way, arm_size, seen_from_waist, turn_waist, turned_back


def gimbal_ways(steps: Steps, arm: GimbalArm, point: Vector, vectors: Vectors) -> Iterator[Way]:
    """Find all ways, in the order of the branches.

    The first two joints keep the distance of the point from where their axes meet, so that the third alone decides it
    (Pieper 1968, the arm without an offset at the waist). What it makes of the point, the first two then turn to where
    the point has to be: the component along axis 2 gives joint 1, what is left joint 2.

    Args:
        steps: The tape.
        arm: The arm.
        point: Where the point that it carries has to be, in the base frame.
        vectors: Vectors of the base frame that are to be turned back by the arm.

    Yields:
        The ways.
    """
    waist = arm.waist
    near = ALIGNED * arm_size(arm.depth, *arm.upper, *arm.lower)
    seen, rest = seen_from_waist(steps, waist, point), steps.unit(rest_angle(waist.joint))
    square = steps.square(seen)
    beyond = steps.name(square - arm.depth**2) if arm.depth != 0 else square
    distance = steps.root(beyond if arm.depth == 0 else steps.select(ZERO, beyond, beyond, ZERO))
    within = steps.select(-2 * TARGET * steps.near.reach * abs(arm.depth), beyond, ONE, ZERO) if arm.depth != 0 else ONE
    elbow = chained(waist.second, transposed(arm.frame))
    found = []
    for bend in bend_to(steps, (distance, ZERO), arm.upper, arm.lower, ZERO):
        back, turned = bent(steps, arm.upper, arm.lower, bend, distance)
        carried = steps.turned(elbow, (*steps.times((distance, ZERO), back), arm.depth))
        across = steps.square(carried[:2])
        sides = turn_waist(steps, waist, seen, carried[2], near, vectors, rest, across=across)
        found.append([_way(steps, arm, side, carried, (bend, turned), within) for side in sides])
    for both in zip(*found, strict=True):
        yield from both


def bent(steps: Steps, upper: Planar, lower: Planar, bend: Bend, distance: sp.Expr) -> tuple[Planar, Planar]:
    """The elbow of one way as complex numbers of length 1.

    Args:
        steps: The tape.
        upper: The first link.
        lower: The second one.
        bend: How they are bent so that their tip meets the point `(distance, 0)`.
        distance: That distance.

    Returns:
        The turn that brings `(distance, 0)` to `upper + bent * lower`, and how far the elbow is turned.
    """
    inverse = steps.name(1 / tidy(upper[0] ** 2 + upper[1] ** 2))
    real, imaginary = steps.times(bend.direction, lower)
    apart = (steps.name((distance - real) * inverse), steps.name(imaginary * inverse))
    back = steps.times(upper, apart)
    return back, steps.times(back, bend.direction)


def _way(
    steps: Steps, arm: GimbalArm, side: Turned, carried: Vector, elbow: tuple[Bend, Planar], within: sp.Expr
) -> Way:
    """One way, from how the waist is turned and what joint 3 makes of the point, as seen from axis 2."""
    bend, turned_by = elbow
    near = ALIGNED * arm_size(arm.depth, *arm.upper, *arm.lower)
    across, square = carried[:2], steps.square(carried[:2])
    # A point on axis 2 leaves joint 2 free.
    rest = rest_angle(arm.shoulder)
    lead, usual = steps.unit(rest), steps.times(side.across, (across[0], -across[1]))
    scale = steps.name(1 / steps.root(square * steps.square(side.across)))
    direction = (
        steps.select(square, near, lead[0], usual[0] * scale),
        steps.select(square, near, lead[1], usual[1] * scale),
    )
    angle = steps.argument(side.across) - steps.argument(across)
    shoulder = Angle(steps.select(square, near, rest, angle.value), angle.low, angle.high)
    amounts = ((arm.waist.joint, side.swing.angle), (arm.shoulder, shoulder), (arm.elbow, bend.second))
    between: Rotation = chained(arm.frame, transposed(arm.waist.second))
    left = (steps.turned(between, vector) for vector in turned_back(steps, direction, side.left))
    return Way(amounts, (within, side.swing.valid, bend.valid), turned_back(steps, turned_by, tuple(left)))
