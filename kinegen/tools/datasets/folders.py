"""Data sets that are folders: Zarr stores, and columns in the names of folders."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np

from kinegen.errors import KinegenError, quote, shown
from kinegen.support.compat import library
from kinegen.support.dataclass import dataclass

SUFFIX = ".zarr"
"""The ending of a store's name."""

_PURPOSE = "a Zarr store"
_CHUNK = 1 << 16
"""Rows of a chunk."""


def arrays_of(path: str, alone: str) -> dict[str, Any]:
    """Return the arrays of a store that have rows, unread and by name; `alone` names one that is the store."""
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
    """Return rows of some arrays, as arrays of NumPy."""
    found = arrays_of(path, alone)
    return {name: np.asarray(found[name][first:end]) for name in columns}


def extent(path: Path) -> tuple[int, int]:
    """Bytes of all files of a store, and when the last of them was changed, in nanoseconds."""
    status = [each.stat() for each in path.rglob("*") if each.is_file()]
    return sum(each.st_size for each in status), max((each.st_mtime_ns for each in status), default=0)


class StoreWriter:
    """Appends rows of numbers and truth values to the arrays of a new store, packed by `none` or `zstd`."""

    def __init__(self, path: str, schema: Any, compression: str) -> None:
        zarr = library("zarr", _PURPOSE, "fleet")
        codecs = [zarr.codecs.ZstdCodec()] if compression == "zstd" else None
        self._arrays: dict[str, Any] = {}
        group = zarr.open_group(path, mode="w", zarr_format=3)
        group.attrs["kinegen"] = (schema.metadata or {}).get(b"kinegen", b"").decode()
        for field in schema:
            inner = getattr(field.type, "value_type", field.type)
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


@dataclass(frozen=True, slots=True)
class Key:
    """A column that has one value in a whole file, a text or a whole number as in all files; None is null."""

    name: str
    value: int | str | None
    is_text: bool

    @property
    def type(self) -> Any:
        """Return the type of the column, a `pyarrow.DataType`."""
        pyarrow = library("pyarrow", "a data set", "fleet")
        return pyarrow.string() if self.is_text else pyarrow.int64()


Keys = tuple[Key, ...]

_NULL = "__HIVE_DEFAULT_PARTITION__"
"""The value of rows without one."""

_WILD = re.compile(r"[*?\[]")


def texts_of(path: str, word: str) -> tuple[tuple[str, str], ...]:
    """Return names and values, as written, in the folders between what a user named and a file.

    A user names a folder, a pattern, of which the folders before the first wild card do not count, or the file itself,
    which has none.
    """
    whole = Path(word).absolute()
    plain = 0
    while plain < len(whole.parts) and not _WILD.search(whole.parts[plain]):
        plain += 1
    base = whole if whole.is_dir() else Path(*whole.parts[:plain])
    folders = Path(os.path.relpath(Path(path).parent, base)).parts if base.is_dir() else ()
    pairs = (folder.partition("=") for folder in folders)
    return tuple((unquote(name), unquote(value)) for name, separator, value in pairs if separator and name)


def typed(found: Sequence[tuple[tuple[str, str], ...]], paths: Sequence[str]) -> tuple[Keys, ...]:
    """Return the columns of all files, whole numbers or else texts; all files have those of the first."""
    names = [name for name, _ in found[0]]
    for pairs, path in zip(found, paths, strict=True):
        if [name for name, _ in pairs] != names:
            wanted = ", ".join(map(quote, names)) or "none"
            raise KinegenError(f"its folders name other columns than those of the first file ({wanted})", shown(path))
    # A column of whole numbers in all files is one of numbers.
    columns = [[pairs[place][1] for pairs in found] for place in range(len(names))]
    whole = [all(value == _NULL or re.fullmatch(r"-?\d{1,18}", value) for value in column) for column in columns]
    return tuple(
        tuple(
            Key(name, None if value == _NULL else int(value) if is_whole else value, not is_whole)
            for (name, value), is_whole in zip(pairs, whole, strict=True)
        )
        for pairs in found
    )


def with_fields(schema: Any, keys: Keys, path: str) -> Any:
    """Return the columns of a file and those of its folders, a `pyarrow.Schema`; no two may have one name."""
    pyarrow = library("pyarrow", "a data set", "fleet")
    for key in keys:
        if key.name in schema.names:
            raise KinegenError(f"its folders name a column {quote(key.name)}, which the file has too", shown(path))
        schema = schema.append(pyarrow.field(key.name, key.type))
    return schema


def with_columns(batch: Any, keys: Keys) -> Any:
    """Return rows of a file with the columns of its folders, a `pyarrow.RecordBatch`."""
    pyarrow = library("pyarrow", "a data set", "fleet")
    for key in keys:
        column = pyarrow.repeat(pyarrow.scalar(key.value, key.type), batch.num_rows)
        batch = pyarrow.record_batch([*batch.columns, column], names=[*batch.schema.names, key.name])
    return batch
