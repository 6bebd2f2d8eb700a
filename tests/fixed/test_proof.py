"""The compiled kernels: within their bounds, the same bits from every compiler, and a broken one is refused."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.files import emit_integers
from kinegen.backends.fixed_point.vectors import FixedVectors
from kinegen.backends.scalar_types import ScalarType
from kinegen.driver import pipeline as building
from kinegen.driver.pipeline import build
from kinegen.driver.results import BuildOptions
from kinegen.errors import KinegenError, MissingToolError, ProofError
from kinegen.ir.fixed_point.program import Operation
from kinegen.model.outputs import USUAL, Quantity
from kinegen.runtime.compiler import Compiler
from kinegen.support.naming import Q30, c_file
from kinegen.verify.fixed_point import compile_integers, prove_fixed
from kinegen.verify.fixed_point_vectors import integer_samples
from tests.fixed import machine
from tests.fixed.kernels import COMPILERS, ROBOTS, SPLIT, UNDEFINED, fixed, run, texts
from tests.fixed.test_overflow import result

pytestmark = pytest.mark.skipif(not COMPILERS, reason="needs gcc or clang")

LEVELS = {"gcc": ("-O0",), "clang": ("-O3", "-march=native")}
WAYS = [
    (compiler, flags)
    for compiler in COMPILERS
    for flags in (LEVELS[compiler], ("-O2", SPLIT), ("-O1", *UNDEFINED[compiler]))
]


def test_every_compiler_and_both_kinds_of_products_give_the_same_bits(name: str, tmp_path: Path) -> None:
    """One of them traps where something undefined happens."""
    kernels = fixed(name)
    q = integer_samples(kernels)[::97]
    found = []
    for number, (compiler, flags) in enumerate(WAYS):
        folder = tmp_path / str(number)
        folder.mkdir()
        library = compile_integers(kernels, texts(name), folder, Compiler((compiler,), ""), *flags)
        found.append([library.call(quantity, q) for quantity in USUAL])

    for other in found[1:]:
        for one, another in zip(found[0], other, strict=True):
            np.testing.assert_array_equal(one, another)


def test_the_compiled_code_computes_what_c_says(name: str, tmp_path: Path) -> None:
    kernels = fixed(name)
    q = integer_samples(kernels)[:: 20_000 if kernels.robot.dof > 7 else 4_000]
    library = compile_integers(kernels, texts(name), tmp_path, Compiler((COMPILERS[0],), ""))
    code = machine.load(texts(name)[c_file(name, "c", Q30)], split=False)
    for program in kernels.programs:
        compiled = library.call(program.program.quantity, q)
        for row, entries in zip(q, compiled, strict=True):
            kept = entries.reshape(-1, entries.shape[-1])[:, :12]
            assert result(code, kernels, program, row.tolist()) == kept.ravel().tolist()


def test_errors_are_below_the_bounds_and_not_far_below(name: str) -> None:
    kernels = fixed(name)
    turns = any(each.operator is Operation.SINCOS for each in kernels.programs[0].statements)
    proof = prove_fixed(kernels, texts(name))

    assert [comparison.quantity for comparison in proof.comparisons] == list(USUAL)
    assert {comparison.target for comparison in proof.comparisons} == {"C q30"}
    for comparison in proof.comparisons:
        assert comparison.poses >= (14_000 if kernels.robot.dof else 1)
        if kernels.robot.dof:
            assert comparison.position_error > comparison.position_tolerance / 5
        if turns and comparison.quantity.is_pose:
            assert comparison.rotation_error > comparison.rotation_tolerance / 6


BREAKS: dict[str, Callable[[str], str]] = {
    "a constant off by 64 units": lambda text: text.replace("463641720", "463641784").replace("927283439", "927283503"),
    "a wrong sign": lambda text: re.sub(r"(const int32_t t\d+ = t\d+) \+", r"\1 -", text, count=1),
    "another joint": lambda text: text.replace("(uint32_t)q[3]", "(uint32_t)q[4]", 1),
    "a coefficient off by 9": lambda text: text.replace("612887889", "612887898"),
    "a last row that is none": lambda text: text.replace("[15] = 1073741824", "[15] = 1073741823"),
}


@pytest.mark.parametrize("defect", BREAKS)
def test_a_broken_kernel_is_refused(defect: str) -> None:
    source = c_file("puma560", "c", Q30)
    broken = BREAKS[defect](texts("puma560")[source])

    assert broken != texts("puma560")[source]
    with pytest.raises(
        ProofError, match=r"puma560: C q30 \w+ differs from the reference at q = .* nothing was written"
    ):
        prove_fixed(fixed("puma560"), {**texts("puma560"), source: broken})


@pytest.mark.parametrize("split", [(), (SPLIT,)], ids=["whole", "halves"])
def test_the_selftest_passes_and_notices_a_wrong_kernel(
    name: str, split: tuple[str, ...], folder: Path, tmp_path: Path
) -> None:
    selftest, source = folder / f"{name}_q30_selftest.c", folder / c_file(name, "c", Q30)
    flags = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-O1", *split, "-DKINEGEN_SELFTEST_MAIN", f"-I{folder}"]
    run([COMPILERS[0], *flags, selftest, source, "-o", tmp_path / "right"])
    printed = run([tmp_path / "right"])
    (tmp_path / "wrong.c").write_text(_shifted(source.read_text(encoding="utf-8")), encoding="utf-8")
    run([COMPILERS[0], *flags, selftest, tmp_path / "wrong.c", "-o", tmp_path / "wrong"])
    wrong = subprocess.run([tmp_path / "wrong"], capture_output=True, text=True, check=False)

    assert re.fullmatch(rf"{name}_q30: \d+ vectors, largest difference \d+, tolerance \d+: passed\n", printed)
    assert (wrong.returncode, wrong.stdout.rpartition(" ")[2]) == (1, "FAILED\n")


def _shifted(text: str) -> str:
    """The code with one result off by a thousand units."""
    changed = re.sub(r"^(    base_\w+(?:\[\d+\])+ = )([\w-]+);", r"\1\2 + 1000;", text, count=1, flags=re.MULTILINE)
    assert changed != text
    return changed


PUMA = ROBOTS / "puma560.yaml"
Q30_FILES = {"puma560_q30.h", "puma560_q30.c", "puma560_q30_vectors.h", "puma560_q30_selftest.c"}


def options(folder: Path) -> BuildOptions:
    """A build of the positions alone, in doubles and integers."""
    return BuildOptions(folder, (ScalarType.DOUBLE,), (Quantity.POSITION,), integers=True)


def names(folder: Path) -> set[str]:
    """The files of the package."""
    return {path.name for path in (folder / "puma560").iterdir()} if folder.exists() else set()


def test_a_build_writes_and_proves_them_beside_the_others(tmp_path: Path) -> None:
    result = build(PUMA, options(tmp_path), lambda _: None)

    assert names(tmp_path) >= {"puma560.c", "__init__.py", *Q30_FILES}
    assert [each.quantity for each in result.proof.comparisons if each.target == "C q30"] == [Quantity.POSITION]
    assert result.proof.holds
    build(PUMA, replace(options(tmp_path), integers=False), lambda _: None)
    assert not names(tmp_path) & Q30_FILES, "a build without them takes them away"


def test_a_build_with_a_broken_kernel_writes_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(kernels: RobotPrograms, vectors: FixedVectors) -> dict[str, str]:
        found = emit_integers(kernels, vectors)
        return {**found, "puma560_q30.c": found["puma560_q30.c"].replace("(uint32_t)q[0]", "(uint32_t)q[1]", 1)}

    monkeypatch.setattr("kinegen.driver.artifacts.emit_integers", broken)
    with pytest.raises(ProofError, match="C q30 position differs"):
        build(PUMA, options(tmp_path / "out"), lambda _: None)

    assert names(tmp_path / "out") == set()


def test_without_a_compiler_they_are_written_and_the_build_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def nothing(*_: object) -> None:
        raise MissingToolError("there is no C compiler")

    monkeypatch.setattr(building, "prove_fixed", nothing)
    for compiled in (True, False):
        result = build(PUMA, replace(options(tmp_path), compile=compiled), lambda _: None)
        assert "the q30 kernels are not verified, since that needs a C compiler" in result.notes
        assert names(tmp_path) >= Q30_FILES


def test_a_refusal_names_the_file_as_the_user_did(tmp_path: Path) -> None:
    with pytest.raises(KinegenError, match=r"robots/screw\.yaml:\d+: no q30 kernels for screw: a length follows"):
        build(ROBOTS / "screw.yaml", options(tmp_path / "out"), lambda _: None)

    assert names(tmp_path / "out") == set()
