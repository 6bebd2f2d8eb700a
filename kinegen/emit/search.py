"""The numbers of the search for joint values, which every language prints.

The NumPy form, `native/runtime/_search.py`, is copied into packages and repeats them; a test compares the two.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from types import MappingProxyType

from kinegen.emit.reals import Real

ByType = Mapping[Real, Fraction]


@dataclass(frozen=True, slots=True)
class Tuning:
    """How a search proceeds.

    Attributes:
        iterations: Steps of one descent at most.
        stall: After so many steps the squared error must have halved.
        samples: Random joint vectors before the first restart; before restart r there are r * r times as many.
        most_restarts: From this restart on their number stays the same.
        restarts: Restarts by default.
        tolerances: Accepted errors by default: of a rotation in radians, of a position as a part of the reach.
        rigid: How far the columns of a target may be from those of a rotation: the root of the sum of all squares.
        margin: Joints slow down in this part of their range before a limit.
        damping: The part of the squared error that damps a step.
        least_damping: Damping where there is no error left.
        longest_step: The largest turn of a joint in one step, in radians.
        huge: An error that every other one is smaller than.
        farthest: The largest squared distance of a target from the base.
        heaviest: The largest weight of a tip.
    """

    iterations: int
    stall: int
    samples: int
    most_restarts: int
    restarts: int
    tolerances: ByType
    rigid: ByType
    margin: Fraction
    damping: Fraction
    least_damping: ByType
    longest_step: Fraction
    huge: Fraction
    farthest: Fraction
    heaviest: Fraction

    @property
    def most_samples(self) -> int:
        """Random joint vectors before one restart at most."""
        return self.samples * self.most_restarts**2


def _by_type(double: Fraction, single: Fraction) -> ByType:
    return MappingProxyType({Real.DOUBLE: double, Real.FLOAT: single})


TUNING = Tuning(
    iterations=60,
    stall=8,
    samples=20,
    most_restarts=16,
    restarts=10,
    tolerances=_by_type(Fraction(1, 10**9), Fraction(1, 10**5)),
    rigid=_by_type(Fraction(3, 10**6), Fraction(3, 10**4)),
    margin=Fraction(2, 5),
    damping=Fraction(1, 10),
    least_damping=_by_type(Fraction(1, 10**12), Fraction(1, 10**7)),
    longest_step=Fraction(4, 5),
    huge=Fraction(10**30),
    farthest=Fraction(10**15),
    heaviest=Fraction(10**6),
)
