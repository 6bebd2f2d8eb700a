"""Columns in the names of folders, as Hive, Spark and Dask write data sets: `arm=left/day=3/part-0.parquet`."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from kinegen.errors import KinegenError, quote, shown
from kinegen.workspace.optional import library


@dataclass(frozen=True, slots=True)
class Key:
    """A column that has one value in a whole file.

    Attributes:
        name: Its name.
        value: The value; None is null.
        is_text: Whether the values of all files are texts, and not whole numbers.
    """

    name: str
    value: int | str | None
    is_text: bool

    @property
    def type(self) -> Any:
        """The type of the column, a `pyarrow.DataType`."""
        pyarrow = library("pyarrow", "a data set", "fleet")
        return pyarrow.string() if self.is_text else pyarrow.int64()


Keys = tuple[Key, ...]

_NULL = "__HIVE_DEFAULT_PARTITION__"
"""The value of rows without one."""

_WILD = re.compile(r"[*?\[]")


def texts_of(path: str, word: str) -> tuple[tuple[str, str], ...]:
    """The columns in the names of the folders between what a user named and a file.

    Args:
        path: The file, absolute.
        word: What was named: a folder, a pattern, of which the folders before the first wild card do not count, or the
            file itself, which has none.

    Returns:
        Names and values as they are written.
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
    """The columns of all files with their values: whole numbers where each of them is one, else texts.

    Args:
        found: What `texts_of` gave for each file.
        paths: The files.

    Raises:
        KinegenError: If the folders of a file name other columns than those of the first.
    """
    names = [name for name, _ in found[0]]
    for pairs, path in zip(found, paths, strict=True):
        if [name for name, _ in pairs] != names:
            wanted = ", ".join(map(quote, names)) or "none"
            raise KinegenError(f"its folders name other columns than those of the first file ({wanted})", shown(path))
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
    """The columns of a file with those of its folders behind them, a `pyarrow.Schema`.

    Args:
        schema: The columns of the file.
        keys: The columns of its folders.
        path: The file.

    Raises:
        KinegenError: If the file has a column of the same name.
    """
    pyarrow = library("pyarrow", "a data set", "fleet")
    for key in keys:
        if key.name in schema.names:
            raise KinegenError(f"its folders name a column {quote(key.name)}, which the file has too", shown(path))
        schema = schema.append(pyarrow.field(key.name, key.type))
    return schema


def with_columns(batch: Any, keys: Keys) -> Any:
    """Rows of a file with columns of its folders, a `pyarrow.RecordBatch`.

    Args:
        batch: The rows.
        keys: The columns.
    """
    pyarrow = library("pyarrow", "a data set", "fleet")
    for key in keys:
        column = pyarrow.repeat(pyarrow.scalar(key.value, key.type), batch.num_rows)
        batch = pyarrow.record_batch([*batch.columns, column], names=[*batch.schema.names, key.name])
    return batch
