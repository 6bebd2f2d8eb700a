"""Damped least squares for several tips in NumPy, as the C files search. It needs NumPy alone.

Tips that share joints, directly or by way of others, are one group. Groups do not depend on each other: each has its
own damping, its own longest step, its own best joint values and its own random starts, but they are evaluated together.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ._search import Effort, Floats, Joint, Search, _are_poses

_HALF = 8  # after so many steps the squared error must have halved
_MOST_STEPS = 60


class Weighted(Effort):
    """What a search may take, with the weights of position and rotation of each tip (tips, 2)."""

    weights: Floats

    @classmethod
    def of(cls, effort: Effort, weights: Floats) -> Weighted:
        """An effort with weights."""
        found = cls(*effort)
        found.weights = weights
        return found


class TipsSearch(Search):
    """One search for all targets at once, each with a pose for every tip."""

    def __init__(
        self,
        evaluate: Callable[[Floats], tuple[Floats, Floats]],
        joints: tuple[Joint, ...],
        reach: float,
        targets: Floats,
        effort: Weighted,
        moving: tuple[tuple[int, ...], ...],
    ) -> None:
        super().__init__(evaluate, joints, reach, targets[:, 0], effort)
        count, tips = targets.shape[:2]
        read = np.repeat(effort.weights > 0, [3, 1], axis=1)[:, [3, 3, 3, 0]]  # columns of a matrix
        self._targets = np.where(read[:, None, :], targets, np.eye(4, dtype=targets.dtype))
        self._parts = effort.weights
        # Of each row of all Jacobians: weights of its tip, of lengths and angles.
        self._rows = (np.repeat(effort.weights, 3, axis=1) * self._weights).ravel()
        groups = _groups(moving)
        self._tip_groups = np.array(groups)
        self._joint_groups = np.zeros(len(joints), int)
        for group, own in zip(groups, moving, strict=True):
            self._joint_groups[list(own)] = group
        self._groups = max(groups) + 1
        self.errors = np.full((count, 2, tips), 1e30)
        self._least, self._done = np.full((count, self._groups), np.inf), np.zeros((count, self._groups), bool)
        poses = np.stack([_are_poses(self._targets[:, tip]) for tip in range(tips)]).all(axis=0)
        self._left = np.where(poses, effort.budget or np.inf, 0)

    def _by_group(self, values: Floats) -> Floats:
        """Sums over the tips (n, tips) of each group (n, groups)."""
        return np.stack([values[:, self._tip_groups == each].sum(axis=1) for each in range(self._groups)], axis=1)

    def _best_of(self, rows: NDArray[np.intp], samples: int, random: np.random.Generator) -> Floats:
        best, least = self.q[rows], np.full((len(rows), self._groups), np.inf)
        least[self._done[rows]] = -np.inf  # these stay where they are
        place, turn = self._parts.T
        target = self._targets[rows]
        for _ in range(samples):
            candidates = random.uniform(self._low, self._high, best.shape)
            pose = self._evaluate(candidates)[0]
            way = (target[..., :3, 3] - pose[..., :3, 3]) * self._weights[:3]
            # 2 (1 - cos(angle)) stands for the square of the angle.
            angle = 3 - (target[..., :3, :3] * pose[..., :3, :3]).sum(axis=(2, 3))
            error = self._by_group((way**2).sum(axis=2) * place**2 + angle * turn**2)
            better = error < least
            least[better] = error[better]
            best = np.where(better[:, self._joint_groups], candidates, best)
        return best

    def _descend(self, rows: NDArray[np.intp], q: Floats) -> None:
        before = np.full(len(rows), np.inf)
        for iteration in range(min(self._effort.steps or _MOST_STEPS, _MOST_STEPS)):
            can = self._left[rows] > 0
            rows, q, before = rows[can], q[can], before[can]
            if not len(rows):
                return
            self._left[rows] -= 1
            self.iterations[rows] += 1
            e, jacobian = self._difference(rows, q)
            weighted = e * self._rows
            error = self._by_group((weighted**2).reshape(len(rows), -1, 6).sum(axis=2))
            self._keep(rows, q, e, error)
            self.solved[rows] = self._done[rows].all(axis=1)
            go = ~self.solved[rows]
            if iteration % _HALF == _HALF - 1:
                rest = np.where(self._done[rows], 0, error).sum(axis=1)
                go &= rest <= before / 2
                before = rest
            if not go.any():
                return
            rows, before = rows[go], before[go]
            columns = jacobian[go] * self._rows[:, None] * self._strides
            q = self._step(q[go], weighted[go], columns, error[go])

    def _keep(self, rows: NDArray[np.intp], q: Floats, e: Floats, error: Floats) -> None:
        """Keep the joints of each group that is nearer to its targets than before, or within the tolerances at last."""
        parts = np.linalg.norm(e.reshape(len(rows), -1, 2, 3), axis=3) * (self._parts > 0)
        far = self._by_group((~(parts <= self._effort.tolerances)).any(axis=2)) > 0
        keep = ~self._done[rows] & ((error < self._least[rows]) | ~far)
        self._least[rows] = np.where(keep, error, self._least[rows])
        self.q[rows] = np.where(keep[:, self._joint_groups], q, self.q[rows])
        tips = keep[:, None, self._tip_groups]
        self.errors[rows] = np.where(tips, parts.swapaxes(1, 2), self.errors[rows])
        self._done[rows] |= ~far

    def _difference(self, rows: NDArray[np.intp], q: Floats) -> tuple[Floats, Floats]:
        """Ways to go and rotation vectors of target_R pose_R^T (n, 6 tips), and the Jacobians (n, 6 tips, dof)."""
        pose, jacobian = self._evaluate(q)
        target, count = self._targets[rows], len(rows)
        r = target[..., :3, :3] @ pose[..., :3, :3].swapaxes(2, 3)
        v = np.stack([r[..., 2, 1] - r[..., 1, 2], r[..., 0, 2] - r[..., 2, 0], r[..., 1, 0] - r[..., 0, 1]], axis=2)
        sine, cosine = np.linalg.norm(v, axis=2), np.trace(r, axis1=2, axis2=3) - 1
        turn = v * (np.arctan2(sine, cosine) / np.where(sine > 0, sine, 1.0))[..., None]
        turn[(sine <= 0) & (cosine < 0), 0] = np.pi
        e = np.concatenate([target[..., :3, 3] - pose[..., :3, 3], turn], axis=2)
        return e.reshape(count, -1), jacobian.reshape(count, -1, len(self._low))

    def _step(self, q: Floats, e: Floats, jacobian: Floats, error: Floats) -> Floats:
        low, high = self._low, self._high
        slope = np.einsum("nij,ni->nj", jacobian, e)
        left = np.where(slope < 0, q - low, high - q) / ((high - low) * 0.4)
        freedom = np.where(self._limited, np.clip(left, 0.0, 1.0), 1.0)
        # The smaller of the two forms of the same equations.
        columns = jacobian * np.sqrt(freedom)[:, None, :]
        damping = 0.1 * error + 1e-12
        if columns.shape[1] <= columns.shape[2]:
            diagonal = np.repeat(damping[:, self._tip_groups], 6, axis=1)
            matrix = columns @ columns.swapaxes(1, 2) + diagonal[..., None] * np.eye(columns.shape[1])
            found = np.einsum("nij,ni->nj", columns, np.linalg.solve(matrix, e[..., None])[..., 0])
        else:
            diagonal = damping[:, self._joint_groups]
            matrix = columns.swapaxes(1, 2) @ columns + diagonal[..., None] * np.eye(columns.shape[2])
            found = np.linalg.solve(matrix, np.einsum("nij,ni->nj", columns, e)[..., None])[..., 0]
        moves = found * np.sqrt(freedom)
        largest = np.full(error.shape, 0.8)
        for group in range(self._groups):
            own = self._angles & (self._joint_groups == group)
            largest[:, group] = np.abs(moves[:, own]).max(axis=1, initial=0.8)
        moved = q + moves * (0.8 / largest)[:, self._joint_groups] * self._strides
        turned = np.where(self._angles & (np.abs(moved) > np.pi), moved - np.copysign(2 * np.pi, moved), moved)
        result: Floats = np.where(self._limited, np.clip(moved, low, high), turned)
        return result


def _groups(moving: tuple[tuple[int, ...], ...]) -> list[int]:
    """The group of each tip, numbered from 0."""
    groups = list(range(len(moving)))
    for tip, joints in enumerate(moving):
        for other in range(tip):
            if set(joints) & set(moving[other]):
                groups = [groups[tip] if each == groups[other] else each for each in groups]
    order = sorted(set(groups), key=groups.index)
    return [order.index(group) for group in groups]
