"""Which columns are the inputs of which kernels, and their numbers as arrays."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import ModuleType
from typing import Any

import numpy as np

from kinegen.errors import KinegenError, quote
from kinegen.fleet.searches import Searching, kernel_of
from kinegen.fleet.sources import PURPOSE
from kinegen.workspace.optional import library

JOINTS = "q"
"""The input that is bound to columns with the names of the joints."""


@dataclass(frozen=True, slots=True)
class Binding:
    """The columns of one input.

    Attributes:
        name: The input, such as `q`, `qd` or `base_T_tool`.
        columns: One column of vectors, or one column for each number.
        size: Numbers that the columns hold for a row: of a pose 12, or 16 with the last row.
        shape: What a kernel takes for a row; of a pose the upper three rows.
    """

    name: str
    columns: tuple[str, ...]
    size: int
    shape: tuple[int, ...]


def bind(
    module: ModuleType, kernels: Sequence[str], schema: Any, chosen: Mapping[str, tuple[str, ...]]
) -> tuple[Binding, ...]:
    """Find the columns of all inputs.

    Args:
        module: The compiled robot.
        kernels: Names of its kernels.
        schema: The columns that there are.
        chosen: Columns that the user named, by input.

    Returns:
        One binding for each input of the kernels, each input once; none for an optional one without columns.

    Raises:
        KinegenError: If a column is missing, is not of numbers, or there are too few or too many.
    """
    takers = [kernel_of(module, name) for name in kernels]
    inputs = {given.name: given for taker in takers for given in taker.inputs}
    optional = {name for taker in takers if isinstance(taker, Searching) for name in taker.optional}
    for name in chosen:
        if name not in inputs:
            raise KinegenError(f"--columns: there is no input {quote(name)} (there are {', '.join(inputs)})")
    found = []
    for name, given in inputs.items():
        if name in optional and name not in chosen and name not in schema.names:
            continue
        columns = chosen.get(name) or _usual(module, name, schema.names)
        size = sum(_numbers(column, schema) for column in columns)
        sizes = sorted({given.size, math.prod(given.shape)})
        if size not in sizes:
            raise KinegenError(
                f"{name}: the columns {', '.join(map(quote, columns))} hold {size} numbers; "
                f"{name} takes {' or '.join(map(str, sizes))}"
            )
        found.append(Binding(name, columns, size, given.laid_out("3x4")))
    return tuple(found)


def _usual(module: ModuleType, name: str, there: Sequence[str]) -> tuple[str, ...]:
    """The columns of an input where the user named none: those with the names of the joints, or one with its own."""
    joints: tuple[str, ...] = module.JOINTS
    if name == JOINTS and set(joints) <= set(there):
        return joints
    if name in there:
        return (name,)
    wanted = f"the joints {', '.join(map(quote, joints))} or {quote(name)}" if name == JOINTS else quote(name)
    option = "j1,j2,..." if name == JOINTS else f"{name}=c1,c2,..."
    raise KinegenError(
        f"there is no column for {name}: expected {wanted}, or --columns {option} "
        f"(there are {', '.join(map(quote, there)) or 'none'})"
    )


def _numbers(column: str, schema: Any) -> int:
    """Numbers of a row of a column."""
    types = library("pyarrow.types", PURPOSE, "fleet")
    places = schema.get_all_field_indices(column)
    if len(places) != 1:
        there = ", ".join(map(quote, schema.names)) or "none"
        problem = f"there are {len(places)} columns" if places else "there is no column"
        raise KinegenError(f"{problem} {quote(column)} (there are {there})")
    kind = schema.field(places[0]).type
    inner = kind.value_type if types.is_fixed_size_list(kind) else kind
    if types.is_list(kind) or types.is_large_list(kind):
        raise KinegenError(f"column {quote(column)} has lists of any length; expected lists of one fixed size")
    if not (types.is_floating(inner) or types.is_integer(inner)):
        raise KinegenError(f"column {quote(column)} is of type {kind}; expected numbers")
    return int(kind.list_size) if types.is_fixed_size_list(kind) else 1


def taken(batch: Any, binding: Binding, real: Any) -> tuple[Any, Any]:
    """The numbers of an input.

    Args:
        batch: Rows, a `pyarrow.RecordBatch`.
        binding: The input.
        real: Number type of NumPy.

    Returns:
        The numbers, an array (numbers, n), NaN where one is null; and which rows have a null, or None where none has.
    """
    numbers = np.empty((binding.size, batch.num_rows), real)
    nulls, place = None, 0
    for column in map(batch.column, binding.columns):
        rows, size = _rows(column)
        numbers[place : place + size] = rows.T
        place += size
        if column.null_count or (size > 1 and column.flatten().null_count):
            missing = np.isnan(rows).any(axis=1) & _null_rows(column, size)
            nulls = missing if nulls is None else nulls | missing
    return numbers[: math.prod(binding.shape)], nulls


def _rows(column: Any) -> tuple[Any, int]:
    """A column as an array (n, numbers of a row), with NaN for null."""
    size = getattr(column.type, "list_size", 1)
    if size == 1 and not hasattr(column.type, "list_size"):
        return column.to_numpy(zero_copy_only=False).reshape(-1, 1), 1
    if not column.null_count:
        return column.flatten().to_numpy(zero_copy_only=False).reshape(-1, size), size
    rows = np.full((len(column), size), np.nan)
    rows[column.is_valid().to_numpy(zero_copy_only=False)] = (
        column.drop_null().flatten().to_numpy(zero_copy_only=False).reshape(-1, size)
    )
    return rows, size


def _null_rows(column: Any, size: int) -> Any:
    """Which rows are null, or hold a null."""
    missing = column.is_null().to_numpy(zero_copy_only=False)
    if size > 1:
        inner = np.zeros((len(column), size), bool)
        inner[~missing] = column.drop_null().flatten().is_null().to_numpy(zero_copy_only=False).reshape(-1, size)
        missing = missing | inner.any(axis=1)
    return missing
