"""All solutions of every family, as formulas on a tape."""

from __future__ import annotations

from collections.abc import Iterator

import sympy as sp

from kinegen.symbolic.fold import Vector
from kinegen.symbolic.inverse.axes import Axes
from kinegen.symbolic.inverse.cranks import Bend, bend_to
from kinegen.symbolic.inverse.exact import Rotation, chained, dot, minus, transposed
from kinegen.symbolic.inverse.family import Family, FlatArm, PointArm, SphericalArm, TripleArm, WristArm
from kinegen.symbolic.inverse.geometry import Planar, Waist, Wrist
from kinegen.symbolic.inverse.solutions import Solution, rest_angle
from kinegen.symbolic.inverse.solve_arm import last_frame, ways
from kinegen.symbolic.inverse.solve_spherical import spherical_solutions
from kinegen.symbolic.inverse.steps import ONE, ZERO, Angle, Steps, fixed
from kinegen.symbolic.inverse.target import Target
from kinegen.symbolic.inverse.thresholds import ALIGNED, LOOSE, PLANE, RIGID, TARGET
from kinegen.symbolic.inverse.waists import Turned, arm_size, minus_named, seen_from_waist, turn_waist
from kinegen.symbolic.inverse.wrists import Columns, Flip, flips, hand_direction, held, sine_of

LARGEST = sp.Integer(10) ** 15


def solve(steps: Steps, family: Family, target: Target, given: sp.Expr = ZERO) -> Iterator[Solution]:
    """Solve for all branches, in the order of `family.branches`.

    Args:
        steps: The tape.
        family: The arm.
        target: The pose of the tool.
        given: The arm angle, if there is one.

    Yields:
        The solutions, before the limits of the joints are seen to.
    """
    axes, sane = family.axes, _sane(steps, family, target)
    match family.build:
        case PointArm(arm):
            for way in ways(steps, arm, target.point(steps, axes, arm.end), ()):
                yield Solution(way.amounts, (sane, *way.valid))
        case WristArm():
            yield from _wrist_solutions(steps, axes, family.build, target, sane)
        case FlatArm():
            yield from _flat_solutions(steps, axes, family.build, target, sane)
        case TripleArm(roll=None):
            yield from _triple_solutions(steps, axes, family.build, target, sane)
        case SphericalArm():
            yield from spherical_solutions(steps, axes, family.build, target, given, sane)
        case TripleArm():
            yield from _roll_solutions(steps, axes, family.build, target, sane)


def _sane(steps: Steps, family: Family, target: Target) -> sp.Expr:
    """1 for a target of finite numbers, whose rotation is one as far as it is read; else 0."""
    lengths = (*target.position, *(parameter for parameter, _ in family.axes.defaults))
    finite = steps.select(steps.name(sp.Add(*(length**2 for length in lengths))), LARGEST, ONE, ZERO)
    if not reads_attitude(family):
        return finite
    return steps.select(_off_rigid(steps, target.rotation), RIGID**2, finite, ZERO)


def _off_rigid(steps: Steps, rotation: Rotation) -> sp.Expr:
    """How far a matrix is from a proper rotation: the sum of the squares of what must be zero.

    The first two columns have to be square on each other and of length 1, the third their cross product.
    """
    first, second, third = transposed(rotation)
    off = [steps.name(steps.square(column) - 1) for column in (first, second)]
    off.append(steps.name(sp.Add(*(steps.name(a * b) for a, b in zip(first, second, strict=True)))))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        across = steps.name(steps.name(first[i] * second[j]) - steps.name(first[j] * second[i]))
        off.append(steps.name(third[k] - across))
    return steps.name(sp.Add(*(entry**2 for entry in off)))


def reads_attitude(family: Family) -> bool:
    """Whether the attitude of a target has a part in the solutions."""
    position = isinstance(family.build, PointArm) or (
        isinstance(family.build, FlatArm) and len(family.build.turns) == 2
    )
    return not position


