"""Very long functions are compiled in a hurry, others are not; the bits are the same."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from kinegen.errors import MissingToolError
from kinegen.model.outputs import Quantity
from kinegen.runtime.compile import _LONG, _order
from kinegen.runtime.compiler import Compiler, find_compiler
from kinegen.runtime.extension import lay_out
from tests.emit.emitted import texts

GCC = Compiler(("gcc",), "Copyright (C) 2022 Free Software Foundation, Inc.")
CLANG = Compiler(("clang",), "Debian clang version 14.0.6")

ROOT = Path(__file__).resolve().parents[2]


def function(lines: int) -> str:
    return "void f(void)\n{\n" + "    ;\n" * lines + "}\n"


def test_the_length_of_one_function_decides() -> None:
    long = function(10) + function(_LONG + 1) + function(10)
    assert _order(GCC, "arm_batch.c", function(_LONG - 10) * 3) == GCC.scheduling
    assert _order(GCC, "arm.c", function(_LONG - 10)) == ()
    assert _order(GCC, "arm_batch.c", long) == _order(GCC, "arm.c", long) == GCC.haste
    assert _order(CLANG, "arm_batch.c", long) == ()


def test_no_package_of_ours_is_compiled_in_a_hurry() -> None:
    batches = list((ROOT / "generated").glob("*/*_batch.c"))

    assert batches
    assert all(_order(GCC, path.name, path.read_text(encoding="utf-8")) == GCC.scheduling for path in batches)


def test_haste_keeps_the_bits(tmp_path: Path) -> None:
    """The instructions may differ; what they compute may not."""
    try:
        compiler = find_compiler()
    except MissingToolError:
        pytest.skip("needs a C compiler")
    lay_out(tmp_path, texts("puma560", (Quantity.POSE,)))
    (tmp_path / "main.c").write_text(MAIN, encoding="utf-8")
    printed = []
    for words in (compiler.scheduling, compiler.haste):
        plain = ("-std=c99", "-O3", "-ffp-contract=off", "-w", *words)
        compiler.run(tmp_path, (*plain, "main.c", "puma560_batch.c", "-o", "program"), "a program")
        printed.append(subprocess.run([tmp_path / "program"], capture_output=True, text=True, check=True).stdout)

    assert len(set(printed[0].split())) > 37
    assert printed[0] == printed[1]


MAIN = """#include <stdio.h>
#include "puma560_batch.h"

int main(void)
{
    static double q[37][6], poses[37][16];
    for (int i = 0; i < 37 * 6; i++) {
        q[i / 6][i % 6] = (double)(i * 7919 % 601) / 100.0 - 3.0;
    }
    puma560_fk_batch(37, q[0], 6, 1, poses[0], 16, 0);
    for (int i = 0; i < 37 * 16; i++) {
        printf("%a\\n", poses[i / 16][i % 16]);
    }
    return 0;
}
"""
