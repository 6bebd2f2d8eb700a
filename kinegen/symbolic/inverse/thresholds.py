"""How near is near enough: the thresholds of the inverse, by number type and by the size of the arm.

Each follows from the unit roundoff u, 2^-53 in double and 2^-24 in single precision, and from how far a target that is
off by so much moves what is compared. Lengths are those of the robot file, also where they are runtime parameters.

A target is taken to be right to `TARGET` of the reach L. With links of lengths a and b the squared sine of the elbow
is off by `TARGET` times `2 r L / (a b)` where the arm is stretched or folded, since it changes by `2 r / (a b)` for
each unit of the distance r between the ends, and r is off by `TARGET * L`. Its condition is what that is for the
stretched arm, r = a + b. The folded arm, r = |a - b|, is better off by `|a - b| / (a + b)`; `weight` is that ratio at
both ends.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import sympy as sp

from kinegen.symbolic.expressions import by_type
from kinegen.symbolic.inverse.axes import JointAxis
from kinegen.symbolic.inverse.family import (
    Build,
    ElbowArm,
    Family,
    FlatArm,
    GimbalArm,
    PointArm,
    SphericalArm,
    TripleArm,
    WristArm,
)
from kinegen.symbolic.inverse.geometry import Planar

ROUNDOFFS = sp.Rational(1, 2**53), sp.Rational(1, 2**24)
"""The unit roundoffs of double and of single precision."""


def _roundings(double: int, single: int) -> sp.Expr:
    return by_type(double * ROUNDOFFS[0], single * ROUNDOFFS[1])


TARGET = _roundings(2**13, 2**6)
"""How far a target may be off, relative to the reach: 9.1e-13 and 3.8e-6."""

ROUNDING = _roundings(8, 8)
"""What the operations up to a squared sine add, relative to its condition."""

ALIGNED = by_type(sp.Rational(1, 10**20), sp.Rational(1, 10**12))
"""Squares below this, against that of the arm or of a unit vector, leave a direction free."""

LOOSE = by_type(sp.Rational(1, 10**19), sp.Rational(1, 10**11))
"""How far a hand may point elsewhere than the target says: the square of what that does to the rotation."""

BESIDE = by_type(sp.Rational(1, 10**6), sp.Rational(1, 10**3))
"""Of two lengths that tell a direction the squared ratio below which the shorter one is not asked."""

PLANE = by_type(sp.Rational(1, 10**6), sp.Rational(1, 10**5))
"""How far a target may be from what an arm of fewer than six joints can do: radians, or relative to the arm's size."""

RIGID = by_type(sp.Rational(3, 10**6), sp.Rational(3, 10**4))
"""How far the columns of a target may be from those of a rotation: the root of the sum of all squares."""

_LEAST_CONDITION = 12
"""That of an arm without an elbow, whose branches meet at the waist or the wrist."""


@dataclass(frozen=True, slots=True)
class Thresholds:
    """The thresholds of one arm.

    Attributes:
        reach: Reach of the arm, as a number.
        condition: The condition of the squared sine of the elbow where the arm is stretched, see above.
        share: What the weight of a squared distance is divided by: (a + b) (a + b + |a - b|).
    """

    reach: sp.Rational
    condition: sp.Rational
    share: sp.Rational

    @property
    def within(self) -> sp.Expr:
        """How far outside its limits a joint that turns may be found, in radians.

        Where two branches meet, rounding turns joints by the root of what it does to squared sines. Squared sines below
        the square of this may be taken for zero, so that joints are far nearer elsewhere and at the stretched arm.
        """
        return by_type(*(_rounded(math.sqrt(8 * self.condition * unit)) for unit in ROUNDOFFS))

    def room(self, joint: JointAxis) -> sp.Expr:
        """How far outside its limits a joint may be found, in its own unit."""
        return self.within / abs(joint.rate) * (1 if joint.turns else self.reach)

    @property
    def flat(self) -> sp.Expr:
        """Squared sines below this, times the weight, are rounding: the arm is stretched or folded."""
        return ROUNDING * self.condition / self.share

    @property
    def beyond(self) -> sp.Expr:
        """What a squared sine may be below zero, times the weight, for a target still to be within reach."""
        return TARGET * self.condition / self.share


def thresholds_of(family: Family, reach: float) -> Thresholds:
    """The thresholds of an arm.

    Args:
        family: How it is built.
        reach: Its reach, in the length unit of the file.

    Returns:
        The record, with the values of the robot file for runtime lengths.
    """
    links = links_of(family.build)
    a, b = (1.0, 1.0) if links is None else (math.hypot(*map(family.axes.value, link)) for link in links)
    condition = _LEAST_CONDITION if a * b == 0 else max(_LEAST_CONDITION, 2 * (a + b) * max(reach, a + b) / (a * b))
    return Thresholds(_rounded(reach), _rounded(condition), _rounded((a + b) * (a + b + abs(a - b)) or 1.0))


def plain_thresholds(reach: float) -> Thresholds:
    """The thresholds of what has no elbow, of a reach in the length unit of the file."""
    return Thresholds(_rounded(reach), sp.Rational(_LEAST_CONDITION), sp.S.One)


def links_of(build: Build) -> tuple[Planar, Planar] | None:
    """The two links about the elbow of an arm; None where it has no elbow."""
    match build:
        case PointArm(ElbowArm() | GimbalArm() as arm) | WristArm(ElbowArm() | GimbalArm() as arm):
            return arm.upper, arm.lower
        case FlatArm() | TripleArm() | SphericalArm():
            return build.upper, build.lower
        case _:
            return None


def _rounded(number: float) -> sp.Rational:
    """To three digits, which is enough for a threshold."""
    return sp.Rational(f"{float(number):.2e}")