def _wrist_solutions(steps: Steps, axes: Axes, build: WristArm, target: Target, sane: sp.Expr) -> Iterator[Solution]:
    wrist = build.wrist
    hand = target.columns(steps, axes, wrist.hand)
    # From the axes in which the arm leaves vectors to those of the wrist, both at q = 0.
    between = chained(wrist.frame, transposed(last_frame(build.arm)))
    start = steps.unit(rest_angle(wrist.joints[0]))
    for way in ways(steps, build.arm, target.point(steps, axes, build.arm.end), hand):
        first, second, third = (steps.turned(between, vector) for vector in way.left)
        for flip in flips(steps, wrist, (first, second, third), start):
            yield Solution((*way.amounts, *zip(wrist.joints, flip, strict=True)), (sane, *way.valid))


def _flat_solutions(steps: Steps, axes: Axes, build: FlatArm, target: Target, sane: sp.Expr) -> Iterator[Solution]:
    first = build.turns[0]
    point = target.point(steps, axes, build.end)
    x, y, z = steps.turned(build.frame, minus_named(steps, point, first.point))
    height = steps.name(z - dot(build.frame[2], minus(build.end, first.point)))
    valid = [sane]
    if build.lift is None:
        size = arm_size(*build.upper, *build.lower)
        valid.append(steps.select(height**2, PLANE**2 * size, ONE, ZERO))
    yaw: Angle | None = None
    if len(build.turns) == 3:
        columns = target.columns(steps, axes, build.frame)
        ahead, up = steps.turned(build.frame, columns[0]), steps.turned(build.frame, columns[2])
        upright = steps.select(ZERO, up[2], ONE, ZERO)
        valid.append(steps.select(steps.square(up[:2]), PLANE**2, upright, ZERO))
        yaw = steps.argument(ahead[:2])
    for bend in bend_to(steps, (x, y), build.upper, build.lower, rest_angle(first)):
        angles = [bend.first, bend.second]
        if yaw is not None:
            angles.append(yaw - bend.first - bend.second)
        lift = [(build.lift, height)] if build.lift else []
        yield Solution((*zip(build.turns, angles, strict=True), *lift), (*valid, bend.valid))


def _triple_size(build: TripleArm) -> sp.Expr:
    return arm_size(build.waist.offset, build.depth, *build.upper, *build.lower, *build.hand)


def _triple_solutions(steps: Steps, axes: Axes, build: TripleArm, target: Target, sane: sp.Expr) -> Iterator[Solution]:
    wrist = build.wrist
    if wrist is None:
        return
    point, hand = target.point(steps, axes, build.end), target.columns(steps, axes, wrist.hand)
    between = chained(wrist.frame, transposed(build.waist.second))
    seen, rest = seen_from_waist(steps, build.waist, point), steps.unit(rest_angle(build.waist.joint))
    sides = turn_waist(steps, build.waist, seen, build.depth, ALIGNED * _triple_size(build), hand, rest)
    for side, is_left in zip(sides, (True, False), strict=True):
        first, second, third = (steps.turned(between, vector) for vector in side.left)
        left = (first, second, third)
        ways = [_hold(steps, build, wrist, side, left, sign, is_left) for sign in (1, -1)]
        for elbow in (0, 1):
            for flip, bends, fits in ways:
                bend = bends[elbow]
                angles = (bend.first, bend.second, flip[0] - bend.first - bend.second)
                yield Solution(
                    (
                        (build.waist.joint, side.swing.angle),
                        *zip(build.turns, angles, strict=True),
                        *zip(wrist.joints[1:], flip[1:], strict=True),
                    ),
                    (sane, side.swing.valid, fits, bend.valid),
                )


def _hold(
    steps: Steps, build: TripleArm, wrist: Wrist, side: Turned, left: Columns, sign: int, is_left: bool
) -> tuple[Flip, tuple[Bend, Bend], sp.Expr]:
    """One way to hold the wrist, the bends of the arm that go with it, and 1 where the hand fits the target, else 0."""
    usual = hand_direction(steps, left)
    wanted = (sign * usual[0], sign * usual[1])
    direction = _within_reach(steps, build, side.across, wanted)
    roll, tilt, flange = held(steps, left, direction)
    skew = fixed(wrist.skew)
    apart = steps.square((direction[0] - wanted[0], direction[1] - wanted[1]))
    fits = steps.select(apart * sine_of(steps, left) ** 2, LOOSE, ONE, ZERO) if direction != wanted else ONE
    bends = _bend_triple(steps, build, side, direction, is_left)
    return (roll, (tilt if sign > 0 else -tilt) - skew, flange), bends, fits


