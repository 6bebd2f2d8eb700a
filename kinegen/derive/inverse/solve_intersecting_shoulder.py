"""Arms whose first axes meet in a point: two of them, or the three of a spherical shoulder with its arm angle.

The third joint of the first kind follows from a distance, the other two from a direction (Pieper 1968, the arm without
an offset at the waist). The elbow of the second kind follows from the distance of the wrist; the line from the shoulder
to the wrist and the arm angle then say how the upper arm is turned, and what is left is a wrist at either end (Shimizu
et al., Analytical inverse kinematic computation for 7-DOF redundant manipulators with joint limits, IEEE Transactions
on Robotics 24(5), 2008). The arm angle is measured from the half plane that contains axis 1 (Kreutz-Delgado, Long and
Seraji, Kinematic analysis of 7-DOF manipulators, International Journal of Robotics Research 11(5), 1992), so that it is
the same for all branches.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import sympy as sp

from kinegen.derive.folding import Vector
from kinegen.derive.inverse.axes import Axes
from kinegen.derive.inverse.exact_geometry import Rotation, chained, tidy, transposed, turned
from kinegen.derive.inverse.family import GimbalArm, SphericalArm
from kinegen.derive.inverse.first_axis import (
    AfterJoint1,
    ArmSolution,
    Vectors,
    free_waist,
    seen_from_waist,
    solve_joint_1,
    turned_back,
)
from kinegen.derive.inverse.geometry import Planar, arm_size
from kinegen.derive.inverse.joint_wrapping import Solution, rest_angle
from kinegen.derive.inverse.limit_conditions import FreeTurn
from kinegen.derive.inverse.planar_subproblems import TwoLinkSolution, bend_to
from kinegen.derive.inverse.points_on_axes import gimbal_bends
from kinegen.derive.inverse.straight_line_operations import ONE, ZERO, Angle, OperationBuilder
from kinegen.derive.inverse.target_pose import Target
from kinegen.derive.inverse.tolerances import ALIGNED, TARGET
from kinegen.derive.inverse.wrists import flips
from kinegen.support.dataclass import dataclass


def gimbal_ways(steps: OperationBuilder, arm: GimbalArm, point: Vector, vectors: Vectors) -> Iterator[ArmSolution]:
    """Yield all ways of an arm whose axes 1 and 2 meet, as `solve.ways` does.

    The first two joints keep the distance of the point from where their axes meet, so that the third alone decides it.
    What it makes of the point, the first two then turn to where the point has to be: the component along axis 2 gives
    joint 1, what is left joint 2.
    """
    waist = arm.waist
    near = ALIGNED * arm_size(arm.depth, *arm.upper, *arm.lower)
    seen, rest = seen_from_waist(steps, waist, point), steps.unit(rest_angle(waist.joint))
    # The distance from where axes 1 and 2 meet depends on the elbow alone.
    square = steps.square(seen)
    beyond = steps.name(square - arm.depth**2) if arm.depth != 0 else square
    distance = steps.root(beyond) if arm.depth == 0 else steps.root_of_positive(beyond)
    within = steps.select(-2 * TARGET * steps.near.reach * abs(arm.depth), beyond, ONE, ZERO) if arm.depth != 0 else ONE
    found = []
    on_axes = gimbal_bends(arm)
    for place, bend in enumerate(bend_to(steps, (distance, ZERO), arm.upper, arm.lower, ZERO)):
        elbow = _led_within(steps, arm, seen, bend, bent(steps, arm.upper, arm.lower, bend, distance)[1])
        across = steps.square(elbow.carried[:2])
        sides = solve_joint_1(steps, waist, seen, elbow.carried[2], near, vectors, rest, across=across)
        first, second = (_way(steps, arm, side, seen, elbow) for side in sides)
        valid = (within, bend.valid, elbow.valid)
        # Both sides are the same where a joint is free.
        free = tuple(each for each, bends in zip(first.free, on_axes, strict=True) if place in bends)
        found.append(
            [
                replace(first, valid=(*valid, *first.valid), free=free),
                replace(second, valid=(*valid, *second.valid), free=()),
            ]
        )
    # Branches go by the shoulder first, ways were found by the elbow.
    for both in zip(*found, strict=True):
        yield from both


@dataclass(frozen=True, slots=True)
class _Elbow:
    """How the third joint is turned.

    Attributes:
        turn: The angle as a complex number of length 1.
        carried: The point as seen from where axes 1 and 2 meet, in the axes of the waist's second frame.
        valid: 1 where it is as far away as it has to be, else 0.
    """

    angle: Angle
    turn: Planar
    carried: Vector
    valid: sp.Expr


def _led_within(steps: OperationBuilder, arm: GimbalArm, seen: Vector, bend: TwoLinkSolution, turn: Planar) -> _Elbow:
    """Turn the elbow of one way a little where rounding leaves no way for the first two joints.

    Where the arm is stretched, its distance hardly depends on the elbow, which the distance tells to the root of the
    rounding alone; that much of it may decide whether the point can be turned to where it has to be. With the point at
    v as seen from axis 2 and at the height h along axis 1, that takes v_x^2 + v_y^2 >= h^2. The least turn is taken
    that makes both equal, from their values and two derivatives by the elbow.
    """
    waist, name = arm.waist, steps.name
    between = chained(waist.second, transposed(arm.frame))
    place, ahead = _carried(steps, arm, between, turn)
    # Both derivatives by the elbow: the lower link turned by a quarter and by half a turn.
    aside = steps.turned(between, (-ahead[1], ahead[0], ZERO))
    back = steps.turned(between, (-ahead[0], -ahead[1], ZERO))
    tilt = tidy(-waist.cosine / waist.sine)
    height = name((seen[2] - waist.cosine * place[2]) / waist.sine)
    across = steps.square(place[:2])
    # What is missing for the waist, as a quadratic function of a small turn of the elbow.
    lack = name(height**2 - across)
    linear = name(2 * (place[0] * aside[0] + place[1] * aside[1] - tilt * height * aside[2]))
    curved = name(
        steps.square(aside[:2])
        - (tilt * aside[2]) ** 2
        + place[0] * back[0]
        + place[1] * back[1]
        - tilt * height * back[2]
    )
    root = steps.root(name(linear**2 + 4 * lack * curved))
    more = name(2 * lack / (linear + steps.select(linear, ZERO, -root, root)))
    # What the waist can do without is left to it; farther away is another elbow, and so near, a turn is its tangent.
    more = steps.select(more**2, (4 * steps.near.within) ** 2, more, ZERO)
    more = steps.select(name((TARGET / 8 * steps.near.reach) ** 2 * across), lack**2, more, ZERO)
    more = steps.select(ZERO, lack, more, ZERO)
    scale = name(1 / steps.root(name(1 + more**2)))
    led = steps.times(turn, (scale, name(more * scale)))
    carried, _ = _carried(steps, arm, between, led)
    # A turn that leaves the target by more than it may be off is no solution.
    reached, wanted = steps.square(carried), steps.square(seen)
    limit = name(2 * (TARGET * steps.near.reach) ** 2 * name(reached + wanted))
    valid = steps.select(limit, name(reached - wanted) ** 2, ZERO, ONE)
    angle = bend.second + Angle(more, 0.0, 0.0)
    return _Elbow(angle, led, carried, valid)


def _carried(steps: OperationBuilder, arm: GimbalArm, between: Rotation, turn: Planar) -> tuple[Vector, Planar]:
    """Return the point that the arm carries for a turn of the elbow, as seen from axis 2, and the lower link."""
    lower = steps.times(turn, arm.lower)
    planar = tuple(steps.name(a + b) for a, b in zip(arm.upper, lower, strict=True))
    return steps.turned(between, (planar[0], planar[1], arm.depth)), lower


def bent(
    steps: OperationBuilder, upper: Planar, lower: Planar, bend: TwoLinkSolution, distance: sp.Expr
) -> tuple[Planar, Planar]:
    """Return the turn that brings `(distance, 0)` to `upper + bent * lower`, and how far the elbow is turned.

    Both are complex numbers of length 1, for links that are bent so that their tip meets the point `(distance, 0)`.
    """
    inverse = steps.name(1 / tidy(upper[0] ** 2 + upper[1] ** 2))
    real, imaginary = steps.times(bend.direction, lower)
    apart = (steps.name((distance - real) * inverse), steps.name(imaginary * inverse))
    # Its length is 1 but for what an arm that is stretched lacks.
    back = steps.sharpened(steps.times(upper, apart))
    return back, steps.times(back, bend.direction)


def _way(steps: OperationBuilder, arm: GimbalArm, side: AfterJoint1, seen: Vector, elbow: _Elbow) -> ArmSolution:
    """Return one way, from the point, how the waist is turned, and what joint 3 makes of the point."""
    near = ALIGNED * arm_size(arm.depth, *arm.upper, *arm.lower)
    across, square = elbow.carried[:2], steps.square(elbow.carried[:2])
    # A point on axis 2 leaves joint 2 free.
    rest = rest_angle(arm.shoulder)
    # Joint 2 turns what joint 3 made of the point to where the waist leaves it.
    lead, usual = steps.unit(rest), steps.times(side.across, (across[0], -across[1]))
    scale = steps.name(1 / steps.root(square * steps.square(side.across)))
    direction = steps.choose(square, near, lead, (usual[0] * scale, usual[1] * scale))
    angle = steps.argument(side.across) - steps.argument(across)
    shoulder = Angle(steps.select(square, near, rest, angle.value), angle.low, angle.high)
    amounts = ((arm.waist.joint, side.swing.angle), (arm.shoulder, shoulder), (arm.elbow, elbow.angle))
    between: Rotation = chained(arm.frame, transposed(arm.waist.second))
    left = (steps.turned(between, vector) for vector in turned_back(steps, direction, side.left))
    free = (
        *free_waist(steps, arm.waist, seen, ZERO, near, direction),
        FreeTurn(arm.shoulder, square, near, (ZERO, ZERO, ONE)),
    )
    axes = turned_back(steps, elbow.turn, tuple(steps.turned(between, each.axis) for each in free))
    return ArmSolution(
        amounts,
        (side.swing.valid,),
        turned_back(steps, elbow.turn, tuple(left)),
        tuple(replace(each, axis=axis) for each, axis in zip(free, axes, strict=True)),
    )


@dataclass(frozen=True, slots=True)
class _Line:
    """The line from the shoulder to the wrist, in the frame of the shoulder, and the arm angle about it.

    Attributes:
        lead: Its direction across axis 1.
        tilt: Cosine and sine of its angle from axis 1.
        angle: Cosine and sine of the arm angle.
        distance: Its length.
    """

    lead: Planar
    tilt: Planar
    angle: Planar
    distance: sp.Expr

    def seen(self, steps: OperationBuilder, vector: Vector) -> Vector:
        """Return a vector of the shoulder's frame along the line, towards the elbow, and square to both."""
        along, across = steps.back(self.lead, vector[:2])
        line, down = steps.back(self.tilt, (vector[2], along))
        elbow, square = steps.back(self.angle, (-down, -across))
        return line, elbow, square

    def placed(self, steps: OperationBuilder, vector: Vector) -> Vector:
        """Lead back: a vector along the line, towards the elbow and square to both becomes one of the shoulder."""
        line, elbow, square = vector
        up, beside = steps.times(self.angle, (elbow, square))
        height, along = steps.times(self.tilt, (line, -up))
        return (*steps.times(self.lead, (along, -beside)), height)


