"""All solutions of arms with parallel axes: planar arms and SCARA, three with a waist and a roll or a wrist."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import sympy as sp

from kinegen.derive.folding import Vector
from kinegen.derive.inverse.axes import Axes, JointAxis
from kinegen.derive.inverse.exact_geometry import chained, dot, minus, transposed
from kinegen.derive.inverse.family import Family, FlatArm, TripleArm
from kinegen.derive.inverse.first_axis import AfterJoint1, Guide, folded_within_limits, seen_from_waist, solve_joint_1
from kinegen.derive.inverse.geometry import Planar, Waist, Wrist, arm_size
from kinegen.derive.inverse.joint_wrapping import Solution, rest_angle
from kinegen.derive.inverse.planar_subproblems import TwoLinkSolution, bend_to
from kinegen.derive.inverse.straight_line_operations import ONE, ZERO, Angle, OperationBuilder, fixed
from kinegen.derive.inverse.target_pose import Target
from kinegen.derive.inverse.tolerances import ALIGNED, LOOSE, PLANE, TARGET
from kinegen.derive.inverse.wrists import (
    Flip,
    Side,
    hand_direction,
    hand_within_limits,
    held,
    is_limited,
    shared_out,
    sine_of,
    that_is_aligned,
)

_BETTER = 4
"""The plane of one shoulder is that of the target where the other one's fits so many times worse."""


def roll_solutions(
    steps: OperationBuilder, axes: Axes, build: TripleArm, target: Target, sane: sp.Expr
) -> Iterator[Solution]:
    """Solve for all branches of five joints; `sane` is 1 for a finite target whose rotation is one, else 0."""
    waist, roll = build.waist, build.roll
    if roll is None:
        return
    point = target.point(steps, axes, build.end)
    pointing, beside, _ = target.columns(steps, axes, (roll.direction, waist.second[2], waist.first[2]))
    seen, size = seen_from_waist(steps, waist, point), triple_size(build)
    guide = Guide(steps.turned(waist.first, pointing), size)
    in_plane = waist.cosine == 0 and build.depth == 0
    near, start = ALIGNED * size, steps.unit(rest_angle(waist.joint))
    # Without a depth the plane of the approach vector decides the waist, also where the point is on axis 1.
    if in_plane:
        level = steps.square(guide.vector[:2])
        near = steps.name((level + ALIGNED) * size)
        rest = _rest_within_limits(steps, waist, roll, start, (pointing, beside))
        start = _plane_of_approach(steps, rest, guide.vector[:2], level, seen)
    sides = solve_joint_1(steps, waist, seen, build.depth, near, (pointing, beside), start, guide)
    fits = _fits(steps, sides, size, is_one_plane=in_plane)
    # The approach vector gives the sum of the parallel joints, what is across it the roll.
    heading = waist.way(roll.direction)
    for side, fit, is_left in zip(sides, fits, (True, False), strict=True):
        approach, across = side.left
        # The hand as the fourth joint leaves it: its x axis along the approach vector, its y axis along axis 2.
        sine = steps.name(steps.name(approach[1] * across[0]) - steps.name(approach[0] * across[1]))
        turn = steps.argument((across[2], sine))
        lift = steps.argument(approach[:2]) - fixed(sp.atan2(heading[1], heading[0]))
        direction = steps.back(heading[:2], approach[:2])
        for bend in bend_triple(steps, build, side.across, direction, is_left):
            angles = (bend.first, bend.second, lift - bend.first - bend.second)
            yield Solution(
                ((waist.joint, side.swing.angle), *zip(build.turns, angles, strict=True), (roll, turn)),
                (sane, side.swing.valid, fit, bend.valid),
            )


def _fits(
    steps: OperationBuilder, sides: tuple[AfterJoint1, AfterJoint1], size: sp.Expr, *, is_one_plane: bool
) -> list[sp.Expr]:
    """Return 1 for each shoulder in whose plane the target lies, else 0.

    A hand beside the plane of the waist has a plane for each shoulder. A target that is meant for one of them may be
    nearly in the other one, as where the hand points nearly along axis 1: it belongs there if it fits as well, or as
    well as a target can.
    """
    off = [steps.name(side.left[0][2] ** 2 + steps.name(side.missed**2) / size) for side in sides]
    most = PLANE**2 * ONE
    if not is_one_plane:
        best = steps.select(off[0], off[1], off[0], off[1])
        most = steps.name(_BETTER**2 * best + ALIGNED)
        most = steps.select(most, PLANE**2, most, PLANE**2)
    return [steps.select(each, most, ONE, ZERO) for each in off]


