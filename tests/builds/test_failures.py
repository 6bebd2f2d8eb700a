"""Whatever goes wrong leaves the earlier output whole and says what happened."""

from __future__ import annotations

import contextlib
import errno
import os
import shutil
import signal
import stat
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

from kinegen.backends.scalar_types import ScalarType
from kinegen.driver import pipeline as building
from kinegen.errors import CompileError, KinegenError, ProofError, RobotFileError, WriteError
from kinegen.runtime.compiler import Compiler
from tests.builds.workshop import ARM, ROOT, contents, make, picture, write_robot


def script(folder: Path, text: str) -> Path:
    """A program of a few lines of shell."""
    path = folder / "compiler"
    path.write_text(f"#!/bin/sh\n{text}\n", encoding="utf-8")
    path.chmod(path.stat().st_mode | stat.S_IXUSR)
    return path


def without_compilers(tmp_path: Path, patch: pytest.MonkeyPatch) -> None:
    """A PATH on which nothing lies."""
    (tmp_path / "empty").mkdir()
    patch.setenv("PATH", str(tmp_path / "empty"))


def test_without_a_compiler_the_package_evaluates_with_numpy_and_a_note_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    without_compilers(tmp_path, monkeypatch)
    result = make(write_robot(tmp_path), tmp_path / "out")

    assert result.backend == "numpy"
    missing = (
        "there is no C compiler (none of cc, gcc, clang was found): install one, for example with `apt install gcc`"
    )
    assert result.notes == (f"{missing}; the module evaluates with NumPy until then",)
    assert "arm/arm.c" in contents(tmp_path / "out")
    assert "arm/_native.abi3.so" not in contents(tmp_path / "out")
    assert result.proof.holds