def spherical_solutions(
    steps: OperationBuilder, axes: Axes, build: SphericalArm, target: Target, angle: sp.Expr, sane: sp.Expr
) -> Iterator[Solution]:
    """Solve for all branches at an arm angle; `sane` is 1 for a target of finite numbers whose rotation is one."""
    line = _line(steps, axes, build, target, angle)
    # Sines and cosines of what is no number, or too large, are NaN.
    valid = steps.select(-2 * ONE, line.angle[0], ONE, ZERO)
    # Seen from the line, the attitude is the same for all branches.
    hand = target.columns(steps, axes, build.wrist.hand)
    seen = [line.seen(steps, steps.turned(build.shoulder.frame, column)) for column in hand]
    starts = [steps.unit(rest_angle(wrist.joints[0])) for wrist in (build.shoulder, build.wrist)]
    bends = bend_to(steps, (line.distance, ZERO), build.upper, build.lower, ZERO)
    for bend, side in zip(bends, (1, -1), strict=True):
        shoulder = flips(steps, build.shoulder, _upper_arm(steps, build, line, bend, side), starts[0])
        wrist = flips(steps, build.wrist, _left_to_wrist(steps, build, bend, side, seen), starts[1])
        for first in shoulder:
            for last in wrist:
                amounts = (
                    *zip(build.shoulder.joints, first, strict=True),
                    (build.elbow, bend.second),
                    *zip(build.wrist.joints, last, strict=True),
                )
                yield Solution(amounts, (sane, valid, bend.valid))


