"""Gives the results of kernels and solvers as columns with names, units and nulls.

Solvers take poses of 16 numbers, refuse what is not a pose, and begin random descents by the number of a target in its
batch. Over data sets they take rows, and a row without a pose has no solution.
"""

from __future__ import annotations

import itertools
import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from types import ModuleType
from typing import Any

import numpy as np

from kinegen.errors import KinegenError, quote
from kinegen.model.outputs import COMPLETE_INVERSE, NUMERIC_INVERSE, REDUNDANCY_RANGE, Quantity
from kinegen.model.robot import Robot
from kinegen.support.compat import library
from kinegen.support.dataclass import dataclass
from kinegen.tools.datasets.csv_text import PURPOSE

ROWS = 1 << 12
"""Rows of a batch where something searches: fixed, so that random starts do not depend on the memory of a run."""

TARGET, START = "base_T_tool", "start"


@dataclass(frozen=True, slots=True)
class Searching:
    """A search as a kernel, which solves for targets (n, 4, 4); optional inputs may have no columns."""

    inputs: tuple[Any, ...]
    results: tuple[Any, ...]
    optional: tuple[str, ...]
    solve: Callable[..., tuple[Any, ...]]
    kind: str = "search"

    def __call__(self, rows: dict[str, Any], threads: int) -> list[Any]:
        """Solve for rows of data, arrays (numbers, n) by the name of the input.

        Returns an array (n, numbers) for each result. Where the target is no pose, numbers are NaN and truth is false.
        """
        real, count = rows[TARGET].dtype, rows[TARGET].shape[1]
        targets = np.zeros((count, 4, 4), real)
        targets[:, :3] = rows[TARGET].T.reshape(count, 3, 4)
        targets[:, 3, 3] = 1
        # A row without a pose gets one, so that the others keep their places, on which random descents depend.
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
    """Return a kernel of a compiled robot by its name; a search in the form of one."""
    makers = {
        NUMERIC_INVERSE.function: _numeric,
        COMPLETE_INVERSE.function: _complete,
        REDUNDANCY_RANGE.function: _ranges,
    }
    return makers[name](getattr(module, name)) if name in makers else getattr(module, name)


def _numeric(search: Any) -> Searching:
    """Return the numeric inverse: joint values, whether they reach the target, and what is left."""
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
    """Return the complete inverse: 16 joint vectors, and which of them are solutions."""
    return _of_targets(inverse, solutions=(16, inverse.dof), valid=(16,))


def _ranges(ranges: Any) -> Searching:
    """Return the ranges of a redundancy: intervals of each branch, and how many there are."""
    return _of_targets(ranges, intervals=(ranges.branches, ranges.most, 2), counts=(ranges.branches,))


def _of_targets(solver: Any, **shapes: tuple[int, ...]) -> Searching:
    """Return a solver that takes targets alone; its results have these names and shapes."""
    (joints,), pose = solver.kernel.inputs, solver.kernel.results[0]
    results = (joints._replace(name=name, shape=shape, is_truth=name == "valid") for name, shape in shapes.items())

    def solve(targets: Any, threads: int) -> tuple[Any, ...]:
        return tuple(solver(targets, threads=threads))

    return Searching((pose._replace(name=TARGET),), tuple(results), (), solve)


@dataclass(frozen=True, slots=True)
class Column:
    """One result of a kernel; a flat one has a column for each number.

    Attributes:
        name: Name of the column, and the beginning of the names of flat columns.
        shape: Numbers for a row; of a pose the upper three rows.
    """

    kernel: str
    name: str
    shape: tuple[int, ...]
    is_truth: bool
    is_flat: bool

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the columns in the file; those of flat ones end in the number's place, as in `pose_0_3`."""
        if not self.is_flat or not self.shape:
            return (self.name,)
        places = itertools.product(*map(range, self.shape))
        return tuple("_".join(map(str, (self.name, *place))) for place in places)


def columns_of(module: ModuleType, kernels: Mapping[str, str], *, is_flat: bool) -> tuple[Column, ...]:
    """Return a column for each result of kernels, named after the output and, of several, after the result."""
    found = []
    for word, kernel in kernels.items():
        results = kernel_of(module, kernel).results
        for each in results:
            name = word if len(results) == 1 else f"{word}_{each.name}"
            found.append(Column(kernel, name, each.laid_out("3x4"), each.is_truth, is_flat))
    return tuple(found)


def check_names(columns: Sequence[Column], passed: Sequence[str]) -> None:
    """Refuse results whose columns would have the name of a column that passes through."""
    for name in (name for column in columns for name in column.names):
        if name in passed:
            raise KinegenError(f"the data has a column {quote(name)} already; leave it out with --drop {name}")


