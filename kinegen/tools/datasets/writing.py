"""Writes files of results whole or not at all, by one run at a time for each output.

The system releases the lock of a process that dies, so a lock file that is left behind holds nothing back. Where a file
system has no locks, the process and the host in the file decide. The file also has the token of its run, a random
number that is in the names of its unfinished files: the next run removes exactly those.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import re
import secrets
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from kinegen.errors import KinegenError, WriteError, shown
from kinegen.support.dataclass import dataclass
from kinegen.support.files.replacing import put_in_place, remove
from kinegen.support.system import is_running, lock
from kinegen.tools.datasets.writers import WRITERS, Writer

_NAME = "kinegen-lock"
_TOKEN = re.compile(r"[0-9a-f]{16}")
_FOREIGN = "this is not what a run writes; move it away"
_MOST = 4096
"""Bytes of a lock file that are read."""


@contextmanager
def alone(folder: Path, name: str = "") -> Iterator[str]:
    """Hold an output, a folder or the one file of a name in it, while a run writes it; the folder has to exist.

    Yields:
        The token of this run, 16 hexadecimal digits. Unfinished files that a killed run left in the folder are gone.

    Raises:
        KinegenError: If another run writes there.
        WriteError: If nothing can be written there.
    """
    path = _lock_of(folder, name)
    # A link could lead to a file of the user, and opening a pipe may wait for ever.
    if path.is_symlink() or (path.exists() and not path.is_file()):
        raise KinegenError(_FOREIGN, shown(path))
    try:
        handle = _held(path)
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise WriteError(f"results cannot be written here: {reason}", shown(folder)) from error
    before = _read(handle)
    if not before and os.fstat(handle).st_size:
        os.close(handle)
        raise KinegenError(_FOREIGN, shown(path))
    try:
        if _TOKEN.fullmatch(str(before.get("token"))):
            sweep(folder, str(before["token"]))
        token = secrets.token_hex(8)
        text = json.dumps({"token": token, "pid": os.getpid(), "host": socket.gethostname()}) + "\n"
        os.ftruncate(handle, 0)
        os.lseek(handle, 0, os.SEEK_SET)
        os.write(handle, text.encode())
        try:
            yield token
        finally:
            sweep(folder, token)
    finally:
        is_gone = _is_removed(path)
        os.close(handle)
        if not is_gone:  # some systems remove no file that is open
            _is_removed(path)


def _is_removed(path: Path) -> bool:
    try:
        path.unlink()
    except OSError:
        return False
    return True


def is_held(path: Path, token: str) -> bool:
    """Tell whether a run still writes an output; a worker elsewhere may be slower than the end of its run."""
    for place in (_lock_of(path.parent, path.name), _lock_of(path.parent, "")):
        with contextlib.suppress(OSError, ValueError, TypeError, KeyError, RecursionError):
            if json.loads(place.read_bytes())["token"] == token:
                return True
    return False


def _lock_of(folder: Path, name: str) -> Path:
    return folder / (f".{name}.{_NAME}" if name else f".{_NAME}")


def unfinished(path: Path, token: str) -> Path:
    """Another name for a file, in the same folder, under which a run writes it; a new one for each call."""
    return path.with_name(f".{path.name}.unfinished-{token}-{secrets.token_hex(4)}")


def sweep(folder: Path, token: str) -> None:
    """Remove the unfinished files of one run."""
    for each in folder.glob(f".*.unfinished-{token}-????????"):
        remove(each)


def _held(path: Path) -> int:
    """Return a handle of the lock file, which no other process holds."""
    while True:
        # A link is not followed, also where it has come since.
        handle = os.open(path, os.O_RDWR | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0), 0o666)
        try:
            _take(handle, path)
            # The run that held it before may have removed the file after it was opened here.
            if os.path.samestat(os.fstat(handle), path.stat()):
                return handle
        except FileNotFoundError:
            pass
        except BaseException:
            os.close(handle)
            raise
        os.close(handle)


def _take(handle: int, path: Path) -> None:
    """Lock a file, or refuse."""
    try:
        if lock(handle):
            return
    except BlockingIOError:
        raise KinegenError(f"{_words(_read(handle))} writes here; wait until it has ended", shown(path)) from None
    holder = _read(handle)
    if holder and not _is_dead(holder):
        way = "wait until it has ended, or remove this file if it has"
        raise KinegenError(f"{_words(holder)} writes here; {way}", shown(path))


def _words(holder: dict[str, object]) -> str:
    return f"another run (process {holder.get('pid', '?')} on {shown(holder.get('host', '?'))})"


def _read(handle: int) -> dict[str, object]:
    """Return what a lock file says; nothing where a run has not written it yet."""
    os.lseek(handle, 0, os.SEEK_SET)
    try:
        found = json.loads(os.read(handle, _MOST))
    except (ValueError, RecursionError):
        return {}
    return found if isinstance(found, dict) else {}


def _is_dead(holder: dict[str, object]) -> bool:
    """Tell whether the process of a lock file is known to have ended."""
    pid = holder.get("pid")
    if holder.get("host") != socket.gethostname() or not isinstance(pid, int) or pid < 1:
        return False
    return not is_running(pid)


_BLOCK = 1 << 20
"""Bytes of a file that are read at once."""


@dataclass(frozen=True, slots=True)
class Content:
    """Bytes and digest of a file, or of the names, sizes and contents of all files of a store in their order."""

    size: int
    sha256: str


@dataclass(frozen=True, slots=True)
class Made:
    """A file that is complete: its rows, and what it holds."""

    rows: int
    content: Content


@contextmanager
def writing(path: Path, kind: str, schema: Any, compression: str, token: str) -> Iterator[Writer]:
    """Write a file, of a kind such as `parquet`, which is there when everything was written, and not before.

    What stands there is replaced at the end; the token of the run is in the name until the file is complete.

    Raises:
        WriteError: If it cannot be written, as on a full disk; nothing is left behind then.
    """

    def require_run() -> None:
        if not is_held(path, token):
            raise KinegenError("its run has ended before this file was complete", shown(path))

    draft = unfinished(path, token)
    try:
        with _reported(path):
            writer = WRITERS[kind](str(draft), schema, compression)
        yield _Reporting(writer, path)
        with _reported(path):
            writer.close()
            put_in_place(draft, path, require_run)
    finally:
        remove(draft)


def content_of(path: Path) -> Content | None:
    """Size and digest of a file or a store; None where there is neither, or it cannot be read."""
    digest, size = hashlib.sha256(), 0
    try:
        if path.is_file():
            size = _add(path, digest)
        elif path.is_dir():
            for each in sorted(path.rglob("*")):
                if each.is_file():
                    digest.update(f"{each.relative_to(path).as_posix()}\0{each.stat().st_size}\0".encode())
                    size += _add(each, digest)
        else:
            return None
    except OSError:
        return None
    return Content(size, digest.hexdigest())


def _add(path: Path, digest: Any) -> int:
    size = 0
    with path.open("rb") as file:
        while block := file.read(_BLOCK):
            digest.update(block)
            size += len(block)
    return size


@contextmanager
def _reported(path: Path) -> Iterator[None]:
    try:
        yield
    except KinegenError:
        raise
    except (OSError, ValueError, NotImplementedError) as error:
        reason = getattr(error, "strerror", None) or str(error).partition("\n")[0]
        raise WriteError(f"it cannot be written: {reason}", shown(path)) from error


class _Reporting:
    """A writer whose errors name the file."""

    def __init__(self, writer: Writer, path: Path) -> None:
        self._writer, self._path = writer, path

    def write_batch(self, batch: Any) -> None:
        """Take rows."""
        with _reported(self._path):
            self._writer.write_batch(batch)

    def close(self) -> None:
        """Nothing: `writing` closes the file."""
