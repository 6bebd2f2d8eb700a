"""The example calibration finds what it set out to find."""

from __future__ import annotations

import re
import subprocess
import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from kinegen.io.load import load
from kinegen.verify import reference

ROOT = Path(__file__).resolve().parents[2]


@cache
def printed() -> str:
    command = [sys.executable, "examples/calibration_ur5.py", "--no-compile"]
    return subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout


def test_every_parameter_is_found_to_within_three_standard_deviations() -> None:
    rows = re.findall(r"^(\w+) +(\S+) +(\S+) +(\S+)  m\S+ +(\S+) sigma$", printed(), re.M)

    assert len(rows) == 24
    for name, wrong, found, sigma, off in rows:
        assert abs(float(found) - float(wrong)) < 3 * float(sigma), name
        assert abs(float(off)) < 3, name
        assert float(sigma) < 0.03, name


def test_scipy_ends_at_the_same_place() -> None:
    assert "least_squares, the same to 0.01 sigma: yes" in printed()


@pytest.mark.parametrize(
    ("varied", "parameters", "rank"),
    [
        ("standard table", 24, 22),
        ("Hayati rows", 24, 24),
        ("Hayati rows, base and tool", 36, 30),
        ("the same without six", 30, 30),
    ],
)
def test_parallel_axes_base_and_tool_leave_as_much_to_be_found_as_they_should(
    varied: str, parameters: int, rank: int
) -> None:
    assert re.search(rf"^{varied} +{parameters} +{rank}$", printed(), re.M)


def test_other_poses_are_then_right_to_less_than_the_noise() -> None:
    before, after = (float(error) for error in re.findall(r"other poses \w+ *: (\S+) mm", printed()))

    assert before > 1
    assert after < 0.05


def test_the_arm_with_hayati_rows_is_the_arm_of_the_data_sheet() -> None:
    q = np.random.default_rng(2).uniform(-3, 3, (20, 6))
    hayati, standard = load("examples/ur5_calibration.yaml"), load("robots/ur5.yaml")

    np.testing.assert_allclose(reference.pose(hayati, q), reference.pose(standard, q), atol=1e-14)
