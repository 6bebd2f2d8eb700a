"""The C of the search for many targets: strict compilers, and the bits of the search for one in every layout."""

from __future__ import annotations

from pathlib import Path

import pytest

from kinegen.backends.c import C
from kinegen.backends.scalar_types import ScalarType
from kinegen.driver.pipeline import lower_file
from kinegen.model.outputs import NUMERIC_INVERSE
from kinegen.support.naming import prefix
from tests.emit.emitted import COMPILERS, STRICT, run
from tests.numeric_inverse.conftest import robot_file

ROBOTS_AND_TREES = ("stanford", "calibrated_2r", "hand", "two_arms")
"""A prismatic joint; runtime parameters; tips without a common joint; two arms on a waist, with both of these."""


def write(name: str, real: ScalarType, folder: Path) -> tuple[list[Path], list[str | Path]]:
    """The C files, and the flags of the program that compares."""
    kernels = lower_file(robot_file(name), (NUMERIC_INVERSE,))
    for file, text in C.files(kernels, real).items():
        (folder / file).write_text(text, encoding="utf-8")
    stem = prefix(name, real)
    headers = [folder / f"{stem}_batch.h", folder / f"{stem}_numeric_inverse_batch.h"]
    flags = [
        f"-DREAL={real}",
        f"-DNAME(f)={stem}_##f",
        f"-DJOINTS={kernels.robot.dof}",
        *["-DPARAMS"] * bool(kernels.defaults),
        *[f"-DTIP_COUNT={len(kernels.robot.tips)}"] * kernels.robot.is_tree,
    ]
    return sorted(folder.glob(f"{stem}*.c")), [*flags, *(word for header in headers for word in ("-include", header))]


@pytest.mark.parametrize("name", ROBOTS_AND_TREES)
@pytest.mark.parametrize("real", ScalarType)
def test_a_batch_has_the_bits_of_single_searches(name: str, real: ScalarType, tmp_path: Path) -> None:
    sources, flags = write(name, real, tmp_path)
    caller = Path(__file__).with_name("batches.c")
    plain = ["-std=c99", "-ffp-contract=off", "-fno-tree-slp-vectorize", "-O2"]
    run([COMPILERS[0], *plain, *flags, *sources, caller, "-o", tmp_path / "program"])

    assert run([tmp_path / "program"]) == "solved\n"


@pytest.mark.parametrize("name", ["calibrated_2r", "two_arms"])
@pytest.mark.parametrize("compiler", COMPILERS)
@pytest.mark.parametrize("real", ScalarType)
def test_it_compiles_silently_and_calls_the_kernel_alone(
    name: str, compiler: str, real: ScalarType, tmp_path: Path
) -> None:
    write(name, real, tmp_path)
    source = tmp_path / f"{prefix(name, real)}_numeric_inverse_batch.c"
    run([compiler, *STRICT[compiler].split(), "-O1", "-c", source, "-o", tmp_path / "batch.o"])
    missing = {line.split()[-1] for line in run(["nm", "-u", tmp_path / "batch.o"]).splitlines()}

    # Compilers take the last two from the C library even for code that names neither.
    assert missing - {"memset", "memcpy"} == {f"{prefix(name, real)}_fk_jacobian_batch"}
