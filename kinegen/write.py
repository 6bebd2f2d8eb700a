"""Text to disk: a folder gets all of its files or keeps what it had.

In: a folder, and the content of each file, also in folders below it. Files that would not change are not touched. The
others are exchanged in one step (see `exchange`), so that a full disk, an unwritable folder, Ctrl-C or a kill leaves
the earlier output whole. Only files that kinegen wrote are replaced or removed (see `manifest`). A lock on the folder
keeps two builds apart. Nothing here looks into the text or alters it.
"""

from __future__ import annotations

import contextlib
import os
import sys
import tempfile
import time
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from kinegen.errors import WriteError
from kinegen.exchange import STAGE, Change, exchange, recover
from kinegen.manifest import MANIFEST, digest_of, is_ours, is_plain_path, manifest_text, read_manifest
from kinegen.naming import EXTENSION

if sys.platform != "win32":
    import fcntl

_PATIENCE = 60.0  # seconds
_PAUSE = 0.02  # seconds
_NAMED = 3
"""Files in the way that a message names."""


@dataclass(frozen=True, slots=True)
class Written:
    """What became of one file.

    Attributes:
        path: The file.
        status: Whether it is new, has changed, is as it was, or was removed.
    """

    path: Path
    status: Literal["new", "changed", "unchanged", "removed"]

    @property
    def changed(self) -> bool:
        """Whether the file was touched."""
        return self.status != "unchanged"


def write_files(
    folder: Path,
    files: Mapping[str, str | bytes],
    stale: Callable[[str], bool] | None = None,
    *,
    force: bool = False,
    patience: float = _PATIENCE,
) -> tuple[Written, ...]:
    """Write the files of a folder, all or none, with a list of them (see `manifest`).

    Args:
        folder: The folder; made if missing.
        files: Content by plain file name, or by a path below the folder with forward slashes such as `src/arm.c`; text
            is written as UTF-8 with the line ends that it has.
        stale: Asked of each other file that an earlier build wrote and nobody changed, by its name, whether it is left
            over; those are removed. By default nothing is.
        force: Whether to replace files of these names that kinegen did not write, or that were changed since.
        patience: How long to wait for another build that writes to the folder, in seconds.

    Returns:
        What became of each file, in the order of `files`, then of the list, then the removed ones by name.

    Raises:
        WriteError: If the folder cannot be written, or a file in it is in the way; it is then as it was.
    """
    contents = {name: text.encode() if isinstance(text, str) else text for name, text in files.items()}
    places = _places(contents)
    try:
        refuse_link(folder)
        with _made(folder), _locked(folder, patience) as alone, _made_below(folder, places):
            if alone:
                recover(folder)
            return _write(folder, contents, stale, force=force)
    except OSError as error:
        reason = error.strerror or str(error)
        raise WriteError(f"cannot write {folder}: {reason}; the earlier output is untouched") from error


def refuse_link(folder: Path) -> None:
    """Refuse a folder that is a symbolic link: what lies behind it may not be meant.

    Args:
        folder: A folder that is to be written, or one that holds such folders.

    Raises:
        WriteError: If it is a link.
    """
    if folder.is_symlink():
        raise WriteError(f"{folder} is a symbolic link; name the folder that it points to; nothing was written")


def write_file(path: Path, content: str | bytes) -> None:
    """Write the one file that a user named, whole or not at all; nothing else in its folder is touched.

    Args:
        path: The file; replaced if it exists. Its folder is made if missing.
        content: What it gets; text is written as UTF-8.

    Raises:
        WriteError: If it cannot be written; an earlier file of that name is then as it was.
    """
    data = content.encode() if isinstance(content, str) else content
    try:
        # A link is followed here: the user named this very file.
        target = Path(os.path.realpath(path))
        target.parent.mkdir(parents=True, exist_ok=True)
        if target.is_dir():
            raise IsADirectoryError(f"{path} is a folder")
        handle, name = tempfile.mkstemp(prefix=STAGE, dir=target.parent)
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(data)
                file.flush()
                os.fsync(file.fileno())
            Path(name).chmod(target.stat().st_mode & 0o777 if target.exists() else 0o666 & ~_umask())
            Path(name).replace(target)
        except BaseException:
            Path(name).unlink(missing_ok=True)
            raise
    except OSError as error:
        raise WriteError(f"cannot write {path}: {error.strerror or error}; nothing was written") from error


def _umask() -> int:
    mask = os.umask(0o077)
    os.umask(mask)
    return mask


