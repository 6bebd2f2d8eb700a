"""The emitted search: strict compilers, no library, refusals, and the same bits at every level."""

from __future__ import annotations

import ast
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from kinegen.backends.c.kernel import emit_kernel
from kinegen.backends.c.numeric_inverse import emit_numeric_inverse
from kinegen.backends.languages import LANGUAGES, kept, refusals
from kinegen.backends.scalar_types import ScalarType
from kinegen.backends.solver_parameters import TUNING
from kinegen.driver.pipeline import lower_file
from kinegen.errors import KinegenError
from kinegen.model.outputs import NUMERIC_INVERSE, POSE_AND_JACOBIAN, parse_quantity, with_needed
from kinegen.runtime.vendored import _search
from tests.builds.workshop import ROBOTS
from tests.emit.emitted import COMPILERS, STRICT, STRICT_AVR, run
from tests.emit.test_c_compilers import CORTEX_M4F
from tests.numeric_inverse.conftest import robot_file

ARMS = ("stanford", "calibrated_2r")

MAIN = """
#include <stdio.h>
#include "{stem}_numeric_inverse.h"
int main(void)
{{
    const {real} zero[{dof}] = {{0}};
    {real} q[{dof}], base_T_tool[16], jacobian[6 * {dof}];
    const {real} far[{dof}] = {values};
    {stem}_found found;
    {stem}_fk_jacobian(far, {params}base_T_tool, jacobian);
    const int solved = {stem}_numeric_inverse(base_T_tool, zero, {params}&{stem}_default_search, q, &found);
    printf("%d %d %d", solved, (int)found.iterations, (int)found.descents);
    for (int j = 0; j < {dof}; j++) printf(" %a", (double)q[j]);
    return 0;
}}
"""


def write(name: str, real: ScalarType, folder: Path) -> list[Path]:
    kernels = lower_file(robot_file(name), (NUMERIC_INVERSE,))
    files = emit_kernel(kernels, real) | emit_numeric_inverse(kernels, real)
    stem = name if real is ScalarType.DOUBLE else f"{name}_f32"
    params = f"&{stem}_default_params, " if kernels.defaults else ""
    values = "{" + ", ".join(["0.5"] * kernels.robot.dof) + "}"
    files["main.c"] = MAIN.format(stem=stem, real=real, dof=kernels.robot.dof, params=params, values=values)
    for file, text in files.items():
        (folder / file).write_text(text, encoding="utf-8")
    return [folder / file for file in files if file.endswith(".c")]


@pytest.mark.parametrize("compiler", COMPILERS)
@pytest.mark.parametrize("name", [*ARMS, "hand", "two_arms"])
@pytest.mark.parametrize("real", ScalarType)
def test_it_compiles_silently_and_needs_no_library(compiler: str, name: str, real: ScalarType, tmp_path: Path) -> None:
    *_, search, _ = write(name, real, tmp_path)
    run([compiler, *STRICT[compiler].split(), "-O1", "-c", search, "-o", tmp_path / "search.o"])
    missing = {line.split()[-1] for line in run(["nm", "-u", tmp_path / "search.o"]).splitlines()}

    assert all(symbol.endswith("fk_jacobian") for symbol in missing)


@pytest.mark.skipif(shutil.which("avr-gcc") is None, reason="needs avr-gcc (Debian: apt-get install gcc-avr avr-libc)")
@pytest.mark.parametrize("name", ["stanford", "hand"])
def test_it_compiles_silently_where_an_int_has_16_bits(name: str, tmp_path: Path) -> None:
    *_, search, _ = write(name, ScalarType.FLOAT, tmp_path)
    run(["avr-gcc", *STRICT_AVR.split(), "-c", search, "-o", tmp_path / "search.o"])


@pytest.mark.skipif(shutil.which("arm-none-eabi-gcc") is None, reason="needs arm-none-eabi-gcc")
@pytest.mark.parametrize(("real", "place"), [(ScalarType.FLOAT, 0), (ScalarType.DOUBLE, 1)])
def test_it_takes_no_more_stack_than_the_page_says(real: ScalarType, place: int, tmp_path: Path) -> None:
    """Debian's compiler is what the page was measured with; others keep a few registers more or fewer."""
    page = " ".join((ROBOTS.parent / "docs" / "inverse.md").read_text(encoding="utf-8").split())
    (stated,) = re.findall(r"needs (\d+) bytes of stack in float and (\d+) in double", page)
    *_, search, _ = write("puma560", real, tmp_path)
    run(["arm-none-eabi-gcc", *CORTEX_M4F, "-fstack-usage", "-c", search, "-o", tmp_path / "search.o"])
    frames = re.findall(r"_numeric_inverse\t(\d+)\tstatic", (tmp_path / "search.su").read_text(encoding="utf-8"))
    assert len(frames) == 1
    assert 0.9 * int(stated[place]) < int(frames[0]) < 1.1 * int(stated[place])


@pytest.mark.parametrize("real", ScalarType)
def test_the_bits_do_not_depend_on_compiler_or_level(real: ScalarType, tmp_path: Path) -> None:
    sources = write("stanford", real, tmp_path)
    told = set()
    for compiler in COMPILERS:
        for level in ("-O0", "-O3"):
            flags = ["-std=c99", "-ffp-contract=off", level, f"-I{tmp_path}", "-o", tmp_path / "program"]
            run([compiler, *flags, *sources])
            told.add(subprocess.run([tmp_path / "program"], capture_output=True, text=True, check=True).stdout)

    assert len(told) == 1
    assert told.pop().startswith("1 ")


def test_a_robot_without_joints_is_refused() -> None:
    with pytest.raises(KinegenError, match="no numeric inverse for blocks: it has no joints"):
        lower_file(ROBOTS / "blocks.yaml", (NUMERIC_INVERSE,))


def test_rust_leaves_the_search_of_a_tree_out_and_says_so() -> None:
    kernels = lower_file(ROBOTS / "hand.yaml", (NUMERIC_INVERSE,))

    assert kept(kernels, LANGUAGES["c"]).numeric_inverse
    assert not kept(kernels, LANGUAGES["rust"]).numeric_inverse
    assert "Rust has no numeric_inverse: for several tips it is in C and Python alone" in refusals(
        kernels, LANGUAGES["rust"]
    )


def test_it_brings_the_kernel_it_needs_once() -> None:
    assert with_needed((NUMERIC_INVERSE,)) == (POSE_AND_JACOBIAN,)
    assert with_needed((POSE_AND_JACOBIAN, NUMERIC_INVERSE)) == (POSE_AND_JACOBIAN,)
    assert parse_quantity("numeric_inverse") == NUMERIC_INVERSE


def test_the_numpy_form_searches_with_the_same_numbers() -> None:
    named = _search._ITERATIONS, _search._STALL, _search._SAMPLES, _search._MOST_SAMPLES
    text = Path(_search.__file__).read_text(encoding="utf-8")
    written = {node.value for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Constant)}
    others = (TUNING.margin, TUNING.damping, TUNING.longest_step, TUNING.huge, TUNING.farthest, *TUNING.rigid.values())

    assert named == (TUNING.iterations, TUNING.stall, TUNING.samples, TUNING.most_samples)
    assert {float(number) for number in (*others, TUNING.least_damping[ScalarType.DOUBLE])} <= written
