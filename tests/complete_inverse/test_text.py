"""The emitted complete inverse: strict compilers, no library, refusals, and the same bits at every level."""

from __future__ import annotations

from pathlib import Path

import pytest

from kinegen.backends.c.complete_inverse import emit_complete_inverse
from kinegen.backends.c.kernel import emit_kernel
from kinegen.backends.complete_inverse.elimination_choice import complete_of
from kinegen.backends.languages import LANGUAGES, refusals
from kinegen.backends.scalar_types import ScalarType
from kinegen.driver.pipeline import lower_file
from kinegen.errors import KinegenError
from kinegen.io.load import load
from kinegen.model.outputs import COMPLETE_INVERSE, POSE_AND_JACOBIAN, parse_quantity, with_needed
from kinegen.ui.cli import main
from tests.builds.workshop import ROBOTS, make
from tests.emit.emitted import COMPILERS, STRICT, run

MAIN = """
#include <stdio.h>
#include "{name}_complete_inverse.h"
int main(void)
{{
    double base_T_tool[16], jacobian[36], solutions[16][6];
    const double q[6] = {{0.5, 1.5, 2.5, -0.5, 1.0, -1.5}};
    {name}_fk_jacobian(q, base_T_tool, jacobian);
    const int count = {name}_complete_inverse(base_T_tool, solutions);
    printf("%d", count);
    for (int i = 0; i < 16; i++) {{
        for (int j = 0; j < 6; j++) printf(" %a", solutions[i][j]);
    }}
    return 0;
}}
"""


def write(name: str, folder: Path) -> list[Path]:
    kernels = lower_file(ROBOTS / f"{name}.yaml", (COMPLETE_INVERSE,))
    files = emit_kernel(kernels, ScalarType.DOUBLE) | emit_complete_inverse(kernels)
    files["main.c"] = MAIN.format(name=name)
    for file, text in files.items():
        (folder / file).write_text(text, encoding="utf-8")
    return [folder / file for file in files if file.endswith(".c")]


@pytest.mark.parametrize("compiler", COMPILERS)
@pytest.mark.parametrize("name", ["jaco2", pytest.param("xarm6", marks=pytest.mark.long)])
def test_it_compiles_silently_and_needs_no_library(compiler: str, name: str, tmp_path: Path) -> None:
    _, complete, _ = write(name, tmp_path)
    flags = [*STRICT[compiler].split(), "-O1", "-fno-stack-protector"]
    run([compiler, *flags, "-c", complete, "-o", tmp_path / "complete.o"])
    missing = {line.split()[-1] for line in run(["nm", "-u", tmp_path / "complete.o"]).splitlines()}

    assert all(symbol.endswith("fk_jacobian") or symbol in ("memcpy", "memset") for symbol in missing)


def test_the_bits_do_not_depend_on_compiler_or_level(tmp_path: Path) -> None:
    sources = write("jaco2", tmp_path)
    told = set()
    for compiler in COMPILERS:
        for level in ("-O0", "-O3"):
            program = tmp_path / f"run_{compiler}_{level[1:]}"
            run([compiler, "-std=c99", level, "-ffp-contract=off", *sources, "-o", program])
            told.add(run([program]))

    assert len(told) == 1
    assert int(told.pop().split()[0]) >= 2


def test_the_same_text_every_time(tmp_path: Path) -> None:
    texts = [path.read_text() for path in write("gen3_lite", tmp_path)]
    complete_of.cache_clear()

    assert [path.read_text() for path in write("gen3_lite", tmp_path)] == texts


