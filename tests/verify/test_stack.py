"""Arrays that no stack holds are found in C files, however their size is written."""

from __future__ import annotations

from pathlib import Path

import pytest

from kinegen.errors import ProofError
from kinegen.io.load import load
from kinegen.verify.source_checks import constants, require_little_stack, too_large

ROOT = Path(__file__).resolve().parents[2]
HEADER = "enum { ARM_DOF = 6 };\n#define ARM_BRANCHES 8\n#define ARM_MOST (1 << 20)\n"
BODY = "enum { TILE = 64, ROWS = 12 * ARM_DOF };\nvoid f(size_t n, const double q[restrict ARM_DOF])\n{\n    LINE\n}\n"


@pytest.mark.parametrize(
    ("line", "word"),
    [
        ("volatile double waste[262144]; waste[0] = 0;", "waste has 262,144 entries"),
        ("double a[2], w[1 << 18];", "w has 262,144 entries"),
        ("double w[512][512];", "w has 262,144 entries"),
        ("double w[ARM_MOST];", "w has 1,048,576 entries"),
        ("enum { HERE = 70000u }; float w[HERE];", "w has 70,000 entries"),
        ("if (n) { double w[ROWS * 4096]; w[0] = 0; }", "w has 294,912 entries"),
        ("struct { double w[64 * 4096u]; } s;", "w has 262,144 entries"),
        ("double w[n];", "no constant says how many entries w[n] has"),
        ("double w[(int)n + 3] = {0};", "no constant says"),
        ("static int calls; calls++;", "calls outlives a call"),
        ("static double last[ARM_DOF] = {0}; last[0] = q[0];", "last outlives a call"),
        ("}\nint more = 1;\nvoid g(void)\n{", "more outlives a call"),
        ("}\nunsigned char seen[6];\nvoid g(void)\n{", "seen outlives a call"),
        ("double *w = alloca(n);", "it takes memory by alloca"),
        ("double *w = __builtin_alloca (n);", "it takes memory by __builtin_alloca"),
    ],
)
def test_an_array_is_refused_that_no_stack_holds(line: str, word: str) -> None:
    assert word in too_large(BODY.replace("LINE", line), constants(HEADER))


@pytest.mark.parametrize(
    "line",
    [
        "double t[ROWS][TILE]; t[0][n & 63] = q[2];",
        "double t[ARM_BRANCHES * ARM_DOF][TILE];",
        "double t[12] = {0}, u[3 * (ARM_DOF + 1)];",
        "/* double w[1 << 20]; */ double t[4]; // malloc(3)",
        "return (double)n / t[3];",
        "static const double t[ARM_DOF] = {0};",
        "}\nstatic inline double g(int i);\nstatic const int few = 3;\nvoid h(void)\n{",
    ],
)
def test_an_array_of_the_size_of_a_kernel_is_taken(line: str) -> None:
    assert not too_large(BODY.replace("LINE", line), constants(HEADER))


def test_a_file_of_a_package_is_named(tmp_path: Path) -> None:
    (tmp_path / "arm.h").write_text(HEADER, encoding="utf-8")
    (tmp_path / "arm.c").write_text(BODY.replace("LINE", "double w[ARM_MOST];"), encoding="utf-8")

    with pytest.raises(ProofError, match=r"arm\.c: w has 1,048,576 entries on the stack"):
        require_little_stack(load(ROOT / "robots" / "scara.yaml"), tmp_path, ["arm.c"])


def test_packages_have_no_such_array() -> None:
    arm = load(ROOT / "robots" / "hand.yaml")
    for name in ("hand", "ur5", "calibrated_2r"):
        folder = ROOT / "generated" / name
        require_little_stack(arm, folder, [path.name for path in sorted(folder.glob("*.c"))])