def _write(
    folder: Path, contents: dict[str, bytes], stale: Callable[[str], bool] | None, *, force: bool
) -> tuple[Written, ...]:
    listed = read_manifest(folder)
    written = tuple(Written(folder / name, _status(folder / name, content)) for name, content in contents.items())
    changed = {name: contents[name] for name, entry in zip(contents, written, strict=True) if entry.changed}
    _check_ways(folder, [name for name in changed if os.path.lexists(folder / name)], listed, force=force)
    # What an earlier build wrote besides: some of it is left over, the rest stays in the list.
    others = sorted({*(listed or {}), EXTENSION} - contents.keys())
    others = [name for name in others if is_ours(folder / name, name, listed)]
    gone = tuple(name for name in others if stale is not None and stale(name))
    digests = {name: listed[name] for name in others if name not in gone and name in listed} if listed else {}
    digests |= {name: digest_of(content) for name, content in contents.items() if name != EXTENSION}
    manifest = manifest_text(digests)
    entry = Written(folder / MANIFEST, _status(folder / MANIFEST, manifest))
    if entry.changed:
        changed[MANIFEST] = manifest
    if changed or gone:
        exchange(folder, Change(changed, gone))
    return (*written, entry, *(Written(folder / name, "removed") for name in gone))


def _check_ways(folder: Path, names: Sequence[str], listed: Mapping[str, str] | None, *, force: bool) -> None:
    """See that each file that would be replaced is kinegen's own, or may be replaced all the same."""
    folders = [name for name in names if (folder / name).is_dir() and not (folder / name).is_symlink()]
    if folders:
        raise WriteError(f"{folder / folders[0]} is a folder; move it away; nothing was written")
    foreign = [] if force else [name for name in names if not is_ours(folder / name, name, listed)]
    if foreign:
        named = ", ".join(str(folder / name) for name in foreign[:_NAMED])
        more = f" and {len(foreign) - _NAMED} more" if len(foreign) > _NAMED else ""
        verb, them = ("was", "it") if len(foreign) == 1 else ("were", "them")
        raise WriteError(
            f"{named}{more} {verb} not written by kinegen, or changed since: move {them} away, or replace {them} "
            "with --force; nothing was written"
        )


def _status(path: Path, content: bytes) -> Literal["new", "changed", "unchanged"]:
    try:
        return "unchanged" if not path.is_symlink() and path.read_bytes() == content else "changed"
    except FileNotFoundError:
        return "changed" if path.is_symlink() else "new"
    except IsADirectoryError:
        return "changed"


def _places(names: Collection[str]) -> tuple[str, ...]:
    """The folders below the main one that names stand in, each after those that hold it; no name leads elsewhere."""
    places: set[str] = set()
    for name in names:
        if not is_plain_path(name) or name == MANIFEST:
            raise WriteError(f"{name!a} is not a plain file name; nothing was written")
        parts = name.split("/")
        places |= {"/".join(parts[:end]) for end in range(1, len(parts))}
    both = places.intersection(names)
    if both:
        raise WriteError(f"{min(both)!a} is the name of a folder too; nothing was written")
    return tuple(sorted(places))


@contextlib.contextmanager
def _made_below(folder: Path, places: Sequence[str]) -> Iterator[None]:
    """Make folders below the main one, and take away what was made if nothing came of it."""
    paths = [folder / name for name in places]
    for path in paths:
        # A link could lead out of the folder, and what lies there is not ours to replace.
        if path.is_symlink():
            raise WriteError(f"{path} is a link; the earlier output is untouched")
    made: list[Path] = []
    try:
        for path in paths:
            if not path.is_dir():
                path.mkdir()
                made.append(path)
        yield
    except BaseException:
        with contextlib.suppress(OSError):
            for place in reversed(made):
                place.rmdir()
        raise


@contextlib.contextmanager
def _made(folder: Path) -> Iterator[None]:
    """Make the folder, and take away what was made if nothing came of it."""
    missing = [place for place in (folder, *folder.parents) if not place.exists()]
    folder.mkdir(parents=True, exist_ok=True)
    try:
        yield
    except BaseException:
        with contextlib.suppress(OSError):
            for place in missing:
                place.rmdir()
        raise


@contextlib.contextmanager
def _locked(folder: Path, patience: float) -> Iterator[bool]:
    """Hold the folder against other builds, and say whether that is possible here.

    The lock is on the folder itself, so no lock file is left in it.
    """
    if sys.platform == "win32":
        yield False
        return
    deadline = time.monotonic() + patience
    while True:
        handle = os.open(folder, os.O_RDONLY)
        try:
            alone = _wait(handle, folder, deadline)
            # Another build may have exchanged or removed the folder while we waited.
            if os.path.samestat(os.fstat(handle), folder.stat()):
                yield alone
                return
        finally:
            os.close(handle)


def _wait(handle: int, folder: Path, deadline: float) -> bool:
    """Wait for the lock; False on a file system without locks."""
    if sys.platform == "win32":
        return False
    while True:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            if time.monotonic() >= deadline:
                raise WriteError(
                    f"another build is still writing to {folder}; the earlier output is untouched"
                ) from None
            time.sleep(_PAUSE)
        except OSError:
            return False
        else:
            return True