def _line(steps: OperationBuilder, axes: Axes, build: SphericalArm, target: Target, angle: sp.Expr) -> _Line:
    """Return the line, from where the target puts the wrist's centre; it is upright on axis 1 or without a length."""
    shoulder = build.shoulder
    centre = target.point(steps, axes, build.wrist.centre)
    x, y, z = steps.turned(shoulder.frame, steps.minus(centre, shoulder.centre))
    near = ALIGNED * arm_size(*build.upper, *build.lower)
    level, start = steps.square((x, y)), steps.unit(rest_angle(shoulder.joints[0]))
    across = steps.root(level)
    distance = steps.root(level + z**2)
    inverse = steps.name(1 / steps.select(level, near, ONE, across))
    lead = steps.choose(level, near, start, (x * inverse, y * inverse))
    # Links that may fold leave a line of no length, which is taken to be upright.
    scale, tilt = distance, (z, across)
    if steps.near.may_fold(*(steps.length(link) for link in (build.upper, build.lower))):
        is_short = steps.square((distance, ZERO))
        scale = steps.select(is_short, near, ONE, distance)
        tilt = steps.choose(is_short, near, (ONE, ZERO), tilt)
    tilt = steps.scaled(tilt, steps.name(1 / scale))
    return _Line(lead, tilt, (sp.cos(angle), sp.sin(angle)), distance)


def _upper_arm(steps: OperationBuilder, build: SphericalArm, line: _Line, bend: TwoLinkSolution, side: int) -> Rotation:
    """Return the rotation that is left to the shoulder, in its frame."""
    back, _ = bent(steps, build.upper, build.lower, bend, line.distance)
    columns = []
    for column in build.shoulder.hand:
        x, y, z = turned(build.frame, column)
        along, aside = steps.back(back, (x, y))
        columns.append(line.placed(steps, (along, side * aside, side * z)))
    return columns[0], columns[1], columns[2]


def _left_to_wrist(
    steps: OperationBuilder, build: SphericalArm, bend: TwoLinkSolution, side: int, seen: list[Vector]
) -> Rotation:
    """Return the rotation that is left to the wrist, in its frame."""
    between = chained(build.wrist.frame, transposed(build.frame))
    columns = []
    for line, elbow, square in seen:
        columns.append(steps.turned(between, (*steps.back(bend.direction, (line, side * elbow)), side * square)))
    return columns[0], columns[1], columns[2]
