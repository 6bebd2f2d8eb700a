"""Roots, angles of points and selections have the bits of the host on every board."""

from __future__ import annotations

import subprocess
from fractions import Fraction
from pathlib import Path

import pytest

from kinegen.backends.scalar_types import ScalarType
from kinegen.ir.program import Constant, Operator, Program, Statement, Temporary, Variable
from kinegen.verify.boards.programs import build_program, write_kernels
from kinegen.verify.boards.targets import SOURCES, STRICT, TARGETS, Target, run_program
from tests.boards.conftest import require
from tests.functions.library import COMPILERS, run
from tests.functions.programs import kernels, signature

pytestmark = pytest.mark.boards

ON_BOARDS = [(target, real) for target in TARGETS.values() for real in target.reals]
SMALL = Constant(Fraction(1, 2**135))
"""Makes floats subnormal, so that their roots take the other way."""

X, Y, Z = (Variable(index) for index in range(3))
T = [Temporary(f"t{number}") for number in range(11)]
OPERATIONS = (
    (Operator.MUL, (X, X)),
    (Operator.SQRT, (T[0],)),
    (Operator.MUL, (T[0], SMALL)),
    (Operator.SQRT, (T[2],)),
    (Operator.ATAN2, (X, Y)),
    (Operator.ATAN2, (T[3], Z)),
    (Operator.SELECT_LT, (X, Y, X, Y)),
    (Operator.ATAN2, (T[6], X)),
    (Operator.SUB, (Y, Z)),
    (Operator.SELECT_LT, (T[7], T[4], T[8], T[1])),
    (Operator.ATAN2, (T[9], T[8])),
)
PROGRAM = Program(
    signature("made", len(OPERATIONS)),
    (),
    (),
    tuple(Statement((name.name,), *operation) for name, operation in zip(T, OPERATIONS, strict=True)),
    tuple(T),
)


def on_host(folder: Path, real: ScalarType) -> list[str]:
    """What the program that shows bits prints on this machine."""
    folder.mkdir()
    files = write_kernels(folder, [kernels(PROGRAM)], real)
    own = (SOURCES / "bits.c", SOURCES / "host.c")
    command = [COMPILERS[0], *STRICT, "-O2", f"-DREAL={real}", "-I", folder, "-I", SOURCES, *files, *own]
    run([*command, "-o", folder / "bits"])
    return subprocess.run([folder / "bits"], capture_output=True, text=True, check=True).stdout.splitlines()


@pytest.mark.skipif(not COMPILERS, reason="needs gcc or clang")
@pytest.mark.parametrize(
    ("target", "real"), ON_BOARDS, ids=lambda value: value.name if isinstance(value, Target) else value.value
)
def test_every_board_gives_the_bits_of_the_host(target: Target, real: ScalarType, tmp_path: Path) -> None:
    require(target)
    files = write_kernels(tmp_path, [kernels(PROGRAM)], real)
    program = build_program(target, tmp_path, files, SOURCES / "bits.c", real, ("-Os",))

    assert run_program(target, program) == on_host(tmp_path / "host", real)
