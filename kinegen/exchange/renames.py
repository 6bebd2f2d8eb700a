"""One file after the other, with copies of the old ones at hand."""

from __future__ import annotations

import contextlib
import os
import shutil
import tempfile
from collections.abc import Sequence
from pathlib import Path

from kinegen.errors import WriteError
from kinegen.exchange.change import STAGE, Change, sync, sync_folders, write_new, write_record

READY = "ready"
"""Mark in a temporary folder whose copies are complete: files are being renamed."""


class LostError(WriteError):
    """The old files could not be put back; their copies stay where they are."""


def rename_each(folder: Path, change: Change) -> None:
    """Put a change into effect file by file, or take it back.

    Args:
        folder: The folder.
        change: What is written and removed.

    Raises:
        OSError: If it cannot be done; the folder is then as it was.
        LostError: If the old files could not be put back.
    """
    stage = Path(tempfile.mkdtemp(prefix=STAGE, dir=folder))
    new, old = stage / "new", stage / "old"
    kept = frozenset(name for name in change.names if os.path.lexists(folder / name))
    try:
        write_record(stage, folder, change.names, tuple(sorted(kept)))
        new.mkdir()
        write_new(new, folder, change)
        for name in kept:
            (old / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(folder / name, old / name, follow_symlinks=False)
            if not (old / name).is_symlink():
                sync(old / name)
        (stage / READY).touch()
        sync_folders(stage)
        _commit(stage, folder, change, kept)
    except LostError:
        raise
    except BaseException:
        shutil.rmtree(stage, ignore_errors=True)
        raise
    _remove_bytecode(folder, change)
    # Without its mark first: a build killed from here on has done its work.
    (stage / READY).unlink()
    shutil.rmtree(stage, ignore_errors=True)


def _commit(stage: Path, folder: Path, change: Change, kept: frozenset[str]) -> None:
    try:
        for name in change.contents:
            (stage / "new" / name).replace(folder / name)
        for name in change.gone:
            (folder / name).unlink()
    except BaseException:
        roll_back(stage / "old", folder, kept, change.names)
        raise


def _remove_bytecode(folder: Path, change: Change) -> None:
    for module in change.modules:
        path = folder / module
        for stale in (path.parent / "__pycache__").glob(f"{path.name}.*"):
            with contextlib.suppress(OSError):
                stale.unlink()


def roll_back(old: Path, folder: Path, kept: frozenset[str], names: Sequence[str]) -> None:
    """Put the old files back. What was exchanged is not asked: an interrupt may fall between a step and its record.

    Args:
        old: Folder of their copies.
        folder: The output folder.
        kept: The files that existed before.
        names: All files that the change was about.

    Raises:
        LostError: If that is not possible.
    """
    while True:
        try:
            for name in names:
                if name not in kept:
                    (folder / name).unlink(missing_ok=True)
                elif os.path.lexists(old / name):
                    (old / name).replace(folder / name)
        except KeyboardInterrupt:
            continue  # Ctrl-C once more: every step can be taken again
        except OSError as error:
            raise LostError(f"cannot restore the earlier output ({error}); its files are in {old}") from error
        return
