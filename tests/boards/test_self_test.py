"""The self-test that firmware runs: on the host, on boards, and with a sine-cosine of the board's own."""

from __future__ import annotations

import shutil
import struct
import subprocess
from pathlib import Path

import pytest

from kinegen.backends.c.kernel import emit_kernel
from kinegen.backends.c.vectors import emit_vectors
from kinegen.backends.routines import SINCOS
from kinegen.backends.scalar_types import ScalarType
from kinegen.model.outputs import Quantity
from kinegen.verify.boards.programs import build_program
from kinegen.verify.boards.targets import TARGETS, Target, run_program
from kinegen.verify.vectors import compute_vectors
from tests.boards.conftest import kernels, require

needs_gcc = pytest.mark.skipif(shutil.which("gcc") is None, reason="needs gcc (apt install gcc)")

MAIN = """
#include "board.h"
#include "puma560_f32_vectors.h"

static void show(float number)
{
    union {
        float number;
        uint32_t bits;
    } both = {number};
    char text[10];
    for (int digit = 0; digit < 8; digit++) {
        text[digit] = "0123456789abcdef"[(both.bits >> (28 - 4 * digit)) & 15u];
    }
    text[8] = '\\n';
    text[9] = '\\0';
    board_write(text);
}

int main(void)
{
    show(puma560_f32_selftest());
    show(puma560_f32_selftest_sincos());
    show(PUMA560_F32_TOLERANCE);
    show(PUMA560_F32_PAIR_TOLERANCE);
    return 0;
}
"""
# Good to about 1e-4: a board's own pair may be anything.
ROUGH = """
#ifndef ROUGH_H
#define ROUGH_H
#include <math.h>
#define KINEGEN_PUMA560_F32_SINCOS(x, s, c) (*(s) = sinf(x) + 1e-4F, *(c) = cosf(x))
#endif
"""


def write_files(folder: Path, real: ScalarType = ScalarType.FLOAT) -> None:
    """The C files of a build of the PUMA 560's pose."""
    single = kernels("puma560", Quantity.POSE)
    for name, text in (emit_kernel(single, real) | emit_vectors(single, compute_vectors(single), real)).items():
        (folder / name).write_text(text, encoding="utf-8")


def run_self_test(folder: Path, stem: str, *flags: str) -> subprocess.CompletedProcess[str]:
    """Compiles and runs the self-test on the host as its head says."""
    command = ["gcc", "-std=c99", "-Wall", "-Werror", "-DKINEGEN_SELFTEST_MAIN", *flags]
    subprocess.run([*command, f"{stem}_selftest.c", f"{stem}.c", "-lm", "-o", "test"], cwd=folder, check=True)
    return subprocess.run([folder / "test"], capture_output=True, text=True, check=False)


@needs_gcc
@pytest.mark.parametrize("real", list(ScalarType))
def test_the_worst_error_of_the_pair_is_printed(real: ScalarType, tmp_path: Path) -> None:
    write_files(tmp_path, real)
    stem = "puma560" if real is ScalarType.DOUBLE else "puma560_f32"
    done = run_self_test(tmp_path, stem)
    first, second = done.stdout.splitlines()

    assert done.returncode == 0
    assert first.endswith("passed")
    assert second.startswith(f"{stem}: sine and cosine at 23 angles, largest error ")
    assert 0 < float(second.split()[9].rstrip(",")) < SINCOS[real].absolute_error


@needs_gcc
def test_a_pair_of_ones_own_takes_the_place_of_ours_and_is_measured(tmp_path: Path) -> None:
    write_files(tmp_path)
    (tmp_path / "rough.h").write_text(ROUGH, encoding="utf-8")
    done = run_self_test(tmp_path, "puma560_f32", "-include", "rough.h", "-Wno-unused-value")
    first, second = done.stdout.splitlines()
    symbols = subprocess.run(["nm", tmp_path / "test"], capture_output=True, text=True, check=True).stdout

    assert done.returncode == 1
    assert first.endswith("FAILED")
    assert second.endswith("FAILED")
    assert float(second.split()[9].rstrip(",")) == pytest.approx(1e-4, rel=1e-2)
    assert "puma560_f32_sincos" not in symbols


@pytest.mark.boards
@pytest.mark.parametrize("target", TARGETS.values(), ids=list(TARGETS))
def test_boards_pass_it(target: Target, tmp_path: Path) -> None:
    require(target)
    write_files(tmp_path)
    main = tmp_path / "main.c"
    main.write_text(MAIN, encoding="utf-8")
    files = [tmp_path / "puma560_f32.c", tmp_path / "puma560_f32_selftest.c"]
    lines = run_program(target, build_program(target, tmp_path, files, main, ScalarType.FLOAT, ("-Os",)))
    difference, error, tolerance, pair_tolerance = (struct.unpack(">f", bytes.fromhex(line))[0] for line in lines)

    assert 0 < difference <= tolerance
    assert error < pair_tolerance < 3 * SINCOS[ScalarType.FLOAT].absolute_error
    assert 0 < error < SINCOS[ScalarType.FLOAT].absolute_error