def _rest_within_limits(
    steps: OperationBuilder, waist: Waist, roll: JointAxis, start: Planar, hand: tuple[Vector, Vector]
) -> Planar:
    """Return the direction of the waist where the hand is on axis 1 and points along it: joint 5 keeps its limits too.

    Both then turn about one line, and the hand's vector that was along axis 2 has the sum of their angles, or their
    difference where the hand points against axis 1.
    """
    if roll.arc is None:
        return start
    (_, _, ahead), (x, y, _) = (steps.turned(waist.first, vector) for vector in hand)
    total = (steps.name(-waist.sine * y), steps.name(waist.sine * x))
    return shared_out(
        steps,
        (waist.joint, roll),
        total,
        start,
        lambda vector: (vector[0], steps.select(ahead, ZERO, -vector[1], vector[1])),
    )


def _plane_of_approach(steps: OperationBuilder, rest: Planar, guide: Planar, level: sp.Expr, seen: Vector) -> Planar:
    """Return the direction of the waist in whose plane the approach vector lies, towards the arm's point.

    The waist follows the approach vector wherever that tells its direction better than the point does; where both are
    on the axis, the joint is at rest.
    """
    inverse = steps.name(1 / steps.root(level))
    side = steps.select(guide[0] * seen[0] + guide[1] * seen[1], ZERO, -inverse, inverse)
    return steps.choose(level, ALIGNED, rest, (guide[0] * side, guide[1] * side))


def triple_size(build: TripleArm) -> sp.Expr:
    """Return the size of an arm with three parallel axes, squared."""
    return arm_size(build.waist.offset, build.depth, *build.upper, *build.lower, *build.hand)


def bend_triple(
    steps: OperationBuilder, build: TripleArm, point: Planar, direction: Planar, is_left: bool
) -> tuple[TwoLinkSolution, TwoLinkSolution]:
    """Return the two ways to bring axis 4 to where the hand begins, whose direction is the sum of joints 2 to 4."""
    begin = steps.times(direction, build.hand)
    across = (steps.name(point[0] - begin[0]), steps.name(point[1] - begin[1]))
    links = (build.upper, build.lower)
    left, right = (
        replace(bend, first=folded_within_limits(steps, build.turns, links, across, bend.first, direction))
        for bend in bend_to(steps, across, *links, rest_angle(build.turns[0]))
    )
    return (left, right) if is_left else (right, left)


def flat_solutions(
    steps: OperationBuilder, axes: Axes, build: FlatArm, target: Target, sane: sp.Expr
) -> Iterator[Solution]:
    """Solve for all branches of a planar arm or a SCARA; a target has to be in its plane, or upright."""
    first = build.turns[0]
    point = target.point(steps, axes, build.end)
    x, y, z = steps.turned(build.frame, steps.minus(point, first.point))
    height = steps.name(z - dot(build.frame[2], minus(build.end, first.point)))
    valid = [sane]
    # A planar arm reaches its plane alone.
    if build.lift is None:
        size = arm_size(*build.upper, *build.lower)
        valid.append(steps.select(height**2, PLANE**2 * size, ONE, ZERO))
    yaw: Angle | None = None
    # Three joints keep the tool upright, and the yaw of the target is the sum of their angles.
    if len(build.turns) == 3:
        columns = target.columns(steps, axes, build.frame)
        ahead, up = steps.turned(build.frame, columns[0]), steps.turned(build.frame, columns[2])
        upright = steps.select(ZERO, up[2], ONE, ZERO)
        valid.append(steps.select(steps.square(up[:2]), PLANE**2, upright, ZERO))
        yaw = steps.argument(ahead[:2])
    for bend in bend_to(steps, (x, y), build.upper, build.lower, rest_angle(first)):
        angles = [bend.first, bend.second]
        if yaw is not None:
            angles[0] = folded_within_limits(
                steps, build.turns, (build.upper, build.lower), (x, y), bend.first, ahead[:2]
            )
            angles.append(yaw - angles[0] - bend.second)
        lift = [(build.lift, height)] if build.lift else []
        yield Solution((*zip(build.turns, angles, strict=True), *lift), (*valid, bend.valid))


