"""Writing a folder: only what changed, all or nothing, and one build at a time."""

from __future__ import annotations

import errno
import hashlib
import importlib.util
import json
import os
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from kinegen.errors import WriteError
from kinegen.support.files import exchange, replacing
from kinegen.support.files.manifest import MANIFEST, is_sealed_library, sealed_library
from kinegen.support.files.write import write_file, write_files

OLD = {"arm.h": "old header\n", "arm.c": "old source\n", "same.txt": "the same\n"}
NEW = {"arm.h": "new header\n", "arm.c": "new source\n", "same.txt": "the same\n", "more.c": "more\n"}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder that holds `OLD`."""
    place = tmp_path / "generated" / "arm"
    write_files(place, OLD)
    return place


@pytest.fixture(params=["as a whole", "one by one"])
def way(request: pytest.FixtureRequest, folder: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """Both ways to exchange files: the second one is taken where somebody works in the folder."""
    if request.param == "one by one":
        monkeypatch.chdir(folder)
    elif sys.platform != "linux":
        pytest.skip("folders change places on Linux alone")
    return str(request.param)


@pytest.fixture
def inside(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Files are exchanged one by one, since this process works in the folder."""
    monkeypatch.chdir(folder)


def state(folder: Path) -> dict[str, tuple[bytes, int]]:
    """Content and time of every file."""
    return {path.name: (path.read_bytes(), path.stat().st_mtime_ns) for path in folder.iterdir()}


def texts(folder: Path) -> dict[str, str]:
    """Content of every file but the list of them."""
    found = (path for path in folder.iterdir() if path.name != MANIFEST and path.is_file())
    return {path.name: path.read_text(encoding="utf-8") for path in found}


def listed(folder: Path) -> dict[str, str]:
    """The list of files that kinegen wrote."""
    files: dict[str, str] = json.loads((folder / MANIFEST).read_text())["files"]
    return files


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
    assert [(entry.path.name, entry.status) for entry in written] == [
        ("x.txt", "new"),
        ("y.bin", "new"),
        (MANIFEST, "new"),
    ]


def test_only_what_changed_is_touched(folder: Path, way: str) -> None:
    before = state(folder)

    written = write_files(folder, NEW)

    assert texts(folder) == NEW
    assert state(folder)["same.txt"] == before["same.txt"]
    assert [entry.status for entry in written] == ["changed", "changed", "unchanged", "new", "changed"]
    assert [entry.changed for entry in written] == [True, True, False, True, True]


def test_nothing_changed_touches_nothing(folder: Path) -> None:
    before = state(folder), folder.stat().st_mtime_ns

    written = write_files(folder, OLD)

    assert (state(folder), folder.stat().st_mtime_ns) == before
    assert not any(entry.changed for entry in written)


@pytest.mark.parametrize(
    "name",
    [
        "",
        ".",
        "..",
        "../a",
        "/a",
        "a\\b",
        "a\0b",
        ".kinegen-x",
        "a//b",
        "a/",
        "./a",
        "a/../b",
        "a/..",
        "a/b\\c",
        "a/.kinegen-x/b",
    ],
)
def test_only_plain_names_are_allowed(folder: Path, name: str) -> None:
    before = state(folder)

    with pytest.raises(WriteError, match="is not a plain file name; nothing was written"):
        write_files(folder, {"ok.txt": "", name: ""})

    assert state(folder) == before


TREE = {"CMakeLists.txt": "new list\n", "src/arm.c": "new source\n", "src/deep/er/arm.h": "new header\n"}


def tree(folder: Path) -> dict[str, str]:
    """Content of every file below a folder, by path."""
    paths = sorted(path for path in folder.rglob("*") if path.is_file() and path.name != MANIFEST)
    return {path.relative_to(folder).as_posix(): path.read_text(encoding="utf-8") for path in paths}


