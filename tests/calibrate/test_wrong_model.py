"""Outliers, errors of the model and measurements that do not belong to the robot are three things, and are said so."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from kinegen.tools.calibrate.arm_model import Arm
from kinegen.tools.calibrate.evaluation import outliers
from kinegen.tools.calibrate.measurements import Kind, Measurements
from kinegen.tools.calibrate.options import Loss
from kinegen.tools.calibrate.plausibility import Shape, patterns
from kinegen.tools.calibrate.residuals import make_problem
from kinegen.tools.calibrate.solve import Fit, fit
from kinegen.ui.cli import main
from tests.calibrate.simulated import ROBOTS, SIGMA, arm_of, joint_vectors, measured, wrong

ROWS = 50
BAD = [3, 9, 17, 25, 33, 41]


@pytest.fixture(scope="module")
def arm() -> Arm:
    return arm_of(ROBOTS / "ur5.yaml", "theta", "a", "d", "alpha")[1]


def fitted(arm: Arm, found: Measurements) -> Fit:
    return fit(make_problem(arm, found), Loss.HUBER)


def commanded(arm: Arm, true: NDArray[np.float64], said: NDArray[np.float64]) -> Measurements:
    """Positions at true joint vectors, under the joint values that the controller says."""
    return replace(measured(arm, wrong(arm), true, Kind.POSITION), q=said)


def spread(found: Fit) -> float:
    """How far chi-square may be from 1."""
    return float(3 * np.sqrt(2 / found.freedom))


def test_chi_square_is_that_of_the_rows_that_are_no_outliers(arm: Arm) -> None:
    """Six of fifty rows are far off, which is more than a tenth of what was measured."""
    good = measured(arm, wrong(arm), joint_vectors(arm, ROWS), Kind.POSITION)
    moved = good.positions.copy()
    moved[BAD] += 0.005 * np.random.default_rng(4).normal(size=(len(BAD), 3))
    found = fitted(arm, replace(good, positions=moved))

    assert sorted(each.line for each in outliers(found)) == [good.lines[row] for row in BAD]
    assert abs(found.chi_square - 1) < 2 * spread(found)
    assert found.freedom == 3 * (ROWS - len(BAD)) - int(found.free.sum())
    assert patterns(found) == ()


def test_a_gear_factor_is_not_a_file_full_of_outliers(arm: Arm) -> None:
    said = joint_vectors(arm, ROWS)
    true = said * np.array([1, 1.002, 1, 1, 1, 1])
    found = fitted(arm, commanded(arm, true, said))

    (pattern,) = patterns(found)
    assert found.chi_square > 1 + spread(found)
    assert len(outliers(found)) < ROWS / 5
    assert (pattern.joint, pattern.shape) == ("shoulder", Shape.GEAR)
    assert pattern.size == pytest.approx(0.002, rel=0.05)
    assert pattern.explained > 0.95


def test_an_eccentric_gear_is_named_with_its_amplitude(arm: Arm) -> None:
    said = joint_vectors(arm, ROWS)
    true = said.copy()
    true[:, 2] += 0.001 * np.sin(said[:, 2] + 0.7)
    (pattern,) = patterns(fitted(arm, commanded(arm, true, said)))

    assert (pattern.joint, pattern.shape) == ("elbow", Shape.TURN)
    assert pattern.size == pytest.approx(0.001, rel=0.1)


def test_errors_of_two_joints_are_named_one_after_the_other(arm: Arm) -> None:
    said = joint_vectors(arm, ROWS)
    found = patterns(fitted(arm, commanded(arm, said * np.array([1, 1, 1.003, 1, 1.004, 1]), said)))

    assert [(each.joint, each.shape) for each in found] == [("elbow", Shape.GEAR), ("wrist_2", Shape.GEAR)]


def test_noise_alone_and_a_stated_uncertainty_that_is_too_small_follow_no_joint(arm: Arm) -> None:
    for factor in (1.0, 0.3):
        good = measured(arm, wrong(arm), joint_vectors(arm, ROWS), Kind.POSITION)
        found = fitted(arm, replace(good, sigma=factor * good.sigma))

        assert patterns(found) == ()
        assert outliers(found) == ()
        assert (abs(found.chi_square - 1) < spread(found)) == (factor == 1)


TABLE = """\
kinegen: 1
name: arm
convention: standard
units: {length: mm, angle: deg}
joints:
  - {name: j1, theta: q, d: 290, a: 0, alpha: -90}
  - {name: j2, theta: q - 90, d: 0, a: 270, alpha: 0}
  - {name: j3, theta: q, d: 80, a: 70, alpha: -90}
