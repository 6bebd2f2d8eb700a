"""Batches of rows of a span, so that memory is bounded whatever the size of a file."""

from __future__ import annotations

import contextlib
import queue
import threading
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from kinegen.fleet.partitions import with_columns
from kinegen.fleet.sources import PURPOSE, VECTOR, Span, column, reading_errors
from kinegen.fleet.stores import rows_of
from kinegen.workspace.optional import library

_AHEAD = 1
"""Batches that are read while others are computed."""


def batches(span: Span, columns: tuple[str, ...], floats: frozenset[str], rows: int) -> Iterator[Any]:
    """Read a span.

    Args:
        span: Which rows.
        columns: Which columns, in order.
        floats: Which of them are floating-point numbers even where a text file begins with whole ones.
        rows: The most rows at a time.

    Yields:
        Batches, each a `pyarrow.RecordBatch`, that are read while the one before is worked on.

    Raises:
        KinegenError: If the file cannot be read.
    """
    yield from _ahead(lambda: _guarded(span, columns, floats, rows))


def _guarded(span: Span, columns: tuple[str, ...], floats: frozenset[str], rows: int) -> Iterator[Any]:
    keys = tuple(key for key in span.keys if key.name in columns)
    own = [name for name in columns if name not in {key.name for key in keys}]
    with reading_errors(span.path):
        if span.kind == "csv":
            found = _csv(span, own, floats, rows)
        else:
            found = _READERS[span.kind](span, own, rows)
        yield from (with_columns(batch, keys) for batch in found)


def _ahead(make: Callable[[], Iterator[Any]]) -> Iterator[Any]:
    """What an iterator gives, taken from it by a thread of its own."""
    waiting: queue.Queue[tuple[str, Any]] = queue.Queue(_AHEAD)
    stopped = threading.Event()

    def put(item: tuple[str, Any]) -> None:
        while not stopped.is_set():
            with contextlib.suppress(queue.Full):
                waiting.put(item, timeout=0.1)
                return

    def read() -> None:
        try:
            for batch in make():
                put(("batch", batch))
                if stopped.is_set():
                    return
            put(("end", None))
        except BaseException as error:  # noqa: BLE001 - raised again where the batches are used
            put(("error", error))

    thread = threading.Thread(target=read, daemon=True)
    thread.start()
    try:
        while True:
            kind, item = waiting.get()
            if kind == "end":
                return
            if kind == "error":
                raise item
            yield item
    finally:
        stopped.set()
        thread.join()


def _parquet(span: Span, columns: list[str], rows: int) -> Iterator[Any]:
    parquet = library("pyarrow.parquet", PURPOSE, "fleet")
    groups = range(span.first, span.first + span.count)
    with parquet.ParquetFile(span.path) as file:
        yield from file.iter_batches(rows, row_groups=groups, columns=columns)


def _arrow(span: Span, columns: list[str], rows: int) -> Iterator[Any]:
    pyarrow = library("pyarrow", PURPOSE, "fleet")
    with pyarrow.memory_map(span.path) as mapped, pyarrow.ipc.open_file(mapped) as file:
        for place in range(span.first, span.first + span.count):
            yield from _pieces(file.get_batch(place).select(columns), rows)


def _csv(span: Span, columns: list[str], floats: frozenset[str], rows: int) -> Iterator[Any]:
    csv, pyarrow = library("pyarrow.csv", PURPOSE, "fleet"), library("pyarrow", PURPOSE, "fleet")
    types = csv.ConvertOptions(column_types=dict.fromkeys(floats, pyarrow.float64()))
    with csv.open_csv(span.path, convert_options=types) as reader:
        for batch in reader:
            yield from _pieces(batch.select(columns), rows)


def _npy(span: Span, columns: list[str], rows: int) -> Iterator[Any]:
    pyarrow = library("pyarrow", PURPOSE, "fleet")
    array = np.load(span.path, mmap_mode="r", allow_pickle=False)
    for first in range(span.first, span.first + span.count, rows):
        part = array[first : min(first + rows, span.first + span.count)]
        yield pyarrow.record_batch({VECTOR: column(part)}).select(columns)


def _npz(span: Span, columns: list[str], rows: int) -> Iterator[Any]:
    pyarrow = library("pyarrow", PURPOSE, "fleet")
    with np.load(span.path, allow_pickle=False) as arrays:
        whole = pyarrow.record_batch({name: column(arrays[name]) for name in columns})
    yield from _pieces(whole, rows)


def _zarr(span: Span, columns: list[str], rows: int) -> Iterator[Any]:
    pyarrow = library("pyarrow", PURPOSE, "fleet")
    for first in range(span.first, span.first + span.count, rows):
        found = rows_of(span.path, VECTOR, columns, first, min(first + rows, span.first + span.count))
        yield pyarrow.record_batch({name: column(array) for name, array in found.items()})


def _pieces(batch: Any, rows: int) -> Iterator[Any]:
    for first in range(0, batch.num_rows, rows):
        yield batch.slice(first, rows)


_READERS: dict[str, Callable[[Span, list[str], int], Iterator[Any]]] = {
    "parquet": _parquet,
    "arrow": _arrow,
    "npy": _npy,
    "npz": _npz,
    "zarr": _zarr,
}