def test_files_are_written_below_the_folder(tmp_path: Path) -> None:
    written = write_files(tmp_path / "arm", TREE)
    again = write_files(tmp_path / "arm", TREE | {"src/arm.c": "changed\n"})

    assert tree(tmp_path / "arm") == TREE | {"src/arm.c": "changed\n"}
    assert [entry.status for entry in written] == ["new", "new", "new", "new"]
    assert [entry.status for entry in again] == ["unchanged", "changed", "unchanged", "changed"]
    assert [entry.path for entry in again] == [tmp_path / "arm" / name for name in (*TREE, MANIFEST)]


@pytest.mark.parametrize("number", [1, 2, 3])
def test_a_failure_half_way_leaves_the_folders_below_as_they_were(
    folder: Path, inside: None, monkeypatch: pytest.MonkeyPatch, number: int
) -> None:
    write_files(folder, OLD | {"src/arm.c": "old\n"})
    before = tree(folder)
    monkeypatch.setattr(os, "replace", fail_at(number, KeyboardInterrupt()))

    with pytest.raises(KeyboardInterrupt):
        write_files(folder, TREE)

    assert tree(folder) == before
    assert not (folder / "src" / "deep").exists()


def test_stale_files_below_the_folder_are_removed_if_an_earlier_build_wrote_them(folder: Path, way: str) -> None:
    write_files(folder, {"src/old.c": "old\n", "src/deep/old.c": "old\n"})
    (folder / "src" / "mine.c").write_text("/* Generated by kinegen 0.1.0 from arm.yaml */\n")

    written = write_files(folder, TREE, stale=lambda name: "/" in name)

    gone = [entry.path for entry in written if entry.status == "removed"]
    assert gone == [folder / "src" / "deep" / "old.c", folder / "src" / "old.c"]
    assert tree(folder) == OLD | TREE | {"src/mine.c": "/* Generated by kinegen 0.1.0 from arm.yaml */\n"}


def test_a_link_below_the_folder_is_not_followed(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "elsewhere").mkdir()
    (folder / "src").symlink_to(tmp_path / "elsewhere", target_is_directory=True)
    before = tree(folder)

    with pytest.raises(WriteError, match=r"src is a link; the earlier output is untouched"):
        write_files(folder, TREE)

    assert tree(folder) == before
    assert list((tmp_path / "elsewhere").iterdir()) == []


def test_what_a_link_leads_to_is_not_left_over(folder: Path, tmp_path: Path, way: str) -> None:
    """Somebody moved a folder with files of ours and left a link to it."""
    write_files(folder, OLD | {"src/old.c": "old\n"})
    (folder / "src").rename(tmp_path / "src")
    (folder / "src").symlink_to(tmp_path / "src", target_is_directory=True)

    write_files(folder, NEW, stale=lambda _: True)

    assert (tmp_path / "src" / "old.c").read_text() == "old\n"


def test_a_planted_record_leads_nowhere_else(folder: Path, tmp_path: Path) -> None:
    """Its names and links point at files outside."""
    (tmp_path / "victim").mkdir()
    (tmp_path / "victim" / "arm.c").write_text("mine")
    for place, link in ((folder, "old"), (folder.parent, folder.name)):
        for names in (["arm.c"], ["../../victim/arm.c"]):
            stage = place / f".kinegen-{len(names[0])}"
            stage.mkdir()
            (stage / "ready").touch()
            (stage / link).symlink_to(tmp_path / "victim", target_is_directory=True)
            record = {"kinegen_run": stage.name, "folder": folder.name, "names": names, "kept": names}
            (stage / "run.json").write_text(json.dumps(record))

    write_files(folder, NEW)

    assert (tmp_path / "victim" / "arm.c").read_text() == "mine"
    assert texts(folder).items() >= NEW.items()


def test_a_file_in_the_place_of_a_folder_is_an_error(folder: Path) -> None:
    (folder / "src").write_text("mine")

    with pytest.raises(WriteError, match="File exists; the earlier output is untouched"):
        write_files(folder, TREE)

    assert texts(folder) == OLD | {"src": "mine"}


def test_a_name_cannot_be_file_and_folder_at_once(folder: Path) -> None:
    before = state(folder)

    with pytest.raises(WriteError, match="'src' is the name of a folder too; nothing was written"):
        write_files(folder, {"src": "", "src/arm.c": ""})

    assert state(folder) == before


