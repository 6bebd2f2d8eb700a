"""Reads batches of rows, so that memory is bounded, and makes one file of results from them, in any process."""

from __future__ import annotations

import contextlib
import queue
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from kinegen.errors import KinegenError, shown
from kinegen.support.compat import library
from kinegen.support.dataclass import dataclass
from kinegen.tools.datasets.binding import JOINTS, Binding, taken
from kinegen.tools.datasets.csv_text import PURPOSE, located, opened
from kinegen.tools.datasets.folders import rows_of, with_columns
from kinegen.tools.datasets.plan import Part
from kinegen.tools.datasets.results import Column, computed
from kinegen.tools.datasets.sources import VECTOR, Span, column, reading_errors
from kinegen.tools.datasets.writing import Made, content_of, writing

_AHEAD = 1
"""Batches that are read while others are computed."""

_FINE = 256
"""Rows that are read at once where a row may take any number of bytes."""

_BUFFER = 1 << 20
"""Bytes of a column of a Parquet file that are read at once; without it, a whole row group is."""


@dataclass(frozen=True, slots=True)
class Wanted:
    """The columns that are read of each file, in order, and the most rows and bytes (about) at a time.

    Attributes:
        types: The type of each in a text file, a `pyarrow.DataType`; other files have their own.
        is_fixed: Whether batches have `rows` rows even where these take more bytes.
    """

    columns: tuple[str, ...]
    types: Mapping[str, Any]
    rows: int
    bytes: int
    is_fixed: bool


def batches(span: Span, wanted: Wanted) -> Iterator[Any]:
    """Read a span as batches, each a `pyarrow.RecordBatch`, while the one before is worked on."""
    yield from _ahead(lambda: _guarded(span, wanted))


def _guarded(span: Span, wanted: Wanted) -> Iterator[Any]:
    keys = tuple(key for key in span.keys if key.name in wanted.columns)
    own = [name for name in wanted.columns if name not in {key.name for key in keys}]
    is_wide = not wanted.is_fixed and any(width_of(kind) is None for kind in wanted.types.values())
    rows = min(_FINE, wanted.rows) if is_wide else wanted.rows
    with reading_errors(span.path):
        if span.kind == "csv":
            found = _csv(span, own, wanted.types, rows)
        else:
            found = _READERS[span.kind](span, own, rows)
        found = (with_columns(batch, keys) for batch in found)
        yield from _gathered(found, wanted) if is_wide else found


