"""All solutions of every family, as formulas among let bindings."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import sympy as sp

from kinegen.derive.expressions import IN_SINGLE, by_type
from kinegen.derive.folding import Vector
from kinegen.derive.inverse.exact_geometry import IDENTITY, Rotation, chained, tidy, transposed
from kinegen.derive.inverse.family import (
    Aim,
    Arm,
    ColumnArm,
    ElbowArm,
    Family,
    FlatArm,
    GantryArm,
    GimbalArm,
    PointArm,
    SphericalArm,
    StrokeArm,
    TripleArm,
    WristArm,
)
from kinegen.derive.inverse.first_axis import (
    ArmSolution,
    Free,
    Vectors,
    free_waist,
    seen_from_waist,
    solve_joint_1,
    turned_back,
)
from kinegen.derive.inverse.geometry import Planar, Waist, arm_size
from kinegen.derive.inverse.joint_wrapping import Solution, rest_angle
from kinegen.derive.inverse.limit_conditions import FreeTurn, is_followed, turn_within_limits
from kinegen.derive.inverse.planar_subproblems import bend_to, swing_to
from kinegen.derive.inverse.points_on_axes import folds_onto_axis, strokes_onto_axis, waist_bends
from kinegen.derive.inverse.solve_intersecting_shoulder import gimbal_ways, spherical_solutions
from kinegen.derive.inverse.solve_parallel_axes import flat_solutions, roll_solutions, triple_solutions
from kinegen.derive.inverse.straight_line_operations import ONE, ZERO, OperationBuilder, fixed
from kinegen.derive.inverse.target_pose import Target
from kinegen.derive.inverse.tolerances import ALIGNED, RIGID, ROUNDING
from kinegen.derive.inverse.wrists import (
    flips,
)


def last_frame(arm: Arm) -> Rotation:
    """Return columns of the frame in which an arm leaves vectors, in the base frame at q = 0."""
    match arm:
        case ElbowArm(waist) | StrokeArm(waist):
            return waist.second
        case ColumnArm() | GimbalArm():
            return arm.frame
        case GantryArm():
            return IDENTITY


def ways(steps: OperationBuilder, arm: Arm, point: Vector, vectors: Vectors) -> Iterator[ArmSolution]:
    """Yield all ways in which an arm puts the point that it carries in its place, in the order of the branches.

    Point and vectors are in the base frame; the vectors are turned back by the arm.
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
            apart = steps.minus(point, arm.end)
            amounts = steps.turned(arm.inverse, apart)
            yield ArmSolution(tuple(zip(arm.joints, amounts, strict=True)), (), vectors)


def _elbow_ways(steps: OperationBuilder, arm: ElbowArm, point: Vector, vectors: Vectors) -> Iterator[ArmSolution]:
    waist = arm.waist
    near = ALIGNED * arm_size(waist.offset, arm.depth, *arm.upper, *arm.lower)
    seen, rest = seen_from_waist(steps, waist, point), steps.unit(rest_angle(waist.joint))
    may_fold, on_axis = folds_onto_axis(steps.near, arm.elbow, arm.upper, arm.lower), waist_bends(arm)
    flat = _flat(waist, arm.depth, vectors, is_on_axis_2=may_fold)
    # The waist turns the point into the plane of two links, which are a triangle.
    sides = solve_joint_1(steps, waist, seen, arm.depth, near, vectors, rest, flat=flat, least=_in_front(steps, arm))
    for turned, is_left in zip(sides, (True, False), strict=True):
        bends = bend_to(steps, turned.across, arm.upper, arm.lower, rest_angle(arm.shoulder))
        # Behind the waist the arm is seen in a mirror.
        for place, bend in enumerate(bends) if is_left else reversed(list(enumerate(bends))):
            amounts = ((waist.joint, turned.swing.angle), (arm.shoulder, bend.first), (arm.elbow, bend.second))
            left, free = turned_back(steps, bend.direction, turned.left), Free()
            if is_left and place in on_axis:
                free = free_waist(steps, waist, seen, arm.depth, near, bend.direction)
            if place == 0 and may_fold:
                # Both elbows are the same there.
                square, folded = steps.square(turned.across), ALIGNED * arm_size(*arm.upper, *arm.lower)
                free += (FreeTurn(arm.shoulder, square, folded, (ZERO, ZERO, ONE)),)
            yield ArmSolution(amounts, (turned.swing.valid, bend.valid), left, free)


