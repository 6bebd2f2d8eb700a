"""A data set of joint vectors in, a data set of results out."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from kinegen import __version__
from kinegen.errors import KinegenError, quote
from kinegen.io.columns import no_column
from kinegen.model.outputs import Quantity, parse_quantity
from kinegen.model.robot import JointType
from kinegen.model.variants import digest
from kinegen.support.compat import library
from kinegen.support.dataclass import dataclass
from kinegen.tools.datasets.binding import (
    Binding,
    bind,
    check_columns,
    in_kernel_units,
    joint_bindings,
    placed,
    units_of_angles,
)
from kinegen.tools.datasets.cluster import make_parts, processes, way_of
from kinegen.tools.datasets.csv_text import PURPOSE
from kinegen.tools.datasets.plan import (
    PART_ROWS,
    REALS,
    Options,
    Part,
    begin,
    check_options,
    described,
    finish,
    held,
    is_file,
    one_part,
    parts_of,
    record,
)
from kinegen.tools.datasets.results import (
    ROWS,
    Searching,
    check_names,
    columns_of,
    kernel_of,
    require_one_target,
    schema_of,
)
from kinegen.tools.datasets.sources import Source, find_sources, settled_types
from kinegen.tools.datasets.worker import Job, first_rows, make_part, width_of
from kinegen.tools.datasets.writers import ENDINGS, KINDS, written_schema
from kinegen.tools.datasets.writing import Made
from kinegen.ui.api.building import compile as compiled
from kinegen.ui.api.loading import Source as RobotSource
from kinegen.ui.api.loading import load
from kinegen.ui.api.options import Words, words_of
from kinegen.ui.api.robot_methods import model_of

MOST_ROWS = 1 << 17
"""Rows in memory at once: more make nothing faster."""

LEAST_ROWS = 256

_COPIES = 8
"""How often a row is in memory: read, ahead, as input, as result, packed, and what libraries keep."""


@dataclass(frozen=True, slots=True)
class Summary:
    """A run: rows and files that were computed now, and files that an earlier run had completed.

    Attributes:
        damaged: Files among the written ones that an earlier run had completed and that were not whole any more.
        angle: Unit in which angles of joint values were taken whose titles state none; empty where there were none.
        titled: The units that titles state, such as `deg and rad`.
        largest: The largest angle of a joint in these rows, in radians.
    """

    output: Path
    rows: int
    written: int
    kept: int
    damaged: int
    backend: str
    angle: str = ""
    titled: str = ""
    outside: float = 0.0
    largest: float = 0.0


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
    angle: str | None = None,
    tell: Tell = lambda _done, _all: None,
) -> Summary:
    """Evaluate outputs of a robot over files that may be larger than memory.

    Results have angles in radians and lengths in the robot's unit. NaN stays NaN and null stays null.

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
        angle: Unit of angles in the columns of joint values and their rates, `rad` or `deg`, which no title may
            contradict. By default rad where a title states none, and the unit of the robot file if this is empty.
            Results of an earlier run are in radians, whatever it says.
        tell: Called with the rows that are done and those there are.

    Raises:
        KinegenError: If an option, a column or a file is wrong, or something changed since the run that is resumed.
    """
    path = Path(output)
    kind = KINDS.get(path.suffix.lower(), "") or format
    how = (compression, part_rows, memory, threads, workers, scheduler, resume, force, angle)
    options = Options(_by_input(columns), tuple(drop), flat, real, kind, *how)
    check_options(path, options)
    sources = find_sources([data] if isinstance(data, str | os.PathLike) else list(data))
    with held(path, sources, options) as token:
        return _evaluate(robot, sources, path, words_of(outputs), options, tell, token)


def _by_input(columns: Mapping[str, Sequence[str]] | Sequence[str]) -> tuple[tuple[str, tuple[str, ...]], ...]:
    named = columns if isinstance(columns, Mapping) else {"q": columns} if columns else {}
    return tuple((name, tuple(each)) for name, each in named.items())


def _evaluate(
    robot: RobotSource,
    sources: tuple[Source, ...],
    path: Path,
    words: tuple[str, ...],
    options: Options,
    tell: Tell,
    token: str,
) -> Summary:
    quantities = tuple(map(parse_quantity, words or ("pose",)))
    model = model_of(load(robot))
    require_one_target(model, quantities)
    # Whatever is wrong with columns is refused before anything is compiled.
    chosen, schema = dict(options.columns), sources[0].schema
    with placed(sources):
        names = tuple(variable.name for variable in model.variables)
        check_columns(names, [each.kind for each in quantities], schema, chosen)
    turns = {each.name: each.type is not JointType.PRISMATIC for each in model.variables}
    units = model.units if options.angle == "" else replace(model.units, angle=options.angle or "rad")
    joints = in_kernel_units(joint_bindings(names, quantities, schema, chosen), units, turns, schema)
    units_of_angles(joints, units, turns, schema, is_asked=bool(options.angle))
    passed = _passed(schema, options)
    # Workers elsewhere have other processors, and have to give the same bits.
    module = compiled(model, list(map(str, quantities)), real=options.real, reproducible=bool(options.scheduler))
    bindings = in_kernel_units(bind(module, quantities, schema, chosen), units, turns, schema)
    angles = units_of_angles(bindings, units, turns, schema, is_asked=bool(options.angle))
    options = replace(options, angle=units.angle)
    about = _about(model, words, options)
    fields = _fields(sources, passed, bindings)
    job = _job(module, quantities, bindings, fields, path, options, about, token)
    is_one = is_file(path)
    parts = one_part(sources, path.name) if is_one else parts_of(sources, ENDINGS[options.kind], options.part_rows)
    # The first rows show whether angles are in the unit that nobody stated.
    first = first_rows(job, module.LIMITS, [*turns.values()], parts)
    summary = Summary(path, 0, 0, 0, 0, module.backend, *angles, *first)
    if is_one:
        return replace(summary, rows=_made(job, module, parts, options, tell), written=1)
    way = {"rows": job.rows, "compiled": way_of(module, reproducible=bool(options.scheduler))}
    return _folder(summary, job, module, described(about | way, sources, parts), parts, options, tell)


def _folder(
    summary: Summary,
    job: Job,
    module: ModuleType,
    run: Mapping[str, Any],
    parts: Sequence[Part],
    options: Options,
    tell: Tell,
) -> Summary:
    """Make the files of a folder that an earlier run did not complete, and keep the record of all."""
    path = summary.output
    begun = begin(path, run, job.token, force=options.force)
    wanted = [part for part in parts if part.name not in begun.complete]
    try:
        rows = _made(job, module, wanted, options, tell, lambda name, made: record(path, name, made))
    finally:
        finish(path, run, job.token)
    return replace(summary, rows=rows, written=len(wanted), kept=len(begun.complete), damaged=begun.damaged)


def _passed(schema: Any, options: Options) -> list[str]:
    """Return the columns that pass through, each of a name of its own."""
    for name in options.drop:
        if name != "*" and name not in schema.names:
            raise KinegenError(f"--drop: {no_column(name, schema.names)}")
    # Columns without a name and without values are what a spreadsheet leaves behind the last one.
    left = {
        field.name
        for field in schema
        if field.name or not library("pyarrow.types", PURPOSE, "fleet").is_null(field.type)
    }
    passed = [name for name in schema.names if name in left and name not in options.drop and "*" not in options.drop]
    twice = next((name for name in passed if passed.count(name) > 1), None)
    if twice is not None:
        raise KinegenError(
            f"there are {passed.count(twice)} columns {quote(twice)}; leave them out with --drop {twice}"
        )
    return passed


def _fields(sources: tuple[Source, ...], passed: Sequence[str], bindings: Sequence[Binding]) -> list[Any]:
    """Return the fields that pass through; of text files with types that hold the values of all rows."""
    pyarrow = library("pyarrow", PURPOSE, "fleet")
    schema = sources[0].schema
    texts = [source for source in sources if source.kind == "csv"]
    if not texts:
        return [schema.field(name) for name in passed]
    bound = {name for each in bindings for name in each.columns}
    keys = {key.name for key in sources[0].keys}
    schema = settled_types(texts, [name for name in passed if name not in bound | keys])
    real = pyarrow.float64()
    return [pyarrow.field(name, real) if name in bound else schema.field(name) for name in passed]


def _about(model: Any, words: tuple[str, ...], options: Options) -> dict[str, Any]:
    """Return what decides the results beside the data, for people and for `--resume`."""
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
    } | ({} if options.angle == "rad" else {"angle_of_columns": options.angle})


def _job(
    module: ModuleType,
    quantities: Sequence[Quantity],
    bindings: tuple[Binding, ...],
    fields: Sequence[Any],
    path: Path,
    options: Options,
    about: Mapping[str, Any],
    token: str,
) -> Job:
    kernels = {str(each): each.function for each in quantities}
    columns = columns_of(module, kernels, is_flat=options.is_flat)
    names = tuple(field.name for field in fields)
    check_names(columns, names)
    real = REALS[options.real]
    schema = written_schema(options.kind, schema_of(columns, fields, np.dtype(real), about))
    # Memory allows so many rows, with all copies of a row that are there at a time.
    numbers = sum(each.size for each in bindings) + sum(int(np.prod(each.shape, dtype=int)) for each in columns)
    row = 8 * numbers + sum(width_of(field.type) or 8 for field in fields)
    is_search = any(isinstance(kernel_of(module, name), Searching) for name in kernels.values())
    rows = max(LEAST_ROWS, min(ROWS if is_search else MOST_ROWS, options.memory // (_COPIES * row)))
    whole = path.absolute()
    return Job(
        folder=str(whole.parent if is_file(path) else whole),
        token=token,
        kind=options.kind,
        compression=options.compression,
        packed=schema.serialize().to_pybytes(),
        passed=names,
        bindings=bindings,
        columns=columns,
        real=real,
        rows=rows,
        bytes=options.memory // _COPIES,
        is_fixed=is_search,
        threads=options.threads,
    )


def _made(
    job: Job,
    module: ModuleType,
    parts: Sequence[Part],
    options: Options,
    tell: Tell,
    keep: Callable[[str, Made], None] = lambda _name, _made: None,
) -> int:
    """Have the files made, here or by others, and each that is complete kept; the number of rows."""
    everything = -1 if any(part.rows < 0 for part in parts) else sum(part.rows for part in parts)
    done = 0

    def count(rows: int) -> None:
        nonlocal done
        done += rows
        tell(done, everything)

    tell(0, everything)
    # One process writes the files itself.
    if options.workers == 1 and not options.scheduler:
        for part in parts:
            keep(part.name, make_part(job, module, part, count))
    elif parts:
        with processes(0 if options.scheduler else options.workers, options.scheduler) as client:
            make_parts(client, job, module, parts, count, keep)
    return done
