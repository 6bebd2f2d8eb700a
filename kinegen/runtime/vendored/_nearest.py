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
"""The same for a prismatic joint."""


class Turning(NamedTuple):
    """What whole turns of a joint need.

    Attributes:
        turn: A whole turn in the joint's variable; 0 for a prismatic joint.
        lowest: Its lower limit, with the room that a valid solution has beside it.
        highest: Its upper limit likewise. Without limits both are the largest numbers of the type.
    """

    turn: float
    lowest: float
    highest: float


class Sharing(NamedTuple):
    """Two joints that share one angle where the axis of the joint between them puts theirs in line.

    Attributes:
        first: Index of the first of them.
        middle: Index of the joint between.
        last: Index of the last one.
        sign: With which the last one counts: 1 or -1.
        at: Value of the joint between, to which whole turns may be added.
        near: How near to that it must be.
        low: Lower limits of the first joint, of the last one as it counts, and of their sum.
        high: Upper limits likewise.
    """

    first: int
    middle: int
    last: int
    sign: int
    at: float
    near: float
    low: tuple[float, float, float]
    high: tuple[float, float, float]


class End(NamedTuple):
    """The first or last joint, where a pose may leave it free.

    Attributes:
        joint: Its index.
        is_first: Whether it is the first one; else the last one.
        direction: Its axis, in the base frame, or in the frame of the tool.
        point: A point of the axis, likewise.
        rate: How far the axis is turned for one unit of the variable, in radians.
        rest: Its value at rest.
        limits: Its lower and upper limit.
        met: The point of the tool that leaves it free on its axis; empty where joints before it do that.
        near: How near to the axis that must be: a squared distance.
        places: For each place that leaves it free the joint before it, its value, and how near to that it must be.
    """

    joint: int
    is_first: bool
    direction: tuple[float, float, float]
    point: tuple[float, float, float]
    rate: float
    rest: float
    limits: tuple[float, float]
    met: tuple[float, ...]
    near: float
    places: tuple[tuple[int, float, float], ...]


