"""The example shows what its page says: where printed formulas fail, and that the kernels do not."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from kinegen.ui.cli import main

ROOT = Path(__file__).resolve().parents[2]
OUTPUTS = "pose,rpy_zyx,rpy_zyx_jacobian,quaternion_wxyz"


@pytest.fixture(scope="module")
def printed(tmp_path_factory: pytest.TempPathFactory) -> str:
    folder = str(tmp_path_factory.mktemp("generated"))
    options = ["--no-compile", "--real", "double", "--outputs", OUTPUTS]
    assert main(["build", str(ROOT / "examples" / "gimbal.yaml"), "-o", folder, *options]) == 0
    command = [sys.executable, "-W", "error", "-W", "ignore:NumPy evaluates", "examples/orientation_formulas.py"]
    environment = {**os.environ, "PYTHONPATH": f"{folder}{os.pathsep}{ROOT}"}
    return subprocess.run(command, cwd=ROOT, env=environment, check=True, capture_output=True, text=True).stdout


def test_printed_arcsines_are_right_in_a_quarter_of_all_cases(printed: str) -> None:
    assert re.search(r"^three arcsines +gives the rotation back for +25\.00%", printed, re.M)
    assert re.search(r"^rpy_zyx +gives the rotation back for 100\.00%", printed, re.M)


def test_they_are_right_where_roll_and_yaw_are_within_a_quarter_turn(printed: str) -> None:
    assert len(re.findall(r"rounding +all within a quarter turn", printed)) == 2
    assert len(re.findall(r"wrong +(?:yaw|roll|both) beyond", printed)) == 3


def test_beside_singularities_the_kernels_give_the_rotation_back(printed: str) -> None:
    rows = re.findall(r"^ +(\d\S+) rad +(\S+) +(\S+)", printed, re.M)

    assert len(rows) == 12
    assert [arcsine for gap, arcsine, _ in rows[:6] if float(gap) < 1e-6] == ["wrong"] * 3
    assert [tangents for gap, _, tangents in rows[:6] if float(gap) < 1e-4 and tangents == "rounding"] == []
    assert printed.count("rounding  7e") == 6
    assert [kernel for _, _, kernel in rows[6:]] == ["rounding"] * 6
