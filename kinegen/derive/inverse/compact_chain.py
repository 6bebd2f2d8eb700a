"""The chain of an arm for quick poses with short numbers: from one axis to the next by the least that leads there.

Each pair of neighbours has a shift along the first axis, a step across it and one or two tilts. Neighbours that are
nearly parallel have two tilts instead of a shift (Hayati and Mirmirani 1985), so that no number is larger than the arm,
whatever the table has. Such chains also tell how far the tip of a family's arm is from that of an arm nearly like it.
"""

from __future__ import annotations

import itertools
import math
from functools import lru_cache

import sympy as sp

from kinegen.derive.folding import Vector
from kinegen.derive.inverse.axes import Axes, JointAxis
from kinegen.derive.inverse.exact_geometry import (
    Rotation,
    chained,
    combined,
    cross,
    dot,
    is_null,
    minus,
    perpendicular,
    tidy,
    transposed,
    turned,
    unit,
)
from kinegen.derive.inverse.family import Family
from kinegen.derive.inverse.geometry import feet
from kinegen.derive.inverse.nearest_family import held, is_clear
from kinegen.model.joint_bounds import joint_box
from kinegen.model.robot import Robot
from kinegen.support.dataclass import dataclass

Planar = tuple[sp.Expr, sp.Expr]


@dataclass(frozen=True, slots=True)
class Link:
    """The way from one axis to the next, after the joint has turned by its angle and `lead`.

    Attributes:
        lead: The angle at q = 0, in radians.
        shift: Along the axis.
        across: Along x.
        tilt: Cosine and sine of the turn about x that follows.
        lean: Cosine and sine of the turn about y after it; (1, 0) where there is none.
    """

    lead: sp.Expr
    shift: sp.Expr
    across: sp.Expr
    tilt: Planar
    lean: Planar


@dataclass(frozen=True, slots=True)
class CompactChain:
    """The chain of an arm from a frame on its first axis to one on its last.

    `rotation` (by rows) and `origin` place the first frame in the base frame, `hand_rotation` and `hand_origin` the
    tool in the last frame. There is one link fewer than joints.
    """

    links: tuple[Link, ...]
    rotation: Rotation
    origin: Vector
    hand_rotation: Rotation
    hand_origin: Vector

    @property
    def reach(self) -> float:
        """The sum of its lengths, as far as they are between places where axes come near to each other."""
        lengths = [(link.shift, link.across) for link in self.links]
        return sum(math.hypot(*map(float, each)) for each in (*lengths, self.hand_origin))


@lru_cache(maxsize=32)
def own_chain(axes: Axes) -> CompactChain:
    """Return the chain of an arm without runtime parameters whose joints all turn, from the base to the tool."""
    joints = held(axes).joints
    start, origin, _ = _across(joints[0], joints[1], joints[0].point)
    links, front, place = [], start, origin
    # The x axis of each frame is the direction in which the next axis lies; what it turns by is the lead.
    for joint, following in itertools.pairwise(joints):
        x, here, there = _across(joint, following, place)
        y = cross(joint.direction, x)
        ahead, beside, up = (dot(following.direction, each) for each in (x, y, joint.direction))
        upright = tidy(sp.sqrt(tidy(beside**2 + up**2)))
        tilt = (tidy(up / upright), tidy(-beside / upright))
        links.append(
            Link(
                lead=sp.atan2(dot(cross(front, x), joint.direction), dot(front, x)),
                shift=dot(minus(here, place), joint.direction),
                across=dot(minus(there, here), x),
                tilt=tilt,
                lean=(upright, ahead),
            )
        )
        front, place = combined((upright, x), (-ahead * tilt[0], joint.direction), (ahead * tilt[1], y)), there
    hand, first = _frame(joints[-1], front), _frame(joints[0], start)
    return CompactChain(
        tuple(links), transposed(first), origin, chained(hand, axes.rotation), turned(hand, minus(axes.position, place))
    )


def _frame(joint: JointAxis, front: Vector) -> Rotation:
    """Return columns of the frame of an axis, from its x axis."""
    return front, cross(joint.direction, front), joint.direction