class NearestFormula:
    """Targets and joint vectors to the nearest solutions: the operations of the C function in its order.

    Args:
        inverse: The NumPy form of the inverse.
        turnings: What whole turns of each joint need, for float64 and for float32.
        inputs: How many inputs the inverse has.
        sharings: The joints that can come in line, for float64 and for float32, see `Sharing`.
        ends: The joint at an end that a pose may leave free, for float64 and for float32, see `End`; None without one.
    """

    def __init__(
        self,
        inverse: Callable[..., Sequence[Any]],
        turnings: tuple[tuple[tuple[float, float, float], ...], tuple[tuple[float, float, float], ...]],
        inputs: int = 1,
        sharings: tuple[tuple[tuple[Any, ...], ...], tuple[tuple[Any, ...], ...]] = ((), ()),
        ends: tuple[tuple[Any, ...], tuple[Any, ...]] | None = None,
    ) -> None:
        self._inverse, self._given = inverse, inputs - 1
        kinds: tuple[Any, ...] = np.dtype(np.float64), np.dtype(np.float32)
        self._columns = {kind: np.array(each, kind).T[..., None] for kind, each in zip(kinds, turnings, strict=True)}
        self._sharings = {kind: [Sharing(*each) for each in rows] for kind, rows in zip(kinds, sharings, strict=True)}
        self._ends = {} if ends is None else {kind: End(*each) for kind, each in zip(kinds, ends, strict=True)}

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
        solutions, valid = self._solved(base_T_tool, given, params, q0)
        largest = np.finfo(real).max
        least, chosen = np.full(count, largest, real), np.zeros((dof, count), real)
        end = self._ends.get(real)
        free = np.zeros(0, int) if end is None else self._where_free(end, base_T_tool, solutions, valid)
        least, chosen = self._nearer(solutions, valid, q0, least, chosen)
        if end is not None and free.size:
            # Other solutions of the targets that leave a joint free.
            w = q0[:, free]
            pose, added = _at_rest(end, base_T_tool[:, free], w[end.joint])
            solutions, valid = self._solved(pose, [each[:, free] for each in given], params, w)
            solutions[:, end.joint] += added
            _, lowest, highest = self._columns[real][:, end.joint, 0]
            valid = np.where((solutions[:, end.joint] >= lowest) & (solutions[:, end.joint] <= highest), valid, 0)
            least[free], chosen[:, free] = self._nearer(solutions, valid, w, least[free], chosen[:, free])
        serves = (least < largest) & self._are_near(q0)
        nothing = np.where(serves, real.type(0), real.type(np.nan))
        return (*(chosen + nothing), serves.astype(real))

    def _solved(self, targets: Rows, given: Sequence[Any], params: Sequence[Any], wanted: Rows) -> tuple[Rows, Rows]:
        """All solutions (branches, dof, N), and which are valid (branches, N)."""
        dof, count = wanted.shape
        rows = self._inverse(targets, *given, *params)
        found = np.stack([np.broadcast_to(row, count) for row in rows]).astype(wanted.dtype)
        branches = len(found) // (dof + 1)
        return found[: branches * dof].reshape(branches, dof, count), found[branches * dof :]

    def _nearer(self, solutions: Rows, valid: Rows, q0: Rows, least: Rows, chosen: Rows) -> tuple[Rows, Rows]:
        """The least squared distances (N,) and their solutions (dof, N); those before stay where none is less."""
        real = q0.dtype
        for all_joints, holds in zip(solutions, valid, strict=True):
            for each in self._sharings[real]:
                self._share(each, all_joints, q0)
            moved = _turned(all_joints, q0, *self._columns[real])
            squares = (moved - q0) ** 2
            distance = squares[0]
            for square in squares[1:]:
                distance = distance + square
            is_nearer = (holds > 0) & (distance < least)
            chosen, least = np.where(is_nearer, moved, chosen), np.where(is_nearer, distance, least)
        return least, chosen

    def _where_free(self, end: End, targets: Rows, solutions: Rows, valid: Rows) -> NDArray[np.intp]:
        """The places of the targets that leave a joint free."""
        real, is_free = solutions.dtype.type, np.zeros(solutions.shape[-1], bool)
        for joint, at, near in end.places:
            away = _without_turns(solutions[:, joint] - real(at), self._columns[solutions.dtype][0, joint, 0])
            is_free |= ((np.abs(away) <= real(near)) & (valid > 0)).any(axis=0)
        if end.met:
            axis = np.array(end.direction, real)
            apart = [targets[4 * row + 3] - real(end.point[row]) for row in range(3)]
            for row in range(3):
                for column in range(3):
                    apart[row] = apart[row] + targets[4 * row + column] * real(end.met[column])
            along = (apart[0] * axis[0] + apart[1] * axis[1]) + apart[2] * axis[2]
            across = [part - along * each for part, each in zip(apart, axis, strict=True)]
            is_free |= (across[0] ** 2 + across[1] ** 2) + across[2] ** 2 < real(end.near)
        return np.flatnonzero(is_free)

    def _share(self, pair: Sharing, solutions: Rows, wanted: Rows) -> None:
        """Bring two joints nearest, in place, where their axes coincide."""
        real, turns = solutions.dtype.type, self._columns[solutions.dtype][0][..., 0]
        away = _without_turns(solutions[pair.middle] - real(pair.at), turns[pair.middle])
        rows = np.flatnonzero(np.abs(away) <= real(pair.near))
        if not rows.size:
            return
        sign, turn = real(pair.sign), turns[pair.first]
        (low, low_last, least), (high, high_last, most) = np.array(pair.low, real), np.array(pair.high, real)
        first, last = solutions[pair.first, rows], sign * solutions[pair.last, rows]
        w, w_last = wanted[pair.first, rows], sign * wanted[pair.last, rows]
        aim = _bounded(w, low, high) + _bounded(w_last, low_last, high_last)
        total = _turned(first + last, aim, turn, least, most)
        # Each takes half of what is left over, as far as both limits allow.
        lowest, highest = np.maximum(total - high_last, low), np.minimum(total - low_last, high)
        one = _bounded(((w - w_last) + total) * real(0.5), lowest, highest)
        other = _bounded(total - one, low_last, high_last)
        before = (_turned(first, w, turn, low, high) - w) ** 2
        before = before + (_turned(last, w_last, turn, low_last, high_last) - w_last) ** 2
        is_nearer = (total >= least) & (total <= most) & ((one - w) ** 2 + (other - w_last) ** 2 < before)
        solutions[pair.first, rows] = np.where(is_nearer, one, first)
        solutions[pair.last, rows] = sign * np.where(is_nearer, other, last)

    def _are_near(self, q0: Rows) -> NDArray[np.bool_]:
        """Whether joint vectors are finite, and near enough to zero for whole turns."""
        turn = self._columns[q0.dtype][0]
        farthest = np.where(turn > 0, turn * turn.dtype.type(_MOST_TURNS[q0.dtype]), turn.dtype.type(_FARTHEST_STROKE))
        serving: NDArray[np.bool_] = (np.abs(q0) <= farthest).all(axis=0)
        return serving


