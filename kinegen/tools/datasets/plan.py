"""Plans a run, and records which of its files are complete, so that another run can go on.

The input alone decides the files, so that it does not matter who computes them, or when. While a run works, each file
that is complete is a line of a journal, with its rows, size and digest. At its end, also where it is interrupted, the
lines become the entry `complete` of the manifest, in the order of names. A run that goes on keeps the files whose size
and digest are those on record, and makes the others again.
"""

from __future__ import annotations

import contextlib
import difflib
import json
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from kinegen.errors import KinegenError, WriteError, quote, shown
from kinegen.support.compat import library
from kinegen.support.dataclass import dataclass
from kinegen.support.files.manifest import check_output
from kinegen.support.files.replacing import remove, replacing
from kinegen.tools.datasets.csv_text import PURPOSE
from kinegen.tools.datasets.sources import FORMATS, Source, Span
from kinegen.tools.datasets.writers import COMPRESSIONS, ENDINGS, KINDS, check_compression
from kinegen.tools.datasets.writing import Made, alone, content_of, unfinished

PART_ROWS = 1 << 21
"""Rows of a file of a folder, unless a block of the input has more: a quarter of a gigabyte of poses."""


@dataclass(frozen=True, slots=True)
class Part:
    """One file of the output, and the rows that it is computed from."""

    name: str
    spans: tuple[Span, ...]

    @property
    def rows(self) -> int:
        """Number of rows; -1 where nobody knows before they are read."""
        return -1 if any(span.rows < 0 for span in self.spans) else sum(span.rows for span in self.spans)


def parts_of(sources: Sequence[Source], ending: str, rows: int) -> tuple[Part, ...]:
    """Return the files of a folder: of each input file consecutive blocks, as many as reach a number of rows."""
    spans = [span for source in sources for span in spans_of(source, rows)]
    digits = max(5, len(str(len(spans) - 1)))
    return tuple(Part(f"part-{place:0{digits}d}{ending}", (span,)) for place, span in enumerate(spans))


def one_part(sources: Sequence[Source], name: str) -> tuple[Part, ...]:
    """Return one file with all rows."""
    return (Part(name, tuple(span for source in sources for span in spans_of(source, PART_ROWS))),)


def spans_of(source: Source, rows: int) -> Iterator[Span]:
    """Yield the spans of a file, each of at least a number of rows but for the last."""
    path, kind, keys = source.path, source.kind, source.keys
    # Rows can be read from anywhere, files are read as a whole, and the others by blocks.
    if kind in ("npy", "zarr"):
        for first in range(0, source.rows[0], rows):
            count = min(rows, source.rows[0] - first)
            yield Span(path, kind, first, count, count, keys)
        return
    if kind in ("csv", "npz"):
        yield Span(path, kind, 0, 1, source.rows[0], keys)
        return
    first, gathered = 0, 0
    for place, count in enumerate(source.rows):
        gathered += count
        if gathered >= rows or place == len(source.rows) - 1:
            yield Span(path, kind, first, place + 1 - first, gathered, keys)
            first, gathered = place + 1, 0


REALS = {"double": "float64", "float": "float32"}

LEAST_MEMORY = 64 * 10**6

_ALIKE = 0.75
"""From which likeness on an ending is a known one with a slip: `.parqet` has 0.93."""


@dataclass(frozen=True, slots=True)
class Options:
    """Options of a run; see `evaluate`."""

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
    angle: str | None = None
    """Unit of angles in columns of joint values; empty for that of the robot file, None for rad, or by title."""


def check_options(path: Path, options: Options) -> None:
    """Refuse options that do not fit together, before anything is read."""
    library("pyarrow", PURPOSE, "fleet")
    # Words first, since what follows depends on them.
    for value, there, name in (
        (options.real, REALS, "--real"),
        (options.angle or "rad", ("rad", "deg"), "--angle"),
        (options.kind, ENDINGS, "--format"),
        (options.compression, COMPRESSIONS, "--compression"),
    ):
        if value not in there:
            raise KinegenError(f"{name} is {', '.join(there)}, not {quote(str(value))}")
    check_compression(options.kind, options.compression)
    if options.memory < LEAST_MEMORY:
        raise KinegenError(f"--memory {options.memory}: expected at least {LEAST_MEMORY // 10**6} MB")
    if options.workers < 1:
        raise KinegenError(f"--workers {options.workers}: expected at least 1")
    if options.part_rows < 1:
        raise KinegenError(f"--part-rows {options.part_rows}: expected at least 1")
    # One file has no parts to share or to resume.
    if not is_file(path):
        _check_ending(path)
        return
    if options.workers > 1 or options.scheduler or options.resume:
        word = "--resume" if options.resume else "--scheduler" if options.scheduler else "--workers"
        raise KinegenError(f"{word} takes a folder of files for the results; give one to -o", shown(path))


