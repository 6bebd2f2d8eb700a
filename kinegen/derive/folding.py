"""Structure first: a chain of elementary transforms with everything folded that can be, before any product is formed.

In: turns and shifts. Out: the same transform as `T(t1) R1 T(t2) R2 ... T(t) C` where

- each `R` turns about a coordinate axis by an angle that no neighbour shares an axis with: turns about parallel or
  anti-parallel axes have been merged into one (`Rz(q2) Tx(a2) Rz(q3)` is a shift by `(a2 c2, a2 s2, 0)` and then
  `Rz(q2 + q3)`), which is where `c23` comes from;
- quarter turns have been carried to the end, where they make up the constant attitude `C`, a signed permutation.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import field
from functools import lru_cache

import sympy as sp

from kinegen.derive.transforms import Elementary, Shift, Turn
from kinegen.support.compat import StrEnum
from kinegen.support.dataclass import dataclass

Vector = tuple[sp.Expr, sp.Expr, sp.Expr]
NULL: Vector = (sp.S.Zero, sp.S.Zero, sp.S.Zero)

Columns = tuple[Vector, Vector, Vector]

UNITS: Columns = (
    (sp.S.One, sp.S.Zero, sp.S.Zero),
    (sp.S.Zero, sp.S.One, sp.S.Zero),
    (sp.S.Zero, sp.S.Zero, sp.S.One),
)

SignedAxis = tuple[int, int]
"""An axis (0, 1, 2) and a sign."""

AxisPermutation = tuple[SignedAxis, SignedAxis, SignedAxis]
"""A rotation that permutes the axes: where each unit vector goes."""

IDENTITY_PERMUTATION: AxisPermutation = ((0, 1), (1, 1), (2, 1))

_IN_ROOTS = (1, 2, 3, 4, 6)
"""Denominators of the parts of pi whose sine and cosine books write in roots: multiples of 30 and of 45 degrees."""


@dataclass(frozen=True, slots=True)
class FoldedChain:
    """A folded chain.

    Attributes:
        shifts: One translation before each turn, and one after the last.
        turns: Turns about coordinate axes; no two neighbours share an axis.
        attitude: The constant quarter turns at the end.
    """

    shifts: tuple[Vector, ...]
    turns: tuple[Turn, ...]
    attitude: AxisPermutation


@dataclass(frozen=True, slots=True)
class OffsetSegment:
    """A shift in the middle of a chain: where the frame points there, and how far it goes.

    `shift`: the translation, in the axes after those turns.
    """

    turns: tuple[Turn, ...]
    shift: Vector


@dataclass(frozen=True, slots=True)
class PrefixFold:
    """A chain whose turns are folded but whose shifts (`legs`) stay where they are, for frames that share them."""

    legs: tuple[OffsetSegment, ...]
    turns: tuple[Turn, ...]
    attitude: AxisPermutation


@lru_cache(maxsize=1024)
def cosine_sine(angle: sp.Expr) -> tuple[sp.Expr, sp.Expr]:
    """Return the cosine and the sine of an angle: in roots for multiples of 30 and of 45 degrees.

    Those of other parts of pi, for which sympy has nested roots or tries one special value after the other, stay the
    sine and the cosine of an angle below 45 degrees.
    """
    # Reduced to an angle below 45 degrees, so that equal values are equal expressions.
    share, rest = angle.as_coeff_Mul()
    if rest is not sp.pi or not share.is_Rational or share.q in _IN_ROOTS:
        return sp.cos(angle), sp.sin(angle)
    half_turn, place = share.q, share.p % (2 * share.q)
    below, place = place > half_turn, min(place, 2 * half_turn - place)
    left, place = 2 * place > half_turn, min(place, half_turn - place)
    steep, place = 4 * place > half_turn, min(2 * place, half_turn - 2 * place)
    acute = sp.Rational(place, 2 * half_turn) * sp.pi
    cosine, sine = sp.cos(acute, evaluate=False), sp.sin(acute, evaluate=False)
    cosine, sine = (sine, cosine) if steep else (cosine, sine)
    return -cosine if left else cosine, -sine if below else sine


@lru_cache(maxsize=2**14)
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


@lru_cache(maxsize=2**14)
def total(left: Vector, right: Vector) -> Vector:
    """Add two vectors."""
    return left[0] + right[0], left[1] + right[1], left[2] + right[2]


def minus(left: Vector, right: Vector) -> Vector:
    """Subtract a vector from another."""
    return left[0] - right[0], left[1] - right[1], left[2] - right[2]


@lru_cache(maxsize=2**14)
def scaled(factor: sp.Expr, vector: Vector) -> Vector:
    """Return a multiple of a vector."""
    return factor * vector[0], factor * vector[1], factor * vector[2]


def combined(vector: Vector, column: Callable[[int], Vector], start: Vector = NULL) -> Vector:
    """Add columns, each times an entry of a vector, to a start; a column whose entry is 0 is not asked for."""
    for axis in range(3):
        if vector[axis] != 0:
            start = total(start, scaled(vector[axis], column(axis)))
    return start


def dot(left: Sequence[sp.Expr], right: Sequence[sp.Expr]) -> sp.Expr:
    """Return the scalar product."""
    return sum((a * b for a, b in zip(left, right, strict=True)), sp.S.Zero)


def cross(a: Vector, b: Vector) -> Vector:
    """Return the vector product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def quarter_turns(angle: sp.Expr) -> tuple[sp.Expr, int]:
    """Split an angle into a rest and a number of quarter turns (0 to 3), exactly.

    A constant that is no multiple of a quarter stays in the rest as it is.
    """
    constant, _ = angle.as_independent(*angle.free_symbols, as_Add=True) if angle.free_symbols else (angle, None)
    quarters = constant * 2 / sp.pi
    if quarters.is_Integer:
        return angle - constant, int(quarters) % 4
    return angle, 0


