"""Joint values for poses by damped least squares, for batches of targets. It needs NumPy alone."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._engines import table_of
from ._kernel import Kernel
from ._overlap import check_apart
from ._parameters import checked_params, settled_params
from ._search import Effort, Joint, Search, effort_of
from ._targets import checked_targets, joint_vector_asked
from ._threads import spread, workers_for

Floats = NDArray[np.floating[Any]]

_BLOCK = 1 << 10  # targets of which threads take turns, and that NumPy searches for together
_LONG = 1 << 12  # targets that go to C at once where one thread does all; Ctrl-C gets through in between


class NumericSolution(NamedTuple):
    """What was found for each target; the leading axes are those of the targets.

    Attributes:
        q: Joint vectors (..., dof), within the limits; where nothing was near enough, the nearest.
        solved: Whether both errors are within their tolerances (...).
        position_error: Distances to the targets (...).
        rotation_error: Angles to the targets in rad (...).
        iterations: Steps of all descents (...).
    """

    q: Floats
    solved: NDArray[np.bool_]
    position_error: Floats
    rotation_error: Floats
    iterations: NDArray[np.int32]


class _Task(NamedTuple):
    """What is searched for, one target each: targets (n, 4, 4) and starts (n, dof), and with what effort.

    The parameters are those of all targets, or an array with a row for each.
    """

    targets: Floats
    starts: Floats
    params: Any
    effort: Effort

    def part(self, first: int, last: int) -> _Task:
        """Some of the targets."""
        own = self.params[first:last] if isinstance(self.params, np.ndarray) else self.params
        return self._replace(targets=self.targets[first:last], starts=self.starts[first:last], params=own)


class _Given(NamedTuple):
    """The arguments of a call: axes of the batch, targets (n, 4, 4), starts (n, dof), parameters, arrays by name.

    Targets and starts have the type that is computed in; `real` is that of the results.
    """

    lead: tuple[int, ...]
    real: np.dtype[Any]
    targets: Floats
    starts: Floats
    params: Any
    arrays: Sequence[tuple[str, NDArray[Any]]]


class NumericInverse:
    """The numeric inverse of a robot; its `backend` is "c" or "numpy".

    Args:
        name: Name of this object in its module.
        module: Name of that module.
        symbol: Prefix of the C functions.
        kernel: The pose with its Jacobian.
        joints: Where each joint may stand.
        reach: Length that counts as much as an angle of 3 rad.
        tolerances: Of the position and of the rotation, for float64 and for float32.
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
        self.__name__, self.__module__ = name, module
        self.__doc__ = f"{name}(base_T_tool, start=None, *, ...); help({name}.__call__) lists the options\n\n{doc}"
        self.dof, self.backend = kernel.dof, "numpy" if native is None else "c"
        self.kernel, self.joints, self.reach, self.tolerances = kernel, joints, reach, tolerances
        self._native, self._symbol, self._params = native, symbol, params

    def __call__(
        self,
        base_T_tool: ArrayLike,
        start: ArrayLike | None = None,
        *,
        q0: ArrayLike | None = None,
        params: Any = None,
        out: Any = None,
        tolerances: tuple[float, float] | None = None,
        restarts: int = 10,
        seed: int = 1,
        budget: int = 0,
        steps: int = 0,
        threads: int = 1,
    ) -> NumericSolution:
        """Find joint values for one pose or a batch.

        Args:
            base_T_tool: Targets (..., 4, 4).
            start: Joint vectors of the first descents (..., dof); the middle of the ranges if left out, or for entries
                that are not finite.
            q0: Another name of `start`.
            params: Values of the runtime parameters; by default those of the robot file. Each is a number, or an array
                (...) whose axes broadcast with those of the targets.
            out: A `NumericSolution`, or a tuple, of arrays for the results, of their exact shapes and types.
            tolerances: Of the distance, in the unit of the robot file, and of the angle in rad.
            restarts: Descents after the first, each from the best of some random joint vectors.
            seed: Of the random starts; equal calls give equal results, for any number of threads.
            budget: Evaluations of the kernel for a target at most, one for each step and random joint vector. 0 leaves
                them to `restarts`: 60 steps a descent, 20 r**2 joint vectors (at most 5120) before restart r.
            steps: Steps of a descent at most; 0 for 60, and never more.
            threads: Number of threads that share a batch; 0 for all cores.

        Returns:
            The solutions with what they leave; `out` where it was given.

        Raises:
            ValueError: If a target is not a pose, shapes do not fit, or a count or a tolerance is out of range.
            TypeError: If they are not real numbers, or `params` is not the package's `Params`.
        """
        given = self._given(base_T_tool, joint_vector_asked(self.__name__, "start", start, q0), params)
        lead, real = given.lead, given.real
        accepted = tolerances or self.tolerances[real == np.float32]
        effort = effort_of(self.__name__, accepted, restarts=restarts, seed=seed, budget=budget, steps=steps)
        found = self._empty(lead, real) if out is None else self._checked(out, lead, real, given.arrays)
        self._fill(_Task(given.targets, given.starts, given.params, effort), lead, found, workers_for(threads))
        result: NumericSolution = _with_numbers(found) if out is None else out
        return result

    def _given(self, base_T_tool: ArrayLike, start: ArrayLike | None, params: Any) -> _Given:
        """The arguments, checked: one start and one set of parameters for each target, or one set for all."""
        name = self.__name__
        targets = checked_targets(name, base_T_tool)
        chosen, varied = settled_params(name, checked_params(name, params, self._params))
        lead, (result, real) = self._lead(targets, varied), self.kernel.types([targets])
        arrays = [("base_T_tool", targets), *([] if start is None else [("start", np.asarray(start))]), *varied.items()]
        targets = np.broadcast_to(targets, (*lead, 4, 4)) if varied else targets
        starts = self._starts(start, lead, real)
        if varied:
            chosen = table_of([np.broadcast_to(array, lead) for array in varied.values()], real)
        flat = np.ascontiguousarray(targets, real).reshape(math.prod(lead), 4, 4)
        return _Given(lead, result, flat, starts, chosen, arrays)

    def _fill(self, task: _Task, lead: tuple[int, ...], found: NumericSolution, workers: int) -> None:
        """Search for all targets; arrays whose axes do not run together are filled by way of others."""
        count = len(task.targets)
        flat = NumericSolution(*(np.reshape(entry, (count, *entry.shape[len(lead) :])) for entry in found))
        block = _LONG if self._native is not None and workers == 1 else _BLOCK
        spread(partial(self._search, task, flat, not lead), _blocks(count, block), workers)
        for entry, filled in zip(found, flat, strict=True):
            if not np.shares_memory(entry, filled):
                entry[...] = filled.reshape(entry.shape)

    def bind(self, base_T_tool: Floats, start: Floats, *results: NDArray[Any], **options: Any) -> Callable[[], object]:
        """Fix the arrays: each call of what comes back reads the targets and starts anew and writes the results.

        Args:
            base_T_tool: Targets (..., 4, 4), an array of float64 or float32.
            start: Joint vectors of the first descents (..., dof), an array.
            results: Arrays for `q`, `solved`, `position_error`, `rotation_error` and `iterations`, as for `out`.
            options: As for a call: params, tolerances, restarts, seed, budget, threads.

        Returns:
            A function without arguments.
        """
        if len(results) != len(NumericSolution._fields):
            names = ", ".join(("base_T_tool", "start", *NumericSolution._fields))
            raise TypeError(f"{self.__name__}: bind takes 7 arrays ({names}), {2 + len(results)} given")
        given: tuple[tuple[str, Any], ...] = (("base_T_tool", base_T_tool), ("start", start))
        for label, array in given:
            if not isinstance(array, np.ndarray) or array.dtype not in (np.float64, np.float32):
                raise TypeError(f"{self.__name__}: bind needs {label} as an array of float64 or float32")
        _, varied = settled_params(self.__name__, checked_params(self.__name__, options.get("params"), self._params))
        lead = self._lead(base_T_tool, varied)
        real, _ = self.kernel.types([base_T_tool])
        found = self._checked(results, lead, real, [*given, *varied.items()])
        return partial(self, base_T_tool, start, out=found, **options)

    def __reduce__(self) -> str:
        return self.__name__  # pickled by reference, as functions are

    def __repr__(self) -> str:
        given = f"base_T_tool (4, 4), start ({self.dof},)"
        return f"<{self.__module__}.{self.__name__}: {given} to ({self.dof},), backend {self.backend}>"

    def _lead(self, targets: Floats, varied: Mapping[str, NDArray[Any]]) -> tuple[int, ...]:
        """The axes of the batch, to which those of the targets and of all parameters broadcast."""
        try:
            return np.broadcast_shapes(targets.shape[:-2], *(array.shape for array in varied.values()))
        except ValueError:
            shapes = ", ".join(f"{name} {array.shape}" for name, array in varied.items() if array.ndim)
            shapes = f"base_T_tool {targets.shape}, {shapes}"
            raise ValueError(f"{self.__name__}: the shapes of {shapes} do not fit together") from None

    def _starts(self, start: ArrayLike | None, lead: tuple[int, ...], real: np.dtype[Any]) -> Floats:
        """One start for each target, flat."""
        middle = [(joint.lowest + joint.highest) / 2 for joint in self.joints]
        starts = np.asarray(middle if start is None else start)
        if starts.dtype.kind not in "fiu":
            raise TypeError(f"{self.__name__}: start is of type {starts.dtype}, expected plain real numbers")
        if starts.shape[-1:] != (self.dof,):
            raise ValueError(f"{self.__name__}: start has shape {starts.shape}, expected (..., {self.dof})")
        try:
            wide = np.broadcast_to(starts, (*lead, self.dof))
        except ValueError:
            shape = (*lead, 4, 4)
            raise ValueError(f"{self.__name__}: start of shape {starts.shape} for targets {shape}") from None
        return np.array(wide, real, order="C").reshape(-1, self.dof)

    def _empty(self, lead: tuple[int, ...], real: np.dtype[Any]) -> NumericSolution:
        kinds = self._kinds(real)
        return NumericSolution(*(np.empty((*lead, *inner), kind) for inner, kind in kinds))

    def _kinds(self, real: np.dtype[Any]) -> tuple[tuple[tuple[int, ...], np.dtype[Any]], ...]:
        """Shape for one target, and type, of each result."""
        return ((self.dof,), real), ((), np.dtype(bool)), ((), real), ((), real), ((), np.dtype(np.int32))

    def _checked(
        self, out: Any, lead: tuple[int, ...], real: np.dtype[Any], given: Sequence[tuple[str, NDArray[Any]]]
    ) -> NumericSolution:
        """Arrays for the results, if they can hold them."""
        if not isinstance(out, tuple) or len(out) != len(NumericSolution._fields):
            raise TypeError(f"{self.__name__}: out must be a tuple of arrays for {', '.join(NumericSolution._fields)}")
        others = list(given)
        for field, array, (inner, kind) in zip(NumericSolution._fields, out, self._kinds(real), strict=True):
            label = f"out for {field}"
            if isinstance(array, np.ma.MaskedArray) or not isinstance(array, np.ndarray):
                raise TypeError(f"{self.__name__}: {label} is a {type(array).__name__}, expected a plain NumPy array")
            if array.shape != (*lead, *inner):
                raise ValueError(f"{self.__name__}: {label} has shape {array.shape}, expected {(*lead, *inner)}")
            if array.dtype != kind:
                raise TypeError(f"{self.__name__}: {label} is of type {array.dtype}, expected {kind}")
            if not array.flags.writeable:
                raise ValueError(f"{self.__name__}: {label} is read-only")
            check_apart(self.__name__, label, array, others)
            others.append((field, array))
        return NumericSolution(*out)

    def _search(self, whole: _Task, found: NumericSolution, single: bool, first: int, last: int) -> None:
        """Search for some of the targets."""
        task, part = whole.part(first, last), slice(first, last)
        if self._native is None and isinstance(task.params, np.ndarray) and last - first > 1:
            # Each target has a robot of its own.
            for each in range(first, last):
                self._search(whole, found, single, each, each + 1)
            return
        if self._native is None:
            own = self._params._make(task.params[0].tolist()) if isinstance(task.params, np.ndarray) else task.params
            evaluate = self.kernel if own is None else partial(self.kernel, params=own)
            search = Search(evaluate, self.joints, self.reach, task.targets, task.effort)
            search.run(task.starts, np.random.default_rng((task.effort.seed, first)))
            answer: tuple[Any, ...] = search.q, search.errors, search.iterations, search.solved
        else:
            answer = self._in_c(task, first, single)
        q, errors, iterations, solved = answer
        found.q[part], found.solved[part] = q, solved
        found.position_error[part], found.rotation_error[part] = errors.T
        found.iterations[part] = iterations

    def _in_c(self, task: _Task, first: int, alone: bool) -> tuple[Floats, Floats, Any, Any]:
        targets, starts, params, effort = task
        ffi, count = self._native.ffi, len(targets)
        single = targets.dtype == np.float32
        prefix, item = (f"{self._symbol}_f32", "float[]") if single else (self._symbol, "double[]")
        call = getattr(self._native.lib, f"{prefix}_{self.__name__}_many")
        if isinstance(params, np.ndarray):
            structs: tuple[Any, ...] = ffi.from_buffer(item, params), 1
        else:
            structs = () if params is None else (ffi.new(f"{prefix}_params *", list(params)), 0)
        real, whole = targets.dtype, np.dtype(np.int32)
        q, solved = np.empty((count, self.dof), real), np.empty(count, np.uint8)
        # The struct of the header: two errors, steps and descents.
        found = np.empty(count, [("errors", real, 2), ("iterations", whole), ("descents", whole)])
        call(
            *structs,
            ffi.from_buffer(item, targets),
            ffi.from_buffer(item, starts),
            count,
            first,
            alone,
            ffi.new(item, list(effort.tolerances)),
            effort.restarts,
            effort.seed,
            effort.budget,
            effort.steps,
            ffi.from_buffer(item, q, require_writable=True),
            ffi.from_buffer("unsigned char[]", found.view(np.uint8), require_writable=True),
            ffi.from_buffer("unsigned char[]", solved, require_writable=True),
        )
        return q, found["errors"], found["iterations"], solved


def _with_numbers(found: NumericSolution) -> NumericSolution:
    """The solution of one target has numbers in the place of arrays without axes."""
    others: list[Any] = [entry[()] for entry in found[1:]]
    return NumericSolution(found.q, *others)


def _blocks(count: int, block: int) -> Generator[tuple[int, int]]:
    for first in range(0, count, block):
        yield first, min(first + block, count)
