"""The emitted C is silent under strict compilers, needs nothing else, and is usable from C++."""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from kinegen.backends.scalar_types import ScalarType
from kinegen.support.naming import prefix
from tests.emit.emitted import COMPILERS, ROOT, SMALL, STRICT, c_kernels, run

HARMLESS = re.compile(r"[0-9a-f]+ [TtRr] [\w.]+")
"""Functions and constants; no variable, initialised or not, and nothing that another file would have to supply."""

CORTEX_M4F = "-mthumb -mcpu=cortex-m4 -mfloat-abi=hard -mfpu=fpv4-sp-d16 -std=c99 -ffreestanding -Os".split()


def strict(compiler: str, real: ScalarType) -> list[str]:
    """The strict flags; gcc would ask a suffix of double constants too, so only floats are asked for theirs."""
    suffixes = ["-Wunsuffixed-float-constants"] if compiler == "gcc" and real is ScalarType.FLOAT else []
    return [compiler, *STRICT[compiler].split(), *suffixes]


@pytest.mark.parametrize("compiler", COMPILERS)
def test_the_files_of_every_robot_compile_silently(
    compiler: str, name: str, real: ScalarType, folder: Path, tmp_path: Path
) -> None:
    kernel, batch, selftest = c_kernels(name, real)
    # Batches of the tree, and of arms like others, compile long and tell nothing new.
    for file in (kernel, selftest, batch) if name in SMALL else (kernel, selftest):
        run([*strict(compiler, real), "-O1", "-c", folder / file, "-o", tmp_path / "kernel.o"])


@pytest.mark.skipif("gcc" not in COMPILERS, reason="needs gcc")
@pytest.mark.parametrize("arm", ["calibrated_2r", "blocks"])
def test_the_static_analyser_of_gcc_finds_nothing(
    arm: str, real: ScalarType, folder_of: Callable[[str], Path], tmp_path: Path
) -> None:
    for file in c_kernels(arm, real):
        command = [*strict("gcc", real), "-fanalyzer", "-O1", "-c", folder_of(arm) / file]
        run([*command, "-o", tmp_path / "kernel.o"])


@pytest.mark.parametrize(
    ("compiler", "level"), [(compiler, level) for compiler in COMPILERS for level in ("-O0", "-O2")]
)
def test_objects_hold_functions_and_constants_and_miss_nothing(
    compiler: str, level: str, small: str, real: ScalarType, folder_of: Callable[[str], Path], tmp_path: Path
) -> None:
    """No variable, no library, no helper of the compiler."""
    flags = ["-std=c99", "-ffreestanding", level, "-c", "-o", tmp_path / "kernel.o"]
    run([compiler, *flags, folder_of(small) / c_kernels(small, real)[0]])
    symbols = run(["nm", tmp_path / "kernel.o"]).splitlines()

    assert [line for line in symbols if not HARMLESS.fullmatch(line)] == []
    assert symbols


@pytest.mark.parametrize("compiler", COMPILERS)
def test_batch_kernels_need_no_other_file(
    compiler: str, small: str, real: ScalarType, folder_of: Callable[[str], Path], tmp_path: Path
) -> None:
    batch = folder_of(small) / c_kernels(small, real)[1]
    run([compiler, "-std=c99", "-ffreestanding", "-O0", "-c", batch, "-o", tmp_path / "batch.o"])

    assert run(["nm", "-u", tmp_path / "batch.o"]) == ""


@pytest.mark.skipif(shutil.which("arm-none-eabi-gcc") is None, reason="needs arm-none-eabi-gcc")
def test_a_cortex_m4_calls_no_routine_for_doubles(name: str, folder: Path, tmp_path: Path) -> None:
    """One constant without its suffix, and the compiler would compute in double, by software."""
    kernel = folder / c_kernels(name, ScalarType.FLOAT)[0]
    run(["arm-none-eabi-gcc", *CORTEX_M4F, "-c", kernel, "-o", tmp_path / "kernel.o"])

    assert run(["arm-none-eabi-nm", "-u", tmp_path / "kernel.o"]) == ""


@pytest.mark.skipif("gcc" not in COMPILERS, reason="needs gcc")
def test_msvc_sees_no_qualifier_that_it_does_not_take(
    small: str, real: ScalarType, folder_of: Callable[[str], Path]
) -> None:
    """Between brackets it takes none; elsewhere it has a word of its own."""
    kernel, batch, _ = (
        run(["gcc", "-std=c11", "-D_MSC_VER=1929", "-E", "-P", folder_of(small) / file])
        for file in c_kernels(small, real)
    )

    assert not re.search(r"\b(restrict|__restrict)\b", kernel)
    assert not re.search(r"\brestrict\b|\[\s*__restrict", batch)
    assert re.search(r"\*\s*__restrict\b", batch)


@pytest.mark.skipif(shutil.which("avr-gcc") is None, reason="needs avr-gcc")
def test_a_double_of_32_bits_is_refused_in_words(folder_of: Callable[[str], Path]) -> None:
    command = ["avr-gcc", "-mmcu=atmega2560", "-std=c99", "-fsyntax-only", folder_of("puma560") / "puma560.c"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)

    assert done.returncode != 0
    assert "these kernels need a double of 64 bits" in done.stderr


@pytest.mark.parametrize("compiler", COMPILERS)
@pytest.mark.parametrize("kind", [0, 1])
def test_fast_math_is_refused_in_words(
    compiler: str, kind: int, real: ScalarType, folder_of: Callable[[str], Path]
) -> None:
    kernel = folder_of("puma560") / c_kernels("puma560", real)[kind]
    command = [compiler, "-std=c99", "-ffast-math", "-fsyntax-only", kernel]
    done = subprocess.run(command, capture_output=True, text=True, check=False)

    assert done.returncode != 0
    assert "-ffast-math breaks the sine and cosine" in done.stderr


