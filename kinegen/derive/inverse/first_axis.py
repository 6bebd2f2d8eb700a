"""The waist, on which most arms turn: it is turned for a point, and leaves vectors to the joints after it."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import sympy as sp

from kinegen.derive.folding import Vector
from kinegen.derive.inverse.axes import JointAxis
from kinegen.derive.inverse.exact_geometry import tidy
from kinegen.derive.inverse.geometry import Planar, Waist, arm_size
from kinegen.derive.inverse.joint_wrapping import rest_angle
from kinegen.derive.inverse.limit_conditions import FreeTurn
from kinegen.derive.inverse.planar_subproblems import CircleLineSolution, swing_to
from kinegen.derive.inverse.points_on_axes import folds_onto_axis
from kinegen.derive.inverse.straight_line_operations import ONE, ZERO, Angle, OperationBuilder
from kinegen.derive.inverse.tolerances import ALIGNED, FREE, TELLING
from kinegen.derive.inverse.wrists import shared_out
from kinegen.support.dataclass import dataclass


def folded_within_limits(
    steps: OperationBuilder,
    turns: Sequence[JointAxis],
    links: tuple[Planar, Planar],
    point: Planar,
    first: Angle,
    ahead: Planar,
) -> Angle:
    """Turn the first of three parallel joints, where folded links leave it free, so that the third keeps its limits.

    The links lead from the first axis to the second and from there to the third, which has to be at `point` as seen
    from the first. `first` is how far the first joint is turned, at rest where it is free, and `ahead` the direction
    that the sum of the three angles is to have.
    """
    start, elbow, last = turns
    if last.arc is None or not folds_onto_axis(steps.near, elbow, *links):
        return first
    (_, upper), (_, lower) = (steps.polar(link) for link in links)
    # Folded, the first and the third joint turn about one line, and their sum is what the target asks for.
    total = steps.back(steps.unit(sp.pi + upper - lower), ahead)
    turned = steps.argument(shared_out(steps, (start, last), total, steps.unit(rest_angle(start))))
    near = ALIGNED * arm_size(*links[0], *links[1])
    value = steps.select(steps.square(point), near, turned.value, first.value)
    return Angle(value, min(turned.low, first.low), max(turned.high, first.high))


Amounts = tuple[tuple[JointAxis, Angle | sp.Expr], ...]
Vectors = tuple[Vector, ...]
Free = tuple[FreeTurn, ...]


@dataclass(frozen=True, slots=True)
class ArmSolution:
    """One way to put the point in its place.

    Attributes:
        amounts: How far each joint goes.
        valid: 1 where the point is within reach, else 0; one factor for each condition.
        left: The vectors that were given, turned back by the arm, in the axes of `last_frame`.
        free: The joints that some targets leave free; only of one of two ways that are the same for such a target.
    """

    amounts: Amounts
    valid: tuple[sp.Expr, ...]
    left: Vectors
    free: Free = ()


@dataclass(frozen=True, slots=True)
class AfterJoint1:
    """What a waist leaves to the joints after it, in the axes of its second frame.

    Attributes:
        across: The point as seen from axis 2, across it.
        missed: How far the point is off the depth that was asked for, for a waist that stood at its start.
        left: The vectors, turned back.
    """

    swing: CircleLineSolution
    across: Planar
    missed: sp.Expr
    left: Vectors


@dataclass(frozen=True, slots=True)
class Guide:
    """A vector of length 1 beside which a waist has to be.

    Once the waist is turned, the vector, in the waist's first frame, is square to axis 2. Distances of the point are
    compared with `size`, that of the arm, squared.
    """

    vector: Vector
    size: sp.Expr


def solve_joint_1(
    steps: OperationBuilder,
    waist: Waist,
    point: Vector,
    depth: sp.Expr,
    near: sp.Expr,
    vectors: Vectors,
    start: Planar,
    guide: Guide | None = None,
    across: sp.Expr | None = None,
    flat: sp.Expr = ZERO,
    least: Callable[[sp.Expr], sp.Expr] | None = None,
) -> tuple[AfterJoint1, AfterJoint1]:
    """Turn a waist so that a point comes to a given depth along axis 2, in front and behind.

    Args:
        steps: The let bindings.
        point: The point, in the waist's first frame.
        depth: Its coordinate along axis 2.
        near: The squared distance within which the point counts as on axis 1.
        vectors: Vectors of the base frame that are to be turned back.
        start: Direction of the waist for a point on its axis.
        guide: A vector that the waist is known to turn square to axis 2 as well.
        across: The squared distance of the point from axis 2, for a waist without an offset whose depth is that of a
            point of the same arm.
        flat: Up to where a point is neither in front of axis 1 nor behind it, see `swing_to`.
        least: From the height of a point over axis 2 to what the square of its distance in front of axis 1 must be at
            least for the joints after the waist to reach it, where a point that is off by rounding may be nearer; None
            where it is not.
    """
    x, y, z = point
    # Height and depth of the point fix its distance from the plane through axis 1 and the normal.
    height = steps.name((z - waist.cosine * depth) / waist.sine)
    aside = steps.name(tidy(-waist.sine * depth)) if waist.cosine == 0 else waist.cosine * height - waist.sine * depth
    other = None if across is None else (across, height)
    level = [steps.turned(waist.first, vector) for vector in vectors]
    turned = []
    hollow = None if least is None else steps.name(least(height))
    # Seen along axis 1, the waist is a crank whose tip is beside it.
    swings = swing_to(steps, (x, y), steps.name(aside), near, start, other, flat, hollow)
    if guide is not None and aside != 0:
        swings = _guided(steps, waist, swings, (x, y), guide)
    # What the waist leaves is the point across axis 2 and the vectors turned back.
    for swing in swings:
        left = tuple(_tilted(steps, waist, (*steps.back(swing.direction, each[:2]), each[2])) for each in level)
        _, reached = steps.back(swing.direction, (x, y))
        across = (steps.name(swing.along - waist.offset), height)
        turned.append(AfterJoint1(swing, across, steps.name(reached - aside), left))
    return turned[0], turned[1]


def _guided(
    steps: OperationBuilder,
    waist: Waist,
    swings: tuple[CircleLineSolution, CircleLineSolution],
    point: Planar,
    guide: Guide,
) -> tuple[CircleLineSolution, CircleLineSolution]:
    """Turn swings by a guide wherever that tells their direction better than the point does.

    A point that is known to e L is known by its swing to e L / along, which turns a guide of length g by as much as e L
    g / along; the guide tells it to e / g, which moves the point by e along / g. The first is less where the point is
    farther along than g L, and for a guide that tells nothing, see `TELLING`.
    """
    flat, height = guide.vector[:2], guide.vector[2]
    # A guide square to axis 2 says directly how the waist stands; aslant, it is another crank.
    if waist.cosine == 0:
        level = steps.square(flat)
        inverse = steps.name(1 / steps.root(level))
        lead = steps.scaled(flat, inverse)
        leads, known = (lead, (-lead[0], -lead[1])), level
    else:
        both = swing_to(steps, flat, steps.name(height * waist.cosine / waist.sine), ALIGNED, (ONE, ZERO))
        leads, known = (both[0].direction, both[1].direction), both[0].along ** 2
    found = []
    for sign, swing in zip((1, -1), swings, strict=True):
        ahead = [steps.name(a[0] * swing.direction[0] + a[1] * swing.direction[1]) for a in leads]
        better = steps.choose(ahead[0], ahead[1], leads[1], leads[0])
        found.append(_chosen(steps, swing, better, point, guide, steps.name(known), sign))
    return found[0], found[1]


def _chosen(
    steps: OperationBuilder,
    swing: CircleLineSolution,
    better: Planar,
    point: Planar,
    guide: Guide,
    known: sp.Expr,
    sign: int,
) -> CircleLineSolution:
    """Return a swing, or one in a better direction."""
    less, more = steps.name(swing.along**2 + TELLING * guide.size), steps.name(known * guide.size)
    angle = steps.argument(better)
    along = steps.select(less, more, steps.name(point[0] * better[0] + point[1] * better[1]), swing.along)
    # The other shoulder's plane has the point on the other side.
    valid = steps.select(-FREE * steps.near.reach, sign * along, swing.valid, ZERO)
    value = steps.select(less, more, angle.value, swing.angle.value)
    return CircleLineSolution(
        Angle(value, min(angle.low, swing.angle.low), max(angle.high, swing.angle.high)),
        steps.choose(less, more, better, swing.direction),
        along,
        valid,
    )


def free_waist(
    steps: OperationBuilder, waist: Waist, point: Vector, depth: sp.Expr, near: sp.Expr, *turns: Planar
) -> Free:
    """Return the waist as a joint that a target may leave free: where a point without depth along axis 2 is on axis 1.

    The point is in the waist's first frame, `near` the squared distance within which it counts as on axis 1. `turns`
    are how the joints after the waist turn back what it leaves, about the z axis. Arms that do not get there have no
    such joint.
    """
    if waist.cosine == 0 and depth.is_number and depth != 0:
        return ()
    axis: Vector = (sp.S.Zero, waist.sine, waist.cosine)
    for turn in turns:
        axis = (*steps.back(turn, axis[:2]), axis[2])
    return (FreeTurn(waist.joint, steps.square(point[:2]), near, axis),)


def _tilted(steps: OperationBuilder, waist: Waist, vector: Vector) -> Vector:
    """Return a vector of the waist's first frame, turned, in the axes of its second."""
    x, y, z = vector
    return x, steps.name(waist.cosine * y + waist.sine * z), steps.name(waist.cosine * z - waist.sine * y)


def seen_from_waist(steps: OperationBuilder, waist: Waist, point: Vector) -> Vector:
    """Return a point of the base frame in the waist's first frame."""
    return steps.turned(waist.first, steps.minus(point, waist.origin))


def turned_back(steps: OperationBuilder, direction: Planar, vectors: Vectors) -> Vectors:
    """Vectors turned back about their z axis."""
    return tuple((*steps.back(direction, vector[:2]), vector[2]) for vector in vectors)