def _at_rest(end: End, targets: Rows, wanted: Rows) -> tuple[Rows, Rows]:
    """Poses whose solutions have a joint at rest where those of targets have it as wanted, and how far that is off."""
    real = targets.dtype.type
    low, high = map(real, end.limits)
    apart = _bounded(wanted, low, high) - real(end.rest)
    angle = apart * real(end.rate)
    cosine, sine = np.cos(angle), np.sin(angle)
    axis, point = np.array(end.direction, real), np.array(end.point, real)
    t, pose = targets.reshape(3, 4, -1), np.empty_like(targets).reshape(3, 4, -1)
    if end.is_first:
        for column in range(4):
            shift = point if column == 3 else 0 * point
            moved = _about(t[:, column] - shift[:, None], axis, cosine, -sine)
            pose[:, column] = moved + shift[:, None]
    else:
        for row in range(3):
            pose[row, :3] = _about(t[row, :3], axis, cosine, sine)
            position = t[row, 3]
            for column in range(3):
                position = position + (t[row, column] * point[column] - pose[row, column] * point[column])
            pose[row, 3] = position
    return pose.reshape(targets.shape), apart


def _about(vectors: Rows, axis: Rows, cosine: Rows, sine: Rows) -> Rows:
    """Vectors (3, N) turned about an axis by angles (Rodrigues)."""
    along = (axis[0] * vectors[0] + axis[1] * vectors[1]) + axis[2] * vectors[2]
    turned = np.empty_like(vectors)
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        constant = along * axis[i]
        square = axis[j] * vectors[k] - axis[k] * vectors[j]
        turned[i] = constant + (cosine * (vectors[i] - constant) + sine * square)
    return turned


def _turned(solutions: Rows, wanted: Rows, turn: Any, lowest: Any, highest: Any) -> Rows:
    """Solutions with the whole turns that bring each joint nearest within its limits."""
    per_turn = np.where(turn > 0, 1 / np.where(turn > 0, turn, 1), 0).astype(turn.dtype)
    count = np.round((_bounded(wanted, lowest, highest) - solutions) * per_turn)
    nearest = solutions + count * turn
    # One turn back where that passes a limit.
    count = count - (nearest > highest) + (nearest < lowest)
    moved = solutions + count.astype(turn.dtype) * turn
    outside = (moved < lowest) | (moved > highest) | (turn == 0)
    return np.where(outside, solutions, moved)


def _without_turns(values: Rows, turn: Any) -> Rows:
    """Values less the whole turns that bring them nearest to zero."""
    found: Rows = values - np.round(values * (1 / turn)) * turn
    return found


def _bounded(values: Rows, lowest: Any, highest: Any) -> Rows:
    """Values, or the ends of a range that are nearest to them."""
    found: Rows = np.minimum(np.maximum(values, lowest), highest)
    return found
