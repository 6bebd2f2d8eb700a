"""The files of a data set: where they are, what columns they have, and spans of their rows."""

from __future__ import annotations

import glob
import os
import zipfile
import zlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from kinegen.errors import KinegenError, quote, shown
from kinegen.io.messages import A_WORKBOOK, WORKBOOK_ENDINGS
from kinegen.support.compat import library
from kinegen.support.dataclass import dataclass
from kinegen.tools.datasets.csv_text import PURPOSE, located, opened, settled, wider
from kinegen.tools.datasets.folders import SUFFIX, Keys, arrays_of, extent, texts_of, typed, with_fields

FORMATS = {
    ".parquet": "parquet",
    ".pq": "parquet",
    ".arrow": "arrow",
    ".feather": "arrow",
    ".ipc": "arrow",
    ".csv": "csv",
    **dict.fromkeys((".csv.gz", ".csv.bz2", ".csv.zst"), "csv"),
    ".npy": "npy",
    ".npz": "npz",
    SUFFIX: "zarr",
}
"""What a file holds, by the ending of its name."""

VECTOR = "q"
"""The column of a .npy file or a single Zarr array, whose rows are joint vectors."""


@dataclass(frozen=True, slots=True)
class Source:
    """One file of a data set, with its absolute path, a kind of `FORMATS`, its bytes and its `pyarrow.Schema`.

    Attributes:
        rows: Rows of each of its blocks, which can be read alone; one block of -1 rows where nobody knows before it
            is read.
        time: When it was changed, in nanoseconds.
        keys: Columns with one value each, from names of folders such as `arm=left`.
    """

    path: str
    kind: str
    rows: tuple[int, ...]
    schema: Any
    size: int
    time: int
    keys: Keys = ()


@dataclass(frozen=True, slots=True)
class Span:
    """Consecutive blocks of a file.

    Attributes:
        first: Its first block, or row of a .npy file or a Zarr store.
        rows: Number of rows; -1 where nobody knows before they are read.
    """

    path: str
    kind: str
    first: int
    count: int
    rows: int
    keys: Keys = ()


def find_sources(words: Sequence[str | os.PathLike[str]]) -> tuple[Source, ...]:
    """Find the files that a user names: files, folders and patterns with `*`, `?` and `[...]`.

    They are in the order of the words, within a word in the order of their names, each once.

    Raises:
        KinegenError: If there is no such file, its ending is unknown, it cannot be read, or its columns are not those
            of the first.
    """
    paths: dict[str, str] = {}
    for word in [os.fspath(each) for each in words]:
        for path in _files(word):
            paths.setdefault(path, word)
    if not paths:
        raise KinegenError("name the data: files, folders, or patterns such as 'runs/*.parquet'")
    # All files have the same columns, those of their folders too.
    keys = typed([texts_of(path, word) for path, word in paths.items()], list(paths))
    sources = alike(tuple(map(_opened, paths, keys)))
    for source in sources[1:]:
        if not source.schema.equals(sources[0].schema):
            raise KinegenError(
                f"its columns are not those of {shown(sources[0].path)}; evaluate them apart", shown(source.path)
            )
    return sources


def _files(word: str) -> list[str]:
    # A folder stands for its data, and any other word for a file or a pattern.
    path = Path(word)
    if path.is_dir() and path.suffix.lower() != SUFFIX:
        found = [each for each in sorted(path.rglob("*")) if format_of(each) and _is_data(each, path)]
        if not found:
            raise KinegenError(f"there is no data in this folder (expected {', '.join(FORMATS)})", shown(word))
    elif path.exists():
        found = [path]
    else:
        names = sorted(glob.glob(word, recursive=True))  # noqa: PTH207 - Path.glob takes no absolute pattern
        found = [Path(name) for name in names if _is_one(Path(name))]
        if not found:
            raise KinegenError("there is no such file", shown(word))
    return [str(each.absolute()) for each in found]


def format_of(path: Path) -> str:
    """Return what a file holds, by its name: a value of `FORMATS`, or nothing."""
    *_, before, last = ["", "", *path.suffixes]
    return FORMATS.get(last.lower()) or FORMATS.get((before + last).lower(), "")


def alike(sources: tuple[Source, ...]) -> tuple[Source, ...]:
    """Return the files with equal types in text files of the same columns: those that hold the numbers of all."""
    texts = [source for source in sources if source.kind == "csv"]
    same = [source for source in texts if source.schema.names == texts[0].schema.names]
    if not same:
        return sources
    schema = wider([source.schema for source in same])
    return tuple(
        replace(source, schema=schema) if any(source is each for each in same) else source for source in sources
    )


def settled_types(sources: Sequence[Source], columns: Sequence[str]) -> Any:
    """Return the columns of text files with types that hold the values of all rows, a `pyarrow.Schema`."""
    schema = sources[0].schema
    for source in sources:
        with reading_errors(source.path):
            schema = settled(source.path, schema, columns)
    return schema


