"""Compiled extensions that are kept from one build to the next, in the user's cache folder.

Every entry is one file, named after a digest of all that went into it, and begins with a digest of its content, so
that a damaged one is noticed. A cache that cannot be written is done without.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import shutil
import tempfile
from pathlib import Path

_ENTRIES = 200
"""Extensions kept, at some 100 kB each."""

_FAILURES = 10
"""Folders of refused sources kept."""

_DIGEST = 32


class Cache:
    """The folder of compiled extensions.

    Args:
        folder: Where it lies; by default `kinegen` in the user's cache folder.
    """

    def __init__(self, folder: Path | None = None) -> None:
        self.folder = folder or _user_cache() / "kinegen"

    def key(self, *parts: object) -> str:
        """The name of an entry, from everything that decides its content."""
        return hashlib.sha256(repr(parts).encode()).hexdigest()

    def load(self, key: str) -> bytes | None:
        """The content of an entry, or None where there is none or it is damaged."""
        path = self._path(key)
        try:
            data = path.read_bytes()
        except OSError:
            return None
        digest, content = data[:_DIGEST], data[_DIGEST:]
        if hashlib.sha256(content).digest() != digest:
            return None
        with contextlib.suppress(OSError):
            os.utime(path)  # the newest stay longest
        return content

    def save(self, key: str, content: bytes) -> None:
        """Keep an entry; nothing happens where the folder cannot be written."""
        path = self._path(key)
        with contextlib.suppress(OSError):
            path.parent.mkdir(parents=True, exist_ok=True)
            handle, name = tempfile.mkstemp(dir=path.parent)
            try:
                with os.fdopen(handle, "wb") as file:
                    file.write(hashlib.sha256(content).digest() + content)
                Path(name).replace(path)
            except BaseException:
                Path(name).unlink(missing_ok=True)
                raise
            _prune(path.parent, _ENTRIES)

    def keep(self, key: str, folder: Path) -> Path:
        """Copy a folder of refused sources to where a person can look at it.

        Args:
            key: Name of the entry that it should have become.
            folder: The sources.

        Returns:
            Where the copy lies: in the cache, or else in the folder for temporary files.
        """
        target = self.folder / "refused" / key[:16]
        try:
            shutil.copytree(folder, target, dirs_exist_ok=True)
            _prune(target.parent, _FAILURES)
        except OSError:
            target = Path(tempfile.mkdtemp(prefix="kinegen-refused-"))
            shutil.copytree(folder, target, dirs_exist_ok=True)
        return target

    def _path(self, key: str) -> Path:
        return self.folder / "extensions" / key


def _user_cache() -> Path:
    named = os.environ.get("XDG_CACHE_HOME", "")
    return Path(named) if Path(named).is_absolute() else Path("~/.cache").expanduser()


def _prune(folder: Path, keep: int) -> None:
    """Remove the oldest entries of a folder; another build may remove them at the same time."""
    with contextlib.suppress(OSError):
        entries = sorted(folder.iterdir(), key=lambda entry: -entry.stat().st_mtime_ns)
        for entry in entries[keep:]:
            if entry.is_dir():
                shutil.rmtree(entry, ignore_errors=True)
            else:
                entry.unlink(missing_ok=True)
