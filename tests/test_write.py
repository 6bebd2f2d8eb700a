"""Writing a folder: only what changed, all or nothing, and one build at a time."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from kinegen.errors import WriteError
from kinegen.write import is_generated, write_files

OLD = {"arm.h": "old header\n", "arm.c": "old source\n", "same.txt": "the same\n"}
NEW = {"arm.h": "new header\n", "arm.c": "new source\n", "same.txt": "the same\n", "more.c": "more\n"}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder that holds `OLD`."""
    place = tmp_path / "generated" / "arm"
    write_files(place, OLD)
    return place


def state(folder: Path) -> dict[str, tuple[bytes, int]]:
    """Content and time of every file."""
    return {path.name: (path.read_bytes(), path.stat().st_mtime_ns) for path in folder.iterdir()}


def texts(folder: Path) -> dict[str, str]:
    return {path.name: path.read_text(encoding="utf-8") for path in folder.iterdir()}


def fail_at(number: int, error: BaseException) -> Callable[..., None]:
    """A stand-in for `os.replace` that fails at one call."""
    replace, calls = os.replace, []

    def stand_in(source: Path, target: Path) -> None:
        calls.append(target)
        if len(calls) == number:
            raise error
        replace(source, target)

    return stand_in


def test_files_are_written_as_they_are(tmp_path: Path) -> None:
    written = write_files(tmp_path / "a" / "b", {"x.txt": "é\nline\r\n", "y.bin": b"\x00\xff"})

    assert (tmp_path / "a" / "b" / "x.txt").read_bytes() == b"\xc3\xa9\nline\r\n"
    assert (tmp_path / "a" / "b" / "y.bin").read_bytes() == b"\x00\xff"
    assert [(entry.path.name, entry.status) for entry in written] == [("x.txt", "new"), ("y.bin", "new")]


def test_only_what_changed_is_touched(folder: Path) -> None:
    before = state(folder)

    written = write_files(folder, NEW)

    assert texts(folder) == NEW
    assert state(folder)["same.txt"] == before["same.txt"]
    assert [entry.status for entry in written] == ["changed", "changed", "unchanged", "new"]
    assert [entry.changed for entry in written] == [True, True, False, True]


def test_nothing_changed_touches_nothing(folder: Path) -> None:
    before = state(folder), folder.stat().st_mtime_ns

    written = write_files(folder, OLD)

    assert (state(folder), folder.stat().st_mtime_ns) == before
    assert not any(entry.changed for entry in written)


@pytest.mark.parametrize("name", ["", ".", "..", "a/b", "../a", "/a", "a\\b", "a\0b", ".kinegen-x"])
def test_only_plain_names_are_allowed(folder: Path, name: str) -> None:
    before = state(folder)

    with pytest.raises(WriteError, match="is not a plain file name; nothing was written"):
        write_files(folder, {"ok.txt": "", name: ""})

    assert state(folder) == before


@pytest.mark.parametrize("number", [1, 2, 3])
@pytest.mark.parametrize("error", [KeyboardInterrupt(), OSError(errno.ENOSPC, "No space left on device")])
def test_a_failure_half_way_leaves_the_earlier_output(
    folder: Path, monkeypatch: pytest.MonkeyPatch, number: int, error: BaseException
) -> None:
    before = state(folder)
    monkeypatch.setattr(os, "replace", fail_at(number, error))

    with pytest.raises((KeyboardInterrupt, WriteError)):
        write_files(folder, NEW)

    assert state(folder) == before