def _in_front(steps: OperationBuilder, arm: ElbowArm) -> Callable[[sp.Expr], sp.Expr] | None:
    """Return how far in front of axis 1 a point must be for the elbow, if a target that is off may leave it nearer.

    A point at a depth d along axis 2 is at a squared distance from axis 1 that is off by 2 d e for a target that is off
    by e. Near d that moves the point by the root of this in front of axis 1, where the elbow has room for e. So the
    waist is turned until the point is where the folded arm is, or with an offset of the waist the stretched one.
    """
    first, second = steps.length(arm.upper), steps.length(arm.lower)
    if arm.depth == 0:
        return None
    if arm.waist.offset != 0:
        offset, most = abs(arm.waist.offset), tidy((first + second) ** 2)

        def beside_stretched(height: sp.Expr) -> sp.Expr:
            square = steps.name(most - height**2)
            missing = steps.name(offset - steps.root_of_positive(square))
            return steps.select(ZERO, missing, missing**2, ZERO)

        return beside_stretched
    apart = tidy(first - second)
    if apart == 0 or (apart.is_number and arm.depth.is_number and abs(apart) > abs(arm.depth)):
        return None
    return lambda height: steps.name(apart**2) - height**2


def _stroke_ways(steps: OperationBuilder, arm: StrokeArm, point: Vector, vectors: Vectors) -> Iterator[ArmSolution]:
    waist = arm.waist
    near = ALIGNED * arm_size(waist.offset, arm.depth, *arm.start)
    ahead, aside = _along(arm.heading, arm.start)
    seen, rest = seen_from_waist(steps, waist, point), steps.unit(rest_angle(waist.joint))
    lowered = steps.times(steps.unit(rest_angle(arm.shoulder)), arm.heading)
    on_axis_2 = strokes_onto_axis(arm.stroke, ahead, aside)
    flat = _flat(waist, arm.depth, vectors, is_on_axis_2=on_axis_2)
    sides = solve_joint_1(steps, waist, seen, arm.depth, near, vectors, rest, flat=flat)
    for turned, is_left in zip(sides, (True, False), strict=True):
        # The stroke is a crank that turns about axis 2.
        for way, swing in enumerate(swing_to(steps, turned.across, aside, near, lowered)):
            direction = steps.back(arm.heading, swing.direction)
            amounts = (
                (waist.joint, turned.swing.angle),
                (arm.shoulder, swing.angle - fixed(sp.atan2(arm.heading[1], arm.heading[0]))),
                (arm.stroke, steps.name(swing.along - ahead)),
            )
            left, free = turned_back(steps, direction, turned.left), Free()
            if is_left:
                free = free_waist(steps, waist, seen, arm.depth, near, direction)
            if way == 0 and on_axis_2:
                free += (FreeTurn(arm.shoulder, steps.square(turned.across), near, (ZERO, ZERO, ONE)),)
            yield ArmSolution(amounts, (turned.swing.valid, swing.valid), left, free)


def _flat(waist: Waist, depth: sp.Expr, vectors: Vectors, *, is_on_axis_2: bool) -> sp.Expr:
    """Return the bound below which a point is neither in front of axis 1 nor behind it, see `swing_to`.

    Both shoulders meet there. What rounding leaves there would turn the waist by its root, and leave no wrist in line.
    In single precision that root may take a joint that is at its limit beyond it, so that only a point which is on axis
    2, too, has this.
    """
    if not vectors or depth == 0:
        return ZERO
    if is_on_axis_2 and waist.offset == 0:
        return 2 * ROUNDING
    return by_type(ROUNDING.subs(IN_SINGLE, 0) / 2, ZERO)


def _column_ways(steps: OperationBuilder, arm: ColumnArm, point: Vector, vectors: Vectors) -> Iterator[ArmSolution]:
    x, y, z = steps.turned(arm.frame, steps.minus(point, arm.turn.point))
    ahead, aside = _along(arm.heading, arm.start[:2])
    rest = steps.times(steps.unit(rest_angle(arm.turn)), arm.heading)
    level = tuple(steps.turned(arm.frame, vector) for vector in vectors)
    near = ALIGNED * arm_size(*arm.start)
    # The other way is the same for a point on the axis, but for half a turn.
    is_free = strokes_onto_axis(arm.stroke, ahead, aside)
    turns: Free = (FreeTurn(arm.turn, steps.square((x, y)), near, (ZERO, ZERO, ONE)),) if is_free else ()
    for swing, free in zip(swing_to(steps, (x, y), aside, near, rest), (turns, ()), strict=True):
        direction = steps.back(arm.heading, swing.direction)
        amounts = (
            (arm.turn, swing.angle - fixed(sp.atan2(arm.heading[1], arm.heading[0]))),
            (arm.lift, steps.name(z - arm.start[2])),
            (arm.stroke, steps.name(swing.along - ahead)),
        )
        yield ArmSolution(amounts, (swing.valid,), turned_back(steps, direction, level), free)


