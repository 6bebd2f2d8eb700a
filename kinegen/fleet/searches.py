"""Outputs that search or solve, in the form of a kernel: the numeric inverse and the complete inverse.

They take poses of 16 numbers, refuse what is not a pose, and begin random descents by the number of a target in its
batch. Over data sets they take rows, and a row without a pose has no solution.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from types import ModuleType
from typing import Any

import numpy as np

from kinegen.errors import KinegenError
from kinegen.outputs import COMPLETE_INVERSE, NUMERIC_INVERSE, REDUNDANCY_RANGE, Quantity
from kinegen.robot.model import Robot

ROWS = 1 << 12
"""Rows of a batch where something searches: fixed, so that random starts do not depend on the memory of a run."""

TARGET, START = "base_T_tool", "start"


@dataclass(frozen=True, slots=True)
class Searching:
    """A search as a kernel.

    Attributes:
        inputs: What it takes for a row.
        results: What it gives for a row.
        optional: Inputs that may have no columns.
        solve: Targets (n, 4, 4), threads and further inputs by name to arrays of the results.
        kind: Sort of kernel.
    """

    inputs: tuple[Any, ...]
    results: tuple[Any, ...]
    optional: tuple[str, ...]
    solve: Callable[..., tuple[Any, ...]]
    kind: str = "search"

    def __call__(self, rows: dict[str, Any], threads: int) -> list[Any]:
        """Solve for rows of data.

        Args:
            rows: Arrays (numbers, n) by the name of the input; optional ones may be missing.
            threads: Threads that share the rows.

        Returns:
            Arrays (n, numbers), one for each result. Where the target is no pose, numbers are NaN and truth is false.
        """
        real, count = rows[TARGET].dtype, rows[TARGET].shape[1]
        targets = np.zeros((count, 4, 4), real)
        targets[:, :3] = rows[TARGET].T.reshape(count, 3, 4)
        targets[:, 3, 3] = 1
        wrong = ~np.isfinite(rows[TARGET]).all(axis=0)
        targets[wrong] = np.eye(4)
        others = {name: np.ascontiguousarray(array.T) for name, array in rows.items() if name != TARGET}
        found = []
        for array, result in zip(self.solve(targets, threads, **others), self.results, strict=True):
            values = array.reshape(count, -1)
            values[wrong] = False if result.is_truth else np.nan
            found.append(values if result.is_truth else values.astype(real, copy=False))
        return found


def require_one_target(robot: Robot, quantities: Iterable[Quantity]) -> None:
    """Refuse the numeric inverse of a tree, whose targets would take a column for each tip."""
    if robot.is_tree and NUMERIC_INVERSE in quantities:
        reason = f"numeric_inverse of {robot.name} takes a target for each of its {len(robot.tips)} tips"
        raise KinegenError(f"{reason}, which files of rows do not hold; call it in Python or C", robot.source)


def kernel_of(module: ModuleType, name: str) -> Any:
    """A kernel of a compiled robot by its name; a search in the form of one."""
    makers = {
        NUMERIC_INVERSE.function: _numeric,
        COMPLETE_INVERSE.function: _complete,
        REDUNDANCY_RANGE.function: _ranges,
    }
    return makers[name](getattr(module, name)) if name in makers else getattr(module, name)


def _numeric(search: Any) -> Searching:
    """The numeric inverse: joint values, whether they reach the target, and what is left."""
    (joints,), pose = search.kernel.inputs, search.kernel.results[0]
    alone = joints._replace(shape=())
    results = (
        joints,
        alone._replace(name="solved", is_truth=True),
        alone._replace(name="position_error"),
        alone._replace(name="rotation_error"),
    )

    def solve(targets: Any, threads: int, start: Any = None) -> tuple[Any, ...]:
        found = search(targets, start, threads=threads)
        return found.q, found.solved, found.position_error, found.rotation_error

    inputs = pose._replace(name=TARGET), joints._replace(name=START)
    return Searching(inputs, results, (START,), solve)


def _complete(inverse: Any) -> Searching:
    """The complete inverse: 16 joint vectors, and which of them are solutions."""
    (joints,), pose = inverse.kernel.inputs, inverse.kernel.results[0]
    results = (
        joints._replace(name="solutions", shape=(16, inverse.dof)),
        joints._replace(name="valid", shape=(16,), is_truth=True),
    )

    def solve(targets: Any, threads: int) -> tuple[Any, ...]:
        return tuple(inverse(targets, threads=threads))

    return Searching((pose._replace(name=TARGET),), results, (), solve)


def _ranges(ranges: Any) -> Searching:
    """The ranges of a redundancy: intervals of each branch, and how many there are."""
    (joints,), pose = ranges.kernel.inputs, ranges.kernel.results[0]
    results = (
        joints._replace(name="intervals", shape=(ranges.branches, ranges.most, 2)),
        joints._replace(name="counts", shape=(ranges.branches,)),
    )

    def solve(targets: Any, threads: int) -> tuple[Any, ...]:
        return tuple(ranges(targets, threads=threads))

    return Searching((pose._replace(name=TARGET),), results, (), solve)