def schema_of(columns: Sequence[Column], passed: Sequence[Any], real: Any, about: Mapping[str, Any]) -> Any:
    """Return the columns of the output, a `pyarrow.Schema`, with the metadata `kinegen` as JSON."""
    pyarrow = library("pyarrow", PURPOSE, "fleet")
    fields = [field.remove_metadata() for field in passed]
    for column in columns:
        inner = pyarrow.bool_() if column.is_truth else pyarrow.from_numpy_dtype(real)
        size = int(np.prod(column.shape, dtype=int))
        kind = inner if column.is_flat or not column.shape else pyarrow.list_(inner, size)
        note = {"kernel": column.kernel, "shape": json.dumps(column.shape)}
        fields += [pyarrow.field(name, kind, metadata=note) for name in column.names]
    return pyarrow.schema(fields, metadata={"kinegen": json.dumps(about, sort_keys=True)})


def computed(
    module: ModuleType, columns: Sequence[Column], inputs: Mapping[str, Any], nulls: Any, threads: int
) -> list[Any]:
    """Evaluate kernels for inputs (numbers, n) into arrays of pyarrow, in the order of columns; null where a row is."""
    found: list[Any] = []
    for name, group in itertools.groupby(columns, lambda column: column.kernel):
        kernel = kernel_of(module, name)
        rows = {each.name: inputs[each.name] for each in kernel.inputs if each.name in inputs}
        called = _searched if isinstance(kernel, Searching) else _called
        arrays = called(kernel, rows, threads, [*group])
        for column, array in arrays:
            found += _columns(column, array, nulls)
    return found


def _called(kernel: Any, inputs: dict[str, Any], threads: int, columns: list[Column]) -> list[tuple[Column, Any]]:
    """Return the results of a kernel, each an array (numbers, n) where it is flat and (n, numbers) elsewhere."""
    options: dict[str, Any] = {}
    rows = list(inputs.values())
    # Targets that are no pose become NaN, which have no solution, instead of an error for the whole batch.
    if kernel.kind == "inverse":
        rows, options = [_targets(rows[0]), *rows[1:]], {"check": False}
    # Flat columns are the rows of the joint-major form, which needs no transposition.
    if columns[0].is_flat:
        results = kernel(*rows, threads=threads, layout="joint_major", **options)
    else:
        # The last row of a pose is not stored, but kernels of the large form take it.
        layout = "3x4" if any(each.is_pose for each in kernel.results) else "4x4"
        shapes = [(-1, *each.laid_out(layout)) for each in kernel.inputs]
        is_whole = [each.is_pose and layout == "4x4" for each in kernel.inputs]
        given = map(_whole, rows, is_whole)
        arrays = [array.T.reshape(shape) for array, shape in zip(given, shapes, strict=True)]
        results = kernel(*arrays, threads=threads, layout=layout, **options)
    results = results if len(columns) > 1 else (results,)
    if not columns[0].is_flat:
        results = [array.reshape(len(array), -1) for array in results]
    return list(zip(columns, results, strict=True))


def _searched(
    search: Searching, inputs: dict[str, Any], threads: int, columns: list[Column]
) -> list[tuple[Column, Any]]:
    """Return the same of a search."""
    arrays = search(inputs | {TARGET: _targets(inputs[TARGET])}, threads)
    return [(column, array.T if column.is_flat else array) for column, array in zip(columns, arrays, strict=True)]


def _whole(rows: Any, is_pose: bool) -> Any:
    """Return poses with their last row, 0 0 0 1; other inputs as they are."""
    if not is_pose:
        return rows
    last = np.zeros((4, rows.shape[1]), rows.dtype)
    last[3] = 1
    return np.concatenate([rows, last])


def _targets(rows: Any) -> Any:
    """Return poses (12, n), with NaN in those whose columns are not those of a rotation: they have no solution."""
    allowed = 1e-4 if rows.dtype == np.float32 else 1e-6
    with np.errstate(all="ignore"):
        x, y, z = (rows[[axis, 4 + axis, 8 + axis]] for axis in range(3))
        unit = [abs((each * each).sum(axis=0) - 1) <= allowed for each in (x, y, z)]
        across = [abs((one * other).sum(axis=0)) <= allowed for one, other in ((x, y), (y, z), (z, x))]
        is_right = (np.cross(x, y, axis=0) * z).sum(axis=0) > 0
    wrong = ~np.logical_and.reduce([*unit, *across, is_right])
    return np.where(wrong, np.nan, rows).astype(rows.dtype, copy=False) if wrong.any() else rows


def _columns(column: Column, array: Any, nulls: Any) -> list[Any]:
    pyarrow = library("pyarrow", PURPOSE, "fleet")
    if column.is_flat or not column.shape:
        rows = array if column.is_flat else array.T
        return [pyarrow.array(np.ascontiguousarray(row), mask=nulls) for row in rows]
    mask = None if nulls is None else pyarrow.array(nulls)
    values = pyarrow.array(np.ascontiguousarray(array).reshape(-1))
    return [pyarrow.FixedSizeListArray.from_arrays(values, array.shape[1], mask=mask)]
