"""The chain of an arm for quick poses with short numbers: from one axis to the next by the least that leads there.

In: axes at q = 0. Out: for each pair of neighbours a shift along the first axis, a step across it and one or two tilts.
Neighbours that are nearly parallel have two tilts instead of a shift (Hayati and Mirmirani 1985), so that no number is
larger than the arm, whatever the table has.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from functools import lru_cache

import sympy as sp

from kinegen.symbolic.fold import Vector
from kinegen.symbolic.inverse.axes import Axes, JointAxis
from kinegen.symbolic.inverse.exact import (
    Rotation,
    chained,
    columns,
    combined,
    cross,
    dot,
    is_null,
    minus,
    perpendicular,
    tidy,
    turned,
    unit,
)
from kinegen.symbolic.inverse.geometry import feet
from kinegen.symbolic.inverse.special import held, is_clear

Planar = tuple[sp.Expr, sp.Expr]


@dataclass(frozen=True, slots=True)
class Link:
    """From one axis to the next, after the joint has turned by its angle and `lead`.

    Attributes:
        lead: What the joint is turned by at q = 0, in radians.
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
class OwnChain:
    """The chain of an arm from a frame on its first axis to one on its last.

    Attributes:
        links: Between the axes; one fewer than joints.
        rotation: Of the first frame in the base frame, by rows.
        origin: Of the first frame.
        hand_rotation: Of the tool in the last frame.
        hand_origin: Of the tool in the last frame.
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
def own_chain(axes: Axes) -> OwnChain:
    """The chain of an arm whose joints all turn.

    Args:
        axes: From the base to the tool, without runtime parameters.
    """
    joints = held(axes).joints
    start, origin, _ = _across(joints[0], joints[1], joints[0].point)
    links, front, place = [], start, origin
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
    return OwnChain(
        tuple(links), columns(first), origin, chained(hand, axes.rotation), turned(hand, minus(axes.position, place))
    )


def _frame(joint: JointAxis, front: Vector) -> Rotation:
    """Columns of the frame of an axis, from its x axis."""
    return front, cross(joint.direction, front), joint.direction


def _across(joint: JointAxis, following: JointAxis, origin: Vector) -> tuple[Vector, Vector, Vector]:
    """The direction from an axis to the next one, square to the first, and where it begins and ends.

    Along the common normal; for axes that are nearly parallel, from the place on the first that is reached already.
    """
    if is_clear(joint, following):
        here, there = feet(joint, following)
        return unit(cross(joint.direction, following.direction)), here, there
    along = dot(minus(origin, following.point), joint.direction) / dot(following.direction, joint.direction)
    there = combined((1, following.point), (along, following.direction))
    apart = minus(there, origin)
    return perpendicular(joint.direction) if is_null(apart) else unit(apart), origin, there
