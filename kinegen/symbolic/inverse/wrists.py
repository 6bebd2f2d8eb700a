"""The spherical wrist: three angles from what is left of the attitude after the arm."""

from __future__ import annotations

import math

import sympy as sp

from kinegen.symbolic.fold import Vector
from kinegen.symbolic.inverse.geometry import Planar, Wrist
from kinegen.symbolic.inverse.steps import HALF_TURN, ONE, ZERO, Angle, Steps, fixed
from kinegen.symbolic.inverse.thresholds import ALIGNED

Columns = tuple[Vector, Vector, Vector]


Flip = tuple[Angle, Angle, Angle]
"""One of the two ways to hold a wrist: how far the axes of its three joints are turned."""


def flips(steps: Steps, wrist: Wrist, left: Columns, start: Planar) -> tuple[Flip, Flip]:
    """Solve `left = Rz(t4) Ry(t5 + skew) Rz(t6)` in both ways.

    Args:
        steps: The tape.
        wrist: The wrist.
        left: Columns of the rotation that is left to the wrist, in the wrist's frame and the hand's.
        start: The direction of t4 where axes 4 and 6 are in line, unless t6 would break its limits.

    Returns:
        The way with t5 + skew from 0 to 180 deg, and the one with every axis turned to the other side.
    """
    r13, r23, _ = left[2]
    square = steps.square((r13, r23))
    start = _within_limits(steps, wrist, left, start)
    lead = (steps.select(square, ALIGNED, start[0], r13), steps.select(square, ALIGNED, start[1], r23))
    roll, tilt, flange = held(steps, left, lead)
    skew = fixed(wrist.skew)
    return (roll, tilt - skew, flange), (roll + HALF_TURN, -tilt - skew, flange + HALF_TURN)


def _within_limits(steps: Steps, wrist: Wrist, left: Columns, start: Planar) -> Planar:
    """The direction of t4 where axes 4 and 6 are in line: the given one, or one that leaves t6 at its nearest limit.

    The second column then has the sum t4 + t6, or their difference where the axes point against each other.
    """
    if wrist.flange_limits is None:
        return start
    low, high = wrist.flange_limits
    (_, _, _), (r12, r22, _), (_, _, r33) = left
    total = (r22, steps.name(-r12))
    # t6 as it would be, from the middle of its limits.
    turned = steps.back(start, total)
    middle, end = steps.unit((low + high) / 2), steps.unit((high - low) / 2)
    cosine, sine = steps.back(middle, (turned[0], steps.select(r33, ZERO, -turned[1], turned[1])))
    # Half of the range on, at the end that is nearer; turned back from the sum or the difference, t4 is left.
    side = steps.select(sine, ZERO, -end[1], end[1])
    limit = steps.times(middle, (end[0], side))
    lead = steps.back((limit[0], steps.select(r33, ZERO, -limit[1], limit[1])), total)
    return (
        steps.select(cosine, end[0], lead[0], start[0]),
        steps.select(cosine, end[0], lead[1], start[1]),
    )


def held(steps: Steps, left: Columns, lead: Planar) -> Flip:
    """The angles t4, t5 + skew without flip, and t6, for a given direction of t4.

    t6 comes from what turning back by t4 leaves of the first columns, so that the two fit together however near to each
    other axes 4 and 6 are.
    """
    (r11, r21, _), (r12, r22, _), (_, _, r33) = left
    tilt = Angle(steps.name(sp.atan2(sine_of(steps, left), r33, evaluate=False)), 0.0, math.pi)
    sine = steps.name(steps.name(r21 * lead[0]) - steps.name(r11 * lead[1]))
    cosine = steps.name(steps.name(r22 * lead[0]) - steps.name(r12 * lead[1]))
    return steps.argument(lead), tilt, steps.argument((cosine, sine))


def sine_of(steps: Steps, left: Columns) -> sp.Expr:
    """The sine of the angle between axes 4 and 6, not negative."""
    return steps.root(steps.square(left[2][:2]))


def hand_direction(steps: Steps, left: Columns) -> Planar:
    """The direction of t4 without flip as a complex number of length 1, for an arm that goes on from there.

    Where axes 4 and 6 are in line, the one that leaves t6 = 0: what the other columns say is then the turn t4.
    """
    (_, _, _), (r12, r22, _), (r13, r23, _) = left
    square = steps.square((r13, r23))
    inverse = steps.name(1 / steps.select(square, ALIGNED, ONE, steps.root(square)))
    return (
        steps.name(steps.select(square, ALIGNED, r22, r13) * inverse),
        steps.name(steps.select(square, ALIGNED, -r12, r23) * inverse),
    )
