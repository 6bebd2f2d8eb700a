"""What one worker does: one file of results, from the rows that belong to it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from kinegen.fleet.binding import Binding, taken
from kinegen.fleet.plan import Part
from kinegen.fleet.reading import batches
from kinegen.fleet.results import Column, computed
from kinegen.fleet.sources import PURPOSE
from kinegen.fleet.writing import writing
from kinegen.workspace.optional import library


@dataclass(frozen=True, slots=True)
class Job:
    """What all files of a run have in common; it can be sent to another process.

    Attributes:
        folder: Where the files go.
        kind: What they are.
        compression: How they are packed.
        packed: Their columns, a `pyarrow.Schema` as bytes: pickle would rename the entries of lists.
        passed: Columns of the input that pass through.
        bindings: The inputs of the kernels.
        columns: The results.
        real: Number type, `float64` or `float32`.
        rows: The most rows that are in memory at once.
        threads: Threads of a kernel.
    """

    folder: str
    kind: str
    compression: str
    packed: bytes
    passed: tuple[str, ...]
    bindings: tuple[Binding, ...]
    columns: tuple[Column, ...]
    real: str
    rows: int
    threads: int

    @property
    def schema(self) -> Any:
        """The columns of the files, a `pyarrow.Schema`."""
        pyarrow = library("pyarrow", PURPOSE, "fleet")
        return library("pyarrow.ipc", PURPOSE, "fleet").read_schema(pyarrow.py_buffer(self.packed))


def make_part(
    job: Job, module: ModuleType, part: Part, tell: Callable[[int], None], stopped: Callable[[], bool] = lambda: False
) -> int:
    """Write one file.

    Args:
        job: The run.
        module: The compiled robot.
        part: Which file.
        tell: Called with the number of rows of each batch that is done.
        stopped: Asked between batches whether to give up.

    Returns:
        Number of rows.

    Raises:
        KinegenError: If the input cannot be read or the file cannot be written; there is no file then.
        KeyboardInterrupt: If it was stopped.
    """
    read = tuple(dict.fromkeys((*job.passed, *(name for each in job.bindings for name in each.columns))))
    floats = frozenset(name for each in job.bindings for name in each.columns) - set(job.passed)
    total = 0
    schema = job.schema
    with writing(Path(job.folder) / part.name, job.kind, schema, job.compression) as writer:
        for span in part.spans:
            for batch in batches(span, read, floats, job.rows):
                if stopped():
                    raise KeyboardInterrupt
                writer.write_batch(_answered(job, module, batch, schema))
                total += batch.num_rows
                tell(batch.num_rows)
    return total


def _answered(job: Job, module: ModuleType, batch: Any, schema: Any) -> Any:
    """The rows of the output for rows of the input."""
    pyarrow = library("pyarrow", PURPOSE, "fleet")
    inputs, nulls = {}, None
    for binding in job.bindings:
        inputs[binding.name], missing = taken(batch, binding, np.dtype(job.real))
        nulls = missing if nulls is None else nulls if missing is None else nulls | missing
    arrays = computed(module, job.columns, inputs, nulls, job.threads)
    return pyarrow.record_batch([*(batch.column(name) for name in job.passed), *arrays], schema=schema)
