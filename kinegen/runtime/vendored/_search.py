"""Damped least squares with random restarts in NumPy, as the C files search. It needs NumPy alone."""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.floating[Any]]

_LARGEST = (1 << 31) - 1
_ITERATIONS, _STALL, _SAMPLES, _MOST_SAMPLES = 60, 8, 20, 5120


class Effort(NamedTuple):
    """The bounds of a search: tolerances, restarts, the seed of random starts, evaluations and steps or 0."""

    tolerances: tuple[float, float]
    restarts: int
    seed: int
    budget: int
    steps: int


class Joint(NamedTuple):
    """Where one joint may stand: its limits, or where random starts lie; and whether it turns."""

    lowest: float
    highest: float
    is_limited: bool
    is_angle: bool


class Search:
    """One search for all targets at once."""

    def __init__(
        self,
        evaluate: Callable[[Floats], tuple[Floats, Floats]],
        joints: tuple[Joint, ...],
        reach: float,
        targets: Floats,
        effort: Effort,
    ) -> None:
        self._evaluate, self._targets, self._effort = evaluate, targets, effort
        self._low, self._high = np.array([joint[:2] for joint in joints]).T
        self._limited, self._angles = np.array([joint[2:] for joint in joints]).T
        self._weights = np.array([3 / reach] * 3 + [1.0] * 3)
        # What of a joint counts as much as an angle of 1 rad.
        self._strides = np.where(self._angles, 1.0, reach / 3)
        count = len(targets)
        self.q = np.zeros((count, len(joints)))
        self.errors, self.solved = np.full((count, 2), 1e30), np.zeros(count, bool)
        self._least = np.full(count, np.inf)
        self.iterations = np.zeros(count, np.int32)
        self._left = np.where(_are_poses(targets), effort.budget or np.inf, 0)

    def run(self, starts: Floats, random: np.random.Generator) -> None:
        """Descend from the starts, and then from random joint vectors where that was not enough."""
        starts = np.where(np.isfinite(starts), starts, (self._low + self._high) / 2)
        q = np.where(self._limited, np.clip(starts, self._low, self._high), starts).astype(float)
        self.q[:] = q
        for descent in range(self._effort.restarts + 1):
            samples = min(_SAMPLES * descent**2, _MOST_SAMPLES)
            # Samples that leave no step behind them are not drawn.
            open_ = np.flatnonzero(~self.solved & (self._left > samples))
            if not len(open_):
                return
            if descent:
                q[open_] = self._best_of(open_, samples, random)
                self._left[open_] -= samples
            self._descend(open_, q[open_])

    def _best_of(self, rows: NDArray[np.intp], samples: int, random: np.random.Generator) -> Floats:
        best, least = np.empty((len(rows), len(self._low))), np.full(len(rows), np.inf)
        for _ in range(samples):
            candidates = random.uniform(self._low, self._high, best.shape)
            pose, target = self._evaluate(candidates)[0], self._targets[rows]
            way = (target[:, :3, 3] - pose[:, :3, 3]) * self._weights[:3]
            # 2 (1 - cos(angle)) stands for the square of the angle.
            error = (way**2).sum(axis=1) + 3 - (target[:, :3, :3] * pose[:, :3, :3]).sum(axis=(1, 2))
            better = error < least
            best[better], least[better] = candidates[better], error[better]
        return best

    def _descend(self, rows: NDArray[np.intp], q: Floats) -> None:
        before = np.full(len(rows), np.inf)
        for iteration in range(min(self._effort.steps or _ITERATIONS, _ITERATIONS)):
            can = self._left[rows] > 0
            rows, q, before = rows[can], q[can], before[can]
            if not len(rows):
                return
            self._left[rows] -= 1
            self.iterations[rows] += 1
            e, jacobian = self._difference(rows, q)
            error = ((e * self._weights) ** 2).sum(axis=1)
            errors = np.stack([np.linalg.norm(e[:, :3], axis=1), np.linalg.norm(e[:, 3:], axis=1)], axis=1)
            done = (errors <= self._effort.tolerances).all(axis=1)
            keep = (error < self._least[rows]) | done
            self.q[rows[keep]], self.errors[rows[keep]] = q[keep], errors[keep]
            self._least[rows[keep]] = error[keep]
            self.solved[rows[done]] = True
            go = ~done
            if iteration % _STALL == _STALL - 1:
                go &= error <= before / 2
                before = error
            if not go.any():
                return
            rows, before = rows[go], before[go]
            weighted = jacobian[go] * self._weights[:, None] * self._strides
            q = self._step(q[go], e[go] * self._weights, weighted, error[go])

    def _difference(self, rows: NDArray[np.intp], q: Floats) -> tuple[Floats, Floats]:
        """The way to go, the rotation vector of target_R pose_R^T, and the Jacobian."""
        pose, jacobian = self._evaluate(q)
        target = self._targets[rows]
        r = target[:, :3, :3] @ pose[:, :3, :3].swapaxes(1, 2)
        v = np.stack([r[:, 2, 1] - r[:, 1, 2], r[:, 0, 2] - r[:, 2, 0], r[:, 1, 0] - r[:, 0, 1]], axis=1)
        sine, cosine = np.linalg.norm(v, axis=1), np.trace(r, axis1=1, axis2=2) - 1
        turn = v * (np.arctan2(sine, cosine) / np.where(sine > 0, sine, 1.0))[:, None]
        turn[(sine <= 0) & (cosine < 0), 0] = np.pi
        return np.concatenate([target[:, :3, 3] - pose[:, :3, 3], turn], axis=1), jacobian

    def _step(self, q: Floats, e: Floats, jacobian: Floats, error: Floats) -> Floats:
        low, high = self._low, self._high
        slope = np.einsum("nij,ni->nj", jacobian, e)
        left = np.where(slope < 0, q - low, high - q) / ((high - low) * 0.4)
        freedom = np.where(self._limited, np.clip(left, 0.0, 1.0), 1.0)
        damping = (0.1 * error + 1e-12)[:, None, None] * np.eye(6)
        matrix = (jacobian * freedom[:, None, :]) @ jacobian.swapaxes(1, 2) + damping
        moves = np.einsum("nij,ni->nj", jacobian, np.linalg.solve(matrix, e[..., None])[..., 0]) * freedom
        largest = np.abs(moves[:, self._angles]).max(axis=1, initial=0.8)
        moved = q + moves * (0.8 / largest)[:, None] * self._strides
        turned = np.where(self._angles & (np.abs(moved) > np.pi), moved - np.copysign(2 * np.pi, moved), moved)
        result: Floats = np.where(self._limited, np.clip(moved, low, high), turned)
        return result