Variable = tuple[int, sp.Expr]
"""An axis and an angle about it without its constant part."""


@dataclass(slots=True)
class ChainFolder:
    """The state while a chain is walked; frozen records leave it.

    Attributes:
        constants: The constant part with which the sine and cosine of an angle are taken, where it is not to be that
            which stands before a shift; see `shared_constants`.
        found: The constant parts that stand before shifts, in order, of each angle.
        apart: Of the turns about parallel axes between which a shift goes across in two directions, those that are not
            merged, by their number; constant quarter turns are not merged then either, so that no shift before them is
            turned. None to merge all.
        met: How many of them there were.
    """

    shifts: list[Vector] = field(default_factory=lambda: [NULL])
    turns: list[Turn] = field(default_factory=list)
    attitude: AxisPermutation = IDENTITY_PERMUTATION
    constants: Mapping[Variable, sp.Expr] = field(default_factory=dict)
    found: dict[Variable, list[sp.Expr]] = field(default_factory=dict)
    apart: frozenset[int] | None = None
    met: int = 0

    def walk(self, steps: Iterable[Elementary]) -> None:
        """Append a chain."""
        for step in steps:
            if isinstance(step, Turn):
                self.turn(step)
            else:
                self.shift(step)

    def shift(self, step: Shift) -> Vector:
        """Append a translation; return it in the axes of the last turn."""
        axis, sign = self.attitude[step.axis]
        moved = [sp.S.Zero] * 3
        moved[axis] = sign * step.length
        vector: Vector = (moved[0], moved[1], moved[2])
        self.shifts[-1] = total(self.shifts[-1], vector)
        return vector

    def turned(self, turn: Turn, vector: Vector) -> Vector:
        """Turn a vector back; a difference of constant parts turns it first, which costs no sine and cosine."""
        if vector == NULL:
            return vector
        constant, variable = _parts(turn)
        self.found.setdefault(variable, []).append(constant)
        shared = self.constants.get(variable, constant)
        if shared != constant:
            vector = rotate(turn.axis, constant - shared, vector)
        return rotate(turn.axis, variable[1] + shared, vector)

    def shared(self, turn: Turn) -> tuple[Turn, sp.Expr]:
        """Return the turn whose sine and cosine serve for a turn too, and the difference of both angles."""
        constant, variable = _parts(turn)
        shared = self.constants.get(variable, constant)
        return Turn(turn.axis, variable[1] + shared), constant - shared

    def split_last(self) -> None:
        """Make two turns of the last one if shifts are turned by its angle but for a constant."""
        turn = self.turns[-1]
        constant, variable = _parts(turn)
        shared = self.constants.get(variable, constant)
        if shared != constant:
            self.turns[-1:] = [Turn(turn.axis, variable[1] + shared), Turn(turn.axis, constant - shared)]
            self.shifts.insert(-1, NULL)

    def turn(self, step: Turn) -> None:
        """Append a rotation, merged with the last one if the axes are parallel."""
        axis, sign = self.attitude[step.axis]
        angle = sign * step.angle
        if self.turns and self.turns[-1].axis == axis and not self._stays_apart(axis, angle):
            # The shift between two merged turns is turned by the first one.
            last = self.turns.pop()
            carried = self.shifts.pop()
            self.shifts[-1] = total(self.shifts[-1], self.turned(last, carried))
            angle = last.angle + angle
        # Quarters only permute the axes of what follows.
        rest, quarters = quarter_turns(sp.expand(angle))
        self.attitude = _after_quarters(axis, quarters, self.attitude)
        if rest != 0:
            self.turns.append(Turn(axis, rest))
            self.shifts.append(NULL)

    def _stays_apart(self, axis: int, angle: sp.Expr) -> bool:
        if self.apart is None:
            return False
        if not angle.free_symbols:
            return quarter_turns(angle)[0] is sp.S.Zero
        across = [each != 0 for place, each in enumerate(self.shifts[-1]) if place != axis]
        if not all(across) or not self.turns[-1].angle.free_symbols:
            return False
        self.met += 1
        return self.met - 1 in self.apart


