"""How the axes of joints lie to each other, exactly, and the frames that the solutions are written in."""

from __future__ import annotations

import sympy as sp

from kinegen.derive.folding import Vector
from kinegen.derive.inverse.axes import Axes, JointAxis
from kinegen.derive.inverse.exact_geometry import (
    Rotation,
    combined,
    cross,
    dot,
    is_null,
    minus,
    perpendicular,
    tidy,
    turned,
)
from kinegen.support.dataclass import dataclass

Planar = tuple[sp.Expr, sp.Expr]
"""A vector in a plane, which is a complex number to the formulas."""


_SLIGHT = sp.Rational(1, 10**11)
"""What keeps the size of an arm of runtime lengths from zero."""


def are_parallel(left: JointAxis, right: JointAxis) -> bool:
    """Tell whether two axes have the same direction or opposite ones."""
    return is_null(cross(left.direction, right.direction))


def are_square(left: JointAxis, right: JointAxis) -> bool:
    """Tell whether the directions of two axes stand at right angles."""
    return bool(dot(left.direction, right.direction) == 0)


def feet(left: JointAxis, right: JointAxis) -> tuple[Vector, Vector]:
    """Return the points of two axes that are not parallel which lie nearest to each other, on each axis one."""
    cosine = dot(left.direction, right.direction)
    apart = minus(right.point, left.point)
    along_left, along_right = dot(apart, left.direction), dot(apart, right.direction)
    on_right = tidy((cosine * along_left - along_right) / (1 - cosine**2))
    on_left = tidy(along_left + cosine * on_right)
    return combined((1, left.point), (on_left, left.direction)), combined((1, right.point), (on_right, right.direction))


def foot(axis: JointAxis, point: Vector) -> Vector:
    """Return the point of an axis that lies nearest to a point."""
    return combined((1, axis.point), (dot(minus(point, axis.point), axis.direction), axis.direction))


@dataclass(frozen=True, slots=True)
class Waist:
    """A first joint that turns, and the frames before and after it, by their columns in the base frame.

    Both have their x axis along the common normal of axes 1 and 2; z of `first` is axis 1, z of `second` axis 2, and
    `origin` and `shoulder` are on these. A point (x, y, z) of the second frame is `(offset + x, cosine*y - sine*z,
    sine*y + cosine*z)` in the first, with a sine that is positive.
    """

    joint: JointAxis
    first: Rotation
    origin: Vector
    second: Rotation
    shoulder: Vector
    offset: sp.Expr
    cosine: sp.Expr
    sine: sp.Expr

    def place(self, point: Vector) -> Vector:
        """Return a point of the base frame in the second frame."""
        return self.way(minus(point, self.shoulder))

    def way(self, direction: Vector) -> Vector:
        """Return a direction of the base frame in the second frame."""
        return turned(self.second, direction)


def waist_of(axes: Axes, first: JointAxis, second: JointAxis, end: Vector) -> tuple[Waist, JointAxis]:
    """Return the frames of a turning first joint and a second one that is not parallel to it.

    In the zero pose the point `end`, which the arm carries, lies in front of the waist, where that can be chosen. The
    second result is the second joint, turned round if that takes it.
    """
    origin, shoulder = feet(first, second)
    normal = cross(first.direction, second.direction)
    sine = tidy(sp.sqrt(dot(normal, normal)))
    front = combined((1 / sine, normal))
    ahead = axes.value(dot(front, minus(end, origin)))
    is_turned = ahead < 0 or (ahead == 0 and sum(axes.value(entry) for entry in front) < 0)
    # A normal in front of the arm makes "left" mean forward in every convention.
    sign = -1 if is_turned else 1
    front, lift = combined((sign, front)), combined((sign, second.direction))
    waist = Waist(
        joint=first,
        first=(front, cross(first.direction, front), first.direction),
        origin=origin,
        second=(front, cross(lift, front), lift),
        shoulder=shoulder,
        offset=dot(front, minus(shoulder, origin)),
        cosine=dot(first.direction, lift),
        sine=sine,
    )
    return waist, second.flipped() if is_turned else second


@dataclass(frozen=True, slots=True)
class Wrist:
    """Three joints whose axes meet in a point, neighbours at right angles.

    In the frame whose z axis is that of the first of them and whose y axis that of the second, their motion is `Rz(t4)
    Ry(t5 + skew) Rz(t6) Ry(-skew)`.

    Attributes:
        joints: The three, directed so that the first and the last point the same way where the hand is straight.
        centre: Where the axes meet, at q = 0.
        frame: Columns of that frame in the base frame.
        skew: The angle from the first axis to the last one about the second, at q = 0.
        hand: Columns of the frame whose z axis is the last axis, in the base frame: `frame * Ry(skew)`.
    """

    joints: tuple[JointAxis, JointAxis, JointAxis]
    centre: Vector
    frame: Rotation
    skew: sp.Expr
    hand: Rotation


def wrist_of(roll: JointAxis, bend: JointAxis, flange: JointAxis, centre: Vector) -> Wrist:
    """Return the wrist of three joints that turn, each square to the one before, through one point.

    The first need not pass there where only directions matter.
    """
    bend = bend.forward
    across = cross(bend.direction, roll.direction)
    along, aside = dot(flange.direction, roll.direction), dot(flange.direction, across)
    # The flange points the way of the roll axis where the hand is straight, so that no-flip means the same.
    if along < 0 or (along == 0 and aside < 0):
        flange, along, aside = flange.flipped(), -along, -aside
    frame = (across, bend.direction, roll.direction)
    hand = (cross(bend.direction, flange.direction), bend.direction, flange.direction)
    return Wrist((roll, bend, flange), centre, frame, sp.atan2(aside, along), hand)


def flat_frame(axis: JointAxis) -> Rotation:
    """Return columns of a frame whose z axis is that of a joint."""
    front = perpendicular(axis.direction)
    return front, cross(axis.direction, front), axis.direction


def arm_size(*lengths: sp.Expr) -> sp.Expr:
    """Return the sum of squares of lengths; not zero, whatever runtime lengths may become."""
    size = tidy(sp.Add(*(length**2 for length in lengths)))
    return size + _SLIGHT if size.free_symbols else size or sp.S.One
