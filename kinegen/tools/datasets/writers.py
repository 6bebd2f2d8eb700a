"""Takes the batches of a file, for each kind of file; arrays of NumPy are exact, or refused.

There is no null in an array. A null among floating-point numbers is NaN, and a result that is a truth value is false in
a row without results. Whole numbers with a null become floating-point numbers where a whole column is at hand and each
of them is exact; truth values and other whole numbers with a null are refused.
"""

from __future__ import annotations

import zipfile
from collections.abc import Callable
from typing import Any, Protocol

import numpy as np

from kinegen.errors import KinegenError, quote
from kinegen.support.compat import library
from kinegen.tools.datasets.csv_text import PURPOSE
from kinegen.tools.datasets.folders import SUFFIX, StoreWriter

ABOUT = "kinegen"
"""The array of an .npz file that holds the metadata."""

_EXACT = 1 << 53
"""Whole numbers up to this magnitude are exact in double precision."""

_FILES = {"npz": ".npz files take", "zarr": "Zarr takes"}


def check_arrays(kind: str, schema: Any) -> None:
    """Refuse columns that arrays of `npz` or `zarr` do not hold, before anything is computed."""
    for field in schema:
        if not _is_plain(field.type) and not (kind == "npz" and _is_time(field.type)):
            what = "numbers and times without a zone" if kind == "npz" else "numbers"
            raise KinegenError(
                f"column {quote(field.name)} is of type {field.type}; {_FILES[kind]} {what}, so --drop it"
            )
        if kind == "npz" and field.name == ABOUT:
            raise KinegenError(f"column {quote(ABOUT)} has the name of the metadata of .npz files; --drop it")


def _is_plain(kind: Any) -> bool:
    """Tell whether a column holds numbers or truth values, or lists of a fixed size of them."""
    types = library("pyarrow.types", PURPOSE, "fleet")
    inner = kind.value_type if types.is_fixed_size_list(kind) else kind
    return bool(types.is_floating(inner) or types.is_integer(inner) or types.is_boolean(inner))


def _is_time(kind: Any) -> bool:
    """Tell whether NumPy has such times: points without a zone, days and durations."""
    types = library("pyarrow.types", PURPOSE, "fleet")
    return bool(types.is_date(kind) or types.is_duration(kind) or (types.is_timestamp(kind) and kind.tz is None))


def array_of(column: Any, field: Any, *, whole: bool = False) -> Any:
    """Return a column as an array (n,), or (n, size) of lists of a fixed size; a null that no array holds is an error.

    `whole` rows decide the type; results of kernels have the metadata `kernel`.
    """
    size = getattr(field.type, "list_size", None)
    if size is None:
        return _flat(column, field, whole=whole)
    if column.null_count:
        column = _spread(column, size)
    return _flat(column.flatten(), field, whole=whole).reshape(-1, size)


def _spread(column: Any, size: int) -> Any:
    """Lists of a fixed size in which a list that is null has entries that are null."""
    pyarrow = library("pyarrow", PURPOSE, "fleet")
    missing = column.is_null().to_numpy(zero_copy_only=False)
    places = np.zeros(len(column), np.int64)
    places[~missing] = np.arange((~missing).sum())
    rows = (places[:, None] * size + np.arange(size)).reshape(-1)
    entries = column.drop_null().flatten().take(pyarrow.array(rows, mask=np.repeat(missing, size)))
    return pyarrow.FixedSizeListArray.from_arrays(entries, size)


def _flat(column: Any, field: Any, *, whole: bool) -> Any:
    """Return a column of plain values."""
    types = library("pyarrow.types", PURPOSE, "fleet")
    # Null of these is NaN or NaT.
    if not column.null_count or types.is_floating(column.type) or _is_time(column.type):
        return column.to_numpy(zero_copy_only=False)
    compute = library("pyarrow.compute", PURPOSE, "fleet")
    # A result without a solution is false.
    if types.is_boolean(column.type) and b"kernel" in (field.metadata or {}):
        return compute.fill_null(column, False).to_numpy(zero_copy_only=False)
    # Whole numbers become floats if the whole column is known to be exact as such.
    if whole and types.is_integer(column.type):
        numbers = compute.fill_null(column, 0).to_numpy(zero_copy_only=False)
        if not len(numbers) or max(-int(numbers.min()), int(numbers.max())) <= _EXACT:
            missing = column.is_null().to_numpy(zero_copy_only=False)
            return np.where(missing, np.nan, numbers.astype(np.float64))
    what = "Booleans" if types.is_boolean(column.type) else "integers"
    others = "" if whole or types.is_boolean(column.type) else "convert them to floating-point numbers, "
    raise KinegenError(
        f"column {quote(field.name)} has {what} with nulls, which no array of {column.type} holds; {others}write "
        ".parquet or .arrow, or --drop it"
    )