@pytest.mark.skipif(shutil.which("g++") is None, reason="needs g++")
def test_each_header_stands_alone_in_c_and_in_cpp(name: str, folder: Path, tmp_path: Path) -> None:
    """Included first and alone, twice, and both number types together."""
    headers = sorted(path.name for path in folder.glob("*.h"))
    plain = [header for header in headers if not header.endswith("_vectors.h")]
    units = [[header, header] for header in plain] + [plain]
    for suffix, compiler in ((".c", ["gcc", *STRICT["gcc"].split()]), (".cpp", "g++ -std=c++11 -Wall".split())):
        for number, unit in enumerate(units):
            source = tmp_path / f"unit{number}{suffix}"
            source.write_text("".join(f'#include "{header}"\n' for header in unit), encoding="utf-8")
        strict_cpp = ["-Wextra", "-Wpedantic", "-Wold-style-cast", "-Werror", "-fsyntax-only", f"-I{folder}"]
        if suffix == ".c":
            strict_cpp.remove("-Wold-style-cast")
        run([*compiler, *strict_cpp, *sorted(tmp_path.glob(f"*{suffix}"))])

    assert len(headers) == 6


@pytest.mark.skipif(shutil.which("g++") is None, reason="needs g++")
def test_cpp_calls_the_kernels(folder_of: Callable[[str], Path], tmp_path: Path) -> None:
    folder = folder_of("calibrated_2r")
    (tmp_path / "main.cpp").write_text(
        """
#include "calibrated_2r.h"
#include "calibrated_2r_f32.h"

int main()
{
    const double q[CALIBRATED_2R_DOF] = {0.1, 0.2};
    const float q_f32[CALIBRATED_2R_DOF] = {0.1F, 0.2F};
    double base_T_tool[16];
    float base_T_tool_f32[16];
    calibrated_2r_fk(q, &calibrated_2r_default_params, base_T_tool);
    calibrated_2r_f32_fk(q_f32, &calibrated_2r_f32_default_params, base_T_tool_f32);
    const double difference = base_T_tool[3] - static_cast<double>(base_T_tool_f32[3]);
    return (difference < 1e-6 && difference > -1e-6 && base_T_tool[15] == 1.0) ? 0 : 1;
}
""",
        encoding="utf-8",
    )
    for file in ("calibrated_2r", "calibrated_2r_f32"):
        run(["gcc", "-std=c99", "-O1", "-c", folder / f"{file}.c", "-o", tmp_path / f"{file}.o"])
    objects = sorted(tmp_path.glob("*.o"))
    run(["g++", "-std=c++11", f"-I{folder}", tmp_path / "main.cpp", *objects, "-o", tmp_path / "main"])

    run([tmp_path / "main"])


MISRA = "cppcheck --quiet --std=c99 --enable=all --inconclusive --addon=misra --error-exitcode=2".split()
ACCEPTED = {
    "misra-c2012-2.4": "an enumeration whose value does not compile under an option that would change constants",
    "misra-c2012-2.5": "the indices of frames and tips are macros for the caller, who may not need them all",
    "misra-c2012-8.7": "the caller is elsewhere; later releases say so of every function",
    "staticFunction": "the same",
    "unusedFunction": "the same",
    "missingIncludeSystem": "float.h is the compiler's",
    "unmatchedSuppression": "releases differ",
    "normalCheckLevelMaxBranches": "a remark",
    "checkersReport": "a remark",
}


@pytest.mark.skipif(shutil.which("cppcheck") is None, reason="needs cppcheck")
@pytest.mark.parametrize(
    ("ending", "rules"),
    [
        # restrict: without it no result could be stored before the last joint value is read; a macro for MSVC alone
        ("", ["misra-c2012-8.14", "misra-c2012-20.4"]),
        # vectors stand in a header; main, for a host, prints
        ("_selftest", ["misra-c2012-8.9", "misra-c2012-21.6"]),
    ],
)
def test_the_misra_addon_of_cppcheck_finds_what_the_page_says(
    ending: str, rules: list[str], folder_of: Callable[[str], Path]
) -> None:
    """The addon checks a part of the rules, so this says "the addon is content", never "MISRA compliant"."""
    files = [f"{prefix('calibrated_2r', real)}{ending}.c" for real in ScalarType]
    run([*MISRA, *(f"--suppress={rule}" for rule in (*ACCEPTED, *rules)), *files], folder_of("calibrated_2r"))
    page = (ROOT / "docs" / "firmware.md").read_text(encoding="utf-8")

    assert all(f" {rule.removeprefix('misra-c2012-')} |" in page for rule in rules)


def test_the_prefix_of_every_public_name_is_the_robots(name: str, real: ScalarType, folder: Path) -> None:
    stem = prefix(name, real)
    for header in (f"{stem}.h", f"{stem}_batch.h", f"{stem}_vectors.h"):
        text = (folder / header).read_text(encoding="utf-8")
        declared = re.findall(r"^(?:void|int|double|float|extern const \w+|static const \w+) (\w+)", text, re.MULTILINE)
        macros = re.findall(r"^#define (\w+)", text, re.MULTILINE)

        # Constants are in capitals, whether they are macros or arrays.
        constants = [symbol for symbol in declared if symbol.isupper()]
        assert all(symbol.startswith(f"{stem.upper()}_") for symbol in constants)
        assert [symbol for symbol in declared if not symbol.startswith(f"{stem}_")] == constants
        assert [
            symbol for symbol in macros if not symbol.startswith((f"{name.upper()}_", f"KINEGEN_{name.upper()}_"))
        ] == []
