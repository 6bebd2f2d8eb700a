"""The results of kernels as columns with names, units and nulls."""

from __future__ import annotations

import itertools
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import ModuleType
from typing import Any

import numpy as np

from kinegen.errors import KinegenError, quote
from kinegen.fleet.searches import TARGET, Searching, kernel_of
from kinegen.fleet.sources import PURPOSE
from kinegen.workspace.optional import library


@dataclass(frozen=True, slots=True)
class Column:
    """One result of a kernel.

    Attributes:
        kernel: Name of the kernel.
        name: Name of the column, and the beginning of the names of flat columns.
        shape: Numbers for a row; of a pose the upper three rows.
        is_truth: Whether they are truth values.
        is_flat: Whether each number is a column.
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
    """The columns that kernels give.

    Args:
        module: The compiled robot.
        kernels: Names of its kernels by the output that was asked for.
        is_flat: Whether each number is to be a column.

    Returns:
        A column for each result: the output's name, and that of the result behind it where there are several.
    """
    found = []
    for word, kernel in kernels.items():
        results = kernel_of(module, kernel).results
        for each in results:
            name = word if len(results) == 1 else f"{word}_{each.name}"
            found.append(Column(kernel, name, each.laid_out("3x4"), each.is_truth, is_flat))
    return tuple(found)


def check_names(columns: Sequence[Column], passed: Sequence[str]) -> None:
    """Refuse results whose columns would have the name of a column that passes through.

    Raises:
        KinegenError: If there is one.
    """
    for name in (name for column in columns for name in column.names):
        if name in passed:
            raise KinegenError(f"the data has a column {quote(name)} already; leave it out with --drop {name}")


def schema_of(columns: Sequence[Column], passed: Sequence[Any], real: Any, about: Mapping[str, Any]) -> Any:
    """The columns of the output, a `pyarrow.Schema`.

    Args:
        columns: The results.
        passed: The fields that pass through.
        real: Number type of the results.
        about: What the metadata `kinegen` says, as JSON.
    """
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
    """Evaluate kernels.

    Args:
        module: The compiled robot.
        columns: The results, those of a kernel side by side.
        inputs: Arrays (numbers, n) by the name of the input.
        nulls: Which rows are null, or None.
        threads: Threads of a kernel.

    Returns:
        Arrays of pyarrow, in the order of the columns' names; null where a row is.
    """
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
    """The results of a kernel, each an array (numbers, n) where it is flat and (n, numbers) elsewhere."""
    options: dict[str, Any] = {}
    rows = list(inputs.values())
    if kernel.kind == "inverse":
        rows, options = [_targets(rows[0]), *rows[1:]], {"check": False}
    if columns[0].is_flat:
        results = kernel(*rows, threads=threads, layout="joint_major", **options)
    else:
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
    """The same of a search."""
    arrays = search(inputs | {TARGET: _targets(inputs[TARGET])}, threads)
    return [(column, array.T if column.is_flat else array) for column, array in zip(columns, arrays, strict=True)]


def _whole(rows: Any, is_pose: bool) -> Any:
    """Poses with their last row, 0 0 0 1; other inputs as they are."""
    if not is_pose:
        return rows
    last = np.zeros((4, rows.shape[1]), rows.dtype)
    last[3] = 1
    return np.concatenate([rows, last])


def _targets(rows: Any) -> Any:
    """Poses (12, n), with NaN in those whose columns are not those of a rotation: they have no solution."""
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
