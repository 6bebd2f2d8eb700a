"""A robot's own version, and headers that belong to other sources."""

from __future__ import annotations

import re
import subprocess
from dataclasses import replace
from pathlib import Path

import pytest

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.c.batch import emit_batch
from kinegen.backends.c.kernel import emit_kernel
from kinegen.backends.c.numeric_inverse import emit_numeric_inverse
from kinegen.backends.scalar_types import ScalarType
from kinegen.derive.dispatch import derive
from kinegen.errors import RobotFileError
from kinegen.io.load import loads
from kinegen.ir.lower import lower, runtime_defaults
from kinegen.model.outputs import POSE_AND_JACOBIAN, USUAL
from kinegen.model.robot import Robot
from kinegen.runtime.compiler import find_compiler

TEXT = """kinegen: 1
name: arm
convention: standard
units: {length: m, angle: deg}
joints:
  - {name: waist, a: 0.1, alpha: 90, d: 0.4, theta: q}
  - {name: elbow, a: 0.3, alpha: 0, d: 0, theta: q}
"""


def arm(version: str = "", length: str = "0.3") -> Robot:
    """The robot of the tests."""
    line = f"version: {version}\n" if version else ""
    return loads(TEXT.replace("convention", f"{line}convention").replace("0.3", length), "arm.yaml")


def files(robot: Robot) -> dict[str, str]:
    """All kernels in C."""
    programs = tuple(lower(derive(robot, quantity)) for quantity in (*USUAL, POSE_AND_JACOBIAN))
    kernels = RobotPrograms(robot, programs, runtime_defaults(robot), numeric_inverse=True)
    found: dict[str, str] = {}
    for real in ScalarType:
        found |= emit_kernel(kernels, real) | emit_batch(kernels, real) | emit_numeric_inverse(kernels, real)
    return found


@pytest.mark.parametrize("version", ["1.2.0", "0.0.1", "10.20.30"])
def test_the_version_of_the_file_is_taken(version: str) -> None:
    assert arm(version).version == arm(version).release == version
    assert arm(version).digest == arm().digest


def test_without_one_it_is_made_of_the_digest() -> None:
    assert arm().version == ""
    assert arm().release == f"0.{int(arm().digest[:6], 16)}.0"
    assert arm().release != arm(length="0.31").release
    assert replace(arm(), digest="000000ffffffffff").release == "0.0.0"


@pytest.mark.parametrize(
    "version", ["1", "1.2", "1.2.3.4", "v1.2.3", "1.02.3", "1.2.3-rc1", "1.2.x", "1234567.0.0", "[1]"]
)
def test_other_versions_are_refused(version: str) -> None:
    with pytest.raises(RobotFileError, match=r"arm\.yaml:3: version: .*three numbers, such as 1\.2\.0"):
        arm(version)


def test_header_and_source_name_the_model() -> None:
    found = files(arm())
    macro = f"ARM_MODEL 0x{arm().digest}U"

    assert f"#define {macro}\n" in found["arm.h"]
    for name, text in found.items():
        assert name.endswith(".h") or f"#if {macro.replace(' ', ' != ')}\n#error" in text, name


@pytest.mark.parametrize("name", sorted(name for name in files(arm()) if name.endswith(".c")))
def test_a_header_of_another_robot_is_a_compile_error(name: str, tmp_path: Path) -> None:
    compiler = find_compiler()
    assert compiler is not None
    old, new = files(arm()), files(arm(length="0.31"))
    command = [*compiler.command, "-std=c99", "-fsyntax-only", str(tmp_path / name)]
    for file, text in (new | {name: old[name]}).items():
        (tmp_path / file).write_text(text, encoding="utf-8")
    mixed = subprocess.run(command, capture_output=True, text=True, check=False)
    (tmp_path / name).write_text(new[name], encoding="utf-8")
    whole = subprocess.run(command, capture_output=True, text=True, check=False)

    assert whole.returncode == 0, whole.stderr
    assert mixed.returncode != 0
    assert re.search("the header and this file were generated from different robot files", mixed.stderr)