def width_of(kind: Any) -> int | None:
    """Bytes of a value of a type; None where values of a type may take any number."""
    types = library("pyarrow.types", PURPOSE, "fleet")
    if types.is_fixed_size_list(kind):
        inner = width_of(kind.value_type)
        return None if inner is None else inner * int(kind.list_size)
    if types.is_dictionary(kind) or types.is_nested(kind):
        return None
    try:
        return max(1, int(kind.bit_width) // 8)
    except ValueError:
        return 1 if types.is_null(kind) else None


def _gathered(found: Iterable[Any], wanted: Wanted) -> Iterator[Any]:
    """Small batches as larger ones, up to a number of rows and of bytes."""
    pyarrow = library("pyarrow", PURPOSE, "fleet")
    held, rows, size = list[Any](), 0, 0
    for batch in found:
        if held and (rows + batch.num_rows > wanted.rows or size + batch.nbytes > wanted.bytes):
            yield _together(pyarrow, held)
            held, rows, size = [], 0, 0
        held.append(batch)
        rows, size = rows + batch.num_rows, size + batch.nbytes
    if held:
        yield _together(pyarrow, held)


def _together(pyarrow: Any, held: list[Any]) -> Any:
    if len(held) == 1:
        return held[0]
    table = pyarrow.Table.from_batches(held).unify_dictionaries().combine_chunks()
    return pyarrow.record_batch([column.combine_chunks() for column in table.columns], schema=table.schema)


def _ahead(make: Callable[[], Iterator[Any]]) -> Iterator[Any]:
    """Yield what an iterator gives, taken from it by a thread of its own."""
    waiting: queue.Queue[tuple[str, Any]] = queue.Queue(_AHEAD)
    stopped = threading.Event()

    # The queue is full while the consumer is slow; a consumer that has stopped takes nothing any more.
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

    # Reading releases the interpreter, so that kernels run meanwhile.
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
    with parquet.ParquetFile(span.path, buffer_size=_BUFFER, pre_buffer=False) as file:
        yield from file.iter_batches(rows, row_groups=groups, columns=columns)


def _arrow(span: Span, columns: list[str], rows: int) -> Iterator[Any]:
    pyarrow = library("pyarrow", PURPOSE, "fleet")
    with pyarrow.memory_map(span.path) as mapped, pyarrow.ipc.open_file(mapped) as file:
        for place in range(span.first, span.first + span.count):
            yield from _pieces(file.get_batch(place).select(columns), rows)


def _csv(span: Span, columns: list[str], types: Mapping[str, Any], rows: int) -> Iterator[Any]:
    pyarrow = library("pyarrow", PURPOSE, "fleet")
    numbers = [name for name in columns if types[name] == pyarrow.float64()]
    with located(span.path, numbers), opened(span.path, {name: types[name] for name in columns}) as reader:
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
    with Path(span.path).open("rb") as file, np.load(file, allow_pickle=False) as arrays:
        whole = pyarrow.record_batch({name: column(arrays[name], name) for name in columns})
    yield from _pieces(whole, rows)


def _zarr(span: Span, columns: list[str], rows: int) -> Iterator[Any]:
    pyarrow = library("pyarrow", PURPOSE, "fleet")
    for first in range(span.first, span.first + span.count, rows):
        found = rows_of(span.path, VECTOR, columns, first, min(first + rows, span.first + span.count))
        yield pyarrow.record_batch({name: column(array, name) for name, array in found.items()})


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


@dataclass(frozen=True, slots=True)
class Job:
    """All that the files of a run have in common; it can be sent to another process.

    Attributes:
        token: Of the run, in the names of files that are not complete.
        packed: Their columns, a `pyarrow.Schema` as bytes: pickle would rename the entries of lists.
        is_fixed: Whether batches have `rows` rows whatever they hold, because results depend on places in a batch.
    """

    folder: str
    token: str
    kind: str
    compression: str
    packed: bytes
    passed: tuple[str, ...]
    bindings: tuple[Binding, ...]
    columns: tuple[Column, ...]
    real: str
    rows: int
    bytes: int
    is_fixed: bool
    threads: int

    @property
    def schema(self) -> Any:
        """Return the columns of the files, a `pyarrow.Schema`."""
        pyarrow = library("pyarrow", PURPOSE, "fleet")
        return library("pyarrow.ipc", PURPOSE, "fleet").read_schema(pyarrow.py_buffer(self.packed))

    @property
    def wanted(self) -> Wanted:
        """Return what is read."""
        pyarrow, schema = library("pyarrow", PURPOSE, "fleet"), self.schema
        bound = dict.fromkeys(name for each in self.bindings for name in each.columns)
        names = tuple(dict.fromkeys((*self.passed, *bound)))
        types = {name: schema.field(name).type for name in self.passed} | dict.fromkeys(bound, pyarrow.float64())
        return Wanted(names, types, self.rows, self.bytes, self.is_fixed)


def make_part(
    job: Job, module: ModuleType, part: Part, tell: Callable[[int], None], stopped: Callable[[], bool] = lambda: False
) -> Made:
    """Write one file.

    `tell` is called with the rows of each batch that is done, `stopped` is asked between batches whether to give up.

    Raises:
        KinegenError: If the input cannot be read, or has changed since the run began, or the file cannot be written;
            there is no file then.
        KeyboardInterrupt: If it was stopped.
    """
    total, schema, wanted, path = 0, job.schema, job.wanted, Path(job.folder) / part.name
    with writing(path, job.kind, schema, job.compression, job.token) as writer:
        for span in part.spans:
            before = total
            for batch in batches(span, wanted):
                if stopped():
                    raise KeyboardInterrupt
                writer.write_batch(_answered(job, module, batch, schema))
                total += batch.num_rows
                tell(batch.num_rows)
            # The plan was made from the file as it was.
            if 0 <= span.rows != total - before:
                raise KinegenError("it was changed while it was read", shown(span.path))
    content = content_of(path)
    if content is None:
        raise KinegenError("it was removed by another program as soon as it was written", shown(path))
    return Made(total, content)


_LOOKED_AT = 4096
"""Rows whose joint values are compared with the limits."""


def first_rows(
    job: Job, limits: Sequence[tuple[float, float] | None], is_angle: Sequence[bool], parts: Sequence[Part]
) -> tuple[float, float]:
    """Return the share of first rows with a joint outside its limits, and their largest angle in radians.

    Both tell whether the unit of their angles is right; they are zero without such rows. Limits are in radians and the
    robot's unit.
    """
    binding = next((each for each in job.bindings if each.name == JOINTS), None)
    span = next((span for part in parts for span in part.spans), None)
    if binding is None or span is None or not limits:
        return 0.0, 0.0
    # Some thousand rows show whether degrees are taken for radians.
    first = next(batches(span, replace(job.wanted, rows=_LOOKED_AT)), None)
    if first is None or not first.num_rows:
        return 0.0, 0.0
    q, _ = taken(first, binding, np.dtype(np.float64))
    low, high = np.transpose([limit or (-np.inf, np.inf) for limit in limits])
    outside = (q < low[:, None] - _SLACK) | (q > high[:, None] + _SLACK)
    angles = np.abs(q[np.array(is_angle, bool)])
    largest = float(np.nanmax(angles)) if np.isfinite(angles).any() else 0.0
    return float(outside.any(axis=0).mean()), largest


_SLACK = 1e-3
"""Radians, or a length, that a joint may be outside."""


def _answered(job: Job, module: ModuleType, batch: Any, schema: Any) -> Any:
    """Return the rows of the output for rows of the input."""
    pyarrow = library("pyarrow", PURPOSE, "fleet")
    inputs, nulls = {}, None
    for binding in job.bindings:
        inputs[binding.name], missing = taken(batch, binding, np.dtype(job.real))
        nulls = missing if nulls is None else nulls if missing is None else nulls | missing
    arrays = computed(module, job.columns, inputs, nulls, job.threads)
    passed = [_as_written(batch.column(name), schema.field(name).type) for name in job.passed]
    return pyarrow.record_batch([*passed, *arrays], schema=schema)


def _as_written(column: Any, kind: Any) -> Any:
    """Return a column that passes through, in the type that the file has: categories may become their values."""
    return column if column.type == kind else column.cast(kind)