def test_a_failure_half_way_brings_removed_files_back(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before, unlink = state(folder), Path.unlink

    def fail(path: Path, *, missing_ok: bool = False) -> None:
        if path.name == "same.txt":
            raise KeyboardInterrupt
        unlink(path, missing_ok=missing_ok)

    monkeypatch.setattr(Path, "unlink", fail)

    with pytest.raises(KeyboardInterrupt):
        write_files(folder, {"more.c": ""}, stale=lambda _: True)

    assert state(folder) == before


def test_a_full_disk_is_named_and_leaves_no_trace(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before, write = state(folder), Path.write_bytes

    def fail(path: Path, content: bytes) -> int:
        if path.name == "arm.c":
            write(path, content[:3])
            raise OSError(errno.ENOSPC, "No space left on device")
        return write(path, content)

    monkeypatch.setattr(Path, "write_bytes", fail)

    with pytest.raises(WriteError) as caught:
        write_files(folder, NEW)

    assert str(caught.value) == f"cannot write {folder}: No space left on device; the earlier output is untouched"
    assert state(folder) == before


@pytest.mark.skipif(sys.platform != "linux", reason="the limit on the size of files works so on Linux")
def test_a_file_that_does_not_fit_leaves_the_earlier_output(folder: Path) -> None:
    """The system itself refuses the write, as it does on a full disk."""
    before = state(folder)
    code = (
        "import resource, sys; from pathlib import Path; from kinegen.write import write_files\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))\n"
        "write_files(Path(sys.argv[1]), {'arm.h': 'x', 'arm.c': 'y' * 2000})"
    )

    done = subprocess.run([sys.executable, "-B", "-c", code, folder], capture_output=True, text=True, check=False)

    assert "WriteError" in done.stderr
    assert "File too large; the earlier output is untouched" in done.stderr
    assert state(folder) == before


def test_a_folder_that_cannot_be_made_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")

    with pytest.raises(WriteError, match=r"cannot write .*arm: Not a directory; the earlier output is untouched"):
        write_files(tmp_path / "file" / "arm", NEW)


def test_an_unwritable_folder_is_named(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if os.geteuid() == 0:  # root may write anywhere: the refusal is played
        refusal = PermissionError(errno.EACCES, "Permission denied")
        monkeypatch.setattr("tempfile.mkdtemp", lambda **_: (_ for _ in ()).throw(refusal))
    else:
        folder.chmod(0o555)
    before = state(folder)

    with pytest.raises(WriteError, match=r"cannot write .*arm: Permission denied; the earlier output is untouched"):
        write_files(folder, NEW)

    folder.chmod(0o755)
    assert state(folder) == before


def test_folders_made_for_nothing_are_taken_away(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "replace", fail_at(2, KeyboardInterrupt()))

    with pytest.raises(KeyboardInterrupt):
        write_files(tmp_path / "generated" / "arm", NEW)

    assert list(tmp_path.iterdir()) == []


def test_a_folder_in_the_place_of_a_file_is_an_error(folder: Path) -> None:
    (folder / "more.c").mkdir()

    with pytest.raises(WriteError, match="Is a directory"):
        write_files(folder, NEW)

    assert (folder / "arm.c").read_text() == OLD["arm.c"]


def test_copies_are_kept_if_the_old_files_cannot_be_put_back(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    replace, calls = os.replace, []

    def fail(source: Path, target: Path) -> None:
        calls.append(target)
        if len(calls) > 1:
            raise OSError(errno.EIO, "Input/output error")
        replace(source, target)

    monkeypatch.setattr(os, "replace", fail)

    with pytest.raises(WriteError, match="cannot put the earlier output back") as caught:
        write_files(folder, NEW)

    kept = Path(str(caught.value).rpartition(" ")[2])
    assert texts(kept) == {name: OLD[name] for name in ("arm.h", "arm.c")}


def test_a_second_interrupt_does_not_stop_the_way_back(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before, replace, calls = state(folder), os.replace, []

    def interrupted(source: Path, target: Path) -> None:
        calls.append(target)
        if len(calls) in (2, 4):
            raise KeyboardInterrupt
        replace(source, target)

    monkeypatch.setattr(os, "replace", interrupted)

    with pytest.raises(KeyboardInterrupt):
        write_files(folder, NEW)

    assert state(folder) == before


def test_leftovers_of_a_killed_build_go_away(folder: Path) -> None:
    (folder / ".kinegen-dead" / "new").mkdir(parents=True)
    (folder / ".kinegen-dead" / "new" / "arm.c").write_text("half")

    write_files(folder, NEW)

    assert texts(folder) == NEW


def test_stale_files_are_removed_if_they_are_ours(folder: Path) -> None:
    (folder / "arm_f32.c").write_text("/* Generated by kinegen 0.1.0 from arm.yaml */\n")
    (folder / "_native.abi3.so").write_bytes(b"\x7fELF")
    (folder / "notes.txt").write_text("mine\n")
    (folder / "__pycache__").mkdir()

    written = write_files(folder, NEW, stale=is_generated)

    assert [entry.path.name for entry in written if entry.status == "removed"] == ["_native.abi3.so", "arm_f32.c"]
    assert sorted(path.name for path in folder.iterdir()) == sorted([*NEW, "notes.txt", "__pycache__"])


def test_a_link_is_replaced_and_its_target_is_not(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "elsewhere").write_text("mine")
    (folder / "more.c").symlink_to(tmp_path / "elsewhere")

    write_files(folder, NEW)

    assert texts(folder) == NEW
    assert (tmp_path / "elsewhere").read_text() == "mine"


def test_two_builds_do_not_mix(tmp_path: Path) -> None:
    """Whoever comes last wins, but wholly."""
    folder = tmp_path / "arm"
    names = [f"file{number}" for number in range(20)]

    def build(word: str) -> None:
        for _ in range(5):
            write_files(folder, dict.fromkeys(names, word))

    threads = [threading.Thread(target=build, args=(word,)) for word in ("one", "two", "three")]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()

    assert sorted(texts(folder)) == sorted(names)
    assert len(set(texts(folder).values())) == 1


def test_a_build_that_never_ends_is_named(folder: Path) -> None:
    code = (
        "import fcntl, os, sys; fcntl.flock(os.open(sys.argv[1], os.O_RDONLY), fcntl.LOCK_EX)\n"
        "print(flush=True); input()"
    )
    with subprocess.Popen([sys.executable, "-c", code, folder], stdin=subprocess.PIPE, stdout=subprocess.PIPE) as other:
        assert other.stdout
        assert other.stdin
        other.stdout.readline()
        begin = time.monotonic()

        with pytest.raises(WriteError, match=r"another build is still writing to .*; the earlier output is untouched"):
            write_files(folder, NEW, patience=0.1)

        other.stdin.close()

    assert time.monotonic() - begin < 5
    assert texts(folder) == OLD
