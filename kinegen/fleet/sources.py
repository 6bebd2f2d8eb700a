"""The files of a data set: where they are, what columns they have, and spans of their rows."""

from __future__ import annotations

import glob
import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from kinegen.errors import KinegenError, shown
from kinegen.fleet.partitions import Keys, texts_of, typed, with_fields
from kinegen.fleet.stores import SUFFIX, arrays_of, extent
from kinegen.workspace.optional import library

PURPOSE = "a data set"

FORMATS = {
    ".parquet": "parquet",
    ".pq": "parquet",
    ".arrow": "arrow",
    ".feather": "arrow",
    ".ipc": "arrow",
    ".csv": "csv",
    ".npy": "npy",
    ".npz": "npz",
    SUFFIX: "zarr",
}
"""What a file holds, by the ending of its name."""

VECTOR = "q"
"""The column of a .npy file or a single Zarr array, whose rows are joint vectors."""


@dataclass(frozen=True, slots=True)
class Source:
    """One file of a data set.

    Attributes:
        path: Its path, absolute.
        kind: What it holds, a value of `FORMATS`.
        rows: Rows of each of its blocks, which can be read alone; one block of -1 rows where nobody knows before it
            is read.
        schema: Its columns, a `pyarrow.Schema`.
        size: Its bytes.
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
        path: The file.
        kind: What it holds.
        first: Its first block, or row of a .npy file or a Zarr store.
        count: Number of blocks, or of such rows.
        rows: Number of rows; -1 where nobody knows before they are read.
        keys: Columns with one value each.
    """

    path: str
    kind: str
    first: int
    count: int
    rows: int
    keys: Keys = ()


def find_sources(words: Sequence[str | os.PathLike[str]]) -> tuple[Source, ...]:
    """The files that a user names.

    Args:
        words: Files, folders, which are searched through, or patterns with `*`, `?` and `[...]`.

    Returns:
        The files in the order of the words, within a word in the order of their names; each once.

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
    keys = typed([texts_of(path, word) for path, word in paths.items()], list(paths))
    sources = tuple(map(_opened, paths, keys))
    for source in sources[1:]:
        if not source.schema.equals(sources[0].schema):
            raise KinegenError(
                f"its columns are not those of {shown(sources[0].path)}; evaluate them apart", shown(source.path)
            )
    return sources


def _files(word: str) -> list[str]:
    path = Path(word)
    if path.is_dir() and path.suffix.lower() != SUFFIX:
        found = [each for each in sorted(path.rglob("*")) if each.suffix.lower() in FORMATS and _is_data(each, path)]
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


def _is_data(path: Path, folder: Path) -> bool:
    """Whether a file belongs to the data of a folder: not what is hidden or about it, as in data sets of others."""
    return _is_one(path) and not any(part.startswith((".", "_")) for part in path.relative_to(folder).parts)


def _is_one(path: Path) -> bool:
    """Whether it is a file or a store, which is a folder."""
    return path.is_file() or (path.suffix.lower() == SUFFIX and path.is_dir())


def _opened(path: str, keys: Keys) -> Source:
    kind = FORMATS.get(Path(path).suffix.lower())
    if kind is None:
        raise KinegenError(f"data of this kind is not read (expected {', '.join(FORMATS)})", shown(path))
    with reading_errors(path):
        rows, schema = _LOOKS[kind](path)
        status = Path(path).stat()
        size, time = extent(Path(path)) if kind == "zarr" else (status.st_size, status.st_mtime_ns)
    return Source(path, kind, tuple(rows), with_fields(schema, keys, path), size, time, keys)


@contextmanager
def reading_errors(path: str) -> Iterator[None]:
    """What libraries raise about a file, as one line that names it.

    Args:
        path: The file.

    Raises:
        KinegenError: In place of the library's error.
    """
    try:
        yield
    except (OSError, ValueError, EOFError, KeyError) as error:
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
    csv = library("pyarrow.csv", PURPOSE, "fleet")
    with csv.open_csv(path) as reader:
        return [-1], reader.schema


def _npy(path: str) -> tuple[Iterable[int], Any]:
    array = np.load(path, mmap_mode="r", allow_pickle=False)
    if array.ndim != 2 or array.dtype.kind not in "fiu":
        raise ValueError(f"an array of shape {array.shape} and type {array.dtype} is not one row a joint vector")
    return [array.shape[0]], _schema({VECTOR: array})


def _npz(path: str) -> tuple[Iterable[int], Any]:
    with np.load(path, allow_pickle=False) as arrays:
        found = {name: arrays[name] for name in arrays.files}
    lengths = {array.shape[:1] for array in found.values()}
    if len(lengths) != 1 or () in lengths:
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
    """The columns of plain arrays: numbers, or vectors of them."""
    pyarrow = library("pyarrow", PURPOSE, "fleet")
    return pyarrow.schema([(name, column(np.asarray(array[:0])).type) for name, array in arrays.items()])


def column(array: Any) -> Any:
    """An array as a column: of shape (n,) its numbers, of shape (n, ...) vectors of a fixed size."""
    pyarrow = library("pyarrow", PURPOSE, "fleet")
    if array.ndim == 1:
        return pyarrow.array(array)
    size = int(np.prod(array.shape[1:]))
    return pyarrow.FixedSizeListArray.from_arrays(pyarrow.array(np.ascontiguousarray(array).reshape(-1)), size)
