"""Joint values for poses by damped least squares, for batches of targets. It needs NumPy alone."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._kernel import Kernel
from ._targets import checked_targets
from ._threads import spread, workers_for

Floats = NDArray[np.floating[Any]]

_BLOCK = 1 << 10  # targets that go to C at once; Ctrl-C gets through in between
_ITERATIONS, _STALL, _SAMPLES, _MOST_SAMPLES = 60, 8, 20, 5120


class NumericSolution(NamedTuple):
    """What was found for each target; the leading axes are those of the targets.

    Attributes:
        q: Joint vectors (..., dof), within the limits; where nothing was near enough, the nearest.
        solved: Whether both errors are within their tolerances (...).
        position_error: Distances to the targets (...).
        rotation_error: Angles to the targets in rad (...).
        iterations: Steps of all descents (...); 0 where the search ran in NumPy and does not count them singly.
    """

    q: Floats
    solved: NDArray[np.bool_]
    position_error: Floats
    rotation_error: Floats
    iterations: NDArray[np.int32]


class Joint(NamedTuple):
    """Where one joint may stand: its limits, or where random starts lie; and whether it turns."""

    lowest: float
    highest: float
    is_limited: bool
    is_angle: bool


class NumericInverse:
    """The numeric inverse of a robot; its `backend` is "c" or "numpy".

    Args:
        name: Name of this object in its module.
        module: Name of that module.
        symbol: Prefix of the C functions.
        kernel: The pose with its Jacobian.
        joints: Where each joint may stand.
        reach: Length that counts as much as an angle of 3 rad.
        tolerances: Accepted position error and rotation error, for float64 and for float32.
        native: What `load_native` gave.
        params: The robot file's values of the runtime parameters; None where there are none.
        doc: Text for `help()`.
    """

    def __init__(
        self,
        name: str,
        *,
        module: str,
        symbol: str,
        kernel: Kernel[Any],
        joints: tuple[Joint, ...],
        reach: float,
        tolerances: tuple[tuple[float, float], tuple[float, float]],
        native: Any = None,
        params: Any = None,
        doc: str = "",
    ) -> None:
        self.__name__, self.__module__, self.__doc__ = name, module, doc
        self.dof, self.backend = kernel.dof, "numpy" if native is None else "c"
        self.kernel, self.joints, self.reach, self.tolerances = kernel, joints, reach, tolerances
        self._native, self._symbol, self._params = native, symbol, params

    def __call__(
        self,
        base_T_tool: ArrayLike,
        start: ArrayLike | None = None,
        *,
        params: Any = None,
        tolerances: tuple[float, float] | None = None,
        restarts: int = 10,
        seed: int = 1,
        threads: int = 1,
    ) -> NumericSolution:
        """Find joint values for one pose or a batch.

        Args:
            base_T_tool: Targets (..., 4, 4).
            start: Joint vectors of the first descents (..., dof); the middle of the ranges if left out.
            params: Values of the runtime parameters; by default those of the robot file.
            tolerances: Accepted distance, in the unit of the robot file, and angle in rad.
            restarts: Descents after the first, each from the best of some random joint vectors.
            seed: Of the random starts; equal calls give equal results, for any number of threads.
            threads: Number of threads that share a batch; 0 for all cores.

        Returns:
            The solutions with what they leave.

        Raises:
            ValueError: If a target is no pose, or shapes do not fit.
            TypeError: If they are no real numbers.
        """
        targets = checked_targets(self.__name__, base_T_tool)
        lead, real = targets.shape[:-2], targets.dtype
        middle = [(joint.lowest + joint.highest) / 2 for joint in self.joints]
        starts = np.asarray(middle if start is None else start)
        if starts.shape[-1:] != (self.dof,) or starts.dtype.kind not in "fiu":
            raise ValueError(f"{self.__name__}: start has shape {starts.shape}, expected (..., {self.dof})")
        try:
            starts = np.array(np.broadcast_to(starts, (*lead, self.dof)), real, order="C").reshape(-1, self.dof)
        except ValueError:
            raise ValueError(f"{self.__name__}: start of shape {starts.shape} for targets {targets.shape}") from None
        accepted = tolerances or self.tolerances[real == np.float32]
        count = math.prod(lead)
        found = NumericSolution(
            np.empty((count, self.dof), real),
            np.zeros(count, np.bool_),
            np.empty(count, real),
            np.empty(count, real),
            np.zeros(count, np.int32),
        )
        flat = np.ascontiguousarray(targets).reshape(count, 4, 4)
        chosen = self._params if params is None else params
        fill = partial(self._search, flat, starts, found, chosen, (*map(float, accepted),), restarts, seed)
        spread(fill, _blocks(count), workers_for(threads))
        others: list[Any] = [np.reshape(entry, lead)[()] for entry in found[1:]]
        return NumericSolution(found.q.reshape(*lead, self.dof), *others)

    def __reduce__(self) -> str:
        return self.__name__  # pickled by reference, as functions are

    def _search(
        self,
        targets: Floats,
        starts: Floats,
        found: NumericSolution,
        params: Any,
        tolerances: tuple[float, ...],
        restarts: int,
        seed: int,
        first: int,
        last: int,
    ) -> None:
        """Search for some of the targets."""
        part = slice(first, last)
        if self._native is None:
            evaluate = self.kernel if params is None else partial(self.kernel, params=params)
            search = _Search(evaluate, self.joints, self.reach, targets[part], tolerances)
            search.run(starts[part], restarts, np.random.default_rng((seed, first)))
            answer: tuple[Any, ...] = search.q, search.errors, 0, search.solved
        else:
            answer = self._in_c(targets[part], starts[part], params, tolerances, restarts, seed, first)
        q, errors, iterations, solved = answer
        found.q[part], found.solved[part] = q, solved
        found.position_error[part], found.rotation_error[part] = errors.T
        found.iterations[part] = iterations

    def _in_c(
        self,
        targets: Floats,
        starts: Floats,
        params: Any,
        tolerances: tuple[float, ...],
        restarts: int,
        seed: int,
        first: int,
    ) -> tuple[Floats, Floats, Any, Any]:
        ffi, count = self._native.ffi, len(targets)
        single = targets.dtype == np.float32
        prefix, item = (f"{self._symbol}_f32", "float[]") if single else (self._symbol, "double[]")
        call = getattr(self._native.lib, f"{prefix}_{self.__name__}_many")
        structs = () if params is None else (ffi.new(f"{prefix}_params *", list(params)),)
        q, errors = np.empty((count, self.dof), targets.dtype), np.empty((count, 2), targets.dtype)
        iterations, solved = np.empty(count, np.int32), np.empty(count, np.uint8)
        call(
            *structs,
            ffi.from_buffer(item, targets),
            ffi.from_buffer(item, starts),
            count,
            first,
            ffi.new(item, list(tolerances)),
            restarts,
            seed & 0xFFFFFFFF,
            ffi.from_buffer(item, q, require_writable=True),
            ffi.from_buffer(item, errors, require_writable=True),
            ffi.from_buffer("int32_t[]", iterations, require_writable=True),
            ffi.from_buffer("unsigned char[]", solved, require_writable=True),
        )
        return q, errors, iterations, solved


class _Search:
    """The same search in NumPy, for all targets at once."""

    def __init__(
        self,
        evaluate: Callable[[Floats], tuple[Floats, Floats]],
        joints: tuple[Joint, ...],
        reach: float,
        targets: Floats,
        tolerances: tuple[float, ...],
    ) -> None:
        self._evaluate, self._targets, self._tolerances = evaluate, targets, tolerances
        self._low, self._high = np.array([joint[:2] for joint in joints]).T
        self._limited, self._angles = np.array([joint[2:] for joint in joints]).T
        self._weights = np.array([3 / reach] * 3 + [1.0] * 3)
        count = len(targets)
        self.q = np.zeros((count, len(joints)))
        self.errors, self.solved = np.full((count, 2), np.inf), np.zeros(count, bool)
        self._least = np.full(count, np.inf)

    def run(self, starts: Floats, restarts: int, random: np.random.Generator) -> None:
        """Descend from the starts, and then from random joint vectors where that was not enough."""
        q = np.where(self._limited, np.clip(starts, self._low, self._high), starts).astype(float)
        self.q[:] = q
        for descent in range(restarts + 1):
            open_ = np.flatnonzero(~self.solved)
            if not len(open_):
                return
            if descent:
                q[open_] = self._best_of(open_, min(_SAMPLES * descent**2, _MOST_SAMPLES), random)
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
        for iteration in range(_ITERATIONS):
            e, jacobian = self._difference(rows, q)
            error = ((e * self._weights) ** 2).sum(axis=1)
            errors = np.stack([np.linalg.norm(e[:, :3], axis=1), np.linalg.norm(e[:, 3:], axis=1)], axis=1)
            done = (errors <= self._tolerances).all(axis=1)
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
            q = self._step(q[go], e[go] * self._weights, jacobian[go] * self._weights[:, None], error[go])

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
        moved = q + moves * (0.8 / largest)[:, None]
        turned = np.where(self._angles & (np.abs(moved) > np.pi), moved - np.copysign(2 * np.pi, moved), moved)
        result: Floats = np.where(self._limited, np.clip(moved, low, high), turned)
        return result


def _blocks(count: int) -> Generator[tuple[int, int]]:
    for first in range(0, count, _BLOCK):
        yield first, min(first + _BLOCK, count)
