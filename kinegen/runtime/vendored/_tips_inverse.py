"""Joint values for the tips of a tree, all at once, by damped least squares. It needs NumPy alone."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._engines import real_array, table_of
from ._numeric_inverse import Floats, NumericInverse, NumericSolution, _Given, _Task, _with_numbers
from ._parameters import checked_params, settled_params
from ._search import effort_of
from ._targets import checked_targets, is_pose, joint_vector_asked
from ._threads import workers_for
from ._tips_search import TipsSearch, Weighted

_HEAVIEST = 1e6
"""The largest weight."""


class TipsInverse(NumericInverse):
    """The numeric inverse of a robot with several tips; its `backend` is "c" or "numpy".

    Args:
        name: Name of this object in its module.
        moving: For each tip the joints that move it.
        options: As for `NumericInverse`.
    """

    def __init__(self, name: str, *, moving: tuple[tuple[int, ...], ...], **options: Any) -> None:
        super().__init__(name, **options)
        doc = self.__doc__ or ""
        self.__doc__ = doc.replace("(base_T_tool, start", "(base_T_tips, start", 1)
        self.moving = moving

    def __call__(
        self,
        base_T_tips: ArrayLike,
        start: ArrayLike | None = None,
        *,
        q0: ArrayLike | None = None,
        params: Any = None,
        weights: ArrayLike | None = None,
        out: Any = None,
        tolerances: tuple[float, float] | None = None,
        restarts: int = 10,
        seed: int = 1,
        budget: int = 0,
        steps: int = 0,
        threads: int = 1,
    ) -> NumericSolution:
        """Find joint values for poses or points of all tips.

        Args:
            base_T_tips: Targets (..., tips, 4, 4), in the order of `TIPS`.
            start: Joint vectors of the first descents (..., dof); the middle of the ranges if left out, or for entries
                that are not finite.
            q0: Another name of `start`.
            params: Values of the runtime parameters; by default those of the robot file. Each is a number, or an array
                (...) whose axes broadcast with those of the targets.
            weights: Of each tip (tips,), or of its position and its rotation (tips, 2), the same for all targets;
                from 0 to 1e6, by default 1. A weight of 0 leaves that part of the tip free: its target is not read.
            out: A `NumericSolution`, or a tuple, of arrays for the results, of their exact shapes and types.
            tolerances: Of the distance, in the unit of the robot file, and of the angle in rad, of every tip.
            restarts: Descents after the first, each from the best of some random joint vectors.
            seed: Of the random starts; equal calls give equal results, for any number of threads.
            budget: Evaluations of the kernel for a target at most, one for each step and random joint vector. 0 leaves
                them to `restarts`: 60 steps a descent, 20 r**2 joint vectors (at most 5120) before restart r.
            steps: Steps of a descent at most; 0 for 60, and never more.
            threads: Number of threads that share a batch; 0 for all cores.

        Returns:
            The solutions with what they leave; `out` where it was given. `position_error` and `rotation_error` have
            an axis of tips (..., tips), and are 0 where a part is free.

        Raises:
            ValueError: If a target is not a pose in what is not free, shapes do not fit, or a count, a weight or a
                tolerance is out of range.
            TypeError: If they are not real numbers, or `params` is not the package's `Params`.
        """
        counted = self._weights(weights)
        start = joint_vector_asked(self.__name__, "start", start, q0)
        given = self._given_tips(base_T_tips, counted, start, params)
        lead, real = given.lead, given.real
        accepted = tolerances or self.tolerances[real == np.float32]
        effort = effort_of(self.__name__, accepted, restarts=restarts, seed=seed, budget=budget, steps=steps)
        found = self._empty(lead, real) if out is None else self._checked(out, lead, real, given.arrays)
        task = _Task(given.targets, given.starts, given.params, Weighted.of(effort, counted))
        self._fill(task, lead, found, workers_for(threads))
        result: NumericSolution = _with_numbers(found) if out is None else out
        return result

    def bind(  # type: ignore[override] # the targets of all tips have another name than those of one
        self, base_T_tips: Floats, start: Floats, *results: NDArray[Any], **options: Any
    ) -> Callable[[], object]:
        """Fix the arrays: each call of what comes back reads the targets and starts anew and writes the results.

        Args:
            base_T_tips: Targets (..., tips, 4, 4), an array of float64 or float32.
            start: Joint vectors of the first descents (..., dof), an array.
            results: Arrays for `q`, `solved`, `position_error`, `rotation_error` and `iterations`, as for `out`.
            options: As for a call: params, weights, tolerances, restarts, seed, budget, threads.

        Returns:
            A function without arguments.
        """
        try:
            return super().bind(base_T_tips, start, *results, **options)
        except (TypeError, ValueError) as error:
            raise type(error)(str(error).replace("base_T_tool", "base_T_tips")) from None

    def __repr__(self) -> str:
        given = f"base_T_tips ({len(self.moving)}, 4, 4), start ({self.dof},)"
        return f"<{self.__module__}.{self.__name__}: {given} to ({self.dof},), backend {self.backend}>"

    def _weights(self, given: ArrayLike | None) -> Floats:
        """Weights of position and rotation (tips, 2), checked."""
        tips = len(self.moving)
        if given is None:
            return np.ones((tips, 2))
        weights = real_array(self.__name__, "weights", given).astype(float)
        if weights.shape not in ((tips,), (tips, 2)):
            raise ValueError(f"{self.__name__}: weights has shape {weights.shape}, expected ({tips},) or ({tips}, 2)")
        wrong = ~((weights >= 0) & (weights <= _HEAVIEST))
        if wrong.any():
            value = weights[wrong].flat[0]
            raise ValueError(f"{self.__name__}: weights holds {value:g}, expected numbers from 0 to {_HEAVIEST:g}")
        return np.repeat(weights[:, None], 2, axis=1) if weights.ndim == 1 else weights

    def _given_tips(self, base_T_tips: ArrayLike, weights: Floats, start: ArrayLike | None, params: Any) -> _Given:
        """The arguments, checked: one start and one set of parameters for each target, or one set for all."""
        name, inner = self.__name__, (len(self.moving), 4, 4)
        targets = real_array(name, "base_T_tips", base_T_tips)
        if targets.shape[-3:] != inner:
            shape = f"(..., {', '.join(map(str, inner))})"
            raise ValueError(f"{name}: base_T_tips has shape {targets.shape}, expected {shape}")
        targets = without_free(targets, weights)
        is_quick = targets.ndim == 3 and targets.dtype in (np.float64, np.float32) and all(map(is_pose, targets))
        try:
            targets = targets if is_quick else checked_targets(name, targets)
        except (TypeError, ValueError) as error:
            raise type(error)(str(error).replace("base_T_tool", "base_T_tips")) from None
        chosen, varied = settled_params(name, checked_params(name, params, self._params))
        lead, (result, real) = self._lead(targets, varied), self.kernel.types([targets])
        targets = np.broadcast_to(targets, (*lead, *inner)) if varied else targets
        starts = self._starts(start, lead, real)
        if varied:
            chosen = table_of([np.broadcast_to(array, lead) for array in varied.values()], real)
        arrays = [("base_T_tips", np.asarray(base_T_tips)), *varied.items()]
        arrays += [] if start is None else [("start", np.asarray(start))]
        flat = np.ascontiguousarray(targets, real).reshape(math.prod(lead), *inner)
        return _Given(lead, result, flat, starts, chosen, arrays)

    def _lead(self, targets: Floats, varied: Mapping[str, NDArray[Any]]) -> tuple[int, ...]:
        """The axes of the batch, to which those of the targets and of all parameters broadcast."""
        try:
            return np.broadcast_shapes(targets.shape[:-3], *(array.shape for array in varied.values()))
        except ValueError:
            shapes = ", ".join(f"{name} {array.shape}" for name, array in varied.items() if array.ndim)
            shapes = f"base_T_tips {targets.shape}, {shapes}"
            raise ValueError(f"{self.__name__}: the shapes of {shapes} do not fit together") from None

    def _kinds(self, real: np.dtype[Any]) -> tuple[tuple[tuple[int, ...], np.dtype[Any]], ...]:
        """Shape for one target, and type, of each result."""
        q, solved, _, _, iterations = super()._kinds(real)
        errors = (len(self.moving),), real
        return q, solved, errors, errors, iterations

    def _search(self, whole: _Task, found: NumericSolution, single: bool, first: int, last: int) -> None:
        """Search for some of the targets."""
        task, part = whole.part(first, last), slice(first, last)
        if self._native is None and isinstance(task.params, np.ndarray) and last - first > 1:
            # Each target has a robot of its own.
            for each in range(first, last):
                self._search(whole, found, single, each, each + 1)
            return
        answer = self._in_numpy(task, first) if self._native is None else self._in_c(task, first, single)
        q, errors, iterations, solved = answer
        found.q[part], found.solved[part], found.iterations[part] = q, solved, iterations
        found.position_error[part], found.rotation_error[part] = errors[:, 0], errors[:, 1]

    def _in_numpy(self, task: _Task, first: int) -> tuple[Any, ...]:
        own = self._params._make(task.params[0].tolist()) if isinstance(task.params, np.ndarray) else task.params
        evaluate = self.kernel if own is None else partial(self.kernel, params=own)
        effort: Any = task.effort
        search = TipsSearch(evaluate, self.joints, self.reach, task.targets, effort, self.moving)
        search.run(task.starts, np.random.default_rng((task.effort.seed, first)))
        return search.q, search.errors, search.iterations, search.solved

    def _in_c(self, task: _Task, first: int, alone: bool) -> tuple[Floats, Floats, Any, Any]:
        targets, starts, params, effort = task
        weights: Any = getattr(effort, "weights")  # noqa: B009 - those of the class of several tips
        ffi, count, real = self._native.ffi, len(targets), targets.dtype
        prefix, item = (f"{self._symbol}_f32", "float[]") if real == np.float32 else (self._symbol, "double[]")
        if isinstance(params, np.ndarray):
            structs: tuple[Any, ...] = ffi.from_buffer(item, params), 1
        else:
            structs = () if params is None else (ffi.new(f"{prefix}_params *", list(params)), 0)
        q, solved = np.empty((count, self.dof), real), np.empty(count, np.uint8)
        # The struct of the header: two errors of each tip, steps and descents.
        whole = np.dtype(np.int32)
        found = np.empty(count, [("errors", real, (2, len(self.moving))), ("iterations", whole), ("descents", whole)])
        getattr(self._native.lib, f"{prefix}_{self.__name__}_many")(
            *structs,
            ffi.from_buffer(item, targets),
            ffi.from_buffer(item, starts),
            count,
            first,
            alone,
            ffi.new(item, list(effort.tolerances)),
            ffi.new(item, weights.ravel().tolist()),
            effort.restarts,
            effort.seed,
            effort.budget,
            effort.steps,
            ffi.from_buffer(item, q, require_writable=True),
            ffi.from_buffer("unsigned char[]", found.view(np.uint8), require_writable=True),
            ffi.from_buffer("unsigned char[]", solved, require_writable=True),
        )
        return q, found["errors"], found["iterations"], solved


def without_free(targets: NDArray[Any], weights: Floats) -> NDArray[Any]:
    """Targets (..., tips, 4, 4) with what is free taken from the identity; the last row goes with the rotation."""
    read = np.repeat(weights[:, None, None, 1] > 0, 4, axis=1).repeat(4, axis=2)
    read[:, :3, 3] = weights[:, None, 0] > 0
    return targets if read.all() else np.where(read, targets, np.eye(4, dtype=targets.dtype))