def test_it_brings_the_kernel_that_it_needs() -> None:
    assert parse_quantity("complete_inverse") == COMPLETE_INVERSE
    assert with_needed((COMPLETE_INVERSE,)) == (POSE_AND_JACOBIAN,)
    with pytest.raises(KinegenError, match="not computed for a single frame"):
        parse_quantity("complete_inverse@tool")


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("stanford", "joint joint_3 is prismatic"),
        ("iiwa14", "it has 7 joints, not 6"),
        ("hand", "it has several tips"),
        ("planar_3r", "it has 3 joints, not 6"),
    ],
)
def test_other_arms_are_refused_in_one_line(name: str, reason: str) -> None:
    with pytest.raises(KinegenError, match=rf"no complete inverse for {name}: {reason}$"):
        lower_file(ROBOTS / f"{name}.yaml", (COMPLETE_INVERSE,))


def test_a_runtime_parameter_is_refused(tmp_path: Path) -> None:
    text = (
        (ROBOTS / "jaco2.yaml").read_text(encoding="utf-8").replace("D1: 0.2755", "D1: {value: 0.2755, runtime: true}")
    )
    (tmp_path / "arm.yaml").write_text(text, encoding="utf-8")

    with pytest.raises(KinegenError, match=r"D1 is a runtime parameter, and the elimination needs its value$"):
        lower_file(tmp_path / "arm.yaml", (COMPLETE_INVERSE,))


def test_an_arm_whose_solutions_share_angles_is_sent_to_its_closed_form() -> None:
    with pytest.raises(KinegenError, match=r"puma560: its solutions share the angles .*; take inverse$"):
        complete_of(load(ROBOTS / "puma560.yaml"))


PARALLEL = """
kinegen: 1
name: four_parallel
convention: standard
units: {length: m, angle: deg}
joints:
  - {name: j1, theta: q, d: 0.3, a: 0, alpha: 90}
  - {name: j2, theta: q, d: 0, a: 0.3, alpha: 0}
  - {name: j3, theta: q, d: 0, a: 0.25, alpha: 0}
  - {name: j4, theta: q, d: 0, a: 0.2, alpha: 0}
  - {name: j5, theta: q, d: 0, a: 0.1, alpha: 90}
  - {name: j6, theta: q, d: 0.1, a: 0, alpha: 0}
"""


def test_an_arm_that_is_singular_everywhere_is_said_so_by_both(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "arm.yaml").write_text(PARALLEL, encoding="utf-8")
    with pytest.raises(KinegenError, match=r"its Jacobian is singular at every .*; take numeric_inverse$"):
        complete_of(load(tmp_path / "arm.yaml"))
    main(["inspect", str(tmp_path / "arm.yaml")])
    told = " ".join(capsys.readouterr().out.split())

    assert "its Jacobian is singular at every joint vector" in told
    assert "--outputs complete_inverse" not in told


def test_a_variable_that_moves_two_axes_is_refused(tmp_path: Path) -> None:
    text = (ROBOTS / "crx10ial.yaml").read_text(encoding="utf-8").replace("J3, theta: q, ", "J3, theta: q + J2, ")
    (tmp_path / "arm.yaml").write_text(text, encoding="utf-8")

    with pytest.raises(KinegenError, match=r"no complete inverse for crx10ial: .* one axis$"):
        complete_of(load(tmp_path / "arm.yaml"))


def test_without_double_it_is_refused(tmp_path: Path) -> None:
    with pytest.raises(KinegenError, match="it computes in double, which this build leaves out"):
        make(ROBOTS / "general_6r.yaml", tmp_path, quantities=(COMPLETE_INVERSE,), reals=(ScalarType.FLOAT,))


def test_languages_that_have_none_say_so() -> None:
    kernels = lower_file(ROBOTS / "general_6r.yaml", (COMPLETE_INVERSE,))
    for name in ("cpp", "rust", "javascript"):
        found = refusals(kernels, LANGUAGES[name])
        assert any(f"has no {COMPLETE_INVERSE}: " in line and "\n" not in line for line in found)


def test_inspect_names_it_where_there_is_no_closed_form(capsys: pytest.CaptureFixture[str]) -> None:
    main(["inspect", str(ROBOTS / "jaco2.yaml"), str(ROBOTS / "iiwa14.yaml")])

    assert capsys.readouterr().out.count("--outputs complete_inverse") == 1
