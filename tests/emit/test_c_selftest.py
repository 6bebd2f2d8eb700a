"""The self-test that is written beside the kernels: it passes, and it fails when a kernel is not what it was."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from kinegen.backends.scalar_types import ScalarType
from kinegen.model.outputs import POSE_AND_JACOBIAN
from kinegen.support.naming import prefix, sincos_macro
from tests.emit.emitted import COMPILERS, code, run, texts, vectors

pytestmark = pytest.mark.skipif(not COMPILERS, reason="needs gcc or clang")

OWN_PAIR = """
#include <math.h>
#define {macro}(x, s, c) (*(s) = sin{f}((x)), *(c) = cos{f}((x)))
"""


def selftest(folder: Path, name: str, real: ScalarType, kernel: Path, *flags: str) -> subprocess.CompletedProcess[str]:
    """Compile the self-test with a kernel and run it."""
    stem = prefix(name, real)
    program = kernel.with_name(f"{stem}_selftest")
    source = folder / f"{stem}_selftest.c"
    command = [COMPILERS[0], "-std=c99", "-O1", "-DKINEGEN_SELFTEST_MAIN", f"-I{folder}", *flags, source, kernel]
    run([*command, "-o", program, "-lm"])
    return subprocess.run([program], capture_output=True, text=True, check=False)


def changed(folder: Path, name: str, real: ScalarType, target: Path, change: Callable[[str], str]) -> Path:
    """A kernel that is not what was emitted, in another folder."""
    stem = prefix(name, real)
    before = (folder / f"{stem}.c").read_text(encoding="utf-8")
    after = change(before)

    assert after != before
    (target / f"{stem}.c").write_text(after, encoding="utf-8")
    return target / f"{stem}.c"


def test_the_self_test_passes(name: str, real: ScalarType, folder: Path, tmp_path: Path) -> None:
    kernel = tmp_path / f"{prefix(name, real)}.c"
    kernel.write_text((folder / kernel.name).read_text(encoding="utf-8"), encoding="utf-8")
    done = selftest(folder, name, real, kernel)

    assert done.returncode == 0, done.stdout
    assert re.match(rf"{prefix(name, real)}: \d+ vectors, largest difference \S+ of the tolerance: passed", done.stdout)
    assert done.stderr == ""


@pytest.mark.parametrize(
    ("arm", "before", "after"),
    [
        ("puma560", "0.4318", "0.4319"),
        ("puma560", "base_p_tool[2] = ", "base_p_tool[2] = -"),
        ("ur5", "base_T_frames[3][7] = t", "base_T_frames[3][7] = 1 + t"),
        ("hand", "base_T_tips[4][0] = ", "base_T_tips[4][0] = -"),
        ("blocks", "base_T_tool[3] = ", "base_T_tool[3] = 1 + "),
        ("cartesian", "q[1]", "q[0]"),
        ("screw", "0.000795774", "0.000796774"),
        ("calibrated_2r", "params->L1", "params->L2"),
    ],
)
def test_the_self_test_fails_where_a_kernel_was_changed(
    arm: str, before: str, after: str, folder_of: Callable[[str], Path], tmp_path: Path
) -> None:
    folder, real = folder_of(arm), ScalarType.FLOAT if arm in ("ur5", "screw") else ScalarType.DOUBLE
    kernel = changed(folder, arm, real, tmp_path, lambda text: text.replace(before, after))
    done = selftest(folder, arm, real, kernel)

    assert done.returncode == 1
    assert "FAILED" in done.stdout


def test_a_result_that_is_not_a_number_fails(
    real: ScalarType, folder_of: Callable[[str], Path], tmp_path: Path
) -> None:
    folder, nan = folder_of("ur5"), "base_p_tool[1] = (q[0] - q[0]) / (q[0] - q[0]) * "
    kernel = changed(folder, "ur5", real, tmp_path, lambda text: text.replace("base_p_tool[1] = ", nan))
    done = selftest(folder, "ur5", real, kernel)

    assert done.returncode == 1
    assert "largest difference -1 of" in done.stdout


def test_a_board_can_put_its_own_pair_in(real: ScalarType, folder_of: Callable[[str], Path], tmp_path: Path) -> None:
    """The emitted pair is then not compiled at all, and the self-test measures the board's."""
    folder, stem, macro = folder_of("puma560"), prefix("puma560", real), sincos_macro("puma560", real)
    header = tmp_path / "board.h"
    header.write_text(OWN_PAIR.format(macro=macro, f="f" if real is ScalarType.FLOAT else ""), encoding="utf-8")
    kernel = tmp_path / f"{stem}.c"
    kernel.write_text((folder / kernel.name).read_text(encoding="utf-8"), encoding="utf-8")
    done = selftest(folder, "puma560", real, kernel, "-include", str(header))
    plain = [COMPILERS[0], "-std=c99", f"-I{folder}", "-c", kernel, "-o", tmp_path / "kernel.o"]
    run([*plain, "-include", header])

    assert done.returncode == 0, done.stdout
    assert re.search("sine and cosine at .*: passed", done.stdout)
    assert f"{stem}_sincos" not in run(["nm", tmp_path / "kernel.o"])


