"""Compiling: what goes in, what is kept, and what a missing or refusing compiler leads to."""

from __future__ import annotations

import os
import stat
import subprocess
import sysconfig
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from kinegen.backends.files import stamp_of
from kinegen.errors import CompileError, MissingToolError
from kinegen.runtime.cffi_interface import declarations, glue
from kinegen.runtime.compile import Extension, compile_extension
from kinegen.runtime.compiler import find_compiler, processor
from kinegen.runtime.dispatch import dispatch, units
from kinegen.runtime.extension import build_extension
from kinegen.runtime.flags import Flags
from kinegen.support.naming import EXTENSION
from tests.native.conftest import SAMPLES, needs_compiler
from tests.native.sample import FLAGS, Sample

CHAIN = Sample("chain", reals=("double",))
pytestmark = needs_compiler


def compiler_script(folder: Path, text: str) -> str:
    """A compiler of one's own."""
    path = folder / "mycc"
    path.write_text(f"#!/bin/sh\n{text}\n")
    path.chmod(path.stat().st_mode | stat.S_IXUSR)
    return str(path)


def build(cache: Path, flags: Flags = FLAGS) -> bytes:
    """Compile it and keep it, as a build does whose proof holds."""
    return kept(build_extension(CHAIN.interface, CHAIN.sources(), flags, cache)).content


def kept(extension: Extension) -> Extension:
    """The extension, from now on in its cache."""
    extension.keep()
    return extension


def test_an_unchanged_build_comes_from_the_cache(tmp_path: Path) -> None:
    first = kept(build_extension(CHAIN.interface, CHAIN.sources(), FLAGS, tmp_path))
    second = build_extension(CHAIN.interface, CHAIN.sources(), FLAGS, tmp_path)

    assert (first.cached, second.cached) == (False, True)
    assert first.content == second.content


def test_what_decides_the_result_decides_the_entry(tmp_path: Path) -> None:
    build(tmp_path)
    sources = CHAIN.sources()
    sources["chain.c"] += "/* one more word */\n"

    assert not kept(build_extension(CHAIN.interface, sources, FLAGS, tmp_path)).cached
    assert not kept(build_extension(CHAIN.interface, CHAIN.sources(), Flags(march=None), tmp_path)).cached
    assert len(list((tmp_path / "extensions").iterdir())) == 3


def test_a_damaged_entry_is_built_anew(tmp_path: Path) -> None:
    content = build(tmp_path)
    (entry,) = (tmp_path / "extensions").iterdir()
    entry.write_bytes(entry.read_bytes()[:-100])

    again = kept(build_extension(CHAIN.interface, CHAIN.sources(), FLAGS, tmp_path))

    assert not again.cached
    assert again.content == content
    assert build_extension(CHAIN.interface, CHAIN.sources(), FLAGS, tmp_path).cached


def test_an_unwritable_cache_is_done_without(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")

    assert build(tmp_path / "file" / "cache")


def test_the_cache_lies_where_the_user_keeps_caches(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "mine"))
    kept(build_extension(CHAIN.interface, CHAIN.sources(), FLAGS))

    assert len(list((tmp_path / "mine" / "kinegen" / "extensions").iterdir())) == 1

    monkeypatch.setenv("XDG_CACHE_HOME", "")
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    (tmp_path / "home").mkdir()
    kept(build_extension(CHAIN.interface, CHAIN.sources(), FLAGS))

    assert len(list((tmp_path / "home" / ".cache" / "kinegen" / "extensions").iterdir())) == 1


def test_nothing_is_left_in_the_folder_for_temporary_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "tmp").mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "tmp"))
    build(tmp_path / "cache")

    assert list((tmp_path / "tmp").iterdir()) == []


