"""Old files for new ones: a folder as a whole, in one step of the file system.

The folder is made a second time beside the first one, with the new files, and with links to all files that stay. Then
the two change places, so that a reader finds the old files or the new ones, also if the power fails or the build is
killed. Where the system cannot do that, and where somebody works in the folder, one file is exchanged after the other:
copies of the old ones are in the folder meanwhile, and what a killed build left half done is undone by the next one.
Leftovers of a killed build are recognised by the record in them; no other folder is touched.
"""

from __future__ import annotations

import contextlib
import ctypes
import errno
import json
import os
import shutil
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path, PurePosixPath
from typing import Any

from kinegen.errors import WriteError
from kinegen.support.dataclass import dataclass
from kinegen.support.files.manifest import is_plain_path
from kinegen.support.system import can_exchange, held, is_of_this_user, sync

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
    """Return whether a file is the bytecode of one of the modules."""
    path = PurePosixPath(name)
    if path.parent.name != "__pycache__":
        return False
    return (path.parent.parent / path.name.partition(".")[0]).as_posix() in modules


def write_new(new: Path, old: Path, change: Change) -> None:
    """Write the new files of a change into a folder, newer than those in `old`, and see that they are on the disk."""
    for name, content in change.contents.items():
        path = new / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
        if path.suffix == ".py":
            _make_newer(path, old / name)
        sync(path)


def _make_newer(path: Path, old: Path) -> None:
    """Give a module another second than the old one: Python tells a changed module by its size and that second."""
    with contextlib.suppress(FileNotFoundError):
        before = old.stat().st_mtime_ns // 10**9
        if path.stat().st_mtime_ns // 10**9 <= before:
            os.utime(path, (before + 1, before + 1))


def write_record(stage: Path, folder: Path, names: Sequence[str], kept: Sequence[str]) -> None:
    """Say in a temporary folder which build it is of, before anything else is there; `kept` are names that existed."""
    record = {"kinegen_run": stage.name, "folder": folder.name, "names": list(names), "kept": list(kept)}
    (stage / RECORD).write_text(json.dumps(record), encoding="utf-8")


def record_of(stage: Path, folder: Path) -> dict[str, Any] | None:
    """Return what a build wrote into its temporary folder first; None for a folder that is not of a build here."""
    try:
        record = json.loads((stage / RECORD).read_text(encoding="utf-8"))
        is_ours = record["kinegen_run"] == stage.name and record["folder"] == folder.name and _is_own(stage)
        plain = all(is_plain_path(name) for name in (*record["names"], *record["kept"]))
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return None
    return record if is_ours and plain else None


def _is_own(stage: Path) -> bool:
    """Return whether a temporary folder was made by this user, and is no link, nor holds one that leads elsewhere."""
    status = stage.lstat()
    links = any(path.is_symlink() for path in (stage, *stage.iterdir()))
    return not links and is_of_this_user(status)


def sync_folders(folder: Path) -> None:
    """See that a folder and those below it are on the disk."""
    for root, _, _ in os.walk(folder):
        sync(Path(root))


READY = "ready"
"""Mark in a temporary folder whose copies are complete: files are being renamed."""


class LostError(WriteError):
    """The old files could not be put back; their copies stay where they are."""


def rename_each(folder: Path, change: Change) -> None:
    """Put a change into effect file by file, with copies of the old ones at hand, or take it back.

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
    """Put the old files back from their copies, those in `kept`, and remove the others among `names`.

    What was exchanged is not asked: an interrupt may fall between a step and its record.

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


__all__ = ["STAGE", "Change", "LostError", "exchange", "recover"]

# No such system call or file system, no links there, a mount point, a parent folder that is not ours.
_OTHERWISE = frozenset(
    {errno.ENOSYS, errno.EINVAL, errno.EXDEV, errno.EBUSY, errno.EPERM, errno.EACCES, errno.EROFS, errno.ENOTSUP}
    | {errno.EMLINK, errno.ENOENT}
)


def exchange(folder: Path, change: Change) -> None:
    """Put a change into effect, wholly or not at all; the folder exists, and so do those in it that get files.

    Raises:
        OSError: If it cannot be done; the folder is then as it was.
        LostError: If the old files could not be put back.
    """
    # A folder that may not be written to is left alone, though its parent would let it change places.
    if can_exchange() and os.access(folder, os.W_OK) and not _is_worked_in(folder):
        try:
            swap(folder, change)
        except OSError as error:
            if error.errno not in _OTHERWISE:
                raise
        else:
            return
    rename_each(folder, change)


def recover(folder: Path) -> None:
    """Undo what a killed build left half done in a folder, and remove its leftovers; the caller holds the lock."""
    for stage in sorted(folder.glob(f"{STAGE}*")):
        record = record_of(stage, folder)
        if record is not None:
            if (stage / READY).exists():
                roll_back(stage / "old", folder, frozenset(record["kept"]), record["names"])
            shutil.rmtree(stage, ignore_errors=True)
    for stage in sorted(folder.parent.glob(f"{STAGE}*")):
        record = record_of(stage, folder)
        if record is not None:
            dissolve(stage / folder.name, folder, frozenset(record["names"]), restore=False)
            forget(stage)


def _is_worked_in(folder: Path) -> bool:
    """Return whether this process was started inside the folder, whose terminal would be left in the old one."""
    try:
        here = Path.cwd()
        return any(place.samefile(folder) for place in (here, *here.parents))
    except OSError:
        return False


_AT_FDCWD, _RENAME_EXCHANGE = -100, 2


def swap(folder: Path, change: Change) -> None:
    """Put a change into effect in one step.

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
    # Others wait until it is cleaned up.
    with held(new):
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

    What kinegen wrote goes (`ours`), and what the folder in use has too. Anything else came in meanwhile, and is
    somebody else's: with `restore` it is moved to the folder, otherwise it stays.
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
