"""What is to change in a folder, how the new files get to the disk, and the record by which leftovers are known."""

from __future__ import annotations

import contextlib
import errno
import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any

from kinegen.manifest import is_plain_path

STAGE = ".kinegen-"
"""How the names of temporary folders begin."""

RECORD = "run.json"
"""The record in a temporary folder."""


@dataclass(frozen=True, slots=True)
class Change:
    """What becomes of a folder.

    Attributes:
        contents: The new files, by name below the folder with forward slashes.
        gone: The files that are removed.
    """

    contents: Mapping[str, bytes]
    gone: tuple[str, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """All files that the change is about."""
        return (*self.contents, *self.gone)

    @property
    def modules(self) -> frozenset[str]:
        """Paths of its Python modules without the suffix; what Python kept of these is stale."""
        return frozenset(name.removesuffix(".py") for name in self.names if name.endswith(".py"))


def is_stale(name: str, modules: frozenset[str]) -> bool:
    """Whether a file is the bytecode of one of the modules."""
    path = PurePosixPath(name)
    if path.parent.name != "__pycache__":
        return False
    return (path.parent.parent / path.name.partition(".")[0]).as_posix() in modules


def write_new(new: Path, old: Path, change: Change) -> None:
    """Write the new files of a change, and see that they are on the disk.

    Args:
        new: Folder that gets them.
        old: Folder of the files that they replace.
        change: What is written.
    """
    for name, content in change.contents.items():
        path = new / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
        if path.suffix == ".py":
            _make_newer(path, old / name)
        sync(path)


def _make_newer(path: Path, old: Path) -> None:
    """Python tells a changed module by its size and by the second of its time, so that has to be another one."""
    with contextlib.suppress(FileNotFoundError):
        before = old.stat().st_mtime_ns // 10**9
        if path.stat().st_mtime_ns // 10**9 <= before:
            os.utime(path, (before + 1, before + 1))


def write_record(stage: Path, folder: Path, names: Sequence[str], kept: Sequence[str]) -> None:
    """Say in a temporary folder which build it is of, before anything else lies there.

    Args:
        stage: The temporary folder.
        folder: The output folder.
        names: All files that the change is about.
        kept: Those of them that existed before.
    """
    record = {"kinegen_run": stage.name, "folder": folder.name, "names": list(names), "kept": list(kept)}
    (stage / RECORD).write_text(json.dumps(record), encoding="utf-8")


def record_of(stage: Path, folder: Path) -> dict[str, Any] | None:
    """What a build wrote into its temporary folder before all else; None for a folder that is not of a build here."""
    try:
        record = json.loads((stage / RECORD).read_text(encoding="utf-8"))
        is_ours = record["kinegen_run"] == stage.name and record["folder"] == folder.name and not stage.is_symlink()
        plain = all(is_plain_path(name) for name in (*record["names"], *record["kept"]))
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return None
    return record if is_ours and plain else None


def sync(path: Path) -> None:
    """See that a file or folder is on the disk; some file systems cannot say so of a folder."""
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    except OSError as error:
        if error.errno not in (errno.EINVAL, errno.ENOTSUP, errno.EBADF):
            raise
    finally:
        os.close(handle)


def sync_folders(folder: Path) -> None:
    """See that a folder and those below it are on the disk."""
    for root, _, _ in os.walk(folder):
        sync(Path(root))
