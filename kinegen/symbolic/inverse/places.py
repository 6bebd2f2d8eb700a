"""Joint values at which the branches of an arm meet: stretched, folded, wrist in line."""

from __future__ import annotations

import sympy as sp

from kinegen.symbolic.inverse.axes import JointAxis
from kinegen.symbolic.inverse.family import (
    ElbowArm,
    Family,
    FlatArm,
    GimbalArm,
    PointArm,
    SphericalArm,
    TripleArm,
    WristArm,
)
from kinegen.symbolic.inverse.geometry import Planar, Wrist

Places = tuple[int, tuple[float, float]]
"""Index of a joint in q, and two of its values."""


def boundaries(family: Family) -> tuple[Places, ...]:
    """The values of the elbow at which the arm is stretched and folded; none where there is no elbow."""
    match family.build:
        case PointArm(ElbowArm() | GimbalArm() as arm) | WristArm(ElbowArm() | GimbalArm() as arm):
            return (_elbow(family, arm.elbow, arm.upper, arm.lower),)
        case FlatArm(turns, _, _, upper, lower):
            return (_elbow(family, turns[1], upper, lower),)
        case TripleArm(_, turns, upper, lower):
            return (_elbow(family, turns[1], upper, lower),)
        case SphericalArm(_, elbow, _, _, upper, lower):
            return (_elbow(family, elbow, upper, lower),)
        case _:
            return ()


def alignments(family: Family) -> tuple[Places, ...]:
    """The values of the middle joint of the wrist at which its neighbours are in line; none without a wrist."""
    match family.build:
        case WristArm(_, wrist):
            return (_bend(family, wrist),)
        case SphericalArm(shoulder, _, wrist):
            return _bend(family, shoulder), _bend(family, wrist)
        case TripleArm(wrist=Wrist() as wrist):
            return (_bend(family, wrist),)
        case _:
            return ()


def _elbow(family: Family, elbow: JointAxis, upper: Planar, lower: Planar) -> Places:
    stretched = sp.atan2(upper[1], upper[0]) - sp.atan2(lower[1], lower[0])
    return _places(family, elbow, stretched)


def _bend(family: Family, wrist: Wrist) -> Places:
    return _places(family, wrist.joints[1], -wrist.skew)


def _places(family: Family, joint: JointAxis, angle: sp.Expr) -> Places:
    first, second = (family.axes.value(each / joint.rate) for each in (angle, angle + sp.pi))
    return joint.number - 1, (first, second)