def test_builds_at_once_do_not_disturb_each_other(tmp_path: Path) -> None:
    results: list[bytes] = []
    threads = [threading.Thread(target=lambda: results.append(build(tmp_path))) for _ in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()

    assert len(results) == 3
    assert len(set(results)) == 1


def test_the_extension_serves_every_python_3(tmp_path: Path) -> None:
    """It uses nothing beyond the stable interface."""
    (tmp_path / EXTENSION).write_bytes(build(tmp_path / "cache"))

    names = subprocess.run(["nm", "-D", tmp_path / EXTENSION], capture_output=True, text=True, check=True).stdout

    defined = [line.split()[-1] for line in names.splitlines() if " T " in line]
    allowed = ("kinegen_", "_pointers", "_arrays", "_many")
    outside = [name for name in defined if not name.startswith("_") and not any(part in name for part in allowed)]
    assert outside == ["PyInit__native"]
    assert {"kinegen_stamp", "kinegen_select", "kinegen_variant", "kinegen_signatures"} <= set(defined)
    assert "_Py" not in names.replace("_Py_Dealloc", "").replace("_Py_NoneStruct", "")


def test_the_stamp_depends_on_names_and_texts_alone() -> None:
    assert stamp_of({"a.c": "x", "b.c": "y"}) == stamp_of({"b.c": "y", "a.c": "x"})
    assert stamp_of({"a.c": "x", "b.c": "y"}) != stamp_of({"a.c": "xb.cy"})
    assert len(stamp_of({})) == 16


# What goes wrong ------------------------------------------------------------------------------------------------------


def test_a_missing_compiler_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setenv("PATH", str(tmp_path))

    with pytest.raises(CompileError) as caught:
        build(tmp_path)

    assert str(caught.value) == (
        "there is no C compiler (none of cc, gcc, clang was found): install one, for example with `apt install gcc`"
    )


def test_a_compiler_named_wrongly_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CC", "gcc-47 -m64")

    with pytest.raises(
        CompileError, match=r"CC names gcc-47, which does not exist or is not a program; correct it or"
    ) as caught:
        build(tmp_path)

    assert not isinstance(caught.value, MissingToolError)  # nobody goes on without what was asked for


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('"gcc', "CC is not a command: no closing quotation in '\"gcc'"),
        ("true", "'true' reported success and wrote no _native.abi3.so; CC must name a C compiler"),
    ],
)
def test_a_compiler_that_is_none_is_named(
    text: str, words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CC", text)

    with pytest.raises(CompileError) as caught:
        build(tmp_path)

    assert str(caught.value).startswith(words)


def test_a_compiler_that_does_not_end_is_ended_with_all_that_it_started(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    waiting = f'case "$*" in *--version*) echo 1;; *) sleep 60 & echo $! >>{tmp_path}/pids; wait;; esac'
    monkeypatch.setenv("CC", compiler_script(tmp_path, waiting))
    monkeypatch.setenv("KINEGEN_COMPILER_SECONDS", "0.5")
    begin = time.monotonic()

    with pytest.raises(CompileError, match=r"it was stopped after 0\.5 s; KINEGEN_COMPILER_SECONDS can name more"):
        build(tmp_path / "cache")

    assert time.monotonic() - begin < 30
    for pid in (tmp_path / "pids").read_text().split():
        assert not Path("/proc", pid).exists() or "Z" in Path("/proc", pid, "stat").read_text()


def test_missing_headers_of_numpy_are_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(np, "get_include", lambda: str(tmp_path / "none"))

    with pytest.raises(MissingToolError, match=r"no numpy/ndarraytypes\.h in .*none\): install them"):
        build(tmp_path)


def test_a_wrapper_that_says_what_another_said_is_another_compiler(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same name and the same words, but it does something else."""
    monkeypatch.setenv("CC", compiler_script(tmp_path, 'exec cc "$@"'))
    build(tmp_path / "cache")
    assert build_extension(CHAIN.interface, CHAIN.sources(), FLAGS, tmp_path / "cache").cached

    compiler_script(tmp_path, 'exec cc -DMORE "$@"')

    assert not build_extension(CHAIN.interface, CHAIN.sources(), FLAGS, tmp_path / "cache").cached


def test_variables_that_compilers_heed_are_part_of_the_entry(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    build(tmp_path)
    monkeypatch.setenv("CPATH", str(tmp_path))

    assert not build_extension(CHAIN.interface, CHAIN.sources(), FLAGS, tmp_path).cached


def test_nothing_is_kept_before_it_is_proven(tmp_path: Path) -> None:
    extension = build_extension(CHAIN.interface, CHAIN.sources(), FLAGS, tmp_path)
    assert not (tmp_path / "extensions").exists()

    extension.keep()
    assert build_extension(CHAIN.interface, CHAIN.sources(), FLAGS, tmp_path).cached

    extension.forget()
    assert not build_extension(CHAIN.interface, CHAIN.sources(), FLAGS, tmp_path).cached


def test_the_compiler_of_the_environment_is_used(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CC", compiler_script(tmp_path, f'echo called >> {tmp_path}/log; exec cc "$@"'))

    assert build(tmp_path / "cache")
    assert "called" in (tmp_path / "log").read_text()


def test_the_words_of_a_refusing_compiler_come_out(tmp_path: Path) -> None:
    sources = CHAIN.sources()
    sources["chain.c"] += "int broken(void) { return nonsense; }\n"

    with pytest.raises(CompileError) as caught:
        build_extension(CHAIN.interface, sources, FLAGS, tmp_path)

    message = str(caught.value)
    assert "refuses chain.c: chain.c:" in message
    assert "error:" in message
    assert "nonsense" in message
    assert "\n" not in message
    kept = Path(message.rpartition("sources kept in ")[2].rstrip(")"))
    assert (kept / "chain.c").read_text() == sources["chain.c"]


def test_a_silent_failure_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CC", compiler_script(tmp_path, 'case "$*" in *--version*) echo 1;; *) exit 3;; esac'))

    with pytest.raises(CompileError, match=r"mycc refuses .*: it ended with status 3"):
        build(tmp_path / "cache")


def test_a_prototype_that_differs_from_the_header_is_refused(tmp_path: Path) -> None:
    """What cffi is told is compared with the emitted header by the compiler itself."""
    cdef = declarations(CHAIN.interface).replace("void chain_fk(", "int chain_fk(")
    kernels = {**CHAIN.sources(), **dispatch(CHAIN.interface, FLAGS)}
    compilations = units(CHAIN.interface, tuple(kernels), FLAGS)

    with pytest.raises(CompileError, match=r"kinegen_cffi\.c"):
        compile_extension(
            {**kernels, **glue(CHAIN.interface, "0" * 16)}, compilations, cdef, "chain._native", cache=tmp_path
        )


def test_missing_headers_of_python_are_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("kinegen.runtime.compile._includes", lambda: (str(tmp_path / "include"),))

    with pytest.raises(CompileError, match=r"no Python.h in .*include\): install them, .*`apt install python3-dev`"):
        build(tmp_path)


def test_failures_do_not_pile_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CC", compiler_script(tmp_path, 'case "$*" in *--version*) echo 1;; *) exit 1;; esac'))
    for number in range(14):
        with pytest.raises(CompileError):
            build(tmp_path / "cache", Flags(extra=(f"-D{number}",)))

    assert len(list((tmp_path / "cache" / "refused").iterdir())) == 10


def test_an_interrupted_build_leaves_no_entry(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("kinegen.runtime.compile.make_c_source", interrupt)

    with pytest.raises(KeyboardInterrupt):
        build(tmp_path)

    assert not (tmp_path / "extensions").exists()


def test_the_processor_is_known() -> None:
    assert processor().machine == os.uname().machine
    assert find_compiler().version


@pytest.mark.parametrize("flags", [FLAGS, Flags(portable=True)], ids=["one form", "variants"])
def test_the_glue_is_clean_c(tmp_path: Path, flags: Flags) -> None:
    """The reading of array headers and of the processor compiles without a warning."""
    sample = SAMPLES["runtime_tree"]
    for name, text in (sample.sources() | dispatch(sample.interface, flags) | glue(sample.interface, "0")).items():
        (tmp_path / name).write_text(text)
    includes = [f"-isystem{folder}" for folder in (np.get_include(), sysconfig.get_path("include"))]
    warnings = ["-Wall", "-Wextra", "-Wshadow", "-Wmissing-prototypes"]

    done = subprocess.run(
        ["cc", *warnings, "-O2", *includes, "-c", "kinegen_glue.c", "kinegen_processor.c", "kinegen_needs.c"],
        cwd=tmp_path, capture_output=True, text=True, check=False,
    )  # fmt: skip

    assert done.stderr == ""
