"""The ranges of a redundancy, and the nearest solution over all of it, for batches of targets. It needs NumPy alone."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._inverse import Inverse
from ._kernel import Kernel
from ._range_search import Axes, Limits, on_circle, on_line
from ._targets import checked_targets, joint_vector_asked
from ._threads import spread, workers_for

Floats = NDArray[np.floating[Any]]
Truths = NDArray[np.bool_]

_BLOCK = 1 << 5  # targets that are looked at together; Ctrl-C gets through in between


class Ranges(NamedTuple):
    """Intervals of the redundancy; the leading axes are those of the targets.

    Attributes:
        intervals: Lower and upper ends (..., branches, most, 2) in rising order; NaN where there are no more.
        counts: How many there are of each branch (..., branches).
    """

    intervals: Floats
    counts: NDArray[np.int32]


class RangedInverse(Inverse):
    """The inverse of an arm with a redundancy, which `nearest=` chooses where it is not given."""

    kind = "inverse"

    ranges: RedundancyRange | None = None
    """What knows the ranges."""

    def __call__(self, *inputs: Any, **named: Any) -> tuple[Any, Any]:
        """Solve as every inverse; with `nearest` and without a redundancy choose that too.

        Args:
            inputs: The target (..., 4, 4), and the redundancy (...).
            named: The same by name, and options as for an inverse.

        Returns:
            As for an inverse.
        """
        if "q0" in named:
            named["nearest"] = joint_vector_asked(self.__name__, "nearest", named.get("nearest"), named.pop("q0"))
        given = [*inputs, *(named[each.name] for each in self.inputs[len(inputs) :] if each.name in named)]
        is_free = len(given) < len(self.inputs) or given[-1] is None
        if self.ranges is None or named.get("nearest") is None or not given or not is_free:
            return super().__call__(*inputs, **named)
        known = (*(each.name for each in self.inputs), "nearest", "threads", "check")
        for name in named:
            if name not in known:
                raise TypeError(f"{self.__name__}: {name} cannot be combined with nearest without a redundancy")
        options = {name: named[name] for name in ("threads", "check") if name in named}
        return self.ranges.nearest(given[0], named["nearest"], **options)


class RedundancyRange:
    """The ranges of the redundancy of a robot; its `backend` is "c" or "numpy".

    Args:
        name: Name of this object in its module.
        module: Name of that module.
        symbol: Prefix of the C functions.
        inverse: The inverse, which gets to know this.
        kernel: The pose with its Jacobian.
        limits: What the search needs, for float64 and for float32: fields of `Limits`.
        parts: Equal parts of the range of a joint.
        budget: Halvings at most.
        most: Intervals of a branch at most.
        samples: Values in an interval that are tried for the nearest solution.
        steps: Steps of a golden section.
        golden: The part of a golden section.
        beside: How far beside the value of a joint vector itself is looked, in part of the range.
        native: What `load_native` gave.
        doc: Text for `help()`.
    """

    def __init__(
        self,
        name: str,
        *,
        module: str,
        symbol: str,
        inverse: RangedInverse,
        kernel: Kernel[Any],
        limits: tuple[tuple[Any, ...], tuple[Any, ...]],
        parts: int,
        budget: int,
        most: int,
        samples: int,
        steps: int,
        golden: float,
        beside: float,
        native: Any = None,
        doc: str = "",
    ) -> None:
        self.__name__, self.__module__ = name, module
        self.__doc__ = f"{name}(base_T_tool, *, threads=1, check=True)\n\n{doc}"
        self.backend = "numpy" if native is None else "c"
        self.inverse, self.kernel, self.most = inverse, kernel, most
        self.branches, self.dof = inverse.results[0].shape
        self._search, self._choice = (parts, budget), (samples, steps, golden, beside)
        self._native, self._symbol = native, symbol
        self._limits = {np.dtype(kind): _limits(each, kind) for kind, each in zip(("float64", "float32"), limits)}
        inverse.ranges = self

    def __call__(self, base_T_tool: ArrayLike, *, threads: int = 1, check: bool = True) -> Ranges:
        """Find the intervals of the redundancy for one pose or a batch.

        Args:
            base_T_tool: Targets (..., 4, 4).
            threads: Number of threads that share a batch; 0 for all cores.
            check: Whether to see that targets are poses.

        Returns:
            The intervals (..., branches, most, 2), and how many there are (..., branches).

        Raises:
            ValueError: If a target is not a pose.
            TypeError: If targets are not real numbers.
        """
        flat, lead = self._targets(base_T_tool, check)
        intervals = np.zeros((len(flat), self.branches, self.most, 2), flat.dtype)
        counts = np.zeros((len(flat), self.branches), np.uint8)

        def work(first: int, last: int) -> None:
            part = slice(first, last)
            if self._native is None:
                for row in range(first, last):
                    self._in_numpy(flat[row], intervals[row], counts[row])
            else:
                self._in_c(self.__name__, flat[part], intervals[part], counts[part])

        spread(work, _blocks(len(flat)), workers_for(threads))
        intervals[np.arange(self.most) >= counts[..., None]] = np.nan
        shape = (*lead, self.branches, self.most, 2)
        return Ranges(intervals.reshape(shape), counts.astype(np.int32).reshape(*lead, self.branches))

    def nearest(
        self, base_T_tool: ArrayLike, q0: ArrayLike, *, threads: int = 1, check: bool = True
    ) -> tuple[Floats, Truths]:
        """Of the solutions for all values of the redundancy the nearest ones to joint vectors.

        Args:
            base_T_tool: Targets (..., 4, 4).
            q0: A joint vector, or one for each target.
            threads: Number of threads that share a batch; 0 for all cores.
            check: Whether to see that targets are poses.

        Returns:
            Joint vectors (..., dof), NaN where there is none, and whether there is one (...).

        Raises:
            ValueError: If a target is not a pose, or a shape is wrong.
        """
        flat, lead = self._targets(base_T_tool, check)
        wanted = np.ascontiguousarray(self.inverse._wanted(q0, lead, flat.dtype)).reshape(-1, self.dof)  # noqa: SLF001
        q, exists = np.zeros((len(flat), self.dof), flat.dtype), np.zeros(len(flat), np.uint8)

        def work(first: int, last: int) -> None:
            part = slice(first, last)
            if self._native is None:
                for row in range(first, last):
                    q[row], exists[row] = self._nearest_in_numpy(flat[row], wanted[row])
            else:
                self._in_c(f"{self.inverse.__name__}_nearest_any", flat[part], wanted[part], q[part], exists[part])

        spread(work, _blocks(len(flat)), workers_for(threads))
        return q.reshape(*lead, self.dof), exists.astype(bool).reshape(lead)[()]

    def __reduce__(self) -> str:
        return self.__name__  # pickled by reference, as functions are

    def __repr__(self) -> str:
        shape = f"({self.branches}, {self.most}, 2)"
        return f"<{self.__module__}.{self.__name__}: base_T_tool (4, 4) to {shape}, backend {self.backend}>"

    def _targets(self, base_T_tool: ArrayLike, check: bool) -> tuple[Floats, tuple[int, ...]]:
        """Targets one behind the other in a type that there is, and their leading axes."""
        targets = checked_targets(self.__name__, base_T_tool) if check else np.asarray(base_T_tool)
        reals = [np.dtype(each) for each in self.inverse._reals]  # noqa: SLF001 - of this package
        kind = targets.dtype if targets.dtype in reals else reals[0]
        return np.ascontiguousarray(targets, dtype=kind).reshape(-1, 4, 4), targets.shape[:-2]

    def _in_c(self, name: str, targets: Floats, *others: Any) -> None:
        single = targets.dtype.itemsize == 4
        stem, real = (f"{self._symbol}_f32", "float[]") if single else (self._symbol, "double[]")
        types = ["unsigned char[]" if each.dtype == np.uint8 else real for each in others]
        ffi = self._native.ffi
        given = [ffi.from_buffer(real, targets)]
        found = [ffi.from_buffer(each, array) for each, array in zip(types, others)]
        split = -1 if len(others) > 2 else 0  # the joint vectors come before the number of targets
        call = getattr(self._native.lib, f"{stem}_{name}_many")
        call(*given, *(found[:1] if split else []), len(targets), *(found[1:] if split else found))

    def _in_numpy(self, target: Floats, intervals: Floats, counts: NDArray[np.uint8]) -> None:
        if not np.isfinite(target).all():
            return
        limits = self._limits[target.dtype]

        def solve(at: Floats) -> tuple[Floats, Truths]:
            return self.inverse(np.broadcast_to(target, (len(at), 4, 4)), at, check=False)

        if limits.given < 0:
            stretches = [*on_circle(solve, self.kernel, limits)]
        else:
            stretches = [on_line(solve, self.kernel, target, limits, *self._search)]
        for branches, low, high, valid in stretches:
            steps = np.diff(valid.astype(int), axis=0, prepend=0, append=0)
            for branch, changes in zip(range(self.branches)[branches], steps.T):
                starts, ends = low[np.flatnonzero(changes == 1)], high[np.flatnonzero(changes == -1) - 1]
                is_apart = starts[1:] - ends[:-1] >= starts.dtype.type(limits.gap)
                first, last = (np.append(*each)[: len(starts)] for each in ((True, is_apart), (is_apart, True)))
                found = np.stack([starts[first], ends[last]], axis=1)
                counts[branch] = min(len(found), self.most)
                intervals[branch, : counts[branch]] = found[: self.most]

    def _nearest_in_numpy(self, target: Floats, q0: Floats) -> tuple[Floats, bool]:
        samples, steps, golden, beside = self._choice
        limits, kind = self._limits[target.dtype], target.dtype
        intervals = np.zeros((self.branches, self.most, 2), kind)
        counts = np.zeros(self.branches, np.uint8)
        self._in_numpy(target, intervals, counts)

        def consider(at: Floats) -> tuple[Floats, Floats]:
            shape = (*at.shape, 4, 4)
            q, exists = self.inverse(np.broadcast_to(target, shape), at.astype(kind), nearest=q0, check=False)
            return q, np.where(exists, ((q - q0) ** 2).sum(axis=-1), np.finfo(kind).max)

        own, (start, end) = self._own(q0, limits), limits.ends
        if not counts.any():
            alone, far = consider(np.array([own], kind))
            return alone[0], bool(far[0] < np.finfo(kind).max)
        low, high = intervals[np.arange(self.most) < counts[:, None]].T
        at = np.linspace(low, high, samples, axis=1)
        rows, places = _lowest(consider(at)[1])
        width = beside * (end - start) if start <= own <= end else 0.0
        below = np.append(at[rows, np.maximum(places - 1, 0)], min(max(own - width, start), own))
        above = np.append(at[rows, np.minimum(places + 1, samples - 1)], max(min(own + width, end), own))
        best = np.append(at[rows, places], own)
        q, distance = consider(best)
        for _ in range(steps):
            up, down = above - best, best - below
            probe = best + golden * np.where(up > down, up, -down)
            other, far = consider(probe)
            nearer, upwards = far < distance, up > down
            below, above = (
                np.where(nearer & upwards, best, np.where(~nearer & ~upwards, probe, below)),
                np.where(nearer & ~upwards, best, np.where(~nearer & upwards, probe, above)),
            )
            best, distance = np.where(nearer, probe, best), np.where(nearer, far, distance)
            q = np.where(nearer[:, None], other, q)
        row = int(distance.argmin())
        return q[row], bool(distance[row] < np.finfo(kind).max)

    def _own(self, q0: Floats, limits: Limits) -> float:
        """The redundancy of a joint vector."""
        if not np.isfinite(q0).all():
            return 0.0
        return float(q0[limits.given]) if limits.given >= 0 else Axes(self.kernel, q0, limits.shortest).angle()


def _lowest(distances: Floats) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Rows and columns of the values that are nearer than their neighbours in the row."""
    largest = np.finfo(distances.dtype).max
    wide = np.pad(distances, ((0, 0), (1, 1)), constant_values=largest)
    rows, places = np.nonzero((distances < largest) & (distances <= wide[:, :-2]) & (distances < wide[:, 2:]))
    return rows, places


def _limits(fields: tuple[Any, ...], kind: str) -> Limits:
    """The numbers of a search as arrays of a type."""
    largest = float(np.finfo(kind).max)
    bounds, turns, sweeps, *others = fields
    low, high = np.array([each or (-largest, largest) for each in bounds], kind).T
    return Limits(low, high, np.array(turns, kind), np.array(sweeps, kind), *others)


def _blocks(count: int) -> Generator[tuple[int, int]]:
    for first in range(0, count, _BLOCK):
        yield first, min(first + _BLOCK, count)