def _parts(turn: Turn) -> tuple[sp.Expr, Variable]:
    """Return the constant part of an angle, and the rest with its axis."""
    constant, variable = turn.angle.as_independent(*turn.angle.free_symbols, as_Add=True)
    return constant, (turn.axis, variable)


class Last(StrEnum):
    """What becomes of the last turn of a chain where shifts are turned by angles that differ from it by a constant."""

    SHARED = "shared"
    """Shifts are turned by its angle, after the difference, so that one sine and cosine serve for all."""
    OWN = "own"
    """It has a sine and cosine of its own."""
    SPLIT = "split"
    """It is two turns: that of the shifts and the difference."""


def shared_constants(
    steps: Sequence[Elementary], last: Last, apart: frozenset[int] | None = None
) -> dict[Variable, sp.Expr]:
    """Of angles that differ by constants, as across a fixed turn, the one whose sine and cosine serve for all.

    Returns the constant part that is to be taken with each angle that shifts are turned by. `last`: whether it is that
    of the last turn, where that is one of them; otherwise it is the first.
    """
    folder = ChainFolder(apart=apart)
    folder.walk(steps)
    # Turns at the end count too, except a last one that turns no shift.
    needed = list(folder.turns)
    if needed and last is not Last.SHARED:
        turn, shift = needed[-1], folder.shifts[-1]
        if rotate(turn.axis, turn.angle, shift) == shift:
            needed.pop()
    for turn in needed:
        constant, variable = _parts(turn)
        folder.found.setdefault(variable, []).insert(0, constant)
    return {variable: each[0] for variable, each in folder.found.items()}


def _after_quarters(axis: int, quarters: int, attitude: AxisPermutation) -> AxisPermutation:
    i, j = (axis + 1) % 3, (axis + 2) % 3
    for _ in range(quarters):
        image = {axis: (axis, 1), i: (j, 1), j: (i, -1)}
        turned = [(image[to][0], sign * image[to][1]) for to, sign in attitude]
        attitude = (turned[0], turned[1], turned[2])
    return attitude


def fold(steps: Iterable[Elementary], last: Last = Last.SHARED) -> FoldedChain:
    """Fold a chain completely, for the pose of its end."""
    return fold_apart(tuple(steps), last)[0]


def fold_apart(steps: Sequence[Elementary], last: Last, apart: frozenset[int] | None = None) -> tuple[FoldedChain, int]:
    """Return the same with some turns apart, see `ChainFolder`; and how many may be apart."""
    folder = ChainFolder(constants=shared_constants(steps, last, apart), apart=apart)
    folder.walk(steps)
    if last is Last.SPLIT and folder.turns:
        folder.split_last()
    return FoldedChain(tuple(folder.shifts), tuple(folder.turns), folder.attitude), folder.met


def fold_for_readers(steps: Iterable[Elementary]) -> FoldedChain:
    """Fold a chain with a sine and cosine of its own for each angle, also where two angles differ by a constant.

    A kernel saves a pair where angles share one; a reader has fewer products without the constant in them.
    """
    folder = ChainFolder()
    folder.walk(steps)
    return FoldedChain(tuple(folder.shifts), tuple(folder.turns), folder.attitude)


def fold_prefixes(steps: Iterable[Elementary]) -> PrefixFold:
    """Fold the turns of a chain but leave each shift where it stands, for poses of many frames along it."""
    folder = ChainFolder()
    legs: list[OffsetSegment] = []
    for step in steps:
        if isinstance(step, Turn):
            folder.turn(step)
            continue
        vector = folder.shift(step)
        turns = tuple(folder.turns)
        if legs and legs[-1].turns == turns:
            legs[-1] = OffsetSegment(turns, total(legs[-1].shift, vector))
        else:
            legs.append(OffsetSegment(turns, vector))
    return PrefixFold(tuple(legs), tuple(folder.turns), folder.attitude)
