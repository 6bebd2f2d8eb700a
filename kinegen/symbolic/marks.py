"""A folded chain that remembers where its elementary transforms stood, for derivatives.

In: turns and shifts, and how fast each one grows with every symbol that is asked for. Out: the same folded chain, level
by level; in each level the pieces of its translation and, between them, marks: here an elementary transform turns the
rest of the chain about an axis through this point, or moves it along that axis.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import sympy as sp

from kinegen.symbolic.fold import NULL, UPRIGHT, Attitude, Folder, Vector, rotate, total
from kinegen.symbolic.transforms import Elementary, Turn, inverse, is_identity

Rates = tuple[sp.Expr, ...]
"""The derivative of the angle or length of one elementary transform by each symbol, in order."""


@dataclass(frozen=True, slots=True)
class Mark:
    """An elementary transform that changes.

    Attributes:
        is_turn: Whether it turns the rest of the chain; otherwise it moves it.
        axis: Unit vector, in the axes of its level.
        rates: How fast it turns or moves.
    """

    is_turn: bool
    axis: Vector
    rates: Rates


@dataclass(frozen=True, slots=True)
class Marked:
    """A folded chain with marks.

    Attributes:
        levels: One before each turn and one after the last: pieces of the translation, and marks, in order.
        turns: Turns about coordinate axes; no two neighbours share an axis.
        attitude: The constant quarter turns at the end.
    """

    levels: tuple[tuple[Vector | Mark, ...], ...]
    turns: tuple[Turn, ...]
    attitude: Attitude


def rates_by(steps: Sequence[Elementary], symbols: Sequence[sp.Symbol]) -> tuple[Rates, ...]:
    """The exact derivatives of the angle or length of every elementary transform."""
    values = [step.angle if isinstance(step, Turn) else step.length for step in steps]
    return tuple(tuple(sp.diff(value, symbol) for symbol in symbols) for value in values)


def mark(steps: Sequence[Elementary], rates: Sequence[Rates]) -> Marked:
    """Fold a chain and mark the transforms that change.

    Args:
        steps: Elementary transforms, left to right; identities among them only leave their mark.
        rates: One entry for each of them.

    Returns:
        The chain as `fold` would give it, cut at the marks.
    """
    marker = _Marker()
    for step, each in zip(steps, rates, strict=True):
        marker.step(step, each)
    return Marked(tuple(map(tuple, marker.levels)), tuple(marker.folder.turns), marker.folder.attitude)


@dataclass(slots=True)
class _Marker:
    """Walks with a folder and keeps what the folder would add up."""

    folder: Folder = field(default_factory=Folder)
    levels: list[list[Vector | Mark]] = field(default_factory=lambda: [[]])

    def step(self, step: Elementary, rates: Rates) -> None:
        axis, sign = self.folder.attitude[step.axis]
        turns = self.folder.turns
        moving = not is_identity(step)
        if moving and isinstance(step, Turn) and turns and turns[-1].axis == axis:
            self._retreat(turns[-1])
        if any(rate != 0 for rate in rates):
            unit = [sp.S.Zero] * 3
            unit[axis] = sp.Integer(sign)
            self.levels[-1].append(Mark(isinstance(step, Turn), (unit[0], unit[1], unit[2]), rates))
        if not moving:
            return
        if isinstance(step, Turn):
            self.folder.turn(step)
            self.levels += [[] for _ in range(len(self.folder.shifts) - len(self.levels))]
        else:
            self._piece(self.levels[-1], self.folder.shift(step))

    def _retreat(self, last: Turn) -> None:
        """What stands after the last turn, in the axes before it: the next turn is going to be merged with it."""
        for item in self.levels.pop():
            if isinstance(item, Mark):
                turned = rotate(last.axis, last.angle, item.axis)
                self.levels[-1].append(Mark(item.is_turn, turned, item.rates))
            else:
                self._piece(self.levels[-1], rotate(last.axis, last.angle, item))

    @staticmethod
    def _piece(level: list[Vector | Mark], piece: Vector) -> None:
        last = level[-1] if level else None
        if last is None or isinstance(last, Mark):
            level.append(piece)
        else:
            level[-1] = total(last, piece)


def pieces(items: Sequence[Vector | Mark]) -> Vector:
    """The translation of a level, or of a part of it."""
    translation = NULL
    for item in items:
        if not isinstance(item, Mark):
            translation = total(translation, item)
    return translation


def reverse(steps: Sequence[Elementary], rates: Sequence[Rates]) -> Marked:
    """A chain from its end to its start, folded anew: where axes are parallel, the angles are sums from the end on."""
    back = [inverse(step) for step in reversed(steps)]
    return mark(back, [tuple(-rate for rate in each) for each in reversed(rates)])


def flipped(marked: Marked) -> Marked:
    """The chain from its end to its start, in the axes at its end before the constant attitude.

    It is not folded anew: the angles stay those of the chain, so that both share their sines and cosines.
    """
    levels = tuple(tuple(_flipped(item) for item in reversed(items)) for items in reversed(marked.levels))
    return Marked(levels, tuple(Turn(turn.axis, -turn.angle) for turn in reversed(marked.turns)), UPRIGHT)


def _flipped(item: Vector | Mark) -> Vector | Mark:
    if isinstance(item, Mark):
        return Mark(item.is_turn, item.axis, tuple(-rate for rate in item.rates))
    return -item[0], -item[1], -item[2]
