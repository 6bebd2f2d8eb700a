"""A folder and its successor change places."""

from __future__ import annotations

import contextlib
import ctypes
import errno
import os
import shutil
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

from kinegen.exchange.change import RECORD, STAGE, Change, is_stale, sync, sync_folders, write_new, write_record

_AT_FDCWD, _RENAME_EXCHANGE = -100, 2


def swap(folder: Path, change: Change) -> None:
    """Put a change into effect in one step.

    Args:
        folder: The folder.
        change: What is written and removed.

    Raises:
        OSError: If it cannot be done so; the folder is then as it was.
    """
    stage = Path(tempfile.mkdtemp(prefix=STAGE, dir=folder.parent))
    new = stage / folder.name
    try:
        write_record(stage, folder, change.names, ())
        _copy_folder(folder, new)
        _link_rest(folder, new, frozenset(change.names), change.modules)
        write_new(new, folder, change)
        sync_folders(new)
    except BaseException:
        shutil.rmtree(stage, ignore_errors=True)
        raise
    # From here on `new` is the old folder or the new one, and only what is known to be superfluous is removed.
    with _held(new):
        try:
            _change_places(new, folder)
        except BaseException:
            # Ctrl-C may have come before the step or after it; what is removed here is superfluous in both cases.
            dissolve(new, folder, frozenset(change.names), restore=False)
            forget(stage)
            raise
        sync(folder.parent)
        dissolve(new, folder, frozenset(change.names), restore=True)
        forget(stage)


def _copy_folder(old: Path, new: Path) -> None:
    new.mkdir()
    status, made = old.stat(), new.stat()
    if (status.st_uid, status.st_gid) != (made.st_uid, made.st_gid):
        os.chown(new, status.st_uid, status.st_gid)
    shutil.copystat(old, new)


def _link_rest(old: Path, new: Path, changed: frozenset[str], modules: frozenset[str], below: str = "") -> None:
    """Link all that stays into the new folder; stale bytecode does not stay."""
    for entry in os.scandir(old):
        name = below + entry.name
        if name in changed or is_stale(name, modules):
            continue
        if entry.is_dir(follow_symlinks=False):
            _copy_folder(Path(entry.path), new / entry.name)
            _link_rest(Path(entry.path), new / entry.name, changed, modules, f"{name}/")
        else:
            os.link(entry.path, new / entry.name, follow_symlinks=False)


def _change_places(first: Path, second: Path) -> None:
    """Give two folders each other's name, in one step."""
    try:
        rename = ctypes.CDLL(None, use_errno=True).renameat2
    except (OSError, AttributeError) as error:
        raise OSError(errno.ENOSYS, os.strerror(errno.ENOSYS)) from error
    if rename(_AT_FDCWD, os.fsencode(first), _AT_FDCWD, os.fsencode(second), _RENAME_EXCHANGE):
        number = ctypes.get_errno()
        raise OSError(number, os.strerror(number), str(second))


def dissolve(old: Path, folder: Path, ours: frozenset[str], *, restore: bool) -> None:
    """Remove a folder that was replaced, or was to replace one.

    What goes is what kinegen wrote, and what lies in the folder too. Anything else came in meanwhile, and is somebody
    else's: it is moved to the folder, or else stays.

    Args:
        old: The superfluous folder.
        folder: The one in use.
        ours: The files that kinegen wrote, by name.
        restore: Whether to move what is somebody else's.
    """
    modules = frozenset(name.removesuffix(".py") for name in ours if name.endswith(".py"))
    for root, _, names in os.walk(old, topdown=False):
        for name in names:
            path = Path(root, name)
            inside = path.relative_to(old).as_posix()
            with contextlib.suppress(OSError):
                if inside in ours or is_stale(inside, modules) or _is_same(path, folder / inside):
                    path.unlink()
                elif restore:
                    (folder / inside).parent.mkdir(parents=True, exist_ok=True)
                    path.replace(folder / inside)
        with contextlib.suppress(OSError):
            Path(root).rmdir()


def _is_same(first: Path, second: Path) -> bool:
    try:
        return os.path.samestat(first.lstat(), second.lstat())
    except OSError:
        return False


def forget(stage: Path) -> None:
    """Remove a temporary folder and its record, if nothing of anybody else is left in it."""
    with contextlib.suppress(OSError):
        if [path.name for path in stage.iterdir()] in ([RECORD], []):
            (stage / RECORD).unlink(missing_ok=True)
            stage.rmdir()


@contextlib.contextmanager
def _held(folder: Path) -> Iterator[None]:
    """Hold the lock of a folder that nobody else knows yet, so that others wait until it is cleaned up."""
    if sys.platform == "win32":
        yield
        return
    import fcntl

    handle = os.open(folder, os.O_RDONLY)
    try:
        with contextlib.suppress(OSError):
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        yield
    finally:
        os.close(handle)
