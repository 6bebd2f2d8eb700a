"""All that can be computed of a robot, in one file: silent under strict compilers, usable from C++, and right."""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path

import pytest

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.files import emit_files
from kinegen.backends.scalar_types import ScalarType
from kinegen.derive.dispatch import derive
from kinegen.errors import KinegenError
from kinegen.io.load import loads
from kinegen.ir.lower import lower, runtime_defaults
from kinegen.ir.program import Program
from kinegen.model.outputs import SOLVERS, Kind, every_quantity
from kinegen.model.robot import Robot
from kinegen.runtime.extension import lay_out
from kinegen.support.naming import prefix
from kinegen.verify.vectors import compute_vectors
from tests.emit.emitted import COMPILERS, STRICT, robot, run

pytestmark = pytest.mark.skipif(
    not COMPILERS or shutil.which("g++") is None, reason="needs g++, and gcc or clang (Debian: apt-get install g++)"
)

FORK = """
kinegen: 1
name: fork
convention: modified
units: {length: m, angle: deg}
joints:
  - {name: turn, theta: q, d: 1/2, a: 0, alpha: 0, limits: [-90, 90]}
  - {name: left, parent: turn, theta: q, d: 0, a: 1/4, alpha: 90}
  - {name: right, parent: turn, theta: 0, d: q, a: 1/8, alpha: -90, limits: [0, 1]}
"""
"""A tree with two tips, one of them on a prismatic joint."""

MILL = """
kinegen: 1
name: mill
convention: standard
units: {length: mm, angle: deg}
joints:
  - {name: x, ets: [Tx(q)]}
  - {name: y, ets: [Ty(q)]}
  - {name: z, ets: [Tz(q)]}
  - {name: c, ets: [Rz(q)]}
  - {name: b, ets: [Ry(q)], limits: [-110, 110]}
tool: {xyz: [0, 0, -80]}
"""
"""A machine tool with five axes."""

TEXTS = {"fork": FORK, "mill": MILL}
NAMES = ("scara", "calibrated_2r", "differential_wrist", "blocks", "fork", "mill")
"""Inverses; runtime parameters; actuators; no joint; a tree; a machine tool."""


def model(name: str) -> Robot:
    """One of these robots."""
    return loads(TEXTS[name], f"{name}.yaml") if name in TEXTS else robot(name)


def programs(arm: Robot) -> Iterator[Program]:
    """Every quantity that the robot has."""
    for quantity in every_quantity():
        if quantity not in SOLVERS:
            try:
                yield lower(derive(arm, quantity))
            except KinegenError:
                continue


LIMITS = {"_selftest": "", "_selftest_inverse": "_INVERSE", "_selftest_sincos": "_PAIR"}
"""The macros with the largest accepted results of the self-tests."""


@cache
def everything(name: str) -> RobotPrograms:
    """All kernels of a robot, and the search where there is something to search."""
    arm = model(name)
    return RobotPrograms(arm, tuple(programs(arm)), runtime_defaults(arm), arm.dof > 0 and not arm.is_tree)


@cache
def texts(name: str) -> Mapping[str, str]:
    """Every text file of the package."""
    return emit_files(everything(name), tuple(ScalarType), compute_vectors(everything(name))).files


def test_these_robots_have_every_quantity_among_them() -> None:
    kinds = {program.quantity.kind for name in NAMES for program in everything(name).programs}

    assert kinds | {solver.kind for solver in SOLVERS} == set(Kind)


@pytest.mark.parametrize("name", NAMES)
def test_all_of_it_is_silent_links_from_cpp_and_passes(name: str, tmp_path: Path) -> None:
    lay_out(tmp_path, texts(name))
    stems = [prefix(name, real) for real in ScalarType]
    for stem in stems:
        endings = ["", "_selftest", *(["_numeric_inverse"] if everything(name).numeric_inverse else [])]
        for source in (f"{stem}{ending}.c" for ending in endings):
            for compiler in COMPILERS:
                run([compiler, *STRICT[compiler].split(), "-O1", "-c", source, "-o", source[:-1] + "o"], tmp_path)
    headers = sorted(path.name for path in tmp_path.glob("*.h") if "_batch" not in path.name)
    checks = [
        (function, f"{stem.upper()}{LIMITS[function.removeprefix(stem)]}_TOLERANCE")
        for stem in stems
        for function in re.findall(rf"\b({stem}_selftest\w*)\(void\);", texts(name)[f"{stem}_vectors.h"])
    ]
    conditions = " && ".join(f"({function}() >= 0) && ({function}() <= {limit})" for function, limit in checks)
    includes = "".join(f'#include "{header}"\n' for header in headers)
    (tmp_path / "main.cpp").write_text(f"{includes}int main() {{ return ({conditions}) ? 0 : 1; }}\n")
    warnings = ["-std=c++11", "-Wall", "-Wextra", "-Wpedantic", "-Wold-style-cast", "-Werror"]
    run(["g++", *warnings, "main.cpp", *sorted(tmp_path.glob("*.o")), "-o", "main"], tmp_path)

    run([tmp_path / "main"])
    assert len(checks) == {"scara": 6, "blocks": 2}.get(name, 4)


def test_a_wrong_inverse_does_not_pass(tmp_path: Path) -> None:
    """A solution that is no solution, and solutions that are not found."""
    lay_out(tmp_path, texts("scara"))
    source = texts("scara")["scara.c"]
    head, _, body = source.partition("void scara_inverse(")
    for changed, told in (
        (
            re.sub(r"solutions\[(\d+)\]\[(\d+)\] = ", r"solutions[\1][\2] = 0.001 + ", body),
            r"within 0\.001, .*: FAILED",
        ),
        (re.sub(r"valid\[(\d+)\] = .*;", r"valid[\1] = 0;", body), r"within -1, .*: FAILED"),
    ):
        (tmp_path / "scara.c").write_text(f"{head}void scara_inverse({changed}", encoding="utf-8")
        command = [COMPILERS[0], "-std=c99", "-DKINEGEN_SELFTEST_MAIN", "scara_selftest.c", "scara.c", "-o", "main"]
        run(command, tmp_path)
        done = subprocess.run([tmp_path / "main"], capture_output=True, text=True, check=False)

        assert done.returncode == 1
        assert re.search(told, done.stdout), done.stdout


@pytest.mark.parametrize("name", NAMES)
def test_lines_of_headers_fit_a_screen(name: str) -> None:
    """But for names that are too long for it, which these robots have not."""
    for file, text in texts(name).items():
        if file.endswith(".h") and not file.endswith(("_vectors.h", "_batch.h")):
            assert [line for line in text.splitlines() if len(line) > 120] == []
            assert not re.search(r"\b1 (multiplications|additions|changes|divisions|pairs|roots|tangents)\b", text)