def triple_solutions(
    steps: OperationBuilder, family: Family, build: TripleArm, target: Target, sane: sp.Expr
) -> Iterator[Solution]:
    """Solve for all branches of an arm of the UR type; `sane` as for `roll_solutions`."""
    wrist, axes = build.wrist, family.axes
    if wrist is None:
        return
    point, hand = target.point(steps, axes, build.end), target.columns(steps, axes, wrist.hand)
    between = chained(wrist.frame, transposed(build.waist.second))
    seen, rest = seen_from_waist(steps, build.waist, point), steps.unit(rest_angle(build.waist.joint))
    sides = []
    swung = solve_joint_1(steps, build.waist, seen, build.depth, ALIGNED * triple_size(build), hand, rest)
    for each in swung:
        first, second, third = (steps.turned(between, vector) for vector in each.left)
        sides.append(Side(each.across, (first, second, third)))
    # Parallel axes 4 and 6 leave the hand free, so that it is chosen for the limits of all.
    free: list[Planar | None] = [None, None]
    if family.defect is None and is_limited(build, wrist):
        free = _free_hands(steps, build, wrist, (sides[0], sides[1]))
    for swing, side, own, is_left in zip((each.swing for each in swung), sides, free, (True, False), strict=True):
        ways = [_hold(steps, build, wrist, side, sign, is_left, own if sign > 0 else None) for sign in (1, -1)]
        for elbow in (0, 1):
            for flip, bends, fits in ways:
                bend = bends[elbow]
                angles = (bend.first, bend.second, flip[0] - bend.first - bend.second)
                yield Solution(
                    (
                        (build.waist.joint, swing.angle),
                        *zip(build.turns, angles, strict=True),
                        *zip(wrist.joints[1:], flip[1:], strict=True),
                    ),
                    (sane, swing.valid, fits, bend.valid),
                )


def _free_hands(
    steps: OperationBuilder, build: TripleArm, wrist: Wrist, sides: tuple[Side, Side]
) -> list[Planar | None]:
    """Return where the hand points on both sides, where axes 4 and 6 are parallel there.

    Axis 6 cannot be parallel to axis 4 on both sides, unless these differ by half a turn, as they do without a depth.
    """
    if build.depth.is_number and build.depth != 0:
        sides = (that_is_aligned(steps, *sides),) * 2
    found: list[Planar | None] = []
    for side in sides:
        start = _within_reach(steps, build, side.across, (side.left[1][1], steps.name(-side.left[1][0])))
        found.append(hand_within_limits(steps, build, wrist, side, start))
    return found


def _hold(
    steps: OperationBuilder, build: TripleArm, wrist: Wrist, side: Side, sign: int, is_left: bool, free: Planar | None
) -> tuple[Flip, tuple[TwoLinkSolution, TwoLinkSolution], sp.Expr]:
    """Return one way to hold the wrist, the bends that go with it, and 1 where the hand fits the target, else 0."""
    usual = hand_direction(steps, side.left)
    wanted = (sign * usual[0], sign * usual[1])
    direction = _within_reach(steps, build, side.across, wanted)
    if free is not None:
        direction = (side.aligned(steps, free[0], direction[0]), side.aligned(steps, free[1], direction[1]))
    roll, tilt, flange = held(steps, side.left, direction)
    skew = fixed(wrist.skew)
    apart = steps.square((direction[0] - wanted[0], direction[1] - wanted[1]))
    fits = steps.select(apart * sine_of(steps, side.left) ** 2, LOOSE, ONE, ZERO) if direction != wanted else ONE
    bends = bend_triple(steps, build, side.across, direction, is_left)
    return (roll, (tilt if sign > 0 else -tilt) - skew, flange), bends, fits


def _within_reach(steps: OperationBuilder, build: TripleArm, point: Planar, direction: Planar) -> Planar:
    """Return the direction of the hand that is nearest to a given one and leaves axis 4 within reach of axis 2.

    With `hand` at a cosine c to the point, axis 4 is at the squared distance `point^2 + hand^2 - 2 |point| |hand| c`.
    The less axis 6 is turned from axis 4, the less does it matter where the hand points, and the less sure is it.
    """
    if build.hand[0] == 0 and build.hand[1] == 0:
        return direction
    upper, lower, hand = (steps.length(link) for link in (build.upper, build.lower, build.hand))
    distance = steps.root(steps.square(point))
    scale = steps.name(1 / (distance * hand))
    along, aside = steps.times(steps.times(direction, build.hand), (point[0], -point[1]))
    cosine, both = steps.name(along * scale), distance**2 + hand**2
    # Cosines at which axis 4 is as far as the stretched and as the folded links reach.
    least, most = (steps.name((both - (upper + sign * lower) ** 2) * scale / 2) for sign in (1, -1))
    nearest = steps.select(cosine, least, least, most)
    sine = steps.root_of_positive(1 - nearest**2)
    sine = steps.select(aside * scale, ZERO, -sine, sine)
    turned_hand = steps.times(point, (nearest, sine))
    real, imaginary = steps.times(turned_hand, (build.hand[0], -build.hand[1]))
    # What rounding put outside is left to the elbow, which has a tolerance for it.
    slack = steps.name(TARGET / 10 * steps.near.condition * upper * lower * scale)

    def chosen(other: sp.Expr, usual: sp.Expr) -> sp.Expr:
        return steps.select(cosine, least - slack, other, steps.select(most + slack, cosine, other, usual))

    return chosen(real * scale, direction[0]), chosen(imaginary * scale, direction[1])
