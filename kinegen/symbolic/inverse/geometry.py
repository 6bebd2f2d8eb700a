"""How the axes of joints lie to each other, exactly, and the frames that the solutions are written in."""

from __future__ import annotations

import math
from dataclasses import dataclass

import sympy as sp

from kinegen.symbolic.fold import Vector
from kinegen.symbolic.inverse.axes import Axes, JointAxis
from kinegen.symbolic.inverse.exact import Rotation, columns, combined, cross, dot, is_null, minus, perpendicular, tidy

Planar = tuple[sp.Expr, sp.Expr]
"""A vector in a plane, which is a complex number to the formulas."""


def are_parallel(left: JointAxis, right: JointAxis) -> bool:
    """Whether two axes have the same direction or opposite ones."""
    return is_null(cross(left.direction, right.direction))


def are_square(left: JointAxis, right: JointAxis) -> bool:
    """Whether the directions of two axes stand at right angles."""
    return bool(dot(left.direction, right.direction) == 0)


def feet(left: JointAxis, right: JointAxis) -> tuple[Vector, Vector]:
    """The points of two axes that are not parallel which lie nearest to each other, on each axis one."""
    cosine = dot(left.direction, right.direction)
    apart = minus(right.point, left.point)
    along_left, along_right = dot(apart, left.direction), dot(apart, right.direction)
    on_right = tidy((cosine * along_left - along_right) / (1 - cosine**2))
    on_left = tidy(along_left + cosine * on_right)
    return combined((1, left.point), (on_left, left.direction)), combined((1, right.point), (on_right, right.direction))


def foot(axis: JointAxis, point: Vector) -> Vector:
    """The point of an axis that lies nearest to a point."""
    return combined((1, axis.point), (dot(minus(point, axis.point), axis.direction), axis.direction))


@dataclass(frozen=True, slots=True)
class Waist:
    """A first joint that turns, and the frames before and after it.

    Both frames have their x axis along the common normal of axes 1 and 2; z of the first is axis 1, z of the second
    axis 2. A point (x, y, z) of the second frame is `(offset + x, cosine*y - sine*z, sine*y + cosine*z)` in the first.

    Attributes:
        joint: The first joint.
        first: Columns of the frame of axis 1, in the base frame.
        origin: Its origin, on axis 1.
        second: Columns of the frame of axis 2.
        shoulder: Its origin, on axis 2.
        offset: Length of the common normal.
        cosine: Of the angle from axis 1 to axis 2.
        sine: Of that angle; positive.
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
        """A point of the base frame in the second frame."""
        apart = minus(point, self.shoulder)
        x, y, z = self.second
        return dot(x, apart), dot(y, apart), dot(z, apart)

    def way(self, direction: Vector) -> Vector:
        """A direction of the base frame in the second frame."""
        x, y, z = self.second
        return dot(x, direction), dot(y, direction), dot(z, direction)


def waist_of(axes: Axes, first: JointAxis, second: JointAxis, end: Vector) -> tuple[Waist, bool]:
    """The frames of a turning first joint and a second one that is not parallel to it.

    Args:
        axes: The chain, for the values of runtime parameters.
        first: Joint 1.
        second: Joint 2.
        end: A point that the arm carries; in the zero pose it lies in front of the waist, where that can be chosen.

    Returns:
        The frames, and whether axis 2 had to be turned round for them.
    """
    origin, shoulder = feet(first, second)
    normal = cross(first.direction, second.direction)
    sine = tidy(sp.sqrt(dot(normal, normal)))
    front = combined((1 / sine, normal))
    ahead = axes.value(dot(front, minus(end, origin)))
    turned = ahead < 0 or (ahead == 0 and sum(axes.value(entry) for entry in front) < 0)
    sign = -1 if turned else 1
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
    return waist, turned


@dataclass(frozen=True, slots=True)
class Wrist:
    """Three joints whose axes meet in a point, neighbours at right angles.

    In the frame whose z axis is that of the first of them and whose y axis that of the second, their motion is
    `Rz(t4) Ry(t5 + skew) Rz(t6) Ry(-skew)`.

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

    @property
    def flange_limits(self) -> tuple[sp.Expr, sp.Expr] | None:
        """How far the last axis may be turned, where that is less than a whole turn."""
        flange = self.joints[2]
        if flange.limits is None:
            return None
        low, high = sorted(tidy(end * flange.rate) for end in flange.limits)
        # As numbers, since SymPy cannot compare ends that are rounded to many digits with a whole turn of 2 pi.
        return (low, high) if float(high - low) < 2 * math.pi else None


def wrist_of(roll: JointAxis, bend: JointAxis, flange: JointAxis, centre: Vector) -> Wrist:
    """The frame of three joints that turn, each square to the one before, through one point.

    Args:
        roll: The first.
        bend: The second.
        flange: The last.
        centre: Where they meet; the first need not pass there where only directions matter.

    Returns:
        The wrist.
    """
    bend = bend if bend.rate > 0 else bend.flipped()
    across = cross(bend.direction, roll.direction)
    along, aside = dot(flange.direction, roll.direction), dot(flange.direction, across)
    if along < 0 or (along == 0 and aside < 0):
        flange, along, aside = flange.flipped(), -along, -aside
    frame = (across, bend.direction, roll.direction)
    hand = (cross(bend.direction, flange.direction), bend.direction, flange.direction)
    return Wrist((roll, bend, flange), centre, frame, sp.atan2(aside, along), hand)


def flat_frame(axis: JointAxis) -> Rotation:
    """Columns of a frame whose z axis is that of a joint."""
    front = perpendicular(axis.direction)
    return front, cross(axis.direction, front), axis.direction


def in_frame(frame: Rotation, vector: Vector) -> Vector:
    """A vector of the base frame in the axes of a frame that is given by its columns."""
    return dot(frame[0], vector), dot(frame[1], vector), dot(frame[2], vector)


def in_base(frame: Rotation, vector: Vector) -> Vector:
    """A vector in the axes of a frame, in the base frame."""
    first, second, third = columns(frame)
    return dot(first, vector), dot(second, vector), dot(third, vector)
