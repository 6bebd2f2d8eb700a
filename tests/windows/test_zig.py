"""The emitted files compile without a warning for macOS, for Windows, and in the dialect of MSVC.

The compiler is clang as Zig brings it. Nothing is run.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import cache
from pathlib import Path

import pytest

from kinegen.backends.languages import LANGUAGES, emit_language
from kinegen.model.outputs import parse_quantity
from tests.emit.emitted import kernels
from tests.fixed.kernels import texts as integer_texts
from tests.windows.tools import run, zig
from tests.windows.words import robot_of

pytestmark = pytest.mark.windows

WARNINGS = ("-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Wvla", "-Werror")

TARGETS = {
    "macOS, aarch64": ("-target", "aarch64-macos", "-std=c99", "-O0"),
    "Windows, x86-64, as clang-cl": ("-target", "x86_64-windows-msvc", "-std=c11", "-O0"),
    "Windows, x86-64, as MinGW": ("-target", "x86_64-windows-gnu", "-std=c99", "-O0"),
    # As /std:c11 has it: no word of clang or gcc is defined, and those of MSVC are. Its headers are not at hand, and
    # the kernels need none but those that every freestanding compiler has.
    "MSVC's dialect": (
        *("-target", "x86_64-windows-msvc", "-std=c11", "-O0", "-ffreestanding", "-U__clang__", "-U__GNUC__"),
        *("-fms-compatibility", "-fms-extensions", "-Wno-keyword-macro"),
    ),
}


@cache
def emitted(name: str) -> Mapping[str, str]:
    """The C files of a robot, integer kernels among them where there are any."""
    files = robot_of(name).files
    integers = integer_texts(name) if name == "calibrated_2r" else {}
    return {file: text for file, text in {**files, **integers}.items() if file not in ("table.c", "words.c", "table.h")}


def compile_each(flags: tuple[str, ...], files: Mapping[str, str], folder: Path) -> None:
    """Compile the C files of a folder, each by itself, into objects that nobody needs."""
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8", newline="\n")
    for name in files:
        if name.endswith(".c"):
            run([zig(), "cc", *WARNINGS, *flags, "-c", name, "-o", "object.o"], folder)


@pytest.mark.parametrize("target", TARGETS)
def test_c_compiles_without_a_warning(target: str, zig_robot: str, tmp_path: Path) -> None:
    compile_each(TARGETS[target], emitted(zig_robot), tmp_path)


def test_the_dialect_of_msvc_is_what_is_tried(tmp_path: Path) -> None:
    """It takes the words that are meant for MSVC, and would not take an array of a length that varies."""
    flags = TARGETS["MSVC's dialect"]
    (tmp_path / "scara.c").write_text(emitted("scara")["scara.c"], encoding="utf-8")
    (tmp_path / "scara.h").write_text(emitted("scara")["scara.h"], encoding="utf-8")
    text = run([zig(), "cc", *flags, "-E", "scara.c"], tmp_path)

    assert "q[ 3]" in text or "q[3]" in text
    assert not re.search(r"\brestrict\b", text)
    with pytest.raises(AssertionError, match="-Wvla"):
        compile_each(flags, {"vla.c": "void f(int n);\nvoid f(int n) { double a[n]; (void)a; }\n"}, tmp_path)


@pytest.mark.parametrize("name", ["scara_batch.c", "scara_numeric_inverse_batch.c"])
def test_msvc_is_told_of_arrays_that_do_not_overlap(name: str) -> None:
    """Where the qualifier is not between brackets it has a word for it."""
    text = emitted("scara")[name]

    assert "#define restrict __restrict\n" in text
    assert "[restrict" not in text.partition("#define restrict")[2]
    assert text.rindex("#include") < text.index("#define restrict")


@pytest.mark.parametrize("target", ["aarch64-macos", "x86_64-windows-gnu"])
def test_cpp_compiles_without_a_warning(target: str, cpp_robot: str, tmp_path: Path) -> None:
    quantities = tuple(map(parse_quantity, ("pose", "fk_jacobian")))
    for name, text in emit_language(kernels(cpp_robot, quantities), LANGUAGES["cpp"]).items():
        (tmp_path / Path(name).name).write_text(text, encoding="utf-8", newline="\n")
    (tmp_path / "user.cpp").write_text(f'#include "{cpp_robot}.hpp"\n', encoding="utf-8")
    flags = ("-target", target, "-std=c++17", "-O0", *WARNINGS)
    run([zig(), "c++", *flags, "-c", "user.cpp", "-o", "user.o"], tmp_path)


def test_a_macos_library_is_linked(tmp_path: Path) -> None:
    """The kernels are all there is in it: what a program calls is found without any other library."""
    files = emitted("calibrated_2r")
    for name, text in files.items():
        (tmp_path / name).write_text(text, encoding="utf-8", newline="\n")
    sources = ["calibrated_2r.c", "calibrated_2r_batch.c"]
    run([zig(), "cc", "-target", "aarch64-macos", "-shared", "-O1", *sources, "-o", "lib.dylib"], tmp_path)

    assert (tmp_path / "lib.dylib").read_bytes()[:4] == bytes.fromhex("cffaedfe")
