"""The emitted tracker: strict compilers, no library, one line of refusal, the same numbers in C and in NumPy."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from kinegen.backends.c.inverse_tracker import emit_inverse_tracker
from kinegen.backends.c.kernel import emit_kernel
from kinegen.backends.languages import LANGUAGES, refusals
from kinegen.backends.scalar_types import ScalarType
from kinegen.backends.solver_parameters import TRACKING
from kinegen.driver.pipeline import lower_file
from kinegen.errors import KinegenError
from kinegen.model.outputs import INVERSE_TRACKER, POSE_AND_JACOBIAN, Kind, Quantity, parse_quantity, with_needed
from kinegen.runtime.vendored import _tracking
from tests.builds.workshop import ROBOTS
from tests.emit.emitted import COMPILERS, STRICT, STRICT_AVR, run

MAIN = """
#include <stdio.h>
#include "puma560_inverse_tracker.h"
#include "puma560_f32_inverse_tracker.h"
int main(void)
{
    const double q0[6] = {0.3, -0.6, 1.2, 0.4, 0.5, 0.2};
    const double most[6] = {0.05, 0.05, 0.05, 0.05, 0.05, 0.05};
    const double twist[6] = {0.1, 0.2, 0.3, 0.1, 0.2, 0.3};
    double base_T_tool[16], jacobian[36], q[6], qd[6], residual[6];
    puma560_tracker tracker;
    puma560_tracked report;
    puma560_tracker_start(&tracker, q0);
    for (int i = 0; i < 300; i++) {
        for (int j = 0; j < 6; j++) q[j] = q0[j] + 0.01 * (i % 150) * (j == 4 ? -1 : 0.5);
        puma560_fk_jacobian(q, base_T_tool, jacobian);
        printf("%d", puma560_tracker_step(&tracker, base_T_tool, (i % 3 == 0) ? most : NULL, &report));
        for (int j = 0; j < 6; j++) printf(" %a", tracker.q[j]);
        printf(" %a %a\\n", report.position_error, report.rotation_error);
    }
    printf("%a %d\\n", puma560_tracker_speeds(&tracker, twist, most, qd, residual), (int)sizeof tracker);
    for (int j = 0; j < 6; j++) printf("%a %a\\n", qd[j], residual[j]);
    return 0;
}
"""


def write(name: str, folder: Path, *reals: ScalarType) -> list[Path]:
    kernels = lower_file(ROBOTS / f"{name}.yaml", (INVERSE_TRACKER,))
    files: dict[str, str] = {}
    for real in reals:
        files |= emit_kernel(kernels, real) | emit_inverse_tracker(kernels, real)
    for file, text in files.items():
        (folder / file).write_text(text, encoding="utf-8")
    return [folder / file for file in files if file.endswith(".c")]


@pytest.mark.parametrize("compiler", COMPILERS)
@pytest.mark.parametrize("name", ["puma560", "scara", "panda_joint_7", "cartesian"])
@pytest.mark.parametrize("real", list(ScalarType))
def test_it_compiles_silently_and_needs_no_library(compiler: str, name: str, real: ScalarType, tmp_path: Path) -> None:
    _, tracker = write(name, tmp_path, real)
    flags = [*STRICT[compiler].split(), "-O1", "-fno-stack-protector"]
    run([compiler, *flags, "-c", tracker, "-o", tmp_path / "tracker.o"])
    missing = {line.split()[-1] for line in run(["nm", "-u", tmp_path / "tracker.o"]).splitlines()}

    assert all(symbol.endswith(("fk_jacobian", "_inverse")) or symbol in ("memcpy", "memset") for symbol in missing)


@pytest.mark.skipif(shutil.which("avr-gcc") is None, reason="needs avr-gcc (Debian: apt-get install gcc-avr avr-libc)")
def test_it_compiles_silently_where_an_int_has_16_bits(tmp_path: Path) -> None:
    *_, tracker = write("puma560", tmp_path, ScalarType.FLOAT)
    run(["avr-gcc", *STRICT_AVR.split(), "-c", tracker, "-o", tmp_path / "tracker.o"])


def test_the_bits_do_not_depend_on_compiler_or_level(tmp_path: Path) -> None:
    sources = write("puma560", tmp_path, *ScalarType)
    (tmp_path / "main.c").write_text(MAIN, encoding="utf-8")
    told = set()
    for compiler in COMPILERS:
        for level in ("-O0", "-O3"):
            program = tmp_path / f"run_{compiler}_{level[1:]}"
            run([compiler, "-std=c99", level, "-ffp-contract=off", *sources, tmp_path / "main.c", "-o", program])
            told.add(run([program]))

    assert len(told) == 1
    lines = told.pop().splitlines()
    assert {line.split()[0] for line in lines[:300]} == {"1", "2"}
    assert lines[300].split()[1] == "56"


def test_it_brings_the_kernels_that_it_needs() -> None:
    inverse = Quantity(Kind.INVERSE)
    assert parse_quantity("inverse_tracker") == INVERSE_TRACKER
    assert with_needed((INVERSE_TRACKER,)) == (POSE_AND_JACOBIAN, inverse)
    assert with_needed((inverse, INVERSE_TRACKER)) == (inverse, POSE_AND_JACOBIAN)
    with pytest.raises(KinegenError, match="not computed for a single frame"):
        parse_quantity("inverse_tracker@tool")


def test_an_arm_angle_is_refused_in_one_line() -> None:
    with pytest.raises(
        KinegenError, match=r"no inverse tracker for iiwa14_arm_angle: an arm angle is given; .*joint_7"
    ):
        lower_file(ROBOTS / "iiwa14_arm_angle.yaml", (INVERSE_TRACKER,))


def test_an_arm_without_a_closed_form_is_refused() -> None:
    with pytest.raises(KinegenError, match="jaco2"):
        lower_file(ROBOTS / "jaco2.yaml", (INVERSE_TRACKER,))


def test_languages_that_have_none_say_so() -> None:
    kernels = lower_file(ROBOTS / "puma560.yaml", (INVERSE_TRACKER,))
    for name in ("cpp", "rust", "javascript", "matlab", "cuda"):
        found = refusals(kernels, LANGUAGES[name])
        assert any(f"has no {INVERSE_TRACKER}: " in line and "\n" not in line for line in found)


def test_numpy_has_the_numbers_of_c() -> None:
    for real, bounds in zip((ScalarType.DOUBLE, ScalarType.FLOAT), _tracking.BOUNDS.values(), strict=True):
        for name in bounds._fields:
            assert getattr(bounds, name) == float(getattr(TRACKING, name)[real])
    for name in ("steps", "polish", "leap", "long_step", "detour", "other_detour", "damping", "held_damping"):
        assert getattr(_tracking, name.upper()) == float(getattr(TRACKING, name))
    assert float(TRACKING.speed_damping) == _tracking.SPEED_DAMPING
