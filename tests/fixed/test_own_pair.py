"""A sine and cosine of the board's own instead of the emitted one: what is proven of it holds."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from kinegen.backends.fixed_point.kernels import FixedKernels
from kinegen.model.outputs import Quantity
from kinegen.runtime.compiler import Compiler
from kinegen.support.naming import Q30, c_file
from kinegen.verify import reference
from kinegen.verify.fixed_point import WORST, IntegerLibrary, compile_integers
from kinegen.verify.fixed_point_vectors import integer_samples, unit
from tests.fixed.kernels import COMPILERS, SPLIT, UNDEFINED, fixed, run, texts

pytestmark = pytest.mark.skipif(not COMPILERS, reason="needs gcc or clang")

PAGE = Path(__file__).resolve().parents[2] / "docs" / "firmware.md"

CORDIC = """
#include <math.h>
#include <stdint.h>

/* An STM32G4 as far as the example goes: a step for each access, in the order in which the example makes them. */
typedef struct { uint32_t CSR, WDATA, RDATA; } board_unit;
typedef struct { uint32_t AHB1ENR; } board_clocks;
static board_clocks board_rcc;
static board_unit board_cordic;
static int board_accesses;
static inline uint32_t board_q31(double exact)
{
    const double off = exact + ((board_accesses % 7) - 3) / 3.0 * ldexp(1.0, -19);
    const double scaled = floor(ldexp(off, 31));
    return (uint32_t)(int32_t)fmin(fmax(scaled, -2147483648.0), 2147483647.0);
}
static inline board_unit *board_access(void)
{
    const double radians = (double)(int32_t)board_cordic.WDATA * 1.4629180792671596e-9;
    const int step = board_accesses++ % 3;
    board_cordic.RDATA = (step == 1) ? board_q31(cos(radians)) : (step == 2) ? board_q31(sin(radians)) : 0u;
    return &board_cordic;
}
#define RCC (&board_rcc)
#define RCC_AHB1ENR_CORDICEN 8u
#define CORDIC board_access()
#define CORDIC_CSR_PRECISION_Pos 4u
#define CORDIC_CSR_NRES (1u << 19)
"""


def compiled(name: str, folder: Path, text: str, compiler: str, *flags: str) -> IntegerLibrary:
    """The kernels with a pair of their own, which stands in a header of the board."""
    macro = f"#define KINEGEN_{name.upper()}_Q30_SINCOS(angle, s, c) board_sincos((angle), (s), (c))\n"
    (folder / "board_trig.h").write_text(text if "_SINCOS(" in text else text + macro, encoding="utf-8")
    strict = ("-Wall", "-Wextra", "-Werror", "-Wno-unused-function", "-Wno-error=unused-function")
    return compile_integers(
        fixed(name), texts(name), folder, Compiler((compiler,), ""), "-include", "board_trig.h", *strict, *flags, "-lm"
    )


def errors(kernels: FixedKernels, library: IntegerLibrary) -> list[NDArray[np.float64]]:
    """For each program how far each output is from the exact one, at most, in units of its last place."""
    q = integer_samples(kernels)[::7]
    points = q * np.array([unit(kernels, index) for index in range(kernels.robot.dof)])
    known = reference.frames(kernels.robot, points)
    found = []
    for program in kernels.programs:
        quantity = program.program.quantity
        frames = [known[name][:, :3, :] for name in _frames(kernels, quantity)]
        exact = np.stack(frames, axis=1) if quantity.is_pose else np.stack(frames, axis=1)[..., 3]
        results = library.call(quantity, q).astype(float)
        kept = results[..., :12] if quantity.is_pose else results
        units = 2.0 ** np.array(program.bits)
        off = kept.reshape(len(q), -1) - exact.reshape(len(q), -1) * units
        found.append(np.abs(off).max(axis=0))
    return found


def _frames(kernels: FixedKernels, quantity: Quantity) -> tuple[str, ...]:
    return kernels.robot.frame_names if quantity == Quantity.FRAMES else kernels.robot.tips


@pytest.mark.parametrize("compiler", COMPILERS)
@pytest.mark.parametrize(("name", "halves"), [("puma560", True), ("puma560", False), ("panda", True), ("panda", False),
                                              ("scara", True), ("hand", False)])  # fmt: skip
def test_the_coarsest_pair_keeps_what_the_header_promises(
    name: str, halves: bool, compiler: str, tmp_path: Path
) -> None:
    """With errors to either side as large as they may be; the sanitizer stops where something overflows."""
    kernels = fixed(name)
    assert kernels.coarse
    bits = kernels.coarse.halves if halves else kernels.coarse.bits
    way = (SPLIT,) if halves else ()
    library = compiled(name, tmp_path, WORST, compiler, f"-DBITS={bits}", *way, *UNDEFINED[compiler])

    for program, off, bound in zip(kernels.programs, errors(kernels, library), kernels.coarse.errors, strict=True):
        assert (off <= np.array(bound) + 1e-3).all()
        assert off.max() > 20 * max(program.errors)  # the emitted pair is far better


def test_products_of_halves_take_a_finer_pair_where_an_arm_has_seven_joints() -> None:
    panda, puma = fixed("panda").coarse, fixed("puma560").coarse

    assert panda
    assert puma
    assert (puma.bits, puma.halves) == (18, 18)
    assert (panda.bits, panda.halves) == (18, 19)


def test_the_emitted_pair_is_not_even_compiled(tmp_path: Path) -> None:
    compiled("puma560", tmp_path, WORST, COMPILERS[0], "-DBITS=18", "-O0")
    symbols = run(["nm", tmp_path / "puma560_q30.so"])

    assert "puma560_q30_sincos" not in symbols
    assert "puma560_q30_high" not in symbols
    assert "puma560_q30_mul" in symbols


def test_the_example_of_the_page_drives_a_cordic(tmp_path: Path) -> None:
    """The registers stand in for those of the board; everything else is the example as it is printed."""
    page = PAGE.read_text(encoding="utf-8")
    found = re.search(r"```c\n(/\* board_trig\.h[^`]*CORDIC->WDATA[^`]*)```", page)
    assert found
    example = found[1].replace('#include "stm32g4xx.h"', CORDIC)
    kernels = fixed("puma560")
    assert kernels.coarse
    begin = "void board_begin(void) { board_trig_begin(); board_accesses = 0; }\n"
    begin += (
        "uint32_t board_csr(void) { return board_cordic.CSR; }\nuint32_t board_clock(void) { return RCC->AHB1ENR; }\n"
    )
    library = compiled("puma560", tmp_path, f"{example}\n{begin}", COMPILERS[0])
    library.library.board_begin()

    assert library.library.board_csr() == (1 << 19) | (6 << 4)  # cosine, 24 steps, two results, one argument, q1.31
    assert library.library.board_clock() == 8
    for off, bound in zip(errors(kernels, library), kernels.coarse.errors, strict=True):
        assert (off <= np.array(bound) + 1e-3).all()  # constants are rounded in the reference, too
        assert off.max() > 500


@pytest.mark.parametrize(("bits", "passes"), [(18, True), (13, False)])
def test_the_self_test_accepts_a_pair_that_the_header_allows(bits: int, passes: bool, tmp_path: Path) -> None:
    for name, text in texts("puma560").items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    macro = "#define KINEGEN_PUMA560_Q30_SINCOS(angle, s, c) board_sincos((angle), (s), (c))\n"
    (tmp_path / "board_trig.h").write_text(WORST + macro, encoding="utf-8")
    flags = ["-std=c99", "-O1", "-DKINEGEN_SELFTEST_MAIN", f"-DBITS={bits}", "-include", "board_trig.h", "-I", tmp_path]
    files = [tmp_path / "puma560_q30_selftest.c", tmp_path / "puma560_q30.c"]
    run([COMPILERS[0], *flags, *files, "-o", tmp_path / "test", "-lm"])
    done = subprocess.run([tmp_path / "test"], capture_output=True, text=True, check=False)

    assert (done.returncode == 0) == passes
    assert re.search(r"tolerance 5\d{4}: ", done.stdout)


def test_a_robot_without_turns_has_no_such_macro() -> None:
    header, source = (texts("cartesian")[c_file("cartesian", suffix, Q30)] for suffix in "hc")

    assert "_SINCOS" not in header + source
    assert fixed("cartesian").coarse is None


def test_the_header_says_what_holds() -> None:
    header = " ".join(texts("puma560")[c_file("puma560", "h", Q30)].replace("\n *", " ").split())

    assert "A macro KINEGEN_PUMA560_Q30_SINCOS(angle, s, c), defined where puma560_q30.c is compiled" in header
    assert "If each is within 2^-18 of the exact one, no operation overflows, and the proven errors of all" in header
    assert re.search(r"rounding may take one 1\d beyond that", header)
