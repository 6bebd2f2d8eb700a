"""The solution nearest to a joint vector, chosen in NumPy as the C function does. It needs NumPy alone."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Rows = NDArray[np.floating[Any]]

_MOST_TURNS = {np.dtype(np.float64): 10_000, np.dtype(np.float32): 100}
"""A joint value further from zero than so many whole turns has lost the digits that the choice is to keep."""

_FARTHEST_STROKE = 1e15
"""The same for a joint that shifts."""


class Turning(NamedTuple):
    """What whole turns of a joint need.

    Attributes:
        turn: A whole turn in the joint's variable; 0 for a joint that shifts.
        lowest: Its lower limit, with the room that a valid solution has beside it.
        highest: Its upper limit likewise. Without limits both are the largest numbers of the type.
    """

    turn: float
    lowest: float
    highest: float


class NearestFormula:
    """Targets and joint vectors to the nearest solutions: the operations of the C function in its order.

    Args:
        inverse: The NumPy form of the inverse.
        turnings: What whole turns of each joint need, for float64 and for float32.
        inputs: How many inputs the inverse has.
    """

    def __init__(
        self,
        inverse: Callable[..., Sequence[Any]],
        turnings: tuple[tuple[tuple[float, float, float], ...], tuple[tuple[float, float, float], ...]],
        inputs: int = 1,
    ) -> None:
        self._inverse, self._given = inverse, inputs - 1
        kinds: tuple[Any, ...] = np.dtype(np.float64), np.dtype(np.float32)
        self._columns = {kind: np.array(each, kind).T[..., None] for kind, each in zip(kinds, turnings, strict=True)}

    def __call__(self, base_T_tool: Rows, *others: Any) -> tuple[Rows, ...]:
        """Choose for N targets.

        Args:
            base_T_tool: The upper three rows of the targets (12, N).
            others: The redundancy, if there is one (1, N); the joint vectors (dof, N); values of the
                runtime parameters, if there are any.

        Returns:
            The joint values, one array (N,) each and NaN where there is no solution, and 1 where there is one, else 0.
        """
        given, q0, params = others[: self._given], others[self._given], others[self._given + 1 :]
        real, (dof, count) = q0.dtype, q0.shape
        rows = self._inverse(base_T_tool, *given, *params)
        found = np.stack([np.broadcast_to(row, count) for row in rows]).astype(real)
        branches = len(found) // (dof + 1)
        solutions, valid = found[: branches * dof].reshape(branches, dof, count), found[branches * dof :]
        largest = np.finfo(real).max
        least, chosen = np.full(count, largest, real), np.zeros((dof, count), real)
        for all_joints, holds in zip(solutions, valid, strict=True):
            moved = self._turned(all_joints, q0)
            squares = (moved - q0) ** 2
            distance = squares[0]
            for square in squares[1:]:
                distance = distance + square
            is_nearer = (holds > 0) & (distance < least)
            chosen, least = np.where(is_nearer, moved, chosen), np.where(is_nearer, distance, least)
        serves = (least < largest) & self._are_near(q0)
        nothing = np.where(serves, real.type(0), real.type(np.nan))
        return (*(chosen + nothing), serves.astype(real))

    def _turned(self, solutions: Rows, wanted: Rows) -> Rows:
        """Solutions with the whole turns that bring each joint nearest within its limits."""
        turn, lowest, highest = self._columns[solutions.dtype]
        per_turn = np.where(turn > 0, 1 / np.where(turn > 0, turn, 1), 0).astype(turn.dtype)
        aim = np.minimum(np.maximum(wanted, lowest), highest)
        count = np.round((aim - solutions) * per_turn)
        nearest = solutions + count * turn
        # One turn back where that passes a limit.
        count = count - (nearest > highest) + (nearest < lowest)
        moved = solutions + count.astype(turn.dtype) * turn
        outside = (moved < lowest) | (moved > highest) | (turn == 0)
        return np.where(outside, solutions, moved)

    def _are_near(self, q0: Rows) -> NDArray[np.bool_]:
        """Whether joint vectors are finite, and near enough to zero for whole turns."""
        turn = self._columns[q0.dtype][0]
        farthest = np.where(turn > 0, turn * turn.dtype.type(_MOST_TURNS[q0.dtype]), turn.dtype.type(_FARTHEST_STROKE))
        serving: NDArray[np.bool_] = (np.abs(q0) <= farthest).all(axis=0)
        return serving
