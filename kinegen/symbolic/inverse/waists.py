"""The waist, on which most arms turn: how it is turned for a point, and what that leaves to the joints after it."""

from __future__ import annotations

from dataclasses import dataclass

import sympy as sp

from kinegen.symbolic.fold import Vector
from kinegen.symbolic.inverse.axes import JointAxis
from kinegen.symbolic.inverse.cranks import Swing, swing_to
from kinegen.symbolic.inverse.exact import tidy
from kinegen.symbolic.inverse.geometry import Planar, Waist
from kinegen.symbolic.inverse.steps import ONE, Angle, Steps
from kinegen.symbolic.inverse.thresholds import BESIDE

_SLIGHT = sp.Rational(1, 10**11)
"""What keeps the size of an arm of runtime lengths from zero."""

Amounts = tuple[tuple[JointAxis, Angle | sp.Expr], ...]
Vectors = tuple[Vector, ...]


@dataclass(frozen=True, slots=True)
class Way:
    """One way to put the point in its place.

    Attributes:
        amounts: How far each joint goes.
        valid: 1 where the point is within reach, else 0; one factor for each condition.
        left: The vectors that were given, turned back by the arm, in the axes of `last_frame`.
    """

    amounts: Amounts
    valid: tuple[sp.Expr, ...]
    left: Vectors


@dataclass(frozen=True, slots=True)
class Turned:
    """What a waist leaves to the joints after it, in the axes of its second frame.

    Attributes:
        swing: How the waist is turned.
        across: The point as seen from axis 2, across it.
        missed: How far the point is off the depth that was asked for, for a waist that stood at its start.
        left: The vectors, turned back.
    """

    swing: Swing
    across: Planar
    missed: sp.Expr
    left: Vectors


def turn_waist(
    steps: Steps,
    waist: Waist,
    point: Vector,
    depth: sp.Expr,
    near: sp.Expr,
    vectors: Vectors,
    start: Planar,
    guide: Planar | None = None,
    across: sp.Expr | None = None,
) -> tuple[Turned, Turned]:
    """Turn a waist so that a point comes to a given depth along axis 2.

    Args:
        steps: The tape.
        waist: The waist.
        point: The point, in the waist's first frame.
        depth: Its coordinate along axis 2.
        near: The squared distance within which the point counts as on axis 1.
        vectors: Vectors of the base frame that are to be turned back.
        start: Direction of the waist for a point on its axis.
        guide: A vector of the waist's first frame to which the waist is known to turn, forward or backward; it tells
            the direction better than a point beside the waist, where forward and backward meet.
        across: The squared distance of the point from axis 2, for a waist without an offset, where that is known better
            than from the point.

    Returns:
        With the point in front and behind.
    """
    x, y, z = point
    height = steps.name((z - waist.cosine * depth) / waist.sine)
    aside = steps.name(tidy(-waist.sine * depth)) if waist.cosine == 0 else waist.cosine * height - waist.sine * depth
    rest = None if across is None else steps.name(across - height**2)
    level = [steps.turned(waist.first, vector) for vector in vectors]
    turned = []
    for found in swing_to(steps, (x, y), steps.name(aside), near, start, rest):
        swing = found if guide is None or aside == 0 else _guided(steps, found, (x, y), guide)
        left = tuple(_tilted(steps, waist, (*steps.back(swing.direction, each[:2]), each[2])) for each in level)
        _, reached = steps.back(swing.direction, (x, y))
        across = (steps.name(swing.along - waist.offset), height)
        turned.append(Turned(swing, across, steps.name(reached - aside), left))
    return turned[0], turned[1]


def _guided(steps: Steps, swing: Swing, point: Planar, guide: Planar) -> Swing:
    """A swing along a guide where the point is nearly beside the waist and the guide is long enough."""
    length = steps.square(guide)
    ahead = steps.name(sum((a * b for a, b in zip(swing.direction, guide, strict=True)), sp.S.Zero))
    inverse = steps.name(1 / steps.root(length))
    sided = steps.select(ahead, sp.S.Zero, -inverse, inverse)
    better = (steps.name(guide[0] * sided), steps.name(guide[1] * sided))
    beside = steps.name(BESIDE * steps.square(point))

    def chosen(other: sp.Expr, usual: sp.Expr) -> sp.Expr:
        return steps.select(swing.along**2, beside, steps.select(BESIDE, length, other, usual), usual)

    angle = steps.argument(better)
    return Swing(
        Angle(
            chosen(angle.value, swing.angle.value), min(angle.low, swing.angle.low), max(angle.high, swing.angle.high)
        ),
        (chosen(better[0], swing.direction[0]), chosen(better[1], swing.direction[1])),
        chosen(steps.name(point[0] * better[0] + point[1] * better[1]), swing.along),
        swing.valid,
    )


def _tilted(steps: Steps, waist: Waist, vector: Vector) -> Vector:
    """A vector of the waist's first frame, turned, in the axes of its second."""
    x, y, z = vector
    return x, steps.name(waist.cosine * y + waist.sine * z), steps.name(waist.cosine * z - waist.sine * y)


def seen_from_waist(steps: Steps, waist: Waist, point: Vector) -> Vector:
    """A point of the base frame in the waist's first frame."""
    return steps.turned(waist.first, minus_named(steps, point, waist.origin))


def minus_named(steps: Steps, left: Vector, right: Vector) -> Vector:
    """The difference of a vector on the tape and a constant one."""
    x, y, z = (steps.name(a - b) for a, b in zip(left, right, strict=True))
    return x, y, z


def arm_size(*lengths: sp.Expr) -> sp.Expr:
    """The sum of squares of lengths; not zero, whatever runtime lengths may become."""
    size = tidy(sp.Add(*(length**2 for length in lengths)))
    return size + _SLIGHT if size.free_symbols else size or ONE


def turned_back(steps: Steps, direction: Planar, vectors: Vectors) -> Vectors:
    """Vectors turned back about their z axis."""
    return tuple((*steps.back(direction, vector[:2]), vector[2]) for vector in vectors)