def is_file(path: Path) -> bool:
    """Tell whether an output is one file or store, and not a folder of them."""
    return path.suffix.lower() in KINDS and not path.is_dir()


def _check_ending(path: Path) -> None:
    """Refuse a folder whose name says that a file is meant."""
    ending = path.suffix.lower()
    near = difflib.get_close_matches(ending, KINDS, 1, _ALIKE) if ending else []
    is_read = ending in FORMATS or any(path.name.lower().endswith(known) for known in FORMATS)
    if path.is_dir() or not (near or is_read):
        return
    meant = f"did you mean {near[0]}? " if near and not is_read else ""
    raise KinegenError(
        f"files called {ending} are not written ({meant}expected {', '.join(KINDS)}, or a folder)", shown(path)
    )


NAME = "_kinegen.json"
"""The file; readers of data sets leave names with an underscore aside."""

_JOURNAL = ".kinegen-parts"
_WAYS = "continue it with the same call, choose another folder, or begin again with --force"
_WORDS = {"compiled": "way of compiling"}
"""What keys of a run are called in messages, where that is not their name."""


@dataclass(frozen=True, slots=True)
class Begun:
    """The state of an earlier run: its complete files, and how many are damaged, no longer what it wrote."""

    complete: frozenset[str] = frozenset()
    damaged: int = 0


def described(about: Mapping[str, Any], sources: Sequence[Source], parts: Sequence[Part]) -> dict[str, Any]:
    """Return everything that decides the results of a run."""
    files = [{"path": each.path, "bytes": each.size, "changed": each.time} for each in sources]
    run = {
        "about": dict(about),
        "input": files,
        "parts": [{"name": part.name, "spans": [asdict(span) for span in part.spans]} for part in parts],
    }
    return dict(json.loads(json.dumps(run)))  # as it is read again: lists, no tuples


def check_folder(folder: Path, *, resume: bool, force: bool) -> None:
    """Refuse a folder for results before anything is computed, and make it if it is missing.

    Raises:
        KinegenError: If the folder has other files, or a run began there and neither is asked for.
        WriteError: If it cannot be written.
    """
    with _reported(folder):
        folder.mkdir(parents=True, exist_ok=True)
        there = {each.name for each in folder.iterdir()}
        if NAME not in there:
            if any(not name.startswith(".") or name == _JOURNAL for name in there):
                raise KinegenError("this folder has other files in it; choose another", shown(folder))
            return
        _read(folder / NAME)
    if not (resume or force):
        raise KinegenError("a run began here; go on with --resume, or begin again with --force", shown(folder))


@contextlib.contextmanager
def held(path: Path, sources: Sequence[Source], options: Options) -> Iterator[str]:
    """Refuse an output that must not be written, and hold it for this run, whose token it gives."""
    whole = path.absolute()
    is_one = is_file(path)
    if is_one:
        check_output(path, (Path(source.path) for source in sources), force=options.force)
    folder, name = (whole.parent, whole.name) if is_one else (whole, "")
    # A run that is refused leaves no folder behind, nor those above it.
    missing = [each for each in (folder, *folder.parents) if not each.exists()]
    try:
        if is_one:
            with _reported(path):
                folder.mkdir(parents=True, exist_ok=True)
        else:
            check_folder(path, resume=options.resume, force=options.force)
        with alone(folder, name) as token:
            yield token
    finally:
        with contextlib.suppress(OSError):
            for each in missing:
                each.rmdir()