"""
GEARED = TABLE.replace("joints:", "parameters: {gear_j2: 1}\njoints:").replace("theta: q - 90", "theta: gear_j2*q - 90")


def position(q: NDArray[np.float64]) -> NDArray[np.float64]:
    """The tip of this table in mm, by trigonometry; q (N, 3) in degrees."""
    one, two, three = np.radians(q).T
    out = 270 * np.sin(two) + 70 * np.sin(two + three)
    up = 290 + 270 * np.cos(two) + 70 * np.cos(two + three)
    aside = 80.0
    x, y = out * np.cos(one) - aside * np.sin(one), out * np.sin(one) + aside * np.cos(one)
    return np.stack([x, y, up], axis=1)


def files(folder: Path, table: str, head: str, q: NDArray[np.float64], points: NDArray[np.float64]) -> list[str]:
    (folder / "arm.yaml").write_text(table, encoding="utf-8")
    rows = [",".join(f"{value:.4f}" for value in row) for row in np.hstack([q, points])]
    (folder / "points.csv").write_text("\n".join([head, *rows, ""]), encoding="utf-8")
    return [str(folder / "arm.yaml"), str(folder / "points.csv")]


@pytest.mark.parametrize(
    ("head", "words", "reason"),
    [
        (
            "j1[rad],j2[rad],j3[rad],x,y,z",
            "theta,a,d,alpha",
            r"joint j\d is at 11\d(\.\d)? rad, 18 turns: are these degrees",
        ),
        ("j1,j2,j3,x[in],y[in],z[in]", "theta,a,d,alpha,base", "which were taken for in, in mm"),
        ("j1,j2,j3,x[cm],y[cm],z[cm]", "theta", "which were taken for cm, in mm"),
        ("j3,j1,j2,x,y,z", "theta,a,d", "if the pose of the base is not known, add base to --fit; compare the columns"),
    ],
)
def test_measurements_of_something_else_are_refused_and_nothing_is_written(
    head: str, words: str, reason: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    q = np.round(np.random.default_rng(5).uniform(-115, 115, (40, 3)), 3)
    out = tmp_path / "out.yaml"
    options = ["--fit", words, "--sigma", "0.03mm", "-o", str(out)]

    assert main(["calibrate", *files(tmp_path, TABLE, head, q, position(q)), *options]) == 1

    said = capsys.readouterr()
    assert said.out == ""
    assert len(said.err.splitlines()) == 1
    assert "points.csv: the measurements do not belong to this robot: after the fit half of them" in said.err
    assert re.search(reason, said.err)
    assert not out.exists()


def test_orientations_in_another_form_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    q = np.round(np.random.default_rng(5).uniform(-115, 115, (40, 3)), 3)
    numbers = np.hstack([position(q), np.random.default_rng(6).uniform(-180, 180, (40, 3))])
    arguments = files(tmp_path, TABLE, "j1,j2,j3,x,y,z,roll,pitch,yaw", q, numbers)

    assert main(["calibrate", *arguments, "--fit", "theta,tool"]) == 1
    assert "the measured orientations do not belong to this robot" in capsys.readouterr().err


def test_the_report_says_how_to_fit_a_gear_and_the_fit_finds_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rng = np.random.default_rng(5)
    q = np.round(rng.uniform(-115, 115, (40, 3)), 3)
    points = position(q * np.array([1, 1.004, 1])) + rng.normal(0, SIGMA * 1e3, (40, 3))
    options = ["--sigma", "0.05mm", "--fit"]

    assert main(["calibrate", *files(tmp_path, TABLE, "j1,j2,j3,x,y,z", q, points), *options, "theta,a,d"]) == 0
    before = " ".join(capsys.readouterr().out.split())
    assert "the errors follow joint j2: a gear factor of 1.004" in before
    assert "add gear_j2: 1 to the parameters, write gear_j2*q in its row, and add gear_j2 to --fit" in before

    arguments = files(tmp_path, GEARED, "j1,j2,j3,x,y,z", q, points)
    assert main(["calibrate", *arguments, *options, "theta,a,d,gear_j2"]) == 0
    after = capsys.readouterr().out
    # A factor has no unit.
    (row,) = [line.split() for line in after.splitlines() if line.strip().startswith("gear_j2")]
    assert row[1] == "1.000000"
    assert float(row[2]) == pytest.approx(1.004, abs=5e-5)
    assert len(row) == 5
    assert "the errors follow" not in after
    assert "the stated uncertainty fits" in after
