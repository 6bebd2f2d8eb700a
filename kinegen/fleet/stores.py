"""Zarr stores: folders that hold arrays, of which rows are read and written chunk by chunk."""

from __future__ import annotations

import shutil
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from kinegen.errors import KinegenError, quote
from kinegen.workspace.optional import library

SUFFIX = ".zarr"
"""The ending of a store's name."""

_PURPOSE = "a Zarr store"
_CHUNK = 1 << 16
"""Rows of a chunk."""


def arrays_of(path: str, alone: str) -> dict[str, Any]:
    """The arrays of a store that have rows, not yet read.

    Args:
        path: The store.
        alone: What an array is called that is the whole store.

    Returns:
        Arrays by name, in the order of their names; they have the same number of rows.

    Raises:
        ValueError: If they have not, or hold anything but numbers and truth values.
    """
    opened = library("zarr", _PURPOSE, "fleet").open(path, mode="r")
    found = {alone: opened} if hasattr(opened, "shape") else dict(sorted(opened.arrays()))
    rows = {name: array for name, array in found.items() if array.ndim}
    if len({array.shape[0] for array in rows.values()}) != 1:
        raise ValueError("its arrays do not have the same number of rows")
    for name, array in rows.items():
        if array.dtype.kind not in "fiub":
            raise ValueError(f"array {quote(name)} is of type {array.dtype}, not of numbers")
    return rows


def rows_of(path: str, alone: str, columns: Iterable[str], first: int, end: int) -> dict[str, Any]:
    """Rows of some arrays, as arrays of NumPy."""
    found = arrays_of(path, alone)
    return {name: np.asarray(found[name][first:end]) for name in columns}


def extent(path: Path) -> tuple[int, int]:
    """Bytes of all files of a store, and when the last of them was changed, in nanoseconds."""
    status = [each.stat() for each in path.rglob("*") if each.is_file()]
    return sum(each.st_size for each in status), max((each.st_mtime_ns for each in status), default=0)


def remove(path: Path) -> None:
    """Remove a file or a store, if it is there."""
    if path.is_dir():
        shutil.rmtree(path, ignore_errors=True)
    else:
        path.unlink(missing_ok=True)


class StoreWriter:
    """Takes rows and appends them to the arrays of a new store.

    Args:
        path: The store.
        schema: The columns, a `pyarrow.Schema`.
        compression: `none` or `zstd`.

    Raises:
        KinegenError: If a column does not hold numbers.
    """

    def __init__(self, path: str, schema: Any, compression: str) -> None:
        zarr, types = library("zarr", _PURPOSE, "fleet"), library("pyarrow.types", _PURPOSE, "fleet")
        codecs = [zarr.codecs.ZstdCodec()] if compression == "zstd" else None
        self._arrays: dict[str, Any] = {}
        group = zarr.open_group(path, mode="w", zarr_format=3)
        group.attrs["kinegen"] = (schema.metadata or {}).get(b"kinegen", b"").decode()
        for field in schema:
            inner = getattr(field.type, "value_type", field.type)
            if not (types.is_floating(inner) or types.is_integer(inner) or types.is_boolean(inner)):
                name = quote(field.name)
                raise KinegenError(f"column {name} is of type {field.type}; Zarr takes numbers, so --drop it")
            size = getattr(field.type, "list_size", None)
            more = () if size is None else (size,)
            self._arrays[field.name] = group.create_array(
                field.name,
                shape=(0, *more),
                chunks=(_CHUNK, *more),
                dtype=np.dtype(inner.to_pandas_dtype()),
                compressors=codecs,
            )

    def append(self, columns: Iterator[tuple[str, Any]]) -> None:
        """Take rows: a name and an array for each column."""
        for name, rows in columns:
            self._arrays[name].append(rows)
