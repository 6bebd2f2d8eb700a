"""Takes something away that Windows or macOS lack, and then does what depends on it.

    python without.py NAME,... ARGUMENT...    runs the command line
    python without.py NAME,...                calls the functions that know of such things, in the working folder

It is run as a program of its own, since modules look for these things when they are imported.
"""

from __future__ import annotations

import ctypes
import os
import signal
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any


def _module(name: str) -> Callable[[], None]:
    def take_away() -> None:
        sys.modules[name] = None  # type: ignore[assignment] # an import of it fails then

    return take_away


def _names(module: Any, *names: str) -> Callable[[], None]:
    def take_away() -> None:
        for name in names:
            delattr(module, name)

    return take_away


def _folders() -> None:
    """A folder cannot be opened, as on Windows."""
    before = os.open

    def opened(path: Any, *arguments: Any, **more: Any) -> int:
        if not isinstance(path, int) and os.path.isdir(path):  # noqa: PTH112
            raise PermissionError(13, "Permission denied", str(path))
        return before(path, *arguments, **more)

    os.open = opened


def _renameat2() -> None:
    """The program itself is no library, as on Windows, so that no function of the system is found in it."""
    before = ctypes.CDLL

    def library(name: Any, *arguments: Any, **more: Any) -> Any:
        if name is None:
            raise OSError("there is no such library")
        return before(name, *arguments, **more)

    ctypes.CDLL = library  # type: ignore[assignment, misc]


LACKS: dict[str, Callable[[], None]] = {
    "fcntl": _module("fcntl"),
    "resource": _module("resource"),
    "pwd": _module("pwd"),
    "grp": _module("grp"),
    "termios": _module("termios"),
    "os.fork": _names(os, "fork"),
    "owners": _names(os, "geteuid", "getuid", "getegid", "getgid", "chown"),
    "groups of processes": _names(os, "killpg", "setsid", "getpgid"),
    "signals": _names(signal, "setitimer", "pthread_sigmask"),
    "sched_getaffinity": _names(os, "sched_getaffinity"),
    "links": _names(os, "link", "O_NOFOLLOW"),
    "statvfs": _names(os, "statvfs"),
    "open folders": _folders,
    "renameat2": _renameat2,
}
"""What is taken away, and how."""


def main() -> int:
    """Take away, then work."""
    for name in filter(None, sys.argv[1].split(",")):
        LACKS[name]()
    if sys.argv[2:]:
        from kinegen.ui.cli import main as kinegen

        return kinegen(sys.argv[2:])
    for work in (write, keep, hold, call):
        work()
    return 0


def write() -> None:
    """Files of a folder, twice: what has changed is exchanged, what is left over is removed."""
    from kinegen.support.files.manifest import check_place
    from kinegen.support.files.write import check_files, write_file, write_files

    folder = Path("out")
    check_place(folder)
    write_files(folder, {"a.txt": "1", "b.txt": "2", "same.txt": "", "below/c.py": "3 = 3"})
    check_files(folder, {"a.txt": "4"})
    write_files(folder, {"a.txt": "4", "same.txt": "", "below/c.py": "c = 3"}, stale=lambda _: True)
    write_file(Path("one.txt"), "5")
    found = {path.name: path.read_text("utf-8") for path in folder.rglob("*") if path.is_file()}
    del found["kinegen-manifest.json"]
    assert found == {"a.txt": "4", "same.txt": "", "c.py": "c = 3"}, found


def keep() -> None:
    """An entry of the cache, which belongs to this user."""
    from kinegen.runtime.cache import Cache

    cache = Cache(Path("cache"))
    cache.save("key", b"content")
    assert (cache.load("key"), cache.refusal) == (b"content", "")


def hold() -> None:
    """An output of `kinegen eval`: one run at a time, and nothing is left of its lock."""
    from kinegen.errors import KinegenError
    from kinegen.tools.datasets.writing import alone

    folder = Path("results")
    folder.mkdir()
    for _ in range(2):
        with alone(folder):
            try:
                with alone(folder):
                    raise AssertionError("two runs write to one output")
            except KinegenError as error:
                assert "writes here" in error.message, error  # noqa: PT017
    assert not list(folder.iterdir())


def call() -> None:
    """Work in a process of its own or in this one, with all processors, and a compiler that is ended."""
    import subprocess

    from kinegen.support import system
    from kinegen.verify.isolation import isolated

    assert isolated("arm", lambda: [1]) == [1]
    assert system.cores() >= 1
    assert system.is_running(os.getpid())
    system.limit({"CORE": (0, 0)})
    with subprocess.Popen([sys.executable, "-c", "input()"], stdin=-1, text=True, start_new_session=True) as process:
        system.end_group(process)
    assert process.returncode


if __name__ == "__main__":
    sys.exit(main())
