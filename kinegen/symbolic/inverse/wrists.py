"""The spherical wrist: three angles from what is left of the attitude after the arm."""

from __future__ import annotations

import math

import sympy as sp

from kinegen.symbolic.fold import Vector
from kinegen.symbolic.inverse.geometry import Planar, Wrist
from kinegen.symbolic.inverse.steps import ALIGNED, HALF_TURN, ONE, Angle, Steps, fixed

Columns = tuple[Vector, Vector, Vector]


Flip = tuple[Angle, Angle, Angle]
"""One of the two ways to hold a wrist: how far the axes of its three joints are turned."""


def flips(steps: Steps, wrist: Wrist, left: Columns, start: Planar) -> tuple[Flip, Flip]:
    """Solve `left = Rz(t4) Ry(t5 + skew) Rz(t6)` in both ways.

    t4 comes from the third column, t6 from what turning back by it leaves of the others, so that the two fit together
    however near to each other axes 4 and 6 are; where they are in line, `start` takes the place of the third column.

    Args:
        steps: The tape.
        wrist: The wrist.
        left: Columns of the rotation that is left to the wrist, in the wrist's frame and the hand's.
        start: The direction of t4 where axes 4 and 6 are in line.

    Returns:
        The way with t5 + skew from 0 to 180 deg, and the one with every axis turned to the other side.
    """
    (r11, r21, _), (r12, r22, _), (r13, r23, r33) = left
    square = steps.square((r13, r23))
    lead = (steps.select(square, ALIGNED, start[0], r13), steps.select(square, ALIGNED, start[1], r23))
    roll = steps.argument(lead)
    tilt = Angle(steps.name(sp.atan2(steps.root(square), r33, evaluate=False)), 0.0, math.pi)
    sine = steps.name(steps.name(r21 * lead[0]) - steps.name(r11 * lead[1]))
    cosine = steps.name(steps.name(r22 * lead[0]) - steps.name(r12 * lead[1]))
    flange = steps.argument((cosine, sine))
    skew = fixed(wrist.skew)
    return (
        (roll, tilt - skew, flange),
        (roll + HALF_TURN, -tilt - skew, flange + HALF_TURN),
    )


def hand_direction(steps: Steps, left: Columns, start: Planar) -> Planar:
    """The direction of t4 without flip as a complex number of length 1, for an arm that goes on from there.

    Args:
        steps: The tape.
        left: As for `flips`.
        start: As for `flips`.

    Returns:
        The complex number.
    """
    r13, r23, _ = left[2]
    square = steps.square((r13, r23))
    length = steps.select(square, ALIGNED, ONE, steps.root(square))
    inverse = steps.name(1 / length)
    return (
        steps.name(steps.select(square, ALIGNED, start[0], r13) * inverse),
        steps.name(steps.select(square, ALIGNED, start[1], r23) * inverse),
    )
