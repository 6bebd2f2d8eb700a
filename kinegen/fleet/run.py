"""A data set of joint vectors in, a data set of results out."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from kinegen import __version__
from kinegen.api.compiling import compile as compiled
from kinegen.api.loading import Source as RobotSource
from kinegen.api.loading import load
from kinegen.api.robot import model_of
from kinegen.api.words import Words, words_of
from kinegen.errors import KinegenError, WriteError, quote, shown
from kinegen.fleet.binding import Binding, bind
from kinegen.fleet.cluster import make_parts, processes
from kinegen.fleet.manifest import begin, described
from kinegen.fleet.plan import PART_ROWS, Part, one_part, parts_of
from kinegen.fleet.results import check_names, columns_of, schema_of
from kinegen.fleet.searches import ROWS, Searching, kernel_of, require_one_target
from kinegen.fleet.sources import PURPOSE, Source, find_sources
from kinegen.fleet.work import Job, make_part
from kinegen.fleet.writing import COMPRESSIONS, ENDINGS, KINDS, check_compression, sweep
from kinegen.output_file import check_output
from kinegen.outputs import parse_quantity
from kinegen.robot.digest import digest
from kinegen.workspace.optional import library

REALS = {"double": "float64", "float": "float32"}

MOST_ROWS = 1 << 17
"""Rows in memory at once: more make nothing faster."""

LEAST_ROWS = 256

LEAST_MEMORY = 64 << 20

_COPIES = 8
"""How often a row is in memory: read, ahead, as input, as result, packed, and what libraries keep."""


@dataclass(frozen=True, slots=True)
class Summary:
    """What a run did.

    Attributes:
        output: The file or folder.
        rows: Rows that were computed now.
        written: Files that were written now.
        kept: Files that an earlier run had completed.
        backend: What computed: `c` or `numpy`.
    """

    output: Path
    rows: int
    written: int
    kept: int
    backend: str


@dataclass(frozen=True, slots=True)
class Options:
    """How a run goes; see `evaluate`."""

    columns: tuple[tuple[str, tuple[str, ...]], ...] = ()
    drop: tuple[str, ...] = ()
    is_flat: bool = False
    real: str = "double"
    kind: str = "parquet"
    compression: str = "none"
    part_rows: int = PART_ROWS
    memory: int = 512 << 20
    threads: int = 1
    workers: int = 1
    scheduler: str = ""
    resume: bool = False
    force: bool = False


Tell = Callable[[int, int], None]
"""Called with the rows that are done, and all rows; -1 where nobody knows how many there are."""


def evaluate(
    robot: RobotSource,
    data: str | os.PathLike[str] | Sequence[str | os.PathLike[str]],
    output: str | os.PathLike[str],
    outputs: Words = "pose",
    *,
    columns: Mapping[str, Sequence[str]] | Sequence[str] = (),
    drop: Sequence[str] = (),
    flat: bool = False,
    real: str = "double",
    format: str = "parquet",  # noqa: A002 - as the option is called
    compression: str = "none",
    part_rows: int = PART_ROWS,
    memory: int = 512 << 20,
    threads: int = 1,
    workers: int = 1,
    scheduler: str = "",
    resume: bool = False,
    force: bool = False,
    tell: Tell = lambda _done, _all: None,
) -> Summary:
    """Evaluate outputs of a robot over files that may be larger than memory.

    Angles are in radians and lengths in the robot's unit. NaN stays NaN and null stays null.

    Args:
        robot: What `kinegen.load` takes.
        data: Files, folders and patterns: Parquet, Arrow (Feather), CSV, .npy with one row a joint vector, .npz, Zarr.
        output: A file (.parquet, .arrow, .npz, .zarr), or a folder, which gets a file for each `part_rows` rows.
        outputs: What is computed, as for `kinegen.compile`.
        columns: Columns of the joint values, or by input, as in `{"qd": ["v1", "v2"]}`; by default as in docs/eval.md.
        drop: Columns that do not pass through to the output; `*` for all of them.
        flat: Whether each number is a column of its own, `pose_0_3`, instead of one column of vectors.
        real: `double` or `float`.
        format: What a folder is filled with: `parquet`, `arrow`, `npz` or `zarr`.
        compression: `none`, `snappy`, `zstd` or `lz4`.
        part_rows: Rows of a file of a folder, at least; blocks of the input stay whole.
        memory: Bytes of memory for data, of each worker.
        threads: Threads of a kernel; 0 for all processors.
        workers: Processes on this machine that share the files of a folder.
        scheduler: Address of a scheduler of Dask whose workers share them instead.
        resume: Whether to go on with a run that was interrupted: files that are complete are kept.
        force: Whether to replace the results of another run.
        tell: Called with the rows that are done and those there are.

    Returns:
        What was done.

    Raises:
        KinegenError: If an option, a column or a file is wrong, or something changed since the run that is resumed.
    """
    path = Path(output)
    kind = KINDS.get(path.suffix.lower(), "") or format
    how = (compression, part_rows, memory, threads, workers, scheduler, resume, force)
    options = Options(_by_input(columns), tuple(drop), flat, real, kind, *how)
    _check(path, options)
    sources = find_sources([data] if isinstance(data, str | os.PathLike) else list(data))
    if _is_file(path):
        check_output(path, (Path(source.path) for source in sources), force=force)
    return _evaluate(robot, sources, path, words_of(outputs), options, tell)


def _by_input(columns: Mapping[str, Sequence[str]] | Sequence[str]) -> tuple[tuple[str, tuple[str, ...]], ...]:
    named = columns if isinstance(columns, Mapping) else {"q": columns} if columns else {}
    return tuple((name, tuple(each)) for name, each in named.items())


def _check(path: Path, options: Options) -> None:
    """Refuse options that do not fit together, before anything is read."""
    library("pyarrow", PURPOSE, "fleet")
    for value, there, name in (
        (options.real, REALS, "--real"),
        (options.kind, ENDINGS, "--format"),
        (options.compression, COMPRESSIONS, "--compression"),
    ):
        if value not in there:
            raise KinegenError(f"{name} is {', '.join(there)}, not {quote(str(value))}")
    check_compression(options.kind, options.compression)
    if options.memory < LEAST_MEMORY:
        raise KinegenError(f"--memory {options.memory}: expected at least {LEAST_MEMORY >> 20} MB")
    if options.workers < 1:
        raise KinegenError(f"--workers {options.workers}: expected at least 1")
    if options.part_rows < 1:
        raise KinegenError(f"--part-rows {options.part_rows}: expected at least 1")
    if not _is_file(path):
        return
    if options.workers > 1 or options.scheduler or options.resume:
        word = "--resume" if options.resume else "--scheduler" if options.scheduler else "--workers"
        raise KinegenError(f"{word} takes a folder of files for the results; give one to -o", shown(path))
    if not path.absolute().parent.is_dir():
        raise WriteError("its folder does not exist", shown(path))


def _is_file(path: Path) -> bool:
    return path.suffix.lower() in KINDS and not path.is_dir()


def _evaluate(
    robot: RobotSource, sources: tuple[Source, ...], path: Path, words: tuple[str, ...], options: Options, tell: Tell
) -> Summary:
    quantities = tuple(map(parse_quantity, words or ("pose",)))
    model = model_of(load(robot))
    require_one_target(model, quantities)
    is_elsewhere = bool(options.scheduler)
    module = compiled(model, list(map(str, quantities)), real=options.real, reproducible=is_elsewhere)
    kernels = {str(each): each.function for each in quantities}
    schema, chosen = sources[0].schema, dict(options.columns)
    bindings = bind(module, list(kernels.values()), schema, chosen)
    about = _about(model, words, options)
    job = _job(module, kernels, bindings, schema, path, options, about)
    parts = (
        one_part(sources, path.name) if _is_file(path) else parts_of(sources, ENDINGS[options.kind], options.part_rows)
    )
    run = described(about | {"rows": job.rows}, sources, parts)
    done = set() if _is_file(path) else begin(path, run, resume=options.resume, force=options.force)
    sweep(Path(job.folder))
    wanted = [part for part in parts if part.name not in done]
    rows = _made(job, module, wanted, options, tell)
    return Summary(path, rows, len(wanted), len(done), module.backend)


def _about(model: Any, words: tuple[str, ...], options: Options) -> dict[str, Any]:
    """What decides the results beside the data, for people and for `--resume`."""
    return {
        "kinegen": __version__,
        "robot": model.name,
        "model": digest(model),
        "joints": [variable.name for variable in model.variables],
        "angle": "rad",
        "length": model.units.length,
        "outputs": list(words),
        "columns": {name: list(columns) for name, columns in options.columns},
        "drop": list(options.drop),
        "flat": options.is_flat,
        "real": options.real,
        "format": options.kind,
        "compression": options.compression,
    }


def _job(
    module: ModuleType,
    kernels: Mapping[str, str],
    bindings: tuple[Binding, ...],
    schema: Any,
    path: Path,
    options: Options,
    about: Mapping[str, Any],
) -> Job:
    columns = columns_of(module, kernels, is_flat=options.is_flat)
    for name in options.drop:
        if name != "*" and name not in schema.names:
            raise KinegenError(f"--drop: there is no column {quote(name)} (there are {', '.join(schema.names)})")
    passed = [field for field in schema if field.name not in options.drop and "*" not in options.drop]
    check_names(columns, [field.name for field in passed])
    real = REALS[options.real]
    written = schema_of(columns, passed, np.dtype(real), about).serialize().to_pybytes()
    numbers = sum(each.size for each in bindings) + sum(int(np.prod(each.shape, dtype=int)) for each in columns)
    row = 8 * (numbers + len(passed))
    most = ROWS if any(isinstance(kernel_of(module, name), Searching) for name in kernels.values()) else MOST_ROWS
    rows = max(LEAST_ROWS, min(most, options.memory // (_COPIES * row)))
    names = tuple(field.name for field in passed)
    folder = path.absolute().parent if _is_file(path) else path.absolute()
    return Job(
        str(folder), options.kind, options.compression, written, names, bindings, columns, real, rows, options.threads
    )


def _made(job: Job, module: ModuleType, parts: Sequence[Part], options: Options, tell: Tell) -> int:
    """Have the files made, here or by others; the number of rows."""
    everything = -1 if any(part.rows < 0 for part in parts) else sum(part.rows for part in parts)
    done = 0

    def count(rows: int) -> None:
        nonlocal done
        done += rows
        tell(done, everything)

    tell(0, everything)
    if options.workers == 1 and not options.scheduler:
        for part in parts:
            make_part(job, module, part, count)
    elif parts:
        with processes(0 if options.scheduler else options.workers, options.scheduler) as client:
            make_parts(client, job, module, parts, count)
    return done
