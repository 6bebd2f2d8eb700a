"""Whether an arm can carry its point onto an axis, and with which elbow.

This is found in numbers, and to be sure: an answer that is doubtful is yes. Where it cannot, nothing needs to be
chosen.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterator, Sequence

import mpmath
import sympy as sp

from kinegen.derive.inverse.axes import JointAxis
from kinegen.derive.inverse.exact_geometry import turned
from kinegen.derive.inverse.family import ElbowArm, GimbalArm
from kinegen.derive.inverse.geometry import Planar
from kinegen.derive.inverse.tolerances import Thresholds

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
    first = [(math.cos(angle), math.sin(angle)) for angle in _tried(arm.shoulder)]
    # The point moves by no more than this from one angle that is tried to a neighbour of it.
    step = 2 * math.pi / (_GRID - 1) * (abs(upper) + 2 * abs(lower))
    found: set[int] = set()
    # Distances from axis 1 are tried on a grid of both angles, until both elbows have been found.
    for second in _tried(arm.elbow):
        side = _wrapped(second + cmath.phase(lower) - cmath.phase(upper))
        new = {bend for bend, sign in ((0, -1), (1, 1)) if sign * side >= -_NEAR} - found
        point = upper + cmath.rect(1, second) * lower
        if new and any(abs(offset + c * point.real - s * point.imag) <= step for c, s in first):
            found |= new
    return frozenset(found)


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
    return math.pi + cmath.phase(_complex(upper)) - cmath.phase(_complex(lower))


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
    axis = [float(entry) for entry in turned(arm.frame, waist.second[2])]
    side = cmath.phase(lower) - cmath.phase(upper)
    points = [upper + cmath.rect(1, 2 * math.pi * turn / 8) * lower for turn in range(8)]
    size = abs(upper) + abs(lower) + abs(depth)
    found = []
    # The squared part of the point along axis 2, less what it is for a point on axis 1, and on axis 2.
    for cosine in (float(waist.cosine), 1.0):
        missed = [
            (axis[0] * point.real + axis[1] * point.imag + axis[2] * depth) ** 2
            - cosine**2 * (abs(point) ** 2 + depth**2)
            for point in points
        ]
        angles = [angle for angle in _zeros([each / size**2 for each in missed]) if _is_within(arm.elbow, angle)]
        # Stretched or folded, both elbows are the same.
        found.append(frozenset(int(_NEAR < _wrapped(angle + side) < math.pi - _NEAR) for angle in angles))
    return found[0], found[1]


def _zeros(values: Sequence[float]) -> Iterator[float]:
    """Yield the zeros of a sum of sines and cosines of an angle and of twice that angle, from eight of its values."""
    coefficients = []
    for order in (2, 1, 0, -1, -2):
        part = sum(value * cmath.rect(1, -2 * math.pi * order * turn / 8) for turn, value in enumerate(values)) / 8
        coefficients.append(complex(round(part.real, 14), round(part.imag, 14)))
    while coefficients and not coefficients[0]:
        del coefficients[0]
    if len(coefficients) < 2:
        return
    # The roots of the polynomial are the eigenvalues of its companion matrix.
    companion = mpmath.zeros(len(coefficients) - 1)
    for place, coefficient in enumerate(coefficients[1:]):
        companion[0, place] = -coefficient / coefficients[0]
        if place:
            companion[place, place - 1] = 1
    for root in map(complex, mpmath.eig(companion, left=False, right=False)):
        if abs(abs(root) - 1) < _NEAR:
            yield cmath.phase(root)


def _is_within(joint: JointAxis, angle: float) -> bool:
    if joint.arc is None:
        return True
    low, high = (float(end) for end in joint.arc)
    return (angle - low + _NEAR) % (2 * math.pi) <= high - low + 2 * _NEAR


def _tried(joint: JointAxis) -> list[float]:
    low, high = (-math.pi, math.pi) if joint.arc is None else (float(end) for end in joint.arc)
    return [low + (high - low) * step / (_GRID - 1) for step in range(_GRID)]


def _wrapped(angle: float) -> float:
    return (angle + math.pi) % (2 * math.pi) - math.pi


def _complex(vector: Planar) -> complex:
    return complex(float(vector[0]), float(vector[1]))
