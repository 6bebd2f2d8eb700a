"""Strict compilers, the C++ compiler and the MISRA addon of cppcheck have nothing to say."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from kinegen.backends.c.kernel import emit_kernel
from kinegen.backends.scalar_types import ScalarType
from kinegen.support.naming import Q30, c_file
from tests.emit.emitted import STRICT
from tests.fixed.kernels import COMPILERS, SPLIT, fixed, run, texts

EXTRA = {"gcc": ("-Wsign-conversion", "-fanalyzer"), "clang": ()}


@pytest.mark.skipif(not COMPILERS, reason="needs gcc or clang")
@pytest.mark.parametrize("split", [(), (SPLIT,)], ids=["whole", "halves"])
@pytest.mark.parametrize("compiler", COMPILERS)
def test_strict_flags_are_silent(
    compiler: str, split: tuple[str, ...], name: str, folder: Path, tmp_path: Path
) -> None:
    extra = () if name == "hand" else EXTRA[compiler]  # the analyzer takes long for five fingers
    for source in (c_file(name, "c", Q30), f"{name}_q30_selftest.c"):
        flags = [*STRICT[compiler].split(), *extra, "-O2", *split]
        run([compiler, *flags, "-c", folder / source, "-o", tmp_path / "kernels.o"])


@pytest.mark.skipif(not COMPILERS, reason="needs gcc or clang")
def test_nothing_is_called(name: str, folder: Path, tmp_path: Path) -> None:
    run(
        [
            COMPILERS[0],
            "-std=c99",
            "-O1",
            "-ffreestanding",
            "-c",
            folder / c_file(name, "c", Q30),
            "-o",
            tmp_path / "k.o",
        ]
    )

    assert run(["nm", "-u", tmp_path / "k.o"]).split() == []


@pytest.mark.skipif(shutil.which("g++") is None, reason="needs g++")
def test_the_header_is_valid_cpp(name: str, folder: Path) -> None:
    header = folder / c_file(name, "h", Q30)
    run(["g++", "-std=c++11", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-fsyntax-only", "-x", "c++", header])


@pytest.mark.skipif(not COMPILERS, reason="needs gcc or clang")
def test_headers_of_all_number_types_go_together(tmp_path: Path) -> None:
    files = {file: text for real in ScalarType for file, text in emit_kernel(fixed("hand").kernels, real).items()}
    for file, text in {**files, **texts("hand")}.items():
        (tmp_path / file).write_text(text, encoding="utf-8")
    includes = "".join(f'#include "hand{suffix}.h"\n' for suffix in ("", "_f32", "_q30"))
    (tmp_path / "all.c").write_text(
        f"{includes}int main(void) {{ return HAND_Q30_LENGTH_BITS - 23; }}\n", encoding="utf-8"
    )
    run([COMPILERS[0], "-std=c99", "-Wall", "-Wextra", "-Werror", tmp_path / "all.c", "-o", tmp_path / "all"])

    run([tmp_path / "all"])


@pytest.mark.skipif(shutil.which("cppcheck") is None, reason="needs cppcheck")
@pytest.mark.parametrize("name", ["calibrated_2r", "stanford"])
def test_the_misra_addon_of_cppcheck_finds_nothing(name: str, folder: Path) -> None:
    """The same rules as for the floating-point kernels, for both kinds of products."""
    accepted = (
        "misra-c2012-2.5",  # the indices of frames and tips are macros for the caller, who may not need them all
        "misra-c2012-8.14",  # restrict: without it no result could be stored before the last joint value is read
        "misra-c2012-20.4",  # restrict is a macro for MSVC alone
        "missingIncludeSystem",  # stdint.h is the compiler's
        "unusedFunction",  # the caller is elsewhere
        "unmatchedSuppression",
    )
    command = ["cppcheck", "--quiet", "--std=c99", "--enable=all", "--inconclusive", "--addon=misra", "--force"]
    suppressed = [f"--suppress={rule}" for rule in accepted]
    run([*command, *suppressed, "--error-exitcode=2", c_file(name, "c", Q30)], folder)