def test_an_extension_of_other_sources_does_not_outlive_a_build_without_a_compiler(
    earlier: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The old one would be refused by its stamp, with a warning at every import."""
    without_compilers(tmp_path, monkeypatch)
    make(write_robot(tmp_path, ARM.replace("0.25", "0.26")), earlier)

    assert "arm/_native.abi3.so" not in contents(earlier)


def test_a_compiler_that_is_named_and_missing_is_an_error(
    earlier: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = picture(earlier)
    monkeypatch.setenv("CC", "no-such-compiler -m32")

    with pytest.raises(CompileError, match="CC names no-such-compiler, which does not exist or is not a program"):
        make(write_robot(tmp_path), earlier)

    assert picture(earlier) == before


def test_what_a_bad_compiler_made_is_not_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It writes a library that does not load while something behind it is broken, which nobody can see from outside."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    broken = tmp_path / "broken"
    broken.touch()
    spoil = f'cc "$@" || exit 1\ncase "$*" in *-shared*) [ ! -e {broken} ] || echo no library >_native.abi3.so;; esac'
    monkeypatch.setenv("CC", str(script(tmp_path, spoil)))
    path = write_robot(tmp_path)

    with pytest.raises(CompileError, match="the compiled module cannot be verified on this machine"):
        make(path, tmp_path / "out")

    broken.unlink()
    assert make(path, tmp_path / "out").backend == "c"


def test_an_extension_whose_proof_fails_is_forgotten(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also one that came from the cache."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    path = write_robot(tmp_path)
    make(path, tmp_path / "out")

    def refuse(*_: Any) -> Any:
        raise ProofError("it differs")

    with monkeypatch.context() as patch:
        patch.setattr(building, "cached_proof", refuse)
        with pytest.raises(ProofError):
            make(path, tmp_path / "out")

    compiled = next(stage for stage in make(path, tmp_path / "out").stages if stage.name == "compile")
    assert compiled.detail == "_native.abi3.so"


def test_a_compiler_that_fails_without_a_word_is_told(
    earlier: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = picture(earlier)
    monkeypatch.setenv("CC", "/bin/false")

    with pytest.raises(CompileError, match=r"/bin/false refuses \S+: it ended with status 1 \(sources kept in "):
        make(write_robot(tmp_path), earlier)

    assert picture(earlier) == before


def test_the_words_of_a_failing_compiler_are_repeated(
    earlier: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = picture(earlier)
    words = "arm.c:3:1: error: no room in the inn"
    monkeypatch.setenv("CC", str(script(tmp_path, f'[ "$1" = --version ] && exit 0\necho "{words}" >&2\nexit 1')))

    with pytest.raises(CompileError) as caught:
        make(write_robot(tmp_path), earlier)

    assert words in str(caught.value)
    kept = Path(str(caught.value).rpartition("sources kept in ")[2].rstrip(")"))
    assert (kept / "arm.c").is_file()
    assert picture(earlier) == before


def test_a_compiler_that_writes_rubbish_is_noticed(
    earlier: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It says that all went well, and leaves files that are no objects."""
    before = picture(earlier)
    rubbish = 'for word; do [ "$last" = -o ] && echo rubbish >"$word"; last=$word; done\nfor word; do :; done\n'
    rubbish += 'case "$word" in *.c) echo rubbish >"${word%.c}.o";; esac'
    monkeypatch.setenv("CC", str(script(tmp_path, rubbish)))

    with pytest.raises(CompileError):
        make(write_robot(tmp_path), earlier)

    assert picture(earlier) == before


def test_a_compiler_that_is_no_program_is_told(earlier: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = picture(earlier)
    compiler = script(tmp_path, "")
    compiler.write_bytes(b"\0\1\2 no program")
    monkeypatch.setenv("CC", str(compiler))

    with pytest.raises(KinegenError, match="cannot be run: Exec format error"):
        make(write_robot(tmp_path), earlier)

    assert picture(earlier) == before


def test_an_edited_file_leaves_the_earlier_output_and_force_replaces_it(earlier: Path, tmp_path: Path) -> None:
    with (earlier / "arm" / "arm.c").open("a", encoding="utf-8") as file:
        file.write("/* mine */\n")
    before = picture(earlier)

    with pytest.raises(WriteError, match=r"arm\.c was not written by kinegen, or changed since: move it away, or"):
        make(write_robot(tmp_path), earlier, compile=False)

    assert picture(earlier) == before
    make(write_robot(tmp_path), earlier, compile=False, force=True)
    assert b"mine" not in contents(earlier)["arm/arm.c"]


def test_a_bad_robot_file_leaves_the_earlier_output(earlier: Path, tmp_path: Path) -> None:
    before = picture(earlier)

    with pytest.raises(RobotFileError, match=r"arm\.yaml:9: joint 1 \(shoulder\): unknown key 'aplha'"):
        make(write_robot(tmp_path, ARM.replace("alpha: 90", "aplha: 90")), earlier)

    assert picture(earlier) == before


def test_a_file_in_the_way_of_the_folder_is_named(tmp_path: Path) -> None:
    (tmp_path / "out").write_text("mine", encoding="utf-8")

    with pytest.raises(WriteError, match=r"cannot write .*out/arm: Not a directory; the earlier output is untouched"):
        make(write_robot(tmp_path), tmp_path / "out", compile=False)

    assert (tmp_path / "out").read_text(encoding="utf-8") == "mine"


@pytest.mark.skipif(os.name != "posix" or os.geteuid() == 0, reason="root may write anywhere")
def test_an_unwritable_folder_is_named(earlier: Path, tmp_path: Path) -> None:
    (earlier / "arm").chmod(0o555)
    before = picture(earlier)

    with pytest.raises(WriteError, match="Permission denied; the earlier output is untouched"):
        make(write_robot(tmp_path), earlier, compile=False)

    (earlier / "arm").chmod(0o755)
    assert picture(earlier) == before


def full_disk(*_: Any, **__: Any) -> None:
    raise OSError(errno.ENOSPC, "No space left on device")


def test_a_full_disk_leaves_the_earlier_output(earlier: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = picture(earlier)
    honest = Path.write_bytes

    def write(path: Path, content: bytes) -> int:
        if path.name == "arm.c" and earlier in path.parents:
            honest(path, content[:100])
            full_disk()
        return honest(path, content)

    monkeypatch.setattr(Path, "write_bytes", write)

    with pytest.raises(WriteError, match="No space left on device; the earlier output is untouched"):
        make(write_robot(tmp_path), earlier, compile=False)

    assert picture(earlier) == before


@pytest.fixture
def disk(tmp_path: Path) -> Iterator[Path]:
    """A disk of its own of half a megabyte, where one may be had."""
    folder = tmp_path / "disk"
    folder.mkdir()
    command = ["mount", "-t", "tmpfs", "-o", "size=512k", "tmpfs", str(folder)]
    may = sys.platform == "linux" and os.geteuid() == 0
    if not may or subprocess.run(command, capture_output=True, check=False).returncode:
        pytest.skip("needs a disk of its own, which only root can have, and not everywhere")
    yield folder
    subprocess.run(["umount", "-l", str(folder)], check=True)


def test_a_disk_that_is_really_full_leaves_the_earlier_output(disk: Path, earlier: Path, tmp_path: Path) -> None:
    shutil.copytree(earlier, disk / "out")
    before = picture(disk / "out")
    with contextlib.suppress(OSError), (disk / "filler").open("wb", buffering=0) as filler:
        while True:
            filler.write(bytes(4096))

    with pytest.raises(WriteError, match="No space left on device; the earlier output is untouched"):
        make(write_robot(tmp_path), disk / "out")

    assert picture(disk / "out") == before


def test_a_disk_that_is_read_only_leaves_the_earlier_output(disk: Path, earlier: Path, tmp_path: Path) -> None:
    shutil.copytree(earlier, disk / "out")
    before = picture(disk / "out")
    subprocess.run(["mount", "-o", "remount,ro", str(disk)], check=True)

    with pytest.raises(WriteError, match="Read-only file system; the earlier output is untouched"):
        make(write_robot(tmp_path), disk / "out")

    assert picture(disk / "out") == before


@pytest.mark.parametrize("compiled", [True, False], ids=["compiling", "proving"])
def test_a_full_folder_for_temporary_files_is_told(
    compiled: bool, earlier: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Compiling and proving work there; the message says where, and what to do."""
    before = picture(earlier)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "nothing known"))
    monkeypatch.setattr("tempfile.mkdtemp", full_disk)

    with pytest.raises(KinegenError) as caught:
        make(write_robot(tmp_path), earlier, compile=compiled)

    assert "No space left on device" in str(caught.value)
    assert "temporary files" in str(caught.value)
    assert picture(earlier) == before


STAGES = ("load", "derive", "lower", "bundle_of", "texts_of", "build_extension", "cached_proof", "write_files")


@pytest.mark.parametrize("stage", STAGES)
@pytest.mark.parametrize("moment", ["before", "after"])
def test_an_interrupt_in_any_stage_leaves_the_earlier_output(
    stage: str, moment: str, earlier: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Ctrl-C as a stage begins, or as it ends; only the last one has written then, and wholly."""
    before = picture(earlier)
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(temporary))
    honest: Callable[..., Any] = getattr(building, stage)

    def interrupted(*arguments: Any, **options: Any) -> Any:
        if moment == "after":
            honest(*arguments, **options)
        raise KeyboardInterrupt

    monkeypatch.setattr(building, stage, interrupted)

    with pytest.raises(KeyboardInterrupt):
        make(write_robot(tmp_path), earlier)

    if (stage, moment) == ("write_files", "after"):
        assert b"0.25" in contents(earlier)["arm/arm.c"]
    else:
        assert picture(earlier) == before
    assert list(temporary.iterdir()) == []


ONCE = """
import sys
from pathlib import Path
from tests.builds.workshop import make

try:
    make(Path(sys.argv[1]), Path(sys.argv[2]))
except KeyboardInterrupt:
    print("interrupted")
"""


@pytest.mark.skipif(os.name != "posix", reason="Ctrl-C goes to a group of processes on POSIX")
def test_ctrl_c_while_the_compiler_runs_ends_everything(earlier: Path, tmp_path: Path) -> None:
    """The terminal sends it to the compilers too; none is started after it, and no folder stays."""
    before = picture(earlier)
    pids, temporary = tmp_path / "pids", tmp_path / "temporary"
    temporary.mkdir()
    compiler = script(tmp_path, f'[ "$1" = --version ] && exit 0\necho $$ >>{pids}\nexec sleep 60')
    environment = {**os.environ, "CC": str(compiler), "PYTHONPATH": str(ROOT), "TMPDIR": str(temporary)}
    with subprocess.Popen(
        [sys.executable, "-c", ONCE, str(write_robot(tmp_path)), str(earlier)],
        env=environment | {"XDG_CACHE_HOME": str(tmp_path / "fresh")},
        stdout=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as build:
        while not pids.exists() and build.poll() is None:
            time.sleep(0.05)
        os.killpg(build.pid, signal.SIGINT)
        try:
            output, _ = build.communicate(timeout=30)
        finally:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(build.pid, signal.SIGKILL)

    assert output == "interrupted\n"
    assert picture(earlier) == before
    assert list(temporary.iterdir()) == []


def test_ctrl_c_while_compilers_are_begun_ends_those_that_run(
    earlier: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One runs already while the others wait for a thread; it does not come to its end."""
    running, ended = tmp_path / "running", tmp_path / "ended"
    compiler = script(tmp_path, f'[ "$1" = --version ] && exit 0\n>{running}\nsleep 20\n>{ended}')
    monkeypatch.setenv("CC", str(compiler))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "fresh"))
    honest = ThreadPoolExecutor.submit

    def interrupted(pool: ThreadPoolExecutor, function: Any, /, *arguments: Any, **options: Any) -> Any:
        if not isinstance(getattr(function, "__self__", None), Compiler):
            return honest(pool, function, *arguments, **options)
        if running.exists():
            raise KeyboardInterrupt
        future = honest(pool, function, *arguments, **options)
        while not running.exists():
            time.sleep(0.01)
        return future

    monkeypatch.setattr(ThreadPoolExecutor, "submit", interrupted)

    with pytest.raises(KeyboardInterrupt):
        make(write_robot(tmp_path), earlier)

    assert not ended.exists()


LOOP = """
import sys, time
from pathlib import Path
from tests.builds.workshop import make
from kinegen.backends.scalar_types import (ScalarType)

path, output, reals, until = Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3], time.monotonic() + 2
chosen = tuple(ScalarType(real) for real in reals.split(","))
rounds = 0
while rounds < 3 or time.monotonic() < until:
    make(path, output, reals=chosen, compile=False)
    rounds += 1
print(rounds)
"""


def test_two_builds_of_one_robot_at_once_do_not_mix(tmp_path: Path) -> None:
    """Two processes write different files of one package in turn; at the end one of them has won, wholly."""
    path = write_robot(tmp_path)
    other = write_robot(tmp_path / "other", ARM.replace("0.25", "0.75"))
    alone = {}
    for number, (robot, reals) in enumerate(((path, tuple(ScalarType)), (other, (ScalarType.DOUBLE,)))):
        make(robot, tmp_path / f"alone{number}", reals=reals, compile=False)
        alone[number] = contents(tmp_path / f"alone{number}")
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    jobs = [
        subprocess.Popen(
            [sys.executable, "-c", LOOP, str(robot), str(tmp_path / "out"), reals],
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        for robot, reals in ((path, "double,float"), (other, "double"))
    ]
    outcomes = [job.communicate(timeout=50) for job in jobs]

    assert [error for _, error in outcomes] == ["", ""]
    assert all(int(rounds) >= 3 for rounds, _ in outcomes)
    assert contents(tmp_path / "out") in alone.values()


def test_a_robot_file_with_a_name_that_is_no_text_is_built(tmp_path: Path) -> None:
    """File names are bytes; the banner shows what it can."""
    name = os.fsdecode(b"arm\xff.yaml")
    try:
        path = write_robot(tmp_path, name=name)
    except OSError:
        pytest.skip("the file system takes text alone")
    result = make(path, tmp_path / "out", compile=False)

    assert result.proof.holds
    assert b"Generated by kinegen" in contents(tmp_path / "out")["arm/arm.h"]
