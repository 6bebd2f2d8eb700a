"""A path followed in NumPy, with the decisions of the C function in its order. It needs NumPy alone."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.floating[Any]]

OPEN, UNSET = -1, -2
"""Branches of a tracker at a singularity, and of one that is not started."""

FOLLOWED, LAGGING, OUT_OF_REACH, AT_LIMIT, OTHER_BRANCH, NOT_A_POSE, NOT_STARTED = 1, 2, 0, -1, -2, -3, -4
"""What a step comes to, as in the C header."""

STEPS, POLISH = 8, 4
LEAP, LONG_STEP = 0.2, 0.3
DETOUR, OTHER_DETOUR = 1.5, 1.4
DAMPING, HELD_DAMPING = 0.1, 1e-4
SPEED_DAMPING = 1e-4
LONG_WAY = 0.50001
HUGE, FARTHEST = 1e30, 1e15
MOST_TURNS = {np.dtype(np.float64): 10_000, np.dtype(np.float32): 100}


class Bounds(NamedTuple):
    """What depends on the number type."""

    open: float
    singular: float
    kept: float
    matching: float
    least_damping: float
    near: float
    passes: int


BOUNDS = {
    np.dtype(np.float64): Bounds(0.01, 1e-14, 1e-7, 1e-6, 1e-12, 1e-4, 2),
    np.dtype(np.float32): Bounds(0.1, 1e-8, 1e-4, 1e-3, 1e-5, 1e-3, 6),
}


class Joints(NamedTuple):
    """Each joint, as numbers of one type.

    Attributes:
        stride: What counts as much as an angle of 1 rad.
        turn: A whole turn; 0 for one that shifts.
        lowest: Lower limits with the room that a valid solution has beside them.
        highest: Upper limits likewise.
        held: Whether it is given with the target.
    """

    stride: Floats
    turn: Floats
    lowest: Floats
    highest: Floats
    held: NDArray[np.bool_]


class Arm(NamedTuple):
    """What a path is followed with.

    Attributes:
        inverse: Target and redundancy to all solutions, and which of them are valid.
        evaluate: Joint vector to its pose and Jacobian.
        joints: The joints.
        weight: What a length counts beside an angle: three over the reach.
        rows: 6 if targets are poses, 3 if their rotation is not read.
        rigid: How far the columns of a target may be from those of a rotation.
    """

    inverse: Callable[..., tuple[Floats, NDArray[np.bool_]]]
    evaluate: Callable[[Floats], tuple[Floats, Floats]]
    joints: Joints
    weight: float
    rows: int
    rigid: float


class Outcome(NamedTuple):
    """What a step came to: status, errors, the joint at its limit or -1."""

    status: int
    position_error: float
    rotation_error: float
    joint: int


class Follower:
    """The state of a path.

    Args:
        arm: What it is followed with.
        q: The joint vector that it begins at.
        given: The redundancy, if there is one.
    """

    def __init__(self, arm: Arm, q: Floats, given: tuple[Any, ...]) -> None:
        self.arm, self.q, self.changes = arm, q.copy(), 0
        self.bounds = BOUNDS[q.dtype]
        self.branch = OPEN if self._serves() else UNSET
        if self.branch == OPEN:
            pose, jacobian = arm.evaluate(self.q)
            if self._spread(jacobian) >= self.bounds.singular:
                self.branch = self._matching(pose, given)

    def step(self, target: Floats, given: tuple[Any, ...], max_step: Floats) -> Outcome:
        """Go to a target (4, 4), no joint by more than `max_step` (dof,)."""
        if self.branch <= UNSET:
            return Outcome(NOT_STARTED, HUGE, HUGE, -1)
        if not self._is_pose(target):
            return Outcome(NOT_A_POSE, HUGE, HUGE, -1)
        branch, s, are_any = self._choose(target, given)
        status, joint = FOLLOWED, -1
        if branch is None:
            status, joint, s = self._continue(target, given, are_any)
            branch = self.branch
        elif self._spread(self.arm.evaluate(s)[1]) < self.bounds.singular and self._change(s) > self.bounds.open:
            s = self._keep_open(target, s)
        if status > 0:
            s, is_cut = self._hold_back(target, max_step, s)
            status = LAGGING if is_cut else FOLLOWED
            self.changes += self.branch not in (branch, OPEN)
            self.q, self.branch = s, branch
        away = self._difference(target, self.arm.evaluate(self.q)[0])
        return Outcome(status, _norm(away[:3]), _norm(away[3:]), joint)

    def speeds(self, twist: Floats) -> Floats:
        """Joint speeds for a twist (6,) of the tool."""
        if self.branch <= UNSET:
            return np.zeros_like(self.q)
        _, jacobian = self.arm.evaluate(self.q)
        near = max(1 - float(self._spread(jacobian)) / self.bounds.near, 0.0)
        damping = near * near * SPEED_DAMPING + self.bounds.least_damping
        weighted = self._weighed(twist) * self._rows()
        return self._descend(jacobian, weighted, self.arm.joints.held, damping, 1 if near > 0 else self.bounds.passes)

    def _serves(self) -> bool:
        joints, most = self.arm.joints, MOST_TURNS[self.q.dtype]
        farthest = np.where(joints.turn > 0, joints.turn * most, FARTHEST)
        return bool(((self.q >= joints.lowest) & (self.q <= joints.highest) & (np.abs(self.q) <= farthest)).all())

    def _is_pose(self, m: Floats) -> bool:
        place = float(m[:3, 3] @ m[:3, 3])
        if self.arm.rows == 3:
            return place < FARTHEST
        x, y, z = m[:3, 0], m[:3, 1], m[:3, 2]
        off = np.array([x @ x - 1, y @ y - 1, x @ y, *(z - np.cross(x, y))])
        return bool(off @ off < self.arm.rigid**2) and place < FARTHEST

    def _near(self, solutions: Floats) -> tuple[Floats, Floats]:
        """Solutions (branches, dof) with the whole turns that bring them nearest, and their squared distances."""
        joints, dtype = self.arm.joints, solutions.dtype
        per_turn = np.where(joints.turn > 0, 1 / np.where(joints.turn > 0, joints.turn, 1), 0).astype(dtype)
        aim = np.minimum(np.maximum(self.q, joints.lowest), joints.highest)
        count = np.round((aim - solutions) * per_turn)
        nearest = solutions + count * joints.turn
        count = count - (nearest > joints.highest) + (nearest < joints.lowest)
        moved = solutions + count.astype(dtype) * joints.turn
        outside = (moved < joints.lowest) | (moved > joints.highest)
        found = np.where(outside, solutions, moved)
        return found, (((found - self.q) / joints.stride) ** 2).sum(axis=1)

    def _matching(self, pose: Floats, given: tuple[Any, ...]) -> int:
        """The branch of the present joint vector; open where there is none."""
        solutions, valid = self.arm.inverse(pose, *given)
        apart = np.where(valid, self._near(solutions)[1], np.inf)
        branch = int(apart.argmin())
        return branch if apart[branch] < self.bounds.matching else OPEN

    def _choose(self, target: Floats, given: tuple[Any, ...]) -> tuple[int | None, Floats, bool]:
        """The nearest solution that no leap leads to, with an advantage for the present branch."""
        found, valid = self.arm.inverse(target, *given)
        solutions, apart = self._near(found)
        apart = np.where(valid, apart, np.inf)
        apart[self.branch if self.branch >= 0 else slice(0)] *= 0.5
        for branch in map(int, apart.argsort(kind="stable")):
            is_same = self.branch in (branch, OPEN)
            if apart[branch] < HUGE and not self._leaps(target, solutions[branch], is_same=is_same):
                return branch, solutions[branch], True
        return None, self.q, bool(valid.any())

    def _leaps(self, target: Floats, s: Floats, *, is_same: bool) -> bool:
        """Whether a joint goes the long way round, or half the move leads the tool aside."""
        joints = self.arm.joints
        if ((np.abs(s - self.q) > joints.turn * LONG_WAY) & (joints.turn > 0) & ~joints.held).any():
            return True
        if self._change(s) <= LEAP:
            return False
        here, _ = self.arm.evaluate(self.q)
        between, _ = self.arm.evaluate(self.q + (s - self.q) * self.q.dtype.type(0.5))
        straight = self._distance(target, here)
        if is_same and straight > LONG_STEP:
            return False
        way = self._distance(between, here) + self._distance(target, between)
        return not way <= straight * (DETOUR if is_same else OTHER_DETOUR) + self.bounds.kept

    def _continue(self, target: Floats, given: tuple[Any, ...], are_any: bool) -> tuple[int, int, Floats]:
        """Where the joints would go without limits, which says why nothing is solved: status, joint, joint vector."""
        begun = np.where(self.arm.joints.held, given[0], self.q).astype(self.q.dtype) if given else self.q
        s, error = self._go_on(target, begun)
        status = OTHER_BRANCH if are_any else OUT_OF_REACH
        if error <= self.bounds.kept**2:
            joint = self._outside(s)
            if joint >= 0:
                return AT_LIMIT, joint, s
            if not self._leaps(target, s, is_same=False):
                return FOLLOWED, -1, s
        return status, -1, s

    def _keep_open(self, target: Floats, s: Floats) -> Floats:
        """A solution whose open joints keep their values."""
        begun = np.where(self.arm.joints.held, s, self.q)
        kept, error = self._go_on(target, begun)
        kept, error = self._turned_back(target, begun, kept, error)
        serves = error <= self.bounds.kept**2 and self._outside(kept) < 0 and self._change(kept) < self._change(s)
        return kept if serves else s

    def _turned_back(self, target: Floats, begun: Floats, q: Floats, error: float) -> tuple[Floats, float]:
        """A solution with what moves nothing, of the way that led there, taken back; with the squared error left."""
        jacobian, _, _ = self._measure(target, q)
        way = begun - q
        columns = self._columns(jacobian, self.arm.joints.held)
        needed = self._descend(
            jacobian, columns @ (way / self.arm.joints.stride), self.arm.joints.held, self.bounds.least_damping, 1
        )
        back = q + (way - needed)
        _, _, left = self._measure(target, back)
        return (back, left) if left <= self.bounds.kept**2 else (q, error)

    def _go_on(self, target: Floats, q: Floats) -> tuple[Floats, float]:
        """Damped least squares towards a target, past limits, with the squared error that is left."""
        jacobian, e, error = self._measure(target, q)
        for _ in range(STEPS):
            damping = error * DAMPING + self.bounds.least_damping
            q = q + self._descend(jacobian, e, self.arm.joints.held, damping, 1)
            jacobian, e, error = self._measure(target, q)
        return q, error

    def _hold_back(self, target: Floats, max_step: Floats, wanted: Floats) -> tuple[Floats, bool]:
        """Changes cut to the largest ones, with the other joints as near as they can bring the tool."""
        joints = self.arm.joints
        most = np.where(max_step > 0, max_step, 0).astype(self.q.dtype)
        low, high = self.q - most, self.q + most
        cut = (wanted < low) | (wanted > high)
        if not cut.any():
            return wanted, False
        s = np.minimum(np.maximum(wanted, low), high)
        low, high = np.maximum(low, joints.lowest), np.minimum(high, joints.highest)
        held = cut | joints.held
        jacobian, e, error = self._measure(target, s)
        for _ in range(POLISH):
            moved = s + self._descend(jacobian, e, held, HELD_DAMPING, 1)
            other = np.where(held, s, np.minimum(np.maximum(moved, low), high))
            jacobian, e, less = self._measure(target, other)
            if not less < error:
                break
            s, error = other, less
        return s, True

    def _descend(self, jacobian: Floats, e: Floats, held: NDArray[np.bool_], damping: float, passes: int) -> Floats:
        """Joint changes for a weighted error, by damped least squares."""
        columns = self._columns(jacobian, held)
        system = columns.T @ columns + damping * np.eye(len(self.q), dtype=self.q.dtype)
        moves, left = np.zeros_like(self.q), e
        for _ in range(passes):
            part = np.linalg.solve(system, columns.T @ left).astype(self.q.dtype)
            moves, left = moves + part * self.arm.joints.stride, left - columns @ part
        return moves

    def _columns(self, jacobian: Floats, held: NDArray[np.bool_]) -> Floats:
        """The Jacobian with lengths weighted and joints counted in their strides, without those that are held."""
        weighed = self._weighed(jacobian.T * self.arm.joints.stride[:, None]).T * self._rows()[:, None]
        return np.where(held, self.q.dtype.type(0), weighed).astype(self.q.dtype)

    def _spread(self, jacobian: Floats) -> float:
        """Product of the squared sines of the angles at which each column meets those before it."""
        held = self.arm.joints.held
        columns = self._columns(jacobian, held).T[~held]
        product = 1.0
        for place, whole in enumerate((columns**2).sum(axis=1)):
            column = columns[place]  # a view
            for earlier in columns[:place]:
                square = earlier @ earlier
                column -= (column @ earlier / square if square > 0 else 0) * earlier
            product *= float(column @ column / whole) if whole > 0 else 0.0
        return product

    def _outside(self, q: Floats) -> int:
        """The joint that is farthest outside its limits; -1 if none is."""
        joints = self.arm.joints
        excess = np.maximum(joints.lowest - q, q - joints.highest) / joints.stride
        return int(excess.argmax()) if excess.max() > 0 else -1

    def _change(self, s: Floats) -> float:
        """The largest change of a joint, in rad or thirds of the reach."""
        return float((np.abs(s - self.q) / self.arm.joints.stride).max())

    def _measure(self, target: Floats, q: Floats) -> tuple[Floats, Floats, float]:
        pose, jacobian = self.arm.evaluate(q)
        e = self._weighed(self._difference(target, pose))
        return jacobian, e, float(e @ e)

    def _distance(self, a: Floats, b: Floats) -> float:
        return _norm(self._weighed(self._difference(a, b)))

    def _difference(self, target: Floats, pose: Floats) -> Floats:
        """The way to a target, and the rotation vector to it."""
        e = np.zeros(6, self.q.dtype)
        e[:3] = target[:3, 3] - pose[:3, 3]
        if self.arm.rows == 6:
            r = target[:3, :3] @ pose[:3, :3].T
            v = np.array([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]])
            sine2, cosine2 = _norm(v), float(np.trace(r)) - 1
            e[3:] = v * (math.atan2(sine2, cosine2) / sine2 if sine2 > 0 else 0)
            if sine2 <= 0 and cosine2 < 0:
                e[3] = math.pi
        return e

    def _weighed(self, e: Floats) -> Floats:
        """Twists (..., 6) with their lengths weighted."""
        found = np.array(e, self.q.dtype)
        found[..., :3] *= self.q.dtype.type(self.arm.weight)
        return found

    def _rows(self) -> Floats:
        return (np.arange(6) < self.arm.rows).astype(self.q.dtype)


def _norm(v: Floats) -> float:
    return float(np.sqrt(v @ v))