def begin(folder: Path, run: Mapping[str, Any], token: str, *, force: bool) -> Begun:
    """Compare a folder that this run holds with an earlier run in it, and write down what is going to be made."""
    with _reported(folder):
        before = _read(folder / NAME) if (folder / NAME).exists() else None
        found = Begun()
        if before is not None and not force:
            _compare(folder, before, run)
            found = _verified(folder, run, _recorded(folder, before))
        # Whatever is not complete is made again, so nothing old is mixed with it.
        for part in () if before is None else before["parts"]:
            if part["name"] not in found.complete:
                remove(folder / part["name"])
        kept = {} if before is None else _recorded(folder, before)
        _write(folder, run, {name: kept[name] for name in found.complete}, token)
        remove(folder / _JOURNAL)
    return found


def record(folder: Path, name: str, made: Made) -> None:
    """Note in the journal that a file is complete."""
    entry = {"name": name, "rows": made.rows, "bytes": made.content.size, "sha256": made.content.sha256}
    with _reported(folder), (folder / _JOURNAL).open("a", encoding="utf-8") as journal:
        journal.write(json.dumps(entry) + "\n")
        journal.flush()
        os.fsync(journal.fileno())


def finish(folder: Path, run: Mapping[str, Any], token: str) -> None:
    """Put the journal into the manifest; where that is not possible it stays."""
    with contextlib.suppress(OSError, KinegenError):
        _write(folder, run, _recorded(folder, _read(folder / NAME)), token)
        remove(folder / _JOURNAL)


def _write(folder: Path, run: Mapping[str, Any], complete: Mapping[str, Any], token: str) -> None:
    text = json.dumps({**run, "complete": complete}, indent=1, sort_keys=True) + "\n"
    with replacing(folder / NAME, unfinished(folder / NAME, token)) as draft:
        draft.write_text(text, encoding="utf-8")


def _read(path: Path) -> dict[str, Any]:
    try:
        found = json.loads(path.read_bytes())
        names = [part["name"] for part in found["parts"]]
        is_ours = all(Path(name).name == name for name in names) and isinstance(found.get("complete", {}), dict)
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        is_ours = False
    if not is_ours:
        raise KinegenError("this is not what a run writes; choose another folder", shown(path))
    return dict(found)


def _recorded(folder: Path, before: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Return what the manifest and the journal say of files, by name; a line that a kill cut off says nothing."""
    found = dict(before.get("complete", {}))
    for line in _lines(folder / _JOURNAL):
        with contextlib.suppress(ValueError, KeyError, TypeError, RecursionError):
            entry = dict(json.loads(line))
            found[str(entry.pop("name"))] = entry
    return found


def _lines(path: Path) -> Iterable[bytes]:
    try:
        return path.read_bytes().splitlines()
    except FileNotFoundError:
        return ()


def _verified(folder: Path, run: Mapping[str, Any], recorded: Mapping[str, Any]) -> Begun:
    """Return which files are as they are on record; the rows, where the plan has their number, as planned."""
    complete, damaged = set[str](), 0
    for part in run["parts"]:
        entry = recorded.get(part["name"])
        if not isinstance(entry, dict):
            continue
        # A file counts if it is what was written, and what is planned now.
        rows = [span["rows"] for span in part["spans"]]
        is_planned = min(rows, default=0) < 0 or sum(rows) == entry.get("rows")
        content = content_of(folder / part["name"]) if is_planned else None
        if content is not None and (content.size, content.sha256) == (entry.get("bytes"), entry.get("sha256")):
            complete.add(part["name"])
        elif content is not None:
            damaged += 1
    return Begun(frozenset(complete), damaged)


def _compare(folder: Path, before: Mapping[str, Any], run: Mapping[str, Any]) -> None:
    """Refuse to go on where something has changed, and say what."""
    for key in sorted({*before["about"], *run["about"]}):
        if before["about"].get(key) != run["about"].get(key):
            word = _WORDS.get(key, key)
            raise KinegenError(f"the results here are of another run, whose {word} differs; {_WAYS}", shown(folder))
    known = {each["path"]: each for each in before["input"]}
    for each in run["input"]:
        if known.get(each["path"]) != each:
            change = "is new" if each["path"] not in known else "has changed"
            raise KinegenError(f"{shown(each['path'])} {change} since the run that began here; {_WAYS}", shown(folder))
    if len(known) != len(run["input"]) or before["parts"] != run["parts"]:
        raise KinegenError(f"the results here are of a run with other files; {_WAYS}", shown(folder))


@contextlib.contextmanager
def _reported(folder: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise WriteError(f"results cannot be written here: {reason}", shown(folder)) from error