def _along(heading: Planar, vector: Planar) -> Planar:
    """Return a planar vector along a direction and across it."""
    return (
        tidy(heading[0] * vector[0] + heading[1] * vector[1]),
        tidy(heading[0] * vector[1] - heading[1] * vector[0]),
    )


def solve(steps: OperationBuilder, family: Family, target: Target, given: sp.Expr = ZERO) -> Iterator[Solution]:
    """Solve for all branches, in the order of `family.branches`, before the limits of the joints are seen to.

    `target` is the pose of the tool, `given` the arm angle, if there is one.
    """
    axes, sane = family.axes, _sane(steps, family, target)
    match family.build:
        case PointArm(arm):
            for way in ways(steps, arm, target.point(steps, axes, arm.end), ()):
                yield Solution(way.amounts, (sane, *way.valid))
        case WristArm():
            yield from _wrist_solutions(steps, family, family.build, target, sane)
        case FlatArm():
            yield from flat_solutions(steps, axes, family.build, target, sane)
        case TripleArm(roll=None):
            yield from triple_solutions(steps, family, family.build, target, sane)
        case SphericalArm():
            yield from spherical_solutions(steps, axes, family.build, target, given, sane)
        case TripleArm():
            yield from roll_solutions(steps, axes, family.build, target, sane)


def _sane(steps: OperationBuilder, family: Family, target: Target) -> sp.Expr:
    """Return 1 for a target of finite numbers, whose rotation is one as far as it is read; else 0."""
    lengths = (*target.position, *(parameter for parameter, _ in family.axes.defaults))
    finite = steps.finite(lengths)
    if not reads_attitude(family):
        return finite
    return steps.select(_off_rigid(steps, target.rotation), RIGID**2, finite, ZERO)


def _off_rigid(steps: OperationBuilder, rotation: Rotation) -> sp.Expr:
    """Return how far a matrix is from a proper rotation: the sum of the squares of what must be zero.

    The first two columns have to be square on each other and of length 1, the third their cross product.
    """
    first, second, third = transposed(rotation)
    off = [steps.name(steps.square(column) - 1) for column in (first, second)]
    off.append(steps.dot(first, second))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        across = steps.name(steps.name(first[i] * second[j]) - steps.name(first[j] * second[i]))
        off.append(steps.name(third[k] - across))
    return steps.square(off)


def reads_attitude(family: Family) -> bool:
    """Tell whether the attitude of a target has a part in the solutions."""
    return family.aim is Aim.POSE


def _wrist_solutions(
    steps: OperationBuilder, family: Family, build: WristArm, target: Target, sane: sp.Expr
) -> Iterator[Solution]:
    wrist, axes = build.wrist, family.axes
    hand = target.columns(steps, axes, wrist.hand)
    # From the axes in which the arm leaves vectors to those of the wrist, both at q = 0.
    between = chained(wrist.frame, transposed(last_frame(build.arm)))
    start = steps.unit(rest_angle(wrist.joints[0]))
    # An arm that is nearly of the family is led back from the solutions of another pose, and nothing stays free.
    may_be_free = family.defect is None and is_followed(wrist)
    # The arm puts the wrist's centre in its place, and the wrist takes the attitude that is left.
    for way in ways(steps, build.arm, target.point(steps, axes, build.arm.end), hand):
        first, second, third = (steps.turned(between, vector) for vector in way.left)
        amounts, left = way.amounts, (first, second, third)
        for free in way.free if may_be_free else ():
            angles, axis = dict(amounts), steps.turned(between, free.axis)
            angles[free.joint], left = turn_within_limits(steps, free, wrist, axis, angles[free.joint], left)
            amounts = tuple(angles.items())
        for flip in flips(steps, wrist, left, start):
            yield Solution((*amounts, *zip(wrist.joints, flip, strict=True)), (sane, *way.valid))