def _within_reach(steps: Steps, build: TripleArm, point: Planar, direction: Planar) -> Planar:
    """The direction of the hand that is nearest to a given one and leaves axis 4 within reach of axis 2.

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
    least, most = (steps.name((both - (upper + sign * lower) ** 2) * scale / 2) for sign in (1, -1))
    nearest = steps.select(cosine, least, least, most)
    sine = steps.root(steps.select(ZERO, 1 - nearest**2, 1 - nearest**2, ZERO))
    sine = steps.select(aside * scale, ZERO, -sine, sine)
    turned_hand = steps.times(point, (nearest, sine))
    real, imaginary = steps.times(turned_hand, (build.hand[0], -build.hand[1]))
    # What rounding put outside is left to the elbow, which has a tolerance for it.
    slack = steps.name(TARGET / 10 * steps.near.condition * upper * lower * scale)

    def chosen(other: sp.Expr, usual: sp.Expr) -> sp.Expr:
        return steps.select(cosine, least - slack, other, steps.select(most + slack, cosine, other, usual))

    return chosen(real * scale, direction[0]), chosen(imaginary * scale, direction[1])


def _bend_triple(steps: Steps, build: TripleArm, side: Turned, direction: Planar, is_left: bool) -> tuple[Bend, Bend]:
    """The two ways to bring axis 4 to where the hand, turned by a direction, begins."""
    begin = steps.times(direction, build.hand)
    across = (steps.name(side.across[0] - begin[0]), steps.name(side.across[1] - begin[1]))
    bends = bend_to(steps, across, build.upper, build.lower, rest_angle(build.turns[0]))
    return bends if is_left else (bends[1], bends[0])


def _roll_solutions(steps: Steps, axes: Axes, build: TripleArm, target: Target, sane: sp.Expr) -> Iterator[Solution]:
    waist, roll = build.waist, build.roll
    if roll is None:
        return
    point = target.point(steps, axes, build.end)
    pointing, beside, _ = target.columns(steps, axes, (roll.direction, waist.second[2], waist.first[2]))
    seen, size = seen_from_waist(steps, waist, point), _triple_size(build)
    guide = steps.turned(waist.first, pointing)[:2]
    level = steps.square(guide)
    near = steps.name((level + ALIGNED) * size)
    start = _plane_of_approach(steps, waist, guide, level, seen)
    heading = waist.way(roll.direction)
    sides = turn_waist(steps, waist, seen, build.depth, near, (pointing, beside), start, guide)
    for side, is_left in zip(sides, (True, False), strict=True):
        approach, across = side.left
        flat = steps.select(approach[2] ** 2, PLANE**2, ONE, ZERO)
        # Where the approach vector has led the waist, the point must lie in that plane too.
        flat = steps.select(side.missed**2, PLANE**2 * size, flat, ZERO)
        # The hand as the fourth joint leaves it: its x axis along the approach vector, its y axis along axis 2.
        sine = steps.name(steps.name(approach[1] * across[0]) - steps.name(approach[0] * across[1]))
        turn = steps.argument((across[2], sine))
        lift = steps.argument(approach[:2]) - fixed(sp.atan2(heading[1], heading[0]))
        direction = steps.back(heading[:2], approach[:2])
        for bend in _bend_triple(steps, build, side, direction, is_left):
            angles = (bend.first, bend.second, lift - bend.first - bend.second)
            yield Solution(
                ((waist.joint, side.swing.angle), *zip(build.turns, angles, strict=True), (roll, turn)),
                (sane, side.swing.valid, flat, bend.valid),
            )


def _plane_of_approach(steps: Steps, waist: Waist, guide: Planar, level: sp.Expr, seen: Vector) -> Planar:
    """The direction of the waist in whose plane the approach vector lies, towards the point that the arm carries.

    The waist follows the approach vector wherever that tells its direction better than the point does; where both are
    on the axis, the joint is at rest.
    """
    rest = steps.unit(rest_angle(waist.joint))
    inverse = steps.name(1 / steps.root(level))
    side = steps.select(guide[0] * seen[0] + guide[1] * seen[1], ZERO, -inverse, inverse)
    return (
        steps.select(level, ALIGNED, rest[0], guide[0] * side),
        steps.select(level, ALIGNED, rest[1], guide[1] * side),
    )