def _is_data(path: Path, folder: Path) -> bool:
    """Tell whether a file belongs to the data of a folder, and is neither hidden nor about it, as data sets have."""
    return _is_one(path) and not any(part.startswith((".", "_")) for part in path.relative_to(folder).parts)


def _is_one(path: Path) -> bool:
    """Tell whether it is a file or a store, which is a folder."""
    return path.is_file() or (path.suffix.lower() == SUFFIX and path.is_dir())


def _opened(path: str, keys: Keys) -> Source:
    kind = format_of(Path(path))
    if Path(path).suffix.lower() in WORKBOOK_ENDINGS:
        raise KinegenError(A_WORKBOOK, shown(path))
    if not kind:
        raise KinegenError(f"data of this kind is not read (expected {', '.join(FORMATS)})", shown(path))
    # Whatever a library raises about a file names the file.
    with reading_errors(path):
        rows, schema = _LOOKS[kind](path)
        schema = with_fields(schema, keys, path)
        if not schema.names:  # which raises where a name is not text
            raise ValueError("it has no columns")
        status = Path(path).stat()
        size, time = extent(Path(path)) if kind == "zarr" else (status.st_size, status.st_mtime_ns)
    return Source(path, kind, tuple(rows), schema, size, time, keys)


_FAULTS = (OSError, ValueError, EOFError, KeyError, TypeError, NotImplementedError, zipfile.BadZipFile, zlib.error)
"""What libraries raise about files that they cannot read."""


@contextmanager
def reading_errors(path: str) -> Iterator[None]:
    """Report errors of libraries about a file as one line that names it."""
    try:
        yield
    except KinegenError:
        raise
    except _FAULTS as error:
        reason = getattr(error, "strerror", None) or str(error).partition("\n")[0] or type(error).__name__
        raise KinegenError(f"it cannot be read: {reason}", shown(path)) from error


def _parquet(path: str) -> tuple[Iterable[int], Any]:
    parquet = library("pyarrow.parquet", PURPOSE, "fleet")
    with parquet.ParquetFile(path) as file:
        groups = file.metadata.num_row_groups
        return [file.metadata.row_group(place).num_rows for place in range(groups)], file.schema_arrow


def _arrow(path: str) -> tuple[Iterable[int], Any]:
    pyarrow = library("pyarrow", PURPOSE, "fleet")
    with pyarrow.memory_map(path) as mapped, pyarrow.ipc.open_file(mapped) as file:
        return [file.get_batch(place).num_rows for place in range(file.num_record_batches)], file.schema


def _csv(path: str) -> tuple[Iterable[int], Any]:
    with located(path), opened(path, {}) as reader:
        return [-1], reader.schema


def _npy(path: str) -> tuple[Iterable[int], Any]:
    array = np.load(path, mmap_mode="r", allow_pickle=False)
    if array.ndim != 2 or array.dtype.kind not in "fiu":
        raise ValueError(f"an array of shape {array.shape} and type {array.dtype} is not one row a joint vector")
    return [array.shape[0]], _schema({VECTOR: array})


def _npz(path: str) -> tuple[Iterable[int], Any]:
    with Path(path).open("rb") as file, np.load(file, allow_pickle=False) as arrays:
        found = {name: array for name in arrays.files if (array := arrays[name]).ndim}
    lengths = {array.shape[:1] for array in found.values()}
    if len(lengths) != 1:
        raise ValueError("its arrays do not have the same number of rows")
    return lengths.pop(), _schema(found)


def _zarr(path: str) -> tuple[Iterable[int], Any]:
    found = arrays_of(path, VECTOR)
    return [next(iter(found.values())).shape[0]], _schema(found)


_LOOKS: dict[str, Callable[[str], tuple[Iterable[int], Any]]] = {
    "parquet": _parquet,
    "arrow": _arrow,
    "csv": _csv,
    "npy": _npy,
    "npz": _npz,
    "zarr": _zarr,
}


def _schema(arrays: dict[str, Any]) -> Any:
    """Return the columns of plain arrays: numbers, or vectors of them."""
    pyarrow = library("pyarrow", PURPOSE, "fleet")
    return pyarrow.schema([(name, column(np.asarray(array[:0]), name).type) for name, array in arrays.items()])


def column(array: Any, name: str = VECTOR) -> Any:
    """Return an array as a column: (n,) numbers, (n, ...) vectors; ValueError if no column has such numbers."""
    pyarrow = library("pyarrow", PURPOSE, "fleet")
    if array.dtype.kind == "c" or (array.dtype.kind == "f" and array.dtype.itemsize > np.dtype(float).itemsize):
        raise ValueError(f"array {quote(name)} is of type {array.dtype}; save it as float64 (array.astype(float))")
    if not array.dtype.isnative:
        array = array.astype(array.dtype.newbyteorder("="))
    if array.ndim == 1:
        return pyarrow.array(array)
    size = int(np.prod(array.shape[1:]))
    return pyarrow.FixedSizeListArray.from_arrays(pyarrow.array(np.ascontiguousarray(array).reshape(-1)), size)