@pytest.mark.parametrize("number", [1, 2, 3])
@pytest.mark.parametrize("error", [KeyboardInterrupt(), OSError(errno.ENOSPC, "No space left on device")])
def test_a_failure_half_way_leaves_the_earlier_output(
    folder: Path, inside: None, monkeypatch: pytest.MonkeyPatch, number: int, error: BaseException
) -> None:
    before = state(folder)
    monkeypatch.setattr(os, "replace", fail_at(number, error))

    with pytest.raises((KeyboardInterrupt, WriteError)):
        write_files(folder, NEW)

    assert state(folder) == before


def test_a_failure_half_way_brings_removed_files_back(
    folder: Path, inside: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    before, unlink = state(folder), Path.unlink

    def fail(path: Path, *, missing_ok: bool = False) -> None:
        if path.name == "same.txt":
            raise KeyboardInterrupt
        unlink(path, missing_ok=missing_ok)

    monkeypatch.setattr(Path, "unlink", fail)

    with pytest.raises(KeyboardInterrupt):
        write_files(folder, {"more.c": ""}, stale=lambda _: True)

    assert state(folder) == before


def test_a_full_disk_is_named_and_leaves_no_trace(folder: Path, way: str, monkeypatch: pytest.MonkeyPatch) -> None:
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
        "import resource, sys; from pathlib import Path; from kinegen.support.files.write import write_files\n"
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


def test_a_name_that_is_too_long_is_named(tmp_path: Path) -> None:
    with pytest.raises(WriteError, match=r"cannot write .*: File name too long; the earlier output is untouched"):
        write_files(tmp_path / ("x" * 300), NEW)


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
    monkeypatch.setattr(exchange, "_change_places", lambda *_: (_ for _ in ()).throw(KeyboardInterrupt()))

    with pytest.raises(KeyboardInterrupt):
        write_files(tmp_path / "generated" / "arm", NEW)

    assert list(tmp_path.iterdir()) == []


def test_a_folder_in_the_place_of_a_file_is_an_error(folder: Path) -> None:
    (folder / "more.c").mkdir()

    with pytest.raises(WriteError, match=r"more\.c is a folder; move it away; nothing was written"):
        write_files(folder, NEW)

    assert (folder / "arm.c").read_text() == OLD["arm.c"]


def test_copies_are_kept_if_the_old_files_cannot_be_put_back(
    folder: Path, inside: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    replace, calls = os.replace, []

    def fail(source: Path, target: Path) -> None:
        calls.append(target)
        if len(calls) > 1:
            raise OSError(errno.EIO, "Input/output error")
        replace(source, target)

    monkeypatch.setattr(os, "replace", fail)

    with pytest.raises(WriteError, match="cannot restore the earlier output") as caught:
        write_files(folder, NEW)

    kept = Path(str(caught.value).rpartition(" ")[2])
    assert texts(kept) == {name: OLD[name] for name in ("arm.h", "arm.c")}


def test_a_second_interrupt_does_not_stop_the_way_back(
    folder: Path, inside: None, monkeypatch: pytest.MonkeyPatch
) -> None:
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


def test_a_link_is_in_the_way_and_its_target_is_not_touched(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "elsewhere").write_text("mine")
    (folder / "more.c").symlink_to(tmp_path / "elsewhere")

    with pytest.raises(WriteError, match=r"more\.c was not written by kinegen"):
        write_files(folder, NEW)
    write_files(folder, NEW, force=True)

    assert texts(folder) == NEW
    assert (tmp_path / "elsewhere").read_text() == "mine"


def test_a_link_as_folder_is_told(folder: Path, tmp_path: Path) -> None:
    link = tmp_path / "link"
    link.symlink_to(folder, target_is_directory=True)
    before = state(folder)

    with pytest.raises(WriteError, match=r"link is a symbolic link; name the folder that it points to"):
        write_files(link, NEW)

    assert state(folder) == before


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


# Whose files ----------------------------------------------------------------------------------------------------------


def test_the_list_holds_the_digest_of_each_file(folder: Path) -> None:
    assert listed(folder) == {name: hashlib.sha256(text.encode()).hexdigest() for name, text in sorted(OLD.items())}


def test_the_list_is_the_same_on_every_machine(folder: Path, tmp_path: Path) -> None:
    write_files(tmp_path / "other", {name: OLD[name] for name in reversed(OLD)} | {"_native.abi3.so": b"this machine"})

    assert (tmp_path / "other" / MANIFEST).read_bytes() == (folder / MANIFEST).read_bytes()


def test_left_over_files_are_removed_only_if_nobody_changed_them(folder: Path, way: str) -> None:
    write_files(folder, OLD | {"old.c": "old\n", "patched.c": "old\n"})
    (folder / "patched.c").write_text("old\n/* my patch */\n")
    (folder / "NOTES.md").write_text("It says: Generated by kinegen 0.1.0 from arm.yaml\n")
    (folder / "arm_patched.c").write_text("/* Generated by kinegen 0.1.0 from arm.yaml */\n")
    (folder / "mine").mkdir()
    (folder / "mine" / "deep.txt").write_text("mine")

    written = write_files(folder, NEW, stale=lambda _: True)

    assert [entry.path.name for entry in written if entry.status == "removed"] == ["old.c"]
    assert sorted(path.name for path in folder.iterdir()) == sorted(
        [*NEW, MANIFEST, "patched.c", "NOTES.md", "arm_patched.c", "mine"]
    )
    assert (folder / "mine" / "deep.txt").read_text() == "mine"
    assert "old.c" not in listed(folder)


def test_an_edited_file_is_not_replaced(folder: Path) -> None:
    (folder / "arm.c").write_text("old source\n/* my patch */\n")
    before = state(folder)

    with pytest.raises(WriteError) as caught:
        write_files(folder, NEW)

    assert str(caught.value) == (
        f"{folder / 'arm.c'} was not written by kinegen, or changed since: move it away, or replace it with --force; "
        "nothing was written"
    )
    assert state(folder) == before
    write_files(folder, NEW, force=True)
    assert texts(folder) == NEW


def test_several_files_in_the_way_are_counted(tmp_path: Path) -> None:
    for name in "abcde":
        (tmp_path / name).write_text("mine")

    with pytest.raises(WriteError, match=r"/a, .*/b, .*/c and 2 more were not written by kinegen, or changed since"):
        write_files(tmp_path, dict.fromkeys("abcde", "new"))


def test_files_of_a_release_without_lists_are_replaced_by_their_banner_and_none_is_removed(tmp_path: Path) -> None:
    banner = "/* Generated by kinegen 0.1.0 from arm.yaml */\n"
    for name in ("arm.c", "arm_old.c"):
        (tmp_path / name).write_text(banner)
    (tmp_path / "_native.abi3.so").write_bytes(b"\x7fELF kinegen_stamp")

    write_files(tmp_path, {"arm.c": "new\n", "_native.abi3.so": sealed_library(b"\x7fELF new")}, stale=lambda _: True)

    assert (tmp_path / "arm.c").read_text() == "new\n"
    assert (tmp_path / "arm_old.c").read_text() == banner
    assert is_sealed_library((tmp_path / "_native.abi3.so").read_bytes())
    (tmp_path / "arm_old.c").write_text("mine")
    with pytest.raises(WriteError, match=r"arm_old\.c was not written by kinegen"):
        write_files(tmp_path, {"arm.c": "new\n", "arm_old.c": "new\n"})


def test_an_extension_that_somebody_changed_is_neither_replaced_nor_removed(folder: Path) -> None:
    write_files(folder, OLD | {"_native.abi3.so": sealed_library(b"\x7fELF kinegen_stamp")})
    with (folder / "_native.abi3.so").open("ab") as file:
        file.write(b"mine")

    with pytest.raises(WriteError, match=r"_native\.abi3\.so was not written by kinegen, or changed since"):
        write_files(folder, OLD | {"_native.abi3.so": sealed_library(b"\x7fELF new")})
    write_files(folder, OLD, stale=lambda _: True)

    assert (folder / "_native.abi3.so").read_bytes().endswith(b"mine")


@pytest.mark.parametrize(
    "text",
    [
        "",
        "{}",
        "[]",
        '{"kinegen_manifest": 2, "files": {}}',
        '{"kinegen_manifest": 1, "files": {"../../precious": "' + "0" * 64 + '"}}',
        '{"kinegen_manifest": 1, "files": {"a.c": "0"}}',
        '{"kinegen_manifest": 1, "files": {"a.c": 7}}',
        '{"kinegen_manifest": 1, "files": []}',
        "[" * 100_000,
    ],
    ids=range(9),
)
def test_a_list_of_another_shape_is_in_the_way(folder: Path, text: str) -> None:
    (folder / MANIFEST).write_text(text)
    before = state(folder)

    with pytest.raises(WriteError, match="is not a list of files that kinegen wrote; move it away; nothing was writ"):
        write_files(folder, NEW)

    assert state(folder) == before


def test_folders_with_names_like_ours_are_nobody_elses_business(folder: Path, way: str) -> None:
    for place in (folder, folder.parent):
        (place / ".kinegen-notes").mkdir()
        (place / ".kinegen-notes" / "precious").write_text("mine")
        (place / ".kinegen-file").write_text("mine")

    write_files(folder, NEW, stale=lambda _: True)

    for place in (folder, folder.parent):
        assert (place / ".kinegen-notes" / "precious").read_text() == "mine"
        assert (place / ".kinegen-file").read_text() == "mine"


def test_what_comes_in_during_the_exchange_is_not_lost(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Somebody saves a file after the new folder was made, and before the folders change places."""
    (folder / "notes.txt").write_text("first\n")
    honest = exchange._change_places

    def late(first: Path, second: Path) -> None:
        (folder / "later.txt").write_text("mine\n")
        (folder / "draft").write_text("second\n")
        (folder / "draft").replace(folder / "notes.txt")
        honest(first, second)

    monkeypatch.setattr(exchange, "_change_places", late)

    write_files(folder, NEW)

    assert texts(folder) == NEW | {"later.txt": "mine\n", "notes.txt": "second\n"}
    assert [path.name for path in folder.parent.iterdir()] == [folder.name]


def test_a_single_file_goes_where_it_was_named_and_touches_nothing_else(folder: Path) -> None:
    (folder / ".kinegen-notes").mkdir()
    (folder / ".kinegen-notes" / "precious").write_text("mine")
    before = {path: path.stat().st_mtime_ns for path in folder.rglob("*") if path.is_file()}

    write_file(folder / "picture.svg", "<svg/>\n")
    write_file(folder / "picture.svg", "<svg></svg>\n")

    assert (folder / "picture.svg").read_text() == "<svg></svg>\n"
    assert {path: path.stat().st_mtime_ns for path in before} == before
    assert {path.name for path in folder.iterdir()} == {*OLD, MANIFEST, ".kinegen-notes", "picture.svg"}
    with pytest.raises(WriteError, match=r"cannot write .*precious/x: File exists; nothing was written"):
        write_file(folder / ".kinegen-notes" / "precious" / "x", "")


# What a kill leaves ---------------------------------------------------------------------------------------------------


HARNESS = """
import itertools, os, random, signal, sys, time
from pathlib import Path
from kinegen.support.files.write import write_files

folder, kills, number, turn = Path(sys.argv[1]), int(sys.argv[2]), random.Random(7), 0
names = [f"f{each}.py" for each in range(3)]

def write(turn):
    write_files(folder, dict.fromkeys(names, str(turn)) | {f"only_{turn % 2}": ""}, stale=lambda _: True)

def found():
    words = {path.read_text() for path in folder.glob("f*.py")}
    assert len(words) == 1 and (folder / "mine.txt").read_text() == "mine", words
    assert [path.name for path in folder.glob("only_*")] == [f"only_{int(min(words)) % 2}"]
    return int(min(words))

write(turn)
begin = time.monotonic()
write(turn + 1)
once, turn, begun = time.monotonic() - begin, turn + 1, turn + 1
for _ in range(kills):
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        for turn in itertools.count(turn + 1):
            os.write(writer, b".")
            write(turn)
    os.read(reader, 1)
    time.sleep(number.uniform(0, 2 * once))
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    os.close(reader)
    os.close(writer)
    turn = found()
print(turn - begun)
"""


@pytest.fixture
def quick_disk(tmp_path: Path) -> Iterator[Path]:
    """A folder in memory where there is one: it takes no time there to be on the disk."""
    if not os.access("/dev/shm", os.W_OK):  # noqa: S108
        yield tmp_path
        return
    folder = Path(tempfile.mkdtemp(dir="/dev/shm"))
    yield folder
    shutil.rmtree(folder)


@pytest.mark.skipif(sys.platform != "linux", reason="folders change places on Linux alone")
def test_a_file_that_nobody_may_read_is_on_the_disk_before_it_is_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file, modes = tmp_path / "picture.svg", []
    file.write_text("old", encoding="utf-8")
    file.chmod(0o200)
    monkeypatch.setattr(replacing, "sync", lambda path: modes.append(path.stat().st_mode & 0o400))

    write_file(file, "new")

    assert modes == [0o400, 0o400]
    assert file.stat().st_mode & 0o777 == 0o200


def test_500_kills_in_the_midst_of_writing_leave_old_files_or_new_ones_and_never_both(quick_disk: Path) -> None:
    """The killed process writes without a pause, so that every kill falls into an exchange."""
    folder = quick_disk / "arm"
    folder.mkdir()
    (folder / "mine.txt").write_text("mine")

    done = subprocess.run(
        [sys.executable, "-c", HARNESS, folder, "500"], capture_output=True, text=True, check=False, timeout=300
    )
    write_files(folder, {"f0.py": "the end\n"}, stale=lambda _: True)

    assert done.stderr == ""
    assert int(done.stdout) > 20
    assert sorted(path.name for path in folder.iterdir()) == ["f0.py", MANIFEST, "mine.txt"]


KILLED = """
import os, signal, sys
from pathlib import Path
from kinegen.support.files.write import write_files

os.chdir(sys.argv[1])
honest, left = os.replace, [int(sys.argv[2])]
def replace(source, target):
    left[0] -= 1
    if left[0] < 0:
        os.kill(os.getpid(), signal.SIGKILL)
    honest(source, target)
os.replace = replace
write_files(Path(sys.argv[1]), {"arm.h": "new", "arm.c": "new", "more.c": "new"}, stale=lambda _: True)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="there is no such signal there")
@pytest.mark.parametrize("step", range(5))
def test_what_was_renamed_before_a_kill_is_put_back_by_the_next_build(folder: Path, step: int) -> None:
    subprocess.run([sys.executable, "-c", KILLED, folder, str(step)], check=False)

    write_files(folder, texts(folder) if step == 4 else OLD)

    assert texts(folder) == ({"arm.h": "new", "arm.c": "new", "more.c": "new"} if step == 4 else OLD)
    assert not list(folder.glob(".kinegen-*"))


# What Python keeps ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("prefix", [None, "elsewhere"], ids=["beside", "elsewhere"])
def test_modules_of_one_size_and_second_are_not_mixed_up(
    folder: Path, tmp_path: Path, way: str, prefix: str | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Python tells stale bytecode by the size and the second of the source alone."""
    monkeypatch.setattr(sys, "pycache_prefix", prefix and str(tmp_path / prefix))
    monkeypatch.setattr(sys, "dont_write_bytecode", False)
    for number in range(10, 30):
        write_files(folder, {"module.py": f"number = {number}\n"})
        spec = importlib.util.spec_from_file_location("module", folder / "module.py")
        assert spec
        assert spec.loader
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)

        assert module.number == number


def test_bytecode_of_replaced_and_removed_modules_goes(folder: Path, way: str) -> None:
    write_files(folder, {"kept.py": "", "changed.py": "old", "gone.py": ""})
    (folder / "__pycache__").mkdir()
    for name in ("kept", "changed", "gone", "mine"):
        (folder / "__pycache__" / f"{name}.cpython-311.pyc").write_bytes(b"")

    write_files(folder, {"kept.py": "", "changed.py": "new"}, stale=lambda _: True)

    assert {path.name.partition(".")[0] for path in (folder / "__pycache__").iterdir()} == {"kept", "mine"}
