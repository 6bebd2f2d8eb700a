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

import sympy as sp

from kinegen.derive.expressions import IN_SINGLE, by_type
from kinegen.derive.inverse.axes import JointAxis
from kinegen.derive.inverse.exact_geometry import tidy
from kinegen.derive.inverse.family import (
    ColumnArm,
    Family,
    FlatArm,
    GantryArm,
    PointArm,
    StrokeArm,
    WristArm,
    elbow_of,
)
from kinegen.derive.inverse.geometry import Planar
from kinegen.support.dataclass import dataclass

ROUNDOFFS = sp.Rational(1, 2**53), sp.Rational(1, 2**24)
"""The unit roundoffs of double and of single precision."""


def _roundings(double: int, single: int) -> sp.Expr:
    return by_type(double * ROUNDOFFS[0], single * ROUNDOFFS[1])


TARGET = _roundings(2**12, 2**6)
"""How far a target may be off, relative to the reach: 4.5e-13 and 3.8e-6."""

ROUNDING = _roundings(8, 8)
"""What the operations up to a squared sine add, relative to its condition."""

FREE = _roundings(2**11, 2**4)
"""Sines, and distances against the size of the arm, below this leave a direction free: 2.3e-13 and 9.5e-7.

A direction that is chosen instead of one that is there moves the tool by twice that at most.
"""

ALIGNED = by_type(*((roundings * unit) ** 2 for roundings, unit in zip((2**11, 2**4), ROUNDOFFS, strict=True)))
"""Its square."""

TELLING = by_type(sp.Rational(1, 10**18), sp.Rational(1, 10**8))
"""The square of the length that a vector needs to say how a waist beside whose axis the point goes is turned.

A vector of length g is known to e. It leaves the waist unknown by e / g, which brings a point at a distance s from the
axis s (e / g)^2 / 2 beside its place. A point where both shoulders meet leaves the waist unknown by the root of e, and
turns such a vector by g times that. Both are rounding at 1e-9 in double and at 1e-4 in float.
"""

LOOSE = 5 * ALIGNED
"""How far a hand may point elsewhere than the target says: the square of what that does to the rotation."""

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
        copied: Joints that are a sum of coordinates of the target or a distance, by their numbers, and how far each
            moves for a target that moves by 1.
    """

    reach: sp.Rational
    condition: sp.Rational
    share: sp.Rational
    copied: tuple[tuple[int, sp.Rational], ...] = ()

    @property
    def within(self) -> sp.Expr:
        """How far outside its limits a joint that turns may be found, in radians.

        Where two branches meet, rounding turns joints by the root of what it does to squared sines. Squared sines below
        the square of this may be taken for zero, so that joints are far nearer elsewhere and at the stretched arm.
        """
        return by_type(*(_rounded(math.sqrt(8 * self.condition * unit)) for unit in ROUNDOFFS))

    def room(self, joint: JointAxis) -> sp.Expr:
        """Return how far outside its limits a joint may be found, in its own unit; 0 where limits are strict."""
        return sp.S.Zero if joint.strict else self.rounding(joint)

    def rounding(self, joint: JointAxis) -> sp.Expr:
        """Return how far rounding may move a joint, in its own unit.

        Where a joint is a sum of coordinates of the target, or a distance, it is off by what the target is off by.
        """
        share = dict(self.copied).get(joint.number)
        if share is not None:
            return TARGET * self.reach * share / abs(joint.rate)
        return self.within / abs(joint.rate) * (1 if joint.turns else self.reach)

    def may_fold(self, first: sp.Expr, second: sp.Expr) -> bool:
        """Tell whether two links may fold onto the axis before them, as far as a target of either type may be off."""
        if not (first.is_number and second.is_number):
            return True
        near = max(first / 10**6, sp.Rational(5, 2) * TARGET.subs(IN_SINGLE, 1) * self.reach)
        return bool(abs(abs(first) - abs(second)) < near)

    @property
    def flat(self) -> sp.Expr:
        """Squared sines below this, times the weight, are rounding: the arm is stretched or folded."""
        return ROUNDING * self.condition / self.share

    @property
    def beyond(self) -> sp.Expr:
        """What a squared sine may be below zero, times the weight, for a target still to be within reach."""
        return TARGET * self.condition / self.share


def thresholds_of(family: Family, reach: float) -> Thresholds:
    """Return the thresholds of an arm for its reach in the unit of the file, with the file's runtime lengths."""
    elbow = elbow_of(family.build)
    # Runtime lengths count with their values in the file: thresholds are constants of the code.
    a, b = (math.hypot(*map(family.axes.value, link)) for link in elbow[1:]) if elbow else (0.0, 0.0)
    condition = _LEAST_CONDITION if a * b == 0 else max(_LEAST_CONDITION, 2 * (a + b) * max(reach, a + b) / (a * b))
    share = _rounded((a + b) * (a + b + abs(a - b)) or 1.0)
    return Thresholds(_rounded(reach), _rounded(condition), share, _copied(family))


def _copied(family: Family) -> tuple[tuple[int, sp.Rational], ...]:
    """Return the joints that shift along a coordinate of the target, and by how much; none for a nearly arm."""
    build = family.build
    arm = build.arm if isinstance(build, PointArm | WristArm) else build
    if family.defect is not None:
        return ()
    match arm:
        case FlatArm(lift=JointAxis() as lift):
            return ((lift.number, sp.S.One),)
        case ColumnArm():
            return ((arm.lift.number, sp.S.One), *_distance(arm.stroke, arm.heading, arm.start[:2]))
        case StrokeArm(depth=sp.S.Zero):
            return _distance(arm.stroke, arm.heading, arm.start)
        case GantryArm():
            rows = (math.hypot(*map(family.axes.value, row)) for row in arm.inverse)
            return tuple((joint.number, _rounded(row)) for joint, row in zip(arm.joints, rows, strict=True))
        case _:
            return ()


def _distance(stroke: JointAxis, heading: Planar, start: Planar) -> tuple[tuple[int, sp.Rational], ...]:
    """Return a stroke that is the distance to an axis, and no root of a difference: its line meets the axis."""
    aside = tidy(heading[0] * start[1] - heading[1] * start[0])
    return ((stroke.number, sp.S.One),) if aside == 0 else ()


def plain_thresholds(reach: float) -> Thresholds:
    """Return the thresholds of what has no elbow, of a reach in the length unit of the file."""
    return Thresholds(_rounded(reach), sp.Rational(_LEAST_CONDITION), sp.S.One)


def _rounded(number: float) -> sp.Rational:
    """To three digits, which is enough for a threshold."""
    return sp.Rational(f"{float(number):.2e}")