def _are_poses(targets: Floats) -> NDArray[np.bool_]:
    """Which matrices are finite, with orthonormal and right-handed columns of the rotation, as the C files see it."""
    with np.errstate(all="ignore"):
        x, y, z, place = (targets[:, :3, column].astype(float) for column in range(4))
        off = np.stack([(x * x).sum(axis=1) - 1, (y * y).sum(axis=1) - 1, (x * y).sum(axis=1)], axis=1)
        square = (off**2).sum(axis=1) + ((z - np.cross(x, y)) ** 2).sum(axis=1)
        rigid = 3e-4 if targets.dtype == np.float32 else 3e-6
        found: NDArray[np.bool_] = (square < rigid**2) & ((place**2).sum(axis=1) < 1e15)
    return found


def effort_of(name: str, tolerances: Any, *, restarts: Any, seed: Any, budget: Any, steps: Any) -> Effort:
    """What a search may take, checked."""
    return Effort(
        _tolerances(name, tolerances),
        _integer(name, "restarts", restarts),
        _integer(name, "seed", seed, least=None) & 0xFFFFFFFF,
        _integer(name, "budget", budget),
        _integer(name, "steps", steps),
    )


def _integer(name: str, label: str, value: Any, least: int | None = 0) -> int:
    """A count that an int32 can hold, or any integer where there is no least one."""
    if isinstance(value, (bool, np.bool_)) or not hasattr(value, "__index__"):
        raise TypeError(f"{name}: {label} is of type {type(value).__name__}, expected an integer")
    number = operator.index(value)
    if least is not None and not least <= number <= _LARGEST:
        raise ValueError(f"{name}: {label} is {number}, expected {least} to {_LARGEST}")
    return number


def _tolerances(name: str, given: Any) -> tuple[float, float]:
    """Two tolerances, which may be zero but not NaN."""
    try:
        position, rotation = map(float, given)
    except (TypeError, ValueError):
        raise TypeError(f"{name}: tolerances is {given!r}, expected a distance and an angle") from None
    if not (position >= 0 and rotation >= 0):
        raise ValueError(f"{name}: tolerances are {position:g} and {rotation:g}, expected none below zero")
    return position, rotation
