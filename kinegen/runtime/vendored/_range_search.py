"""The ranges of a redundancy for one target, found in NumPy as the C functions find them. It needs NumPy alone."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.floating[Any]]
Truths = NDArray[np.bool_]
Solve = Callable[[Floats], tuple[Floats, Truths]]
Look = Callable[[Floats], tuple[Floats, Floats]]

_TURN = 2 * math.pi


class Stretches(NamedTuple):
    """Neighbouring stretches of a redundancy.

    Attributes:
        branches: The branches that this is about.
        low: Where each begins (N,), in rising order.
        high: Where it ends (N,).
        valid: Whether each branch is valid in it (N, branches).
    """

    branches: slice
    low: Floats
    high: Floats
    valid: Truths


class Limits(NamedTuple):
    """What a search needs to know of the joints.

    Attributes:
        low: Lower limits with the room of the inverse; the least number of the type where there are none.
        high: Upper limits likewise.
        turns: A whole turn of each joint; 0 where it shifts.
        sweeps: How far each may move in a part that is not halved again.
        reach: What position errors are divided by.
        ends: The range of the redundancy.
        given: Index of the joint that is given; -1 for an arm angle.
        depth: How often a part is halved.
        least_off: A solution is off its target if it is off by more.
        shortest: Below this length the line from shoulder to wrist has no direction.
        gap: Intervals that are nearer to each other are one.
    """

    low: Floats
    high: Floats
    turns: Floats
    sweeps: Floats
    reach: float
    ends: tuple[float, float]
    given: int
    depth: int
    least_off: float
    shortest: float
    gap: float


class Axes:
    """The axes of a spherical arm at one joint vector, and its line from the shoulder to the wrist.

    Args:
        look: The pose with its Jacobian.
        q: The joint vector.
        shortest: Below this length the line has no direction.
    """

    def __init__(self, look: Look, q: Floats, shortest: float) -> None:
        self.pose, jacobian = look(q)
        length = np.sqrt((jacobian[3:] ** 2).sum(axis=0))
        self.axis, self.speed = (jacobian[3:] / length).T, (jacobian[:3] / length).T
        way = self.way_from(0) - self.way_from(4)
        far = math.sqrt(way @ way)
        self.line = way / far if far > shortest else self.axis[0]

    def way_from(self, first: int) -> Floats:
        """The way to the tool from where two neighbouring axes meet at right angles."""
        x, y = self.axis[first : first + 2]
        z, speed, other = np.cross(x, y), self.speed[first], self.speed[first + 1]
        found: Floats = (speed @ z) * y - (other @ z) * x - (speed @ y) * z
        return found

    def angle(self) -> float:
        """The arm angle."""
        square, elbow = np.cross(self.line, self.axis[0]), np.cross(self.axis[3], self.line)
        to_elbow = self.way_from(0) + np.cross(self.axis[3], self.speed[3])
        side = -1 if to_elbow @ elbow < 0 else 1
        return math.atan2(side * (elbow @ square), side * (elbow @ np.cross(square, self.line)))


def on_circle(solve: Solve, look: Look, limits: Limits) -> Iterator[Stretches]:
    """The stretches of an arm angle between the values at which a joint is at a limit or jumps.

    Args:
        solve: Redundancies (N,) to solutions (N, branches, dof) and validity (N, branches), for the target.
        look: The pose with its Jacobian.
        limits: The joints.
    """
    kind = limits.low.dtype
    solutions, _ = solve(np.zeros(1, kind))
    half = solutions.shape[1] // 2
    for first in (0, half):
        q = solutions[0, first]
        axes = Axes(look, q, limits.shortest) if np.isfinite(q).all() else None
        if axes is None or not np.isfinite(axes.line).all():
            continue
        found = [(angle + math.pi) % _TURN - math.pi for angle in _ends(axes, look, q, limits)]
        ends = np.array(sorted([*limits.ends, *found])).astype(kind)
        ends = np.unique(np.clip(ends, *limits.ends))
        _, valid = solve((ends[:-1] + ends[1:]) / 2)
        yield Stretches(slice(first, first + half), ends[:-1], ends[1:], valid[:, first : first + half])


def _ends(axes: Axes, look: Look, q: Floats, limits: Limits) -> Iterator[float]:
    """The arm angles at which the elbow of one branch brings a joint to a limit, or lines up two axes."""
    yield from _roots(axes.line, axes.axis[0], axes.axis[2])
    yield from _roots(axes.line, axes.axis[6], axes.axis[4])
    largest = np.finfo(q.dtype).max
    for joint in (0, 1, 2, 4, 5, 6):
        fixed, carried, between = axes.axis[[6, 4, 5] if joint > 3 else [0, 2, 1]]
        for limit in (limits.low[joint], limits.high[joint]):
            if abs(limit) == largest:
                continue
            moved = q.copy()
            moved[joint] = limit
            turn = look(moved)[0][:3, :3] @ axes.pose[:3, :3].T
            turn = turn.T if joint in (2, 5, 6) else turn
            if joint in (1, 5):
                yield from _roots(axes.line, fixed, carried, fixed @ turn @ carried)
            elif joint in (0, 6):
                yield from _roots(axes.line, turn @ between, carried, 0.0)
            else:
                yield from _roots(axes.line, fixed, turn @ between, 0.0)


def _roots(line: Floats, u: Floats, w: Floats, constant: Any = None) -> tuple[float, ...]:
    """Where u . Rot(line, angle) w is a constant; without one, where it is greatest and least."""
    a, along = u @ np.cross(line, w), (u @ line) * (w @ line)
    b = u @ w - along
    middle = math.atan2(a, b)
    if constant is None:
        return middle, middle + math.pi
    c = along - constant
    rest = a * a + b * b - c * c
    half = math.atan2(math.sqrt(max(rest, 0)), -c)
    return (middle + half, middle - half) if rest >= 0 else ()


class Samples(NamedTuple):
    """Values of a joint that is given, with their solutions; one row for each value.

    Attributes:
        at: The values (N,).
        q: The solutions (N, branches, dof).
        off: How far the pose of each is from the target.
        apart: How far each is from the three branches in which one choice is another (N, branches, 3).
        valid: Which of them are valid.
    """

    at: Floats
    q: Floats
    off: Floats
    apart: Floats
    valid: Truths

    def rows(self, which: Any) -> Samples:
        """Some of the rows."""
        return Samples(*(each[which] for each in self))

    def joined(self, other: Samples) -> Samples:
        """These rows and then those."""
        return Samples(*map(np.concatenate, zip(self, other)))  # type: ignore[arg-type]


def on_line(solve: Solve, look: Look, target: Floats, limits: Limits, parts: int, budget: int) -> Stretches:
    """The values of a joint that is given that a search looks at.

    Args:
        solve: As for `on_circle`.
        look: The pose with its Jacobian.
        target: The target (4, 4).
        limits: The joints.
        parts: Equal parts of the range.
        budget: Halvings at most.
    """

    def take(at: Floats) -> Samples:
        return _sampled(solve, look, target, limits, at)

    found = take(np.linspace(*limits.ends, 2 * parts + 1).astype(limits.low.dtype))
    first, middle, last = (found.rows(slice(start, stop, 2)) for start, stop in ((0, -2), (1, None), (2, None)))
    seen, left = [found], budget
    for _ in range(limits.depth):
        rows = np.flatnonzero(~_settled(first, middle, last, limits))[:left]
        if not len(rows):
            break
        left -= len(rows)
        first, middle, last = (each.rows(rows) for each in (first, middle, last))
        below, above = take((first.at + middle.at) / 2), take((middle.at + last.at) / 2)
        seen += [below, above]
        first, middle, last = first.joined(middle), below.joined(above), middle.joined(last)
    at, valid = (np.concatenate([each[place] for each in seen]) for place in (0, 4))
    order = np.argsort(at, kind="stable")
    return Stretches(slice(None), at[order], at[order], valid[order])


def _sampled(solve: Solve, look: Look, target: Floats, limits: Limits, at: Floats) -> Samples:
    q, valid = solve(at)
    off = look(q)[0][..., :3, :] - target[:3]
    off[..., 3] /= limits.reach
    every = np.arange(q.shape[1])
    partners = [np.where(every ^ bit < len(every), every ^ bit, every) for bit in (1, 2, 4)]
    apart = [np.sqrt(((_apart(q, q[:, each], limits) / limits.sweeps) ** 2).sum(axis=-1)) for each in partners]
    for each, near in zip(partners, apart):
        near[:, each == every] = np.inf
    return Samples(at, q, np.sqrt((off**2).sum(axis=(-1, -2))), np.stack(apart, axis=-1), valid)


def _apart(a: Floats, b: Floats, limits: Limits) -> Floats:
    """Differences of joint values, without whole turns."""
    off = a - b
    turns = np.where(limits.turns > 0, np.round(off / np.where(limits.turns > 0, limits.turns, 1)), 0)
    found: Floats = off - turns * limits.turns
    return found


def _stacked(samples: tuple[Samples, ...], place: int) -> Any:
    """One field of some samples, one behind the other."""
    return np.stack([each[place] for each in samples])


def _settled(first: Samples, middle: Samples, last: Samples, limits: Limits) -> Truths:
    """Between which three samples nothing changes in any branch; see the C file for the reasons."""
    three = (first, middle, last)
    q, off, apart = (_stacked(three, place) for place in (1, 2, 3))
    valid = np.stack([each.valid for each in three])
    moves = np.stack([_apart(each.q, middle.q, limits) for each in three])
    spread = moves.max(axis=0) - moves.min(axis=0)
    slow = spread <= limits.sweeps
    slow[..., limits.given] = True
    above, below = (q - limits.low).min(axis=0), (limits.high - q).min(axis=0)
    least = apart.min(axis=0)
    far = np.where(np.isinf(least), True, least >= apart.max(axis=0) - least).all(axis=-1)
    stays = (slow & (above >= spread) & (below >= spread)).all(axis=-1) & far
    under, over = (limits.low - q).min(axis=0), (q - limits.high).min(axis=0)
    beyond = (((under > 0) & (under >= spread)) | ((over > 0) & (over >= spread))) & slow
    nearest = off.min(axis=0)
    gone = (nearest > limits.least_off) & (nearest >= off.max(axis=0) - nearest)
    never = beyond.any(axis=-1) | gone
    settled: Truths = np.where(valid.all(axis=0), stays, ~valid.any(axis=0) & never).all(axis=-1)
    return settled
