"""What `kinegen.support.system` makes of a Python that lacks things, and of one of Windows."""

from __future__ import annotations

import errno
import os
import re
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from kinegen.errors import MissingToolError
from kinegen.runtime.compile import compile_extension
from kinegen.support import system
from kinegen.tools.datasets.writing import alone


class Locking:
    """`msvcrt` as far as locks go: one byte of a file is held by one open file."""

    LK_NBLCK = 2

    def __init__(self) -> None:
        self.held: dict[tuple[int, int], int] = {}

    def locking(self, handle: int, mode: int, count: int) -> None:
        """Lock a byte where the file is, or refuse as Windows does."""
        assert (mode, count) == (self.LK_NBLCK, 1)
        status, place = os.fstat(handle), os.lseek(handle, 0, os.SEEK_CUR)
        if self.held.setdefault((status.st_ino, place), handle) != handle:
            raise OSError(errno.EACCES, "Permission denied")


@pytest.fixture
def windows(monkeypatch: pytest.MonkeyPatch) -> Locking:
    """A Python without `fcntl` and with `msvcrt`."""
    locks = Locking()
    monkeypatch.setitem(sys.modules, "fcntl", None)
    monkeypatch.setitem(sys.modules, "msvcrt", locks)  # type: ignore[arg-type]
    return locks


@pytest.mark.usefixtures("windows")
def test_a_file_is_locked_by_the_other_module_beyond_its_end(tmp_path: Path) -> None:
    """Windows lets nobody read what is locked, and the file says who holds it."""
    path = tmp_path / "lock"
    path.write_bytes(b"held by me")
    first, second = (os.open(path, os.O_RDWR) for _ in range(2))

    assert system.lock(first)
    with pytest.raises(BlockingIOError):
        system.lock(second)
    assert os.read(second, 100) == b"held by me"
    assert path.stat().st_size == len(b"held by me")
    for handle in (first, second):
        os.close(handle)


def test_without_either_module_nothing_is_locked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("fcntl", "msvcrt"):
        monkeypatch.setitem(sys.modules, name, None)  # type: ignore[arg-type]
    handle = os.open(tmp_path / "lock", os.O_RDWR | os.O_CREAT)

    assert not system.lock(handle)
    with system.held(tmp_path) as alone:
        assert not alone
    os.close(handle)


def test_a_folder_is_held_by_one(tmp_path: Path) -> None:
    with system.held(tmp_path) as alone:
        assert alone
        with pytest.raises(BlockingIOError), system.held(tmp_path, 0.05):
            pass
    with system.held(tmp_path) as alone:
        assert alone
    with pytest.raises(FileNotFoundError), system.held(tmp_path / "none"):
        pass


@pytest.mark.parametrize(
    ("separator", "command", "found"),
    [
        ("/", "ccache gcc -B '/my tools'", ["ccache", "gcc", "-B", "/my tools"]),
        ("\\", r"C:\mingw\bin\gcc.exe -O1", [r"C:\mingw\bin\gcc.exe", "-O1"]),
        ("\\", r'"C:\Program Files\LLVM\clang.exe" -O1', [r"C:\Program Files\LLVM\clang.exe", "-O1"]),
    ],
)
def test_a_command_keeps_the_backslashes_between_folders(
    separator: str, command: str, found: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(system, "os", SimpleNamespace(sep=separator))

    assert system.words(command) == found


def test_a_compiler_on_windows_makes_no_extension(monkeypatch: pytest.MonkeyPatch) -> None:
    """A gcc that happens to be there would not find Python's library, and the build would fail."""
    monkeypatch.setattr(system.sys, "platform", "win32")

    with pytest.raises(MissingToolError, match="extensions are not compiled on this system"):
        compile_extension({}, (), "", "arm._native")


def test_a_folder_that_cannot_be_opened_is_taken_to_be_on_the_disk(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(path: object, flags: int) -> int:
        raise PermissionError(errno.EACCES, "Permission denied")

    (tmp_path / "file").touch()
    monkeypatch.setattr(os, "open", refuse)

    system.sync(tmp_path)
    with pytest.raises(PermissionError):
        system.sync(tmp_path / "file")


def test_the_lock_of_an_output_goes_where_no_open_file_can_be_removed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    closed, close, unlink = [], os.close, Path.unlink

    def noted(handle: int) -> None:
        closed.append(handle)
        close(handle)

    def refused(path: Path, missing_ok: bool = False) -> None:
        if not closed:
            raise PermissionError(errno.EACCES, "it is open", str(path))
        unlink(path, missing_ok)

    with alone(tmp_path):
        monkeypatch.setattr(os, "close", noted)
        monkeypatch.setattr(Path, "unlink", refused)

    assert list(tmp_path.iterdir()) == []


def test_other_modules_leave_this_to_one() -> None:
    """What they would import or ask for themselves is found by its name."""
    words = re.compile(r"import (fcntl|msvcrt|resource|pwd)\b|\bos\.(name|geteuid|killpg|getuid)\b")
    root = Path(system.__file__).parent
    found = [
        f"{path.relative_to(root)}: {word[0]}"
        for path in sorted(root.rglob("*.py"))
        if path.name != "system.py"
        for word in words.finditer(path.read_text(encoding="utf-8"))
    ]

    assert found == []
