"""What a run is made from, beside its results, so that another run can go on where it stopped."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from kinegen.errors import KinegenError, WriteError, shown
from kinegen.fleet.plan import Part
from kinegen.fleet.sources import Source
from kinegen.fleet.stores import remove

NAME = "_kinegen.json"
"""The file; readers of data sets leave names with an underscore aside."""

_WAYS = "continue it with the same call, choose another folder, or begin again with --force"


def described(about: Mapping[str, Any], sources: Sequence[Source], parts: Sequence[Part]) -> dict[str, Any]:
    """What decides the results of a run.

    Args:
        about: The robot and the options.
        sources: The input.
        parts: The files.
    """
    files = [{"path": each.path, "bytes": each.size, "changed": each.time} for each in sources]
    run = {
        "about": dict(about),
        "input": files,
        "parts": [{"name": part.name, "spans": [asdict(span) for span in part.spans]} for part in parts],
    }
    return dict(json.loads(json.dumps(run)))  # as it is read again: lists, no tuples


def begin(folder: Path, run: Mapping[str, Any], *, resume: bool, force: bool) -> set[str]:
    """Look at a folder, and write down there what is going to be made.

    Args:
        folder: Where the results go; it is made if it is missing.
        run: What `described` gave.
        resume: Whether to go on with a run that was interrupted.
        force: Whether to begin again where there are results of another run.

    Returns:
        Names of the files that are complete.

    Raises:
        KinegenError: If the folder has other files, or a run with another input, robot or options.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        there = {each.name for each in folder.iterdir()}
        before = _read(folder / NAME) if NAME in there else None
        if before is None and any(not name.startswith(".") for name in there):
            raise KinegenError("this folder has other files in it; choose another", shown(folder))
        if before is not None and not force:
            _compare(folder, before, run, resume=resume)
            return there & {part["name"] for part in run["parts"]}
        for part in [] if before is None else before["parts"]:
            remove(folder / part["name"])
        text = json.dumps(run, indent=1, sort_keys=True) + "\n"
        unfinished = folder / f".{NAME}"
        unfinished.write_text(text, encoding="utf-8")
        unfinished.replace(folder / NAME)
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise WriteError(f"results cannot be written here: {reason}", shown(folder)) from error
    return set()


def _read(path: Path) -> dict[str, Any]:
    try:
        found = json.loads(path.read_bytes())
        names = [part["name"] for part in found["parts"]]
        is_ours = all(Path(name).name == name for name in names)
    except (ValueError, KeyError, TypeError, RecursionError):
        is_ours = False
    if not is_ours:
        raise KinegenError("this is not what a run writes; choose another folder", shown(path))
    return dict(found)


def _compare(folder: Path, before: Mapping[str, Any], run: Mapping[str, Any], *, resume: bool) -> None:
    """Refuse to go on where something has changed, and say what."""
    for key in sorted({*before["about"], *run["about"]}):
        if before["about"].get(key) != run["about"].get(key):
            raise KinegenError(f"the results here are of another run, whose {key} differs; {_WAYS}", shown(folder))
    known = {each["path"]: each for each in before["input"]}
    for each in run["input"]:
        if known.get(each["path"]) != each:
            change = "is new" if each["path"] not in known else "has changed"
            raise KinegenError(f"{shown(each['path'])} {change} since the run that began here; {_WAYS}", shown(folder))
    if len(known) != len(run["input"]) or before["parts"] != run["parts"]:
        raise KinegenError(f"the results here are of a run with other files; {_WAYS}", shown(folder))
    if not resume:
        raise KinegenError("a run began here; go on with --resume, or begin again with --force", shown(folder))
