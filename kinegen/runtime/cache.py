"""What is kept from one build to the next, in the user's cache folder: compiled extensions, proofs and figures.

Every entry is one file, named after a digest of all that went into it, and begins with a digest of its name and
content, so that one that is damaged, or was meant for something else, is noticed. Records are JSON with the shape of
their types (see `records`); nothing that is read can run. A folder or an entry of another user, or one that others may
write to, is not used. A cache that cannot be written is done without.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import shutil
import tempfile
from pathlib import Path
from typing import Any, TypeVar

from kinegen.support.records import from_plain, to_plain
from kinegen.support.system import is_of_this_user, others_may_write

Record = TypeVar("Record")

_ENTRIES = 200
"""Entries kept; the largest are extensions, at some 100 kB each."""

_FAILURES = 10
"""Folders of refused sources kept."""

_DIGEST = 32


class Cache:
    """The folder of what is kept.

    Args:
        folder: Where it is; by default `kinegen` in the user's cache folder, and nowhere if there is no home folder.
        shelf: Folder of the entries in it. Small entries that every command needs have one of their own, from which
            extensions do not displace them.
    """

    def __init__(self, folder: Path | None = None, shelf: str = "extensions") -> None:
        self.folder = folder or _user_folder()
        self.shelf = shelf
        self.refusal = "" if self.folder is None else _refusal(self.folder, shelf)
        """Why the folder is not used, in one line; empty where it is."""

    def key(self, *parts: object) -> str:
        """The name of an entry, from everything that decides its content."""
        return hashlib.sha256(repr(parts).encode(errors="surrogatepass")).hexdigest()

    def load(self, key: str) -> bytes | None:
        """The content of an entry, or None where there is none, or it is damaged, or not of this user alone."""
        path = self._path(key)
        if path is None:
            return None
        try:
            with path.open("rb") as file:
                if not _is_own(os.fstat(file.fileno())):
                    return None
                data = file.read()
        except OSError:
            return None
        digest, content = data[:_DIGEST], data[_DIGEST:]
        if _seal(key, content) != digest:
            return None
        with contextlib.suppress(OSError):
            os.utime(path)  # the newest stay longest
        return content

    def save(self, key: str, content: bytes) -> None:
        """Keep an entry; nothing happens where the folder cannot be written."""
        path = self._path(key)
        if path is None:
            return
        with contextlib.suppress(OSError):
            _make_private(path.parent)
            handle, name = tempfile.mkstemp(dir=path.parent)
            try:
                with os.fdopen(handle, "wb") as file:
                    file.write(_seal(key, content) + content)
                Path(name).replace(path)
            except BaseException:
                Path(name).unlink(missing_ok=True)
                raise
            _prune(path.parent, _ENTRIES)

    def forget(self, key: str) -> None:
        """Remove an entry."""
        path = self._path(key)
        if path is not None:
            with contextlib.suppress(OSError):
                path.unlink()

    def load_record(self, key: str, kind: type[Record]) -> Record | None:
        """A record that was kept, or None where there is none, or what is kept has another shape.

        Args:
            key: Name of the entry.
            kind: The type of the record.
        """
        known = self.load(key)
        if known is None:
            return None
        try:
            return from_plain(kind, json.loads(known))
        except (ValueError, TypeError, RecursionError):
            return None

    def save_record(self, key: str, record: Any) -> None:
        """Keep a record."""
        self.save(key, json.dumps(to_plain(record)).encode())

    def keep(self, key: str, folder: Path) -> Path:
        """Copy a folder of refused sources to where a person can look at it.

        Args:
            key: Name of the entry that it should have become.
            folder: The sources.

        Returns:
            Where the copy lies: in the cache, or else in the folder for temporary files.
        """
        if self.folder is not None and not self.refusal:
            target = self.folder / "refused" / key[:16]
            with contextlib.suppress(OSError):
                _make_private(target.parent)
                shutil.copytree(folder, target, dirs_exist_ok=True)
                _prune(target.parent, _FAILURES)
                return target
        target = Path(tempfile.mkdtemp(prefix="kinegen-refused-"))
        shutil.copytree(folder, target, dirs_exist_ok=True)
        return target

    def _path(self, key: str) -> Path | None:
        return self.folder / self.shelf / key if self.folder and key and not self.refusal else None


def _seal(key: str, content: bytes) -> bytes:
    """The digest that an entry begins with."""
    return hashlib.sha256(f"{key}\0".encode() + content).digest()


def _user_folder() -> Path | None:
    named = os.environ.get("XDG_CACHE_HOME", "")
    if Path(named).is_absolute():
        return Path(named) / "kinegen"
    try:
        home = Path.home()
    except RuntimeError:
        return None
    # A home folder that does not exist, as some service users have, is not made.
    return home / ".cache" / "kinegen" if os.environ.get("HOME", "?") and home.is_dir() else None


def _refusal(folder: Path, shelf: str) -> str:
    """Why a folder is not to be trusted; empty if it is, or does not exist yet."""
    for place in (folder, folder / shelf):
        try:
            status = place.stat()
        except OSError:
            continue
        if not is_of_this_user(status):
            return f"the cache {place} is not used, since it belongs to another user; XDG_CACHE_HOME can name another"
        if others_may_write(status):
            return (
                f"the cache {place} is not used, since other users may write to it; delete it, and it is created again"
            )
    return ""


def _is_own(status: os.stat_result) -> bool:
    """Whether a file belongs to this user and nobody else may write to it."""
    return is_of_this_user(status) and not others_may_write(status)


def _make_private(folder: Path) -> None:
    """Make a folder and those above it, for this user alone, whatever new folders are usually open to."""
    for place in reversed((folder, *folder.parents)):
        if not place.is_dir():
            place.mkdir(mode=0o700, exist_ok=True)


def _prune(folder: Path, keep: int) -> None:
    """Remove the oldest entries of a folder; another build may remove them at the same time."""
    with contextlib.suppress(OSError):
        entries = sorted(folder.iterdir(), key=lambda entry: -entry.stat().st_mtime_ns)
        for entry in entries[keep:]:
            if entry.is_dir():
                shutil.rmtree(entry, ignore_errors=True)
            else:
                entry.unlink(missing_ok=True)