def test_the_self_test_of_the_pair_sees_its_error(
    real: ScalarType, folder_of: Callable[[str], Path], tmp_path: Path
) -> None:
    """It prints less than one unit in the last place, and more where a coefficient is not what it was."""
    folder, stem = folder_of("puma560"), prefix("puma560", real)
    kernel = tmp_path / f"{stem}.c"
    kernel.write_text((folder / kernel.name).read_text(encoding="utf-8"), encoding="utf-8")
    good = selftest(folder, "puma560", real, kernel)
    worse = tmp_path / "worse.h"
    worse.write_text(
        OWN_PAIR.format(macro=sincos_macro("puma560", real), f="").replace("sin(", "1e-6 + sin("), encoding="utf-8"
    )
    bad = selftest(folder, "puma560", real, kernel, "-include", str(worse), "-Wno-conversion")
    errors = [float(re.search(r"largest error (\S+),", done.stdout).group(1)) for done in (good, bad)]  # type: ignore[union-attr]

    assert errors[0] < (6e-8 if real is ScalarType.FLOAT else 1.2e-16)
    assert errors[1] == pytest.approx(1e-6, rel=0.1)
    assert re.search("sine and cosine at .*: FAILED", bad.stdout)
    assert (good.returncode, bad.returncode) == (0, 1)


def test_the_vectors_hold_zero_the_ends_of_the_joints_and_random_points() -> None:
    text = code(texts("puma560")["puma560_vectors.h"])
    rows = re.findall(r"^    \{(.*)\}", text.split("puma560_vectors_q")[1].split("};")[0], re.MULTILINE)
    vectors = [[float(number) for number in row.split(",")] for row in rows]

    assert len(vectors) == 16
    assert vectors[0] == [0.0] * 6
    assert all((number * 1024).is_integer() for vector in vectors for number in vector)
    assert all(low <= entry <= high for entry, low, high in zip(vectors[5], vectors[1], vectors[2], strict=True))


def test_all_results_of_a_kernel_have_as_many_vectors() -> None:
    """The Jacobians of a tree are large and have few; the poses beside them have no more, or the array overflows."""
    results = vectors("hand", (POSE_AND_JACOBIAN,)).expected[POSE_AND_JACOBIAN]
    text = code(texts("hand", (POSE_AND_JACOBIAN,))["hand_vectors.h"])
    counts = re.findall(r"hand_fk_jacobian_expected_\w+\[(\d+)\].*?= \{\n(.*?)\n\};", text, re.DOTALL)

    assert [len(result.rows) for result in results] == [4, 4]
    assert [(int(count), rows.count("\n") + 1) for count, rows in counts] == [(4, 4), (4, 4)]
