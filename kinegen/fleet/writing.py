"""Files of results, each whole or not at all: written under another name, and renamed when they are complete."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from kinegen.errors import KinegenError, WriteError, shown
from kinegen.fleet.sources import PURPOSE
from kinegen.fleet.stores import SUFFIX, StoreWriter, remove
from kinegen.workspace.optional import library

KINDS = {".parquet": "parquet", ".arrow": "arrow", ".feather": "arrow", ".npz": "npz", SUFFIX: "zarr"}
"""What is written, by the ending of a file's name."""

ENDINGS = {"parquet": ".parquet", "arrow": ".arrow", "npz": ".npz", "zarr": SUFFIX}
"""The ending of each kind in a folder."""

COMPRESSIONS = ("none", "snappy", "zstd", "lz4")

_UNFINISHED = ".unfinished"


class Writer(Protocol):
    """What takes the batches of a file."""

    def write_batch(self, batch: Any) -> None:
        """Take rows, a `pyarrow.RecordBatch`."""

    def close(self) -> None:
        """Write what is left."""


@contextmanager
def writing(path: Path, kind: str, schema: Any, compression: str) -> Iterator[Writer]:
    """A file, which is there when everything was written, and not before.

    Args:
        path: The file; what stands there is replaced at the end.
        kind: One of `ENDINGS`.
        schema: The columns, a `pyarrow.Schema`.
        compression: One of `COMPRESSIONS`.

    Yields:
        What takes the batches.

    Raises:
        WriteError: If it cannot be written, as on a full disk; nothing is left behind then.
    """
    unfinished = path.with_name(f".{path.name}{_UNFINISHED}-{os.getpid()}")
    try:
        with _reported(path):
            writer = _WRITERS[kind](str(unfinished), schema, compression)
        yield _Reporting(writer, path)
        with _reported(path):
            writer.close()
            unfinished.replace(path)
    finally:
        remove(unfinished)


def sweep(folder: Path) -> None:
    """Remove what runs left behind that were killed."""
    for each in folder.glob(f".*{_UNFINISHED}-*"):
        remove(each)


@contextmanager
def _reported(path: Path) -> Iterator[None]:
    try:
        yield
    except KinegenError:
        raise
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error).partition("\n")[0]
        raise WriteError(f"it cannot be written: {reason}", shown(path)) from error


class _Reporting:
    """A writer whose errors name the file."""

    def __init__(self, writer: Writer, path: Path) -> None:
        self._writer, self._path = writer, path

    def write_batch(self, batch: Any) -> None:
        """Take rows."""
        with _reported(self._path):
            self._writer.write_batch(batch)

    def close(self) -> None:
        """Nothing: `writing` closes the file."""


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
        arrays = {field.name: _numbers(table.column(field.name).combine_chunks(), field) for field in self._schema}
        about = (self._schema.metadata or {}).get(b"kinegen", b"").decode()
        with Path(self._path).open("wb") as file:
            np.savez(file, **arrays, kinegen=np.array(about, "U"))


class _Store:
    """A Zarr store."""

    def __init__(self, path: str, schema: Any, compression: str) -> None:
        self._schema, self._writer = schema, StoreWriter(path, schema, compression)

    def write_batch(self, batch: Any) -> None:
        """Take rows."""
        self._writer.append((field.name, _numbers(batch.column(field.name), field)) for field in self._schema)

    def close(self) -> None:
        """Nothing: rows are written as they come."""


def _numbers(column: Any, field: Any) -> Any:
    """A column as an array; there is no null in NumPy, so numbers are NaN there."""
    size = getattr(field.type, "list_size", None)
    if size is None:
        return column.to_numpy(zero_copy_only=False)
    if column.null_count:
        column = library("pyarrow.compute", PURPOSE, "fleet").fill_null(column, [float("nan")] * size)
    return column.flatten().to_numpy(zero_copy_only=False).reshape(-1, size)


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


_WRITERS: dict[str, Callable[[str, Any, str], Writer]] = {
    "parquet": _parquet,
    "arrow": _arrow,
    "npz": _npz,
    "zarr": _Store,
}


def check_compression(kind: str, compression: str) -> None:
    """Refuse a compression that a kind of file does not have.

    Raises:
        KinegenError: If it has not.
    """
    there = {"arrow": ("none", "zstd", "lz4"), "npz": ("none",), "zarr": ("none", "zstd")}.get(kind, COMPRESSIONS)
    if compression not in there:
        *others, last = there
        words = f"{', '.join(others)} or {last}" if others else last
        raise KinegenError(f"--compression {compression}: {kind} files have {words}")
