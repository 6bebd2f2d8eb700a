"""The waist, on which most arms turn, and points that an arm carries onto an axis.

A waist is turned for a point, and leaves vectors to the joints after it. Whether an arm can carry its point onto an
axis, and with which elbow, is found in numbers, and to be sure: an answer that is doubtful is yes. Where it cannot,
nothing needs to be chosen.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence

import numpy as np
import sympy as sp
from numpy.typing import NDArray

from kinegen.derive.folding import Vector
from kinegen.derive.inverse.axes import JointAxis
from kinegen.derive.inverse.exact_geometry import tidy, turned
from kinegen.derive.inverse.family import ElbowArm, GimbalArm
from kinegen.derive.inverse.geometry import Planar, Waist, arm_size
from kinegen.derive.inverse.joint_wrapping import rest_angle
from kinegen.derive.inverse.limit_conditions import FreeTurn
from kinegen.derive.inverse.planar_subproblems import CircleLineSolution, swing_to
from kinegen.derive.inverse.straight_line_operations import ONE, ZERO, Angle, OperationBuilder
from kinegen.derive.inverse.tolerances import ALIGNED, FREE, TELLING, Thresholds
from kinegen.derive.inverse.wrists import shared_out
from kinegen.support.dataclass import dataclass

Bends = frozenset[int]
"""Places of `bend_to`: 0 with the elbow to the left of the line to the point, 1 to the right."""

BOTH: Bends = frozenset((0, 1))

_GRID = 361
"""Angles of a joint that are tried."""

_NEAR = 1e-4
"""How far a root may be from the unit circle, and an angle from the limits of its joint."""


def waist_bends(arm: ElbowArm) -> Bends:
    """Return the elbows with which two parallel axes carry a point onto axis 1."""
    lengths = (arm.waist.offset, arm.waist.cosine, *arm.upper, *arm.lower)
    if any(length.free_symbols for length in lengths) or arm.waist.cosine != 0:
        return BOTH
    offset, upper, lower = float(arm.waist.offset), _complex(arm.upper), _complex(arm.lower)
    first, second = (_tried(joint)[:, None] for joint in (arm.shoulder, arm.elbow))
    # Distances from axis 1 are tried on a grid of both angles.
    off = offset + (np.exp(1j * first) * (upper + np.exp(1j * second.T) * lower)).real
    # The point moves by no more than this from one angle that is tried to a neighbour of it.
    step = 2 * math.pi / (_GRID - 1) * (abs(upper) + 2 * abs(lower))
    found = np.abs(off) <= step
    sides = _wrapped(second[:, 0] + np.angle(lower) - np.angle(upper))
    return frozenset(bend for bend, sign in ((0, -1), (1, 1)) if found[:, sign * sides >= -_NEAR].any())


def folds_onto_axis(near: Thresholds, elbow: JointAxis, upper: Planar, lower: Planar) -> bool:
    """Tell whether two parallel axes carry a point onto the first of them, the second link folded onto the first."""
    if not near.may_fold(*(sp.sqrt(link[0] ** 2 + link[1] ** 2) for link in (upper, lower))):
        return False
    return any(length.free_symbols for length in (*upper, *lower)) or folds_within_limits(elbow, upper, lower)


def folds_within_limits(elbow: JointAxis, upper: Planar, lower: Planar) -> bool:
    """Tell whether an elbow folds a link of constant length onto the one before it."""
    return _is_within(elbow, folded_angle(upper, lower))


def folded_angle(upper: Planar, lower: Planar) -> float:
    """Return how far the elbow is turned where the second link is folded onto the first one."""
    return math.pi + float(np.angle(_complex(upper)) - np.angle(_complex(lower)))


def strokes_onto_axis(stroke: JointAxis, ahead: sp.Expr, aside: sp.Expr) -> bool:
    """Tell whether a stroke gets its tip, which is `ahead` of an axis at zero and `aside` of it, onto the axis."""
    if (aside.is_number and aside != 0) or stroke.limits is None or ahead.free_symbols:
        return not (aside.is_number and aside != 0)
    low, high = sorted(float(end * stroke.rate) for end in stroke.limits)
    room = _NEAR * (high - low)
    return low - room <= -float(ahead) <= high + room


def gimbal_bends(arm: GimbalArm) -> tuple[Bends, Bends]:
    """Return the elbows with which an arm carries a point onto axis 1, and those with which it does so onto axis 2."""
    waist = arm.waist
    if any(length.free_symbols for length in (*arm.upper, *arm.lower, arm.depth)):
        return BOTH, BOTH
    upper, lower, depth = _complex(arm.upper), _complex(arm.lower), float(arm.depth)
    axis = np.array([float(entry) for entry in turned(arm.frame, waist.second[2])])
    side = np.angle(lower) - np.angle(upper)
    turns = 2 * math.pi * np.arange(8) / 8
    point = upper + np.exp(1j * turns) * lower
    along, square = axis[0] * point.real + axis[1] * point.imag + axis[2] * depth, np.abs(point) ** 2 + depth**2
    found = []
    # The squared part of the point along axis 2, less what it is for a point on axis 1, and on axis 2.
    for cosine in (float(waist.cosine), 1.0):
        angles = _zeros((along**2 - cosine**2 * square) / (abs(upper) + abs(lower) + abs(depth)) ** 2)
        sides = _wrapped(np.array([angle for angle in angles if _is_within(arm.elbow, angle)]) + side)
        # Stretched or folded, both elbows are the same.
        found.append(frozenset(int(_NEAR < place < math.pi - _NEAR) for place in sides))
    return found[0], found[1]


def _zeros(values: NDArray[np.float64]) -> Iterator[float]:
    """Yield the zeros of a sum of sines and cosines of an angle and of twice that angle, from eight of its values."""
    parts = np.fft.fft(values) / 8
    coefficients = [parts[2], parts[1], parts[0], parts[-1], parts[-2]]
    for root in np.roots(np.trim_zeros(np.round(coefficients, 14), "f")):
        if abs(abs(root) - 1) < _NEAR:
            yield float(np.angle(root))


def _is_within(joint: JointAxis, angle: float) -> bool:
    if joint.arc is None:
        return True
    low, high = (float(end) for end in joint.arc)
    return (angle - low + _NEAR) % (2 * math.pi) <= high - low + 2 * _NEAR


def _tried(joint: JointAxis) -> NDArray[np.float64]:
    low, high = (-math.pi, math.pi) if joint.arc is None else (float(end) for end in joint.arc)
    return np.linspace(low, high, _GRID)


def _wrapped(angle: NDArray[np.float64]) -> NDArray[np.float64]:
    found: NDArray[np.float64] = (angle + math.pi) % (2 * math.pi) - math.pi
    return found


def _complex(vector: Planar) -> complex:
    return complex(float(vector[0]), float(vector[1]))


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
