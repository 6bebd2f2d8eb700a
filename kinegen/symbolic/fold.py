"""Structure first: a chain of elementary transforms with everything folded that can be, before any product is formed.

In: turns and shifts. Out: the same transform as `T(t1) R1 T(t2) R2 ... T(t) C` where

- each `R` turns about a coordinate axis by an angle that no neighbour shares an axis with: turns about parallel or
  anti-parallel axes have been merged into one (`Rz(q2) Tx(a2) Rz(q3)` is a shift by `(a2 c2, a2 s2, 0)` and then
  `Rz(q2 + q3)`), which is where `c23` comes from;
- quarter turns have been carried to the end, where they make up the constant attitude `C`, a signed permutation.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import lru_cache

import sympy as sp

from kinegen.symbolic.transforms import Elementary, Shift, Turn

Vector = tuple[sp.Expr, sp.Expr, sp.Expr]
NULL: Vector = (sp.S.Zero, sp.S.Zero, sp.S.Zero)

SignedAxis = tuple[int, int]
"""An axis (0, 1, 2) and a sign."""

Attitude = tuple[SignedAxis, SignedAxis, SignedAxis]
"""A rotation that permutes the axes: where each unit vector goes."""

UPRIGHT: Attitude = ((0, 1), (1, 1), (2, 1))

_SPECIAL = 120
"""The largest denominator of a part of pi whose sine and cosine sympy knows in roots."""


@dataclass(frozen=True, slots=True)
class Folded:
    """A folded chain.

    Attributes:
        shifts: One translation before each turn, and one after the last.
        turns: Turns about coordinate axes; no two neighbours share an axis.
        attitude: The constant quarter turns at the end.
    """

    shifts: tuple[Vector, ...]
    turns: tuple[Turn, ...]
    attitude: Attitude


@dataclass(frozen=True, slots=True)
class Leg:
    """A shift in the middle of a chain: where the frame points there, and how far it goes.

    Attributes:
        turns: The folded turns that stand before it.
        shift: The translation, in the axes after those turns.
    """

    turns: tuple[Turn, ...]
    shift: Vector


@dataclass(frozen=True, slots=True)
class Trail:
    """A chain whose turns are folded but whose shifts stay where they are, for frames that share them.

    Attributes:
        legs: The shifts, from the start to the end.
        turns: All turns, folded.
        attitude: The constant quarter turns at the end.
    """

    legs: tuple[Leg, ...]
    turns: tuple[Turn, ...]
    attitude: Attitude


@lru_cache(maxsize=1024)
def cosine_sine(angle: sp.Expr) -> tuple[sp.Expr, sp.Expr]:
    """The cosine and the sine of an angle, as sympy's `cos` and `sin` give them.

    For a constant sympy tries one special value after the other, which takes milliseconds. It knows none for a part of
    pi with a large denominator; such an angle is brought to the first quadrant here.
    """
    share, rest = angle.as_coeff_Mul()
    if rest is not sp.pi or not share.is_Rational or share.q <= _SPECIAL or abs(share) > 2:
        return sp.cos(angle), sp.sin(angle)
    half_turn, place = share.q, share.p % (2 * share.q)
    below, place = place > half_turn, min(place, 2 * half_turn - place)
    left, place = 2 * place > half_turn, min(place, half_turn - place)
    acute = sp.Rational(place, half_turn) * sp.pi
    cosine, sine = sp.cos(acute, evaluate=False), sp.sin(acute, evaluate=False)
    return -cosine if left else cosine, -sine if below else sine


def rotate(axis: int, angle: sp.Expr, vector: Vector) -> Vector:
    """Turn a vector about a coordinate axis."""
    cosine, sine = cosine_sine(angle)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    turned = list(vector)
    if vector[j] is sp.S.Zero:  # as in unit vectors; sympy takes as long for a zero as for any factor
        turned[i], turned[j] = cosine * vector[i], sine * vector[i]
    elif vector[i] is sp.S.Zero:
        turned[i], turned[j] = -(sine * vector[j]), cosine * vector[j]
    else:
        turned[i] = cosine * vector[i] - sine * vector[j]
        turned[j] = sine * vector[i] + cosine * vector[j]
    return turned[0], turned[1], turned[2]


def total(left: Vector, right: Vector) -> Vector:
    """Add two vectors."""
    return left[0] + right[0], left[1] + right[1], left[2] + right[2]


def quarter_turns(angle: sp.Expr) -> tuple[sp.Expr, int]:
    """Split an angle into a rest and a number of quarter turns (0 to 3), exactly.

    A constant that is no multiple of a quarter stays in the rest as it is.
    """
    constant, _ = angle.as_independent(*angle.free_symbols, as_Add=True) if angle.free_symbols else (angle, None)
    quarters = constant * 2 / sp.pi
    if quarters.is_Integer:
        return angle - constant, int(quarters) % 4
    return angle, 0


@dataclass(slots=True)
class Folder:
    """The state while a chain is walked; frozen records leave it."""

    shifts: list[Vector] = field(default_factory=lambda: [NULL])
    turns: list[Turn] = field(default_factory=list)
    attitude: Attitude = UPRIGHT

    def shift(self, step: Shift) -> Vector:
        """Append a translation; return it in the axes of the last turn."""
        axis, sign = self.attitude[step.axis]
        moved = [sp.S.Zero] * 3
        moved[axis] = sign * step.length
        vector: Vector = (moved[0], moved[1], moved[2])
        self.shifts[-1] = total(self.shifts[-1], vector)
        return vector

    def turn(self, step: Turn) -> None:
        """Append a rotation, merged with the last one if the axes are parallel."""
        axis, sign = self.attitude[step.axis]
        angle = sign * step.angle
        if self.turns and self.turns[-1].axis == axis:
            last = self.turns.pop()
            carried = self.shifts.pop()
            self.shifts[-1] = total(self.shifts[-1], rotate(axis, last.angle, carried))
            angle = last.angle + angle
        rest, quarters = quarter_turns(sp.expand(angle))
        self.attitude = _after_quarters(axis, quarters, self.attitude)
        if rest != 0:
            self.turns.append(Turn(axis, rest))
            self.shifts.append(NULL)


def _after_quarters(axis: int, quarters: int, attitude: Attitude) -> Attitude:
    i, j = (axis + 1) % 3, (axis + 2) % 3
    for _ in range(quarters):
        image = {axis: (axis, 1), i: (j, 1), j: (i, -1)}
        turned = [(image[to][0], sign * image[to][1]) for to, sign in attitude]
        attitude = (turned[0], turned[1], turned[2])
    return attitude


def fold(steps: Iterable[Elementary]) -> Folded:
    """Fold a chain completely, for the pose of its end.

    Args:
        steps: Elementary transforms, left to right.

    Returns:
        The same transform in folded form.
    """
    folder = Folder()
    for step in steps:
        if isinstance(step, Turn):
            folder.turn(step)
        else:
            folder.shift(step)
    return Folded(tuple(folder.shifts), tuple(folder.turns), folder.attitude)


def trace(steps: Iterable[Elementary]) -> Trail:
    """Fold the turns of a chain but leave each shift where it stands, for poses of many frames along it.

    Args:
        steps: Elementary transforms, left to right.

    Returns:
        The shifts with the turns before each, and the folded turns of the whole.
    """
    folder = Folder()
    legs: list[Leg] = []
    for step in steps:
        if isinstance(step, Turn):
            folder.turn(step)
            continue
        vector = folder.shift(step)
        turns = tuple(folder.turns)
        if legs and legs[-1].turns == turns:
            legs[-1] = Leg(turns, total(legs[-1].shift, vector))
        else:
            legs.append(Leg(turns, vector))
    return Trail(tuple(legs), tuple(folder.turns), folder.attitude)