KINDS = {
    ".parquet": "parquet",
    ".pq": "parquet",
    ".arrow": "arrow",
    ".feather": "arrow",
    ".ipc": "arrow",
    ".npz": "npz",
    SUFFIX: "zarr",
}
"""What is written, by the ending of a file's name."""

ENDINGS = {"parquet": ".parquet", "arrow": ".arrow", "npz": ".npz", "zarr": SUFFIX}
"""The ending of each kind in a folder."""

COMPRESSIONS = ("none", "snappy", "zstd", "lz4")


class Writer(Protocol):
    """Takes the batches of a file."""

    def write_batch(self, batch: Any) -> None:
        """Take rows, a `pyarrow.RecordBatch`."""

    def close(self) -> None:
        """Write what is left."""


class _Arrays:
    """An .npz file: one array for each column, held in memory until the file is closed."""

    def __init__(self, path: str, schema: Any) -> None:
        self._path, self._schema = path, schema
        self._parts: list[Any] = []

    def write_batch(self, batch: Any) -> None:
        """Take rows."""
        self._parts.append(batch)

    def close(self) -> None:
        """Write all arrays, uncompressed, so that they can be read where they lie."""
        pyarrow = library("pyarrow", PURPOSE, "fleet")
        table = pyarrow.Table.from_batches(self._parts, self._schema)
        about = (self._schema.metadata or {}).get(b"kinegen", b"").decode()
        # Not by numpy.savez, which takes names as arguments, and so cannot write an array called `file`.
        with zipfile.ZipFile(self._path, "w", zipfile.ZIP_STORED) as archive:
            for field in self._schema:
                column = table.column(field.name).combine_chunks()
                self._add(archive, field.name, array_of(column, field, whole=True))
            self._add(archive, ABOUT, np.array(about, "U"))

    @staticmethod
    def _add(archive: zipfile.ZipFile, name: str, array: Any) -> None:
        with archive.open(f"{name}.npy", "w", force_zip64=True) as file:
            np.lib.format.write_array(file, np.asanyarray(array), allow_pickle=False)


class _Store:
    """A Zarr store."""

    def __init__(self, path: str, schema: Any, compression: str) -> None:
        self._schema, self._writer = schema, StoreWriter(path, schema, compression)

    def write_batch(self, batch: Any) -> None:
        """Take rows."""
        self._writer.append((field.name, array_of(batch.column(field.name), field)) for field in self._schema)

    def close(self) -> None:
        """Nothing: rows are written as they come."""


def written_schema(kind: str, schema: Any) -> Any:
    """Return the columns as a kind of file holds them, a `pyarrow.Schema`; refuse those that it cannot hold."""
    if kind in ("npz", "zarr"):
        check_arrays(kind, schema)
    if kind != "arrow":
        return schema
    # Arrow files have one dictionary a column, but categories change from batch to batch.
    types = library("pyarrow.types", PURPOSE, "fleet")
    for place, field in enumerate(schema):
        if types.is_dictionary(field.type):
            schema = schema.set(place, field.with_type(field.type.value_type))
        elif "dictionary<" in str(field.type):
            raise KinegenError(
                f"column {quote(field.name)} is of type {field.type}; Arrow files hold no categories inside others, so "
                "--drop it"
            )
    return schema


def _parquet(path: str, schema: Any, compression: str) -> Writer:
    parquet = library("pyarrow.parquet", PURPOSE, "fleet")
    # A dictionary of numbers that hardly repeat costs time and is thrown away.
    writer: Writer = parquet.ParquetWriter(path, schema, compression=compression, use_dictionary=False)
    return writer


def _arrow(path: str, schema: Any, compression: str) -> Writer:
    pyarrow = library("pyarrow", PURPOSE, "fleet")
    options = pyarrow.ipc.IpcWriteOptions(compression=None if compression == "none" else compression)
    writer: Writer = pyarrow.ipc.new_file(path, schema, options=options)
    return writer


def _npz(path: str, schema: Any, compression: str) -> Writer:
    del compression
    return _Arrays(path, schema)


WRITERS: dict[str, Callable[[str, Any, str], Writer]] = {
    "parquet": _parquet,
    "arrow": _arrow,
    "npz": _npz,
    "zarr": _Store,
}
"""Makes a writer of a path, a `pyarrow.Schema` and a compression, by the kind of the file."""


def check_compression(kind: str, compression: str) -> None:
    """Refuse a compression that a kind of file does not have."""
    there = {"arrow": ("none", "zstd", "lz4"), "npz": ("none",), "zarr": ("none", "zstd")}.get(kind, COMPRESSIONS)
    if compression not in there:
        *others, last = there
        words = f"{', '.join(others)} or {last}" if others else last
        raise KinegenError(f"--compression {compression}: {kind} files have {words}")
