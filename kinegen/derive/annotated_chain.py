"""A folded chain that remembers where its elementary transforms stood, for derivatives.

In: turns and shifts, and how fast each one grows with every symbol that is asked for. Out: the same folded chain, level
by level; in each level the pieces of its translation and, between them, marks: here an elementary transform turns the
rest of the chain about an axis through this point, or moves it along that axis.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import field

import sympy as sp

from kinegen.derive.folding import (
    IDENTITY_PERMUTATION,
    NULL,
    AxisPermutation,
    ChainFolder,
    Last,
    Vector,
    rotate,
    shared_constants,
    total,
)
from kinegen.derive.transforms import Elementary, Turn, inverse, is_identity
from kinegen.support.dataclass import dataclass

Rates = tuple[sp.Expr, ...]
"""The derivative of the angle or length of one elementary transform by each symbol, in order."""


@dataclass(frozen=True, slots=True)
class JointScrew:
    """An elementary transform that changes.

    `is_turn`: whether it turns the rest of the chain; otherwise it moves it. `axis`: unit vector, in the axes of its
    level.
    """

    is_turn: bool
    axis: Vector
    rates: Rates


@dataclass(frozen=True, slots=True)
class Held:
    """What stands between two turns that are merged, in the axes between them.

    `turn`: from the axes of the level to those of the items.
    """

    turn: Turn
    items: tuple[Vector | JointScrew, ...]


@dataclass(frozen=True, slots=True)
class AnnotatedChain:
    """A folded chain with marks.

    `levels`: one before each turn and one after the last: pieces of the translation, and marks, in order. `turns`:
    turns about coordinate axes; no two neighbours share an axis, except where marks stand apart. `nested`: the levels
    once more, where what two merged turns hold between them is still in its own axes.
    """

    levels: tuple[tuple[Vector | JointScrew, ...], ...]
    turns: tuple[Turn, ...]
    attitude: AxisPermutation
    nested: tuple[tuple[Vector | JointScrew | Held, ...], ...] = ()


def rates_by(steps: Sequence[Elementary], symbols: Sequence[sp.Symbol]) -> tuple[Rates, ...]:
    """Return the exact derivatives of the angle or length of every elementary transform."""
    values = [step.angle if isinstance(step, Turn) else step.length for step in steps]
    return tuple(tuple(sp.diff(value, symbol) for symbol in symbols) for value in values)


def mark(steps: Sequence[Elementary], rates: Sequence[Rates], apart: bool = False) -> AnnotatedChain:
    """Fold a chain and mark the transforms that change.

    Returns the chain as `folding` would give it, cut at the marks. `apart`: whether two turns about one axis stay two
    where turns about another axis cancel between them, as those of an arm that keeps its tool level. Every axis of a
    turn is then a coordinate axis of its level.
    """
    marker = _Marker(apart, folder=ChainFolder(constants=shared_constants(steps, Last.OWN)))
    for step, each in zip(steps, rates, strict=True):
        marker.step(step, each)
    turns = (*marker.before, *marker.folder.turns)
    levels = tuple(tuple(_flat(items)) for items in marker.levels)
    return AnnotatedChain(levels, turns, marker.folder.attitude, tuple(map(tuple, marker.levels)))


@dataclass(slots=True)
class _Marker:
    """Walks with a folder and keeps what the folder would add up; `before` are turns that are not merged any more."""

    apart: bool
    before: list[Turn] = field(default_factory=list)
    folder: ChainFolder = field(default_factory=ChainFolder)
    levels: list[list[Vector | JointScrew | Held]] = field(default_factory=lambda: [[]])

    def step(self, step: Elementary, rates: Rates) -> None:
        axis, sign = self.folder.attitude[step.axis]
        turns = self.folder.turns
        # A turn by quarters permutes axes only, and one about the axis of the last turn is merged with it.
        moving = not is_identity(step)
        if isinstance(step, Turn) and self._is_quarters(step):
            moving = False
        if moving and isinstance(step, Turn) and turns and turns[-1].axis == axis:
            if self.apart and self._has_other_axes(axis):
                self.before += turns
                self.folder = ChainFolder(attitude=self.folder.attitude, constants=self.folder.constants)
            else:
                self._retreat(turns[-1])
        # The mark is before the transform, in the axes where it acts.
        if any(rate != 0 for rate in rates):
            unit = [sp.S.Zero] * 3
            unit[axis] = sp.Integer(sign)
            self.levels[-1].append(JointScrew(isinstance(step, Turn), (unit[0], unit[1], unit[2]), rates))
        if not moving:
            return
        if isinstance(step, Turn):
            self.folder.turn(step)
            self.levels += [[] for _ in range(len(self.before) + len(self.folder.shifts) - len(self.levels))]
        else:
            self._piece(self.levels[-1], self.folder.shift(step))

    def _is_quarters(self, step: Turn) -> bool:
        """Tell whether a turn only permutes the axes of what is behind it; if so, it does."""
        attempt = ChainFolder(attitude=self.folder.attitude)
        attempt.turn(step)
        if not attempt.turns:
            self.folder.attitude = attempt.attitude
        return not attempt.turns

    def _has_other_axes(self, axis: int) -> bool:
        return any(isinstance(item, JointScrew) and item.is_turn and item.axis[axis] == 0 for item in self.levels[-1])

    def _retreat(self, last: Turn) -> None:
        """Put what follows the last turn into the axes before it: the next turn is going to be merged with it."""
        items = _flat(self.levels.pop())
        if items:
            turn, rest = self.folder.shared(last)
            if rest != 0:
                items = [_rotated(Turn(turn.axis, rest), item) for item in items]
            self.levels[-1].append(Held(turn, tuple(items)))

    @staticmethod
    def _piece(level: list[Vector | JointScrew | Held], piece: Vector) -> None:
        if level and isinstance(level[-1], tuple):
            level[-1] = total(level[-1], piece)
        else:
            level.append(piece)


def _flat(items: Iterable[Vector | JointScrew | Held]) -> list[Vector | JointScrew]:
    """Pieces and marks in the axes of their level; neighbouring pieces are one."""
    found: list[Vector | JointScrew] = []
    for item in items:
        if isinstance(item, Held):
            turned: Iterable[Vector | JointScrew] = (_rotated(item.turn, each) for each in item.items)
        else:
            turned = (item,)
        for each in turned:
            last = found[-1] if found else None
            if isinstance(each, JointScrew) or last is None or isinstance(last, JointScrew):
                found.append(each)
            else:
                found[-1] = total(last, each)
    return found


def _rotated(turn: Turn, item: Vector | JointScrew) -> Vector | JointScrew:
    if isinstance(item, JointScrew):
        return JointScrew(item.is_turn, rotate(turn.axis, turn.angle, item.axis), item.rates)
    return rotate(turn.axis, turn.angle, item)


def pieces(items: Sequence[Vector | JointScrew]) -> Vector:
    """Return the translation of a level, or of a part of it."""
    translation = NULL
    for item in items:
        if not isinstance(item, JointScrew):
            translation = total(translation, item)
    return translation


def reverse(steps: Sequence[Elementary], rates: Sequence[Rates], apart: bool = False) -> AnnotatedChain:
    """Fold a chain anew from its end to its start: where axes are parallel, angles are sums from the end on."""
    back = [inverse(step) for step in reversed(steps)]
    return mark(back, [tuple(-rate for rate in each) for each in reversed(rates)], apart)


def flipped(marked: AnnotatedChain) -> AnnotatedChain:
    """Return the chain from its end to its start, in the axes at its end before the constant attitude.

    It is not folded anew: the angles stay those of the chain, so that both share their sines and cosines.
    """
    levels = tuple(tuple(_flipped(item) for item in reversed(items)) for items in reversed(marked.levels))
    return AnnotatedChain(
        levels, tuple(Turn(turn.axis, -turn.angle) for turn in reversed(marked.turns)), IDENTITY_PERMUTATION
    )


def _flipped(item: Vector | JointScrew) -> Vector | JointScrew:
    if isinstance(item, JointScrew):
        return JointScrew(item.is_turn, item.axis, tuple(-rate for rate in item.rates))
    return -item[0], -item[1], -item[2]
