"""All joint vectors for poses of arms with six revolute joints, for batches of targets. It needs NumPy alone."""

from __future__ import annotations

import math
from collections.abc import Generator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._elimination import Bounds, Elimination, Solver
from ._kernel import Kernel
from ._targets import checked_targets
from ._threads import spread, workers_for

Floats = NDArray[np.floating[Any]]

_MOST = 16
_BLOCK = 1 << 8  # targets that are solved at once; Ctrl-C gets through in between
_ROOM = 1e-9


class CompleteSolutions(NamedTuple):
    """All solutions for each target; the leading axes are those of the targets.

    Attributes:
        solutions: Joint vectors (..., 16, dof), in no particular order; rows that are not valid are 0.
        valid: Which rows are solutions (..., 16); they come first.
    """

    solutions: NDArray[np.float64]
    valid: NDArray[np.bool_]


class CompleteInverse:
    """The complete inverse of a robot; its `backend` is "c" or "numpy".

    Args:
        name: Name of this object in its module.
        module: Name of that module.
        symbol: Prefix of the C functions.
        kernel: The pose with its Jacobian.
        limits: Both limits of each joint; None for one without.
        tables: The constants of the eliminations.
        bounds: The tolerances of a solution.
        native: What `load_native` gave.
        doc: Text for `help()`.
    """

    def __init__(
        self,
        name: str,
        *,
        module: str,
        symbol: str,
        kernel: Kernel[Any],
        limits: tuple[tuple[float, float] | None, ...],
        tables: tuple[Elimination, ...],
        bounds: Bounds,
        native: Any = None,
        doc: str = "",
    ) -> None:
        self.__name__, self.__module__ = name, module
        self.__doc__ = f"{name}(base_T_tool, *, threads=1)\n\n{doc}"
        self.dof, self.backend = kernel.dof, "numpy" if native is None else "c"
        self.kernel, self.limits, self.tables, self.bounds = kernel, limits, tables, bounds
        self._native, self._symbol = native, symbol

    def __call__(self, base_T_tool: ArrayLike, *, threads: int = 1) -> CompleteSolutions:
        """Find all joint vectors for one pose or a batch.

        Args:
            base_T_tool: Targets (..., 4, 4); they are computed with as float64.
            threads: Number of threads that share a batch; 0 for all cores.

        Returns:
            The solutions (..., 16, dof), and which of them are valid (..., 16).

        Raises:
            ValueError: If a target is not a pose.
            TypeError: If targets are not real numbers.
        """
        targets = checked_targets(self.__name__, base_T_tool)
        lead, count = targets.shape[:-2], math.prod(targets.shape[:-2])
        flat = np.ascontiguousarray(targets, dtype=np.float64).reshape(count, 4, 4)
        solutions = np.zeros((count, _MOST, self.dof))
        counts = np.zeros(count, np.int32)

        def work(first: int, last: int) -> None:
            part = slice(first, last)
            if self._native is None:
                self._in_numpy(flat[part], solutions[part], counts[part])
            else:
                self._in_c(flat[part], solutions[part], counts[part])

        spread(work, _blocks(count), workers_for(threads))
        valid = np.arange(_MOST) < counts[:, None]
        return CompleteSolutions(solutions.reshape(*lead, _MOST, self.dof), valid.reshape(*lead, _MOST))

    def __reduce__(self) -> str:
        return self.__name__  # pickled by reference, as functions are

    def __repr__(self) -> str:
        return (
            f"<{self.__module__}.{self.__name__}: base_T_tool (4, 4) to ({_MOST}, {self.dof}), backend {self.backend}>"
        )

    def _in_c(self, targets: Floats, solutions: Floats, counts: NDArray[np.int32]) -> None:
        ffi = self._native.ffi
        call = getattr(self._native.lib, f"{self._symbol}_{self.__name__}_many")
        given, found = ffi.from_buffer("double[]", targets), ffi.from_buffer("double[]", solutions)
        call(given, len(targets), found, ffi.from_buffer("int32_t[]", counts))

    def _in_numpy(self, targets: Floats, solutions: Floats, counts: NDArray[np.int32]) -> None:
        rigid = np.flatnonzero(_are_poses(targets))
        solver = Solver(self.kernel, self.tables, self.bounds)
        for row, found in zip(rigid, solver.solve(np.array(targets[rigid], np.float64)), strict=True):
            kept = [q for q in map(self._within, found) if q is not None]
            counts[row] = len(kept)
            if kept:
                solutions[row, : len(kept)] = kept

    def _within(self, q: Floats) -> Floats | None:
        """A joint vector within the limits, whole turns aside; None if there is none."""
        found = np.empty_like(q)
        for index, ends in enumerate(self.limits):
            low, high = ends or (-math.pi, math.pi)
            centre = (low + high) / 2 if ends else 0.0
            turned = math.pi - (math.pi - (q[index] - centre)) % (2 * math.pi)
            found[index] = centre + turned
            if ends and not low - _ROOM <= found[index] <= high + _ROOM:
                return None
        return found


def _blocks(count: int) -> Generator[tuple[int, int]]:
    for first in range(0, count, _BLOCK):
        yield first, min(first + _BLOCK, count)


def _are_poses(targets: Floats) -> NDArray[np.bool_]:
    """Which matrices are finite, with orthonormal and right-handed columns of the rotation, as the C files see it."""
    with np.errstate(all="ignore"):
        x, y, z, place = (targets[:, :3, column] for column in range(4))
        off = np.stack([(x * x).sum(axis=1) - 1, (y * y).sum(axis=1) - 1, (x * y).sum(axis=1)], axis=1)
        square = (off**2).sum(axis=1) + ((z - np.cross(x, y)) ** 2).sum(axis=1)
        found: NDArray[np.bool_] = (square < 9e-12) & ((place**2).sum(axis=1) < 1e15)
    return found
