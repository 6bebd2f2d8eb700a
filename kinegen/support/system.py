"""What differs between operating systems, in one place: locks, owners, processors, what is on the disk.

Everything here asks what Python offers and not which system it is, so that a Python that lacks something is served by
the next best. No module elsewhere imports `fcntl`, `msvcrt` or `resource`, or asks for `os.name`.
"""

from __future__ import annotations

import contextlib
import errno
import hashlib
import importlib
import os
import shlex
import signal
import stat
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

_FAR = 1 << 30
"""The byte that is locked where a lock keeps others from reading what it covers; no lock file is as long."""

_PAUSE = 0.02
"""Seconds between two tries to get a lock."""

_NO_FOLDERS = (errno.EINVAL, errno.ENOTSUP, errno.EBADF, errno.EACCES, errno.EPERM, errno.EISDIR)
"""What systems say that cannot open a folder, or cannot say of it, or of what is only read, that it is on the disk."""

_OTHERS_WRITE = stat.S_IWGRP | stat.S_IWOTH


def _module(name: str) -> Any:
    """Return a module of the standard library that not every system has; None where it is missing."""
    try:
        return importlib.import_module(name)
    except ImportError:
        return None


# Processors and processes ---------------------------------------------------------------------------------------------


def cores() -> int:
    """Return the processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def can_fork() -> bool:
    """Return whether a copy of this process can work, watched by its own clock.

    On macOS there is a fork, but libraries of the system do not survive it.
    """
    return sys.platform == "linux" and hasattr(os, "fork") and hasattr(signal, "setitimer")


def words(command: str) -> list[str]:
    """Return the words of a command line as users write it in a variable; backslashes between folders stay.

    Raises:
        ValueError: If a quotation mark is left open.
    """
    if os.sep == "/":
        return shlex.split(command)
    return [word.strip("\"'") for word in shlex.split(command, posix=False)]


def has_posix_shell() -> bool:
    """Return whether users type commands in a shell that sets variables before a command."""
    return os.name == "posix"


def builds_extensions() -> bool:
    """Return whether compiled extensions of Python are made here.

    On Windows they would need the import library of Python and another name, which nobody has tried; a compiler that
    happens to be there must not make a build fail.
    """
    return sys.platform != "win32"


def end_group(process: subprocess.Popen[str]) -> None:
    """End a process that was started as the first of a session, with all that it started, as far as that goes."""
    if hasattr(os, "killpg") and hasattr(signal, "SIGKILL"):
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(process.pid, signal.SIGKILL)
    process.kill()


def is_running(pid: int) -> bool:
    """Return whether a process of this machine may still run; True where nobody can say."""
    if not hasattr(os, "killpg"):  # there, signal 0 is not a question
        return True
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):
        return True
    return True


def limit(bounds: Mapping[str, tuple[int, int]]) -> None:
    """Bound what this process may use, where the system can, by soft and hard bounds.

    Their names are those of `resource` without `RLIMIT_`.
    """
    resource = _module("resource")
    for name, bound in bounds.items():
        with contextlib.suppress(AttributeError, ValueError, OSError):
            resource.setrlimit(getattr(resource, f"RLIMIT_{name}"), bound)


# Owners ---------------------------------------------------------------------------------------------------------------


def is_of_this_user(status: os.stat_result) -> bool:
    """Return whether a file or folder belongs to the user of this process; True where files have no such owner."""
    return not hasattr(os, "geteuid") or status.st_uid == os.geteuid()


def others_may_write(status: os.stat_result) -> bool:
    """Return whether users besides the owner may write to it; False where its mode does not say so."""
    return hasattr(os, "geteuid") and bool(status.st_mode & _OTHERS_WRITE)


# The disk -------------------------------------------------------------------------------------------------------------


def can_exchange() -> bool:
    """Return whether the system may know a step in which two folders change places, and links for files that stay."""
    return sys.platform == "linux" and hasattr(os, "link") and hasattr(os, "chown")


def sync(path: Path) -> None:
    """See that a file or a folder is on the disk; where a system or its file system cannot say so, nothing happens."""
    try:
        handle = os.open(path, os.O_RDONLY)
    except OSError as error:
        if path.is_dir() and error.errno in _NO_FOLDERS:
            return
        raise
    try:
        os.fsync(handle)
    except OSError as error:
        if error.errno not in _NO_FOLDERS:
            raise
    finally:
        os.close(handle)


# Locks ----------------------------------------------------------------------------------------------------------------


def lock(handle: int) -> bool:
    """Lock an open file, by its number, against other processes, until it is closed or this process ends.

    Returns:
        Whether it is locked; False where the system or its file system has no locks.

    Raises:
        BlockingIOError: If another process holds the lock.
    """
    fcntl, msvcrt = _module("fcntl"), _module("msvcrt")
    if fcntl is not None:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise
        except OSError:
            return False
        return True
    if msvcrt is None:
        return False
    os.lseek(handle, _FAR, os.SEEK_SET)
    try:
        msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)
    except OSError as error:
        raise BlockingIOError(errno.EWOULDBLOCK, os.strerror(errno.EWOULDBLOCK)) from error
    finally:
        os.lseek(handle, 0, os.SEEK_SET)
    return True


@contextmanager
def held(folder: Path, patience: float = 0.0) -> Iterator[bool]:
    """Hold a folder against other processes that ask for it.

    The lock is on the folder itself, so that no file is left in it. Where folders cannot be opened it is on a file in
    the folder for temporary files, whose name is made of the folder's.

    Yields:
        Whether this process holds it alone; False where there are no locks.

    Raises:
        BlockingIOError: If another process holds it for longer than the patience in seconds.
        FileNotFoundError: If the folder is gone.
    """
    deadline = time.monotonic() + patience
    while True:
        handle, is_folder = _opened(folder)
        try:
            alone = _locked(handle, deadline)
            # Another process may have exchanged or removed the folder while we waited.
            if not is_folder or os.path.samestat(os.fstat(handle), folder.stat()):
                yield alone
                return
        finally:
            os.close(handle)


def _opened(folder: Path) -> tuple[int, bool]:
    """Return what is locked for a folder, and whether it is the folder itself."""
    try:
        return os.open(folder, os.O_RDONLY), True
    except OSError as error:
        if not folder.is_dir() or error.errno not in _NO_FOLDERS:
            raise
    name = hashlib.sha256(os.path.normcase(folder.resolve()).encode(errors="surrogatepass")).hexdigest()[:32]
    return os.open(Path(tempfile.gettempdir()) / f"kinegen-{name}.lock", os.O_RDWR | os.O_CREAT, 0o600), False


def _locked(handle: int, deadline: float) -> bool:
    while True:
        try:
            return lock(handle)
        except BlockingIOError:
            if time.monotonic() >= deadline:
                raise
            time.sleep(_PAUSE)


def runs_programs(folder: Path) -> bool:
    """Return whether the file system of a folder lets programs and libraries run; true where that cannot be asked."""
    if not hasattr(os, "statvfs"):
        return True
    return not os.statvfs(folder).f_flag & getattr(os, "ST_NOEXEC", 0)