def _across(joint: JointAxis, following: JointAxis, origin: Vector) -> tuple[Vector, Vector, Vector]:
    """Return the direction from an axis to the next one, square to the first, and where it begins and ends.

    It is along the common normal; for axes that are nearly parallel, from the place on the first that is reached
    already.
    """
    if is_clear(joint, following):
        here, there = feet(joint, following)
        return unit(cross(joint.direction, following.direction)), here, there
    along = dot(minus(origin, following.point), joint.direction) / dot(following.direction, joint.direction)
    there = combined((1, following.point), (along, following.direction))
    apart = minus(there, origin)
    return perpendicular(joint.direction) if is_null(apart) else unit(apart), origin, there


SAMPLES = 1000
"""Joint vectors that are tried."""

_STRIDES = tuple(math.sqrt(prime) for prime in (2, 3, 5, 7, 11, 13, 17))
"""Multiples of these, without their whole parts, are spread evenly (Weyl)."""

Matrix = list[list[float]]
"""The upper three rows of a homogeneous matrix."""


@dataclass(frozen=True, slots=True)
class TipApart:
    """The largest distances found, in the length unit of the file and in radians; larger ones may exist."""

    length: float
    angle: float


def tip_apart(robot: Robot, family: Family) -> TipApart:
    """Compare an arm and the one of its family at `SAMPLES` joint vectors that are spread evenly in the joint box."""
    if family.defect is None:
        return TipApart(0.0, 0.0)
    # Both chains go the same way, so that their joints correspond.
    same = family.defect.axes.reversed() if family.is_reversed else family.defect.axes
    own, special = _screws(same), _screws(family.axes)
    box = joint_box(robot)
    length = angle = 0.0
    for sample in range(SAMPLES):
        drawn = [low + (high - low) * (sample * each % 1) for (low, high), each in zip(box, _STRIDES, strict=False)]
        q = [drawn[number - 1] for number in family.axes.numbers]
        a, b = _tip(own, q), _tip(special, q)
        length = max(length, math.dist(*([row[3] for row in each] for each in (a, b))))
        square = sum((a[i][j] - b[i][j]) ** 2 for i in range(3) for j in range(3))
        angle = max(angle, 2 * math.asin(min(1.0, math.sqrt(square / 8))))
    return TipApart(length, angle)


def _screws(axes: Axes) -> tuple[list[tuple[list[float], list[float], float]], Matrix]:
    """Direction, point and rate of each joint, and the tip at q = 0, as floats."""
    joints = [
        ([float(entry) for entry in joint.direction], [float(entry) for entry in joint.point], float(joint.rate))
        for joint in axes.joints
    ]
    tip = [[*map(float, row), float(entry)] for row, entry in zip(axes.rotation, axes.position, strict=True)]
    return joints, tip


def _tip(screws: tuple[list[tuple[list[float], list[float], float]], Matrix], q: list[float]) -> Matrix:
    """Return the pose of the tip: its pose at q = 0, turned about each axis from the last to the first."""
    joints, start = screws
    columns = [[row[j] for row in start] for j in range(4)]
    # The pose is a product of motions about fixed lines (Brockett 1984).
    for (axis, point, rate), value in zip(reversed(joints), reversed(q), strict=True):
        turned = [_turned(axis, rate * value, column) for column in columns[:3]]
        place = _turned(axis, rate * value, [a - b for a, b in zip(columns[3], point, strict=True)])
        columns = [*turned, [a + b for a, b in zip(place, point, strict=True)]]
    return [[columns[j][i] for j in range(4)] for i in range(3)]


def _turned(axis: list[float], angle: float, vector: list[float]) -> list[float]:
    """Return a vector turned about an axis through the origin (Rodrigues)."""
    cosine, sine = math.cos(angle), math.sin(angle)
    along = sum(a * b for a, b in zip(axis, vector, strict=True)) * (1 - cosine)
    across = [axis[(i + 1) % 3] * vector[(i + 2) % 3] - axis[(i + 2) % 3] * vector[(i + 1) % 3] for i in range(3)]
    return [cosine * v + sine * c + along * a for v, c, a in zip(vector, across, axis, strict=True)]
