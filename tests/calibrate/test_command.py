"""`kinegen calibrate`: what it prints and writes, and what it refuses."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from kinegen.driver import artifacts
from kinegen.errors import MissingToolError
from kinegen.io.load import load
from kinegen.tools.calibrate.arm_model import to_vector
from kinegen.tools.calibrate.measurements import Kind, Measurements
from kinegen.ui.cli import main
from kinegen.verify import reference
from tests.calibrate.simulated import ROBOTS, SIGMA, arm_of, joint_vectors, measured, wrong

STATED = ("--sigma", "0.05mm", "--sigma-angle", "0.1mrad", "--angle", "rad", "--length", "m")

BLOCK = """\
kinegen: 1
name: block
convention: standard
units: {length: mm, angle: deg}
parameters:
  l1:
    value: 400  # length of the upper arm
joints:
  # the waist
  - name: a   # first
    theta: q
    offset: 90
    d: 12.5   # above
    a: l1
    alpha: 180
    limits: [-100, 100]
  - name: b
    theta: "q - atan2(1, 2)"
    d: 3
    a: 300
    alpha: 0
    limits: [-100, 100]   # tail
  # before c
  - name: c
    theta: q - 90
    d: 1
    a: 0
    alpha: 90
  - {name: e, theta: 0, d: 'q + 2', a: 10, alpha: 2}
tool:
  xyz: [1, 2, 3]
# end
"""


def write(path: Path, found: Measurements, *, orientations: bool = True) -> Path:
    """A file with poses or positions, in radians."""
    dof = found.q.shape[1]
    numbers = np.hstack([found.q, found.positions, to_vector(found.rotations)])
    names = [*(f"q{number}" for number in range(1, dof + 1)), "x", "y", "z", "rx", "ry", "rz"]
    kept = len(names) if orientations else dof + 3
    lines = [names[:kept], *([repr(float(number)) for number in row[:kept]] for row in numbers)]
    path.write_text("\n".join(",".join(line) for line in lines) + "\n", encoding="utf-8")
    return path


@pytest.fixture
def poses(tmp_path: Path) -> Path:
    """Measurements of a UR5 that is off by a millimetre and a milliradian in every entry."""
    _, arm = arm_of(ROBOTS / "ur5.yaml", "theta", "a", "d", "alpha")
    return write(tmp_path / "poses.csv", measured(arm, wrong(arm), joint_vectors(arm, 40)))


def refusal(capsys: pytest.CaptureFixture[str], *arguments: str | Path, status: int = 1) -> str:
    """The one line that a call that fails prints."""
    assert main(["calibrate", *map(str, arguments)]) == status
    said = capsys.readouterr()
    assert said.out == ""
    assert len(said.err.splitlines()) == 1
    return said.err


def test_the_whole_report(poses: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out, picture = tmp_path / "out.yaml", tmp_path / "errors.svg"
    robot = ROBOTS / "ur5.yaml"

    options = ("-o", str(out), "--plot", str(picture), "--suggest", "2")
    assert main(["calibrate", str(robot), str(poses), *STATED, *options]) == 0
    printed = capsys.readouterr().out

    assert printed.startswith(f"{robot}: calibrated with {poses}\n  measured: 40 poses\n")
    assert "uncertainty (1 sigma): 0.05 mm and 0.1 mrad, stated" in printed
    assert "the stated uncertainty fits" in printed
    assert "row shoulder becomes a Hayati row" in " ".join(printed.split())
    assert "no outliers" in printed
    assert (
        "closed-form inverse: nearly UR type: parallel axes 2, 3, 4, each branch refined to the actual arm" in printed
    )
    assert printed.endswith(f"  wrote {out}\n  wrote {picture}\n")
    assert b"<svg" in picture.read_bytes()
    text = out.read_text(encoding="utf-8")
    assert text.startswith("# Calibrated with 40 rows of poses.csv: RMS error ")
    assert str(tmp_path) not in text
    for line in robot.read_text(encoding="utf-8").splitlines():
        assert line in text or line.lstrip().startswith("- {name")
    assert load(out).rows[1].convention == "hayati"
    assert "# before calibration: theta q, d 0, a a2, alpha 0\n  - {name: shoulder, convention: hayati" in text


def test_the_same_call_writes_the_same_bytes(poses: Path, tmp_path: Path) -> None:
    for name in ("one", "two"):
        options = ("-o", str(tmp_path / f"{name}.yaml"), "--plot", str(tmp_path / f"{name}.svg"))
        assert main(["calibrate", str(ROBOTS / "ur5.yaml"), str(poses), *STATED, *options]) == 0

    for ending in ("yaml", "svg"):
        assert (tmp_path / f"one.{ending}").read_bytes() == (tmp_path / f"two.{ending}").read_bytes()


def test_the_document_has_the_numbers(poses: Path, capsys: pytest.CaptureFixture[str]) -> None:
    fit = ("--fit", "theta,a,d,alpha,base")
    assert main(["calibrate", str(ROBOTS / "ur5.yaml"), str(poses), *STATED, *fit, "--suggest", "1", "--json"]) == 0
    found: dict[str, Any] = json.loads(capsys.readouterr().out)

    assert found["units"] == {"length": "m", "angle": "rad"}
    assert found["after"]["rms"] < 3 * SIGMA < found["before"]["rms"]
    assert {each["name"] for each in found["tied"]} == {"d_base_turn", "theta_base_turn"}
    fixed = {each["name"] for each in found["parameters"] if each["fixed"]}
    assert fixed == {"d_base_turn", "theta_base_turn"}
    assert all(each["sigma"] > 0 for each in found["parameters"] if not each["fixed"])
    assert len(found["suggestions"][0]["q"]) == 6
    assert found["cross_validation"]["folds"] == 5
    assert found["inverse"]["after"] == "nearly UR type: parallel axes 2, 3, 4"


def test_a_family_that_survives_is_reported(poses: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out.yaml"
    assert (
        main(["calibrate", str(ROBOTS / "ur5.yaml"), str(poses), *STATED, "--fit", "theta,tool", "-o", str(out)]) == 0
    )

    assert "UR type: parallel axes 2, 3, 4, also after calibration" in capsys.readouterr().out
    assert main(["inspect", str(out)]) == 0
    assert "UR type" in capsys.readouterr().out


def test_comments_and_texts_of_a_block_file_stay(tmp_path: Path) -> None:
    file, out = tmp_path / "block.yaml", tmp_path / "out.yaml"
    file.write_text(BLOCK.replace("\n", "\r\n"), encoding="utf-8", newline="")
    _, arm = arm_of(file, "theta", "a", "d", "alpha", "tool")
    values = wrong(arm)
    given = measured(arm, values, joint_vectors(arm, 30), noise=0)
    csv = write(tmp_path / "m.csv", given)

    options = ("--fit", "theta,a,d,alpha,tool", "--sigma", "0.05mm", "--sigma-angle", "0.1mrad", "--angle", "rad")
    assert main(["calibrate", str(file), str(csv), *options, "-o", str(out)]) == 0
    text = out.read_text(encoding="utf-8")

    for comment in ("# length of the upper arm", "# the waist", "# first", "# above", "# tail", "# before c", "# end"):
        assert comment in text
    assert "# before calibration: theta q, d 12.5, a l1, alpha 180, offset 90" in text
    assert "# before calibration: xyz: [1, 2, 3]" in text
    assert 'theta: "q - atan2(1, 2) + ' in text or 'theta: "q - atan2(1, 2) - ' in text
    # d of the first two rows passes to the third: 1 + 3 - 12.5, and what was wrong with it.
    robot = load(out)
    assert [str(row.convention) for row in robot.rows] == ["hayati", "hayati", "standard", "standard"]
    poses = reference.frames(robot, given.q)["tool"]
    assert poses[:, :3, 3] == pytest.approx(given.positions, abs=0.005)
    assert poses[:, :3, :3] == pytest.approx(given.rotations, abs=1e-5)


def test_a_calibrated_file_can_be_calibrated_again(tmp_path: Path) -> None:
    _, arm = arm_of(ROBOTS / "puma560.yaml", "theta", "a", "d", "alpha")
    csv = write(tmp_path / "m.csv", measured(arm, wrong(arm), joint_vectors(arm, 40)))
    first, second = tmp_path / "first.yaml", tmp_path / "second.yaml"

    assert main(["calibrate", str(ROBOTS / "puma560.yaml"), str(csv), *STATED, "-o", str(first)]) == 0
    assert main(["calibrate", str(first), str(csv), *STATED, "--fit", "theta,a,d", "-o", str(second)]) == 0

    before, after = (load(file).rows for file in (first, second))
    assert [str(row.convention) for row in before] == ["modified"] * 2 + ["ets"] + ["modified"] * 3
    # Numbers at the end of an expression are added up, they do not pile up.
    assert " + 0.0 " not in second.read_text(encoding="utf-8")
    assert len(before) == len(after)


@pytest.mark.parametrize("kind", [Kind.POSITION, Kind.DISTANCE, Kind.PLANE, Kind.SPHERE, Kind.ANCHOR])
def test_every_kind_of_measurement_finds_a_wrong_zero(kind: Kind, tmp_path: Path) -> None:
    """Zero positions of joints 2 to 5, which distances and surfaces know too."""
    words = tuple(f"theta_{row}" for row in ("shoulder", "elbow", "wrist_1", "wrist_2"))
    _, arm = arm_of(ROBOTS / "ur5.yaml", *words)
    truth = arm.start + np.array([0.002, -0.003, 0.001, 0.004])
    q = joint_vectors(arm, 60)
    given = measured(arm, truth, q, noise=0)
    points, other = given.positions, joint_vectors(arm, 60, seed=5)
    rows = [f"q{n}" for n in range(1, 7)]
    header, cells = list(rows), [[*map(repr, map(float, row))] for row in q]
    if kind is Kind.POSITION:
        header += ["x", "y", "z"]
        more = [[*map(repr, map(float, point))] for point in points]
    elif kind is Kind.DISTANCE:
        header += [f"to_{row}" for row in rows] + ["distance"]
        away = np.linalg.norm(arm.poses(truth, other)[:, :3, 3] - points, axis=1)
        more = [[*map(repr, map(float, [*row, size]))] for row, size in zip(other, away, strict=True)]
    elif kind is Kind.ANCHOR:
        header += ["anchor", "distance"]
        away = np.linalg.norm(points - [1.2, 0.3, 0.4], axis=1)
        more = [["post", repr(float(size))] for size in away]
    else:
        # Joints 2 and 3 are moved until the tip is on the surface.
        q = on_surface(arm, truth, q, kind)
        cells = [[*map(repr, map(float, row))] for row in q]
        header += [str(kind)]
        more = [["it"] for _ in q]
    text = "\n".join([",".join(header), *(",".join(a + b) for a, b in zip(cells, more, strict=True))])
    (tmp_path / "m.csv").write_text(text, encoding="utf-8")
    out = tmp_path / "out.yaml"

    options = ("--sigma", "0.01mm", "--angle", "rad", "--length", "m", "--fit", ",".join(words), "-o", str(out))
    assert main(["calibrate", str(ROBOTS / "ur5.yaml"), str(tmp_path / "m.csv"), *options]) == 0

    found = reference.frames(load(out), [np.zeros(6)])["tool"] @ np.linalg.inv(arm.poses(truth, np.zeros((1, 6))))
    assert found == pytest.approx(np.eye(4)[None], abs=2e-6)


def on_surface(arm: Any, truth: Any, q: Any, kind: Kind) -> Any:
    """Joint vectors that put the tip on the plane z = 0.1 or on a sphere, by Newton steps of the first three joints."""

    def miss(points: Any) -> Any:
        return points[:, 2] - 0.1 if kind is Kind.PLANE else np.linalg.norm(points - [0.5, 0.2, 0.3], axis=1) - 0.4

    q = q.copy()
    for _ in range(60):
        here = miss(arm.poses(truth, q)[:, :3, 3])
        slopes = []
        for joint in range(3):
            step = np.zeros(6)
            step[joint] = 1e-6
            slopes.append((miss(arm.poses(truth, q + step)[:, :3, 3]) - here) / 1e-6)
        slope = np.stack(slopes, axis=1)
        move = -here[:, None] * slope / np.maximum((slope**2).sum(axis=1), 1e-3)[:, None]
        q[:, :3] += np.clip(move, -0.3, 0.3)
    here = miss(arm.poses(truth, q)[:, :3, 3])
    kept = q[np.abs(here) < 1e-12]
    assert len(kept) > 25
    return kept


def test_inputs_are_never_overwritten(poses: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    robot = tmp_path / "ur5.yaml"
    text = (ROBOTS / "ur5.yaml").read_text(encoding="utf-8")
    robot.write_text(text, encoding="utf-8")
    other = tmp_path / "other.yaml"
    other.write_text("mine", encoding="utf-8")

    for path in (robot, poses):
        assert "this is an input, which is never overwritten" in refusal(capsys, robot, poses, "-o", path, "--force")
    assert "the file exists" in refusal(capsys, robot, poses, "-o", other)
    assert "this is a folder" in refusal(capsys, robot, poses, "-o", tmp_path)
    assert "this is a file, not a folder" in refusal(capsys, robot, poses, "-o", other / "no" / "out.yaml")
    assert robot.read_text(encoding="utf-8") == text
    assert other.read_text(encoding="utf-8") == "mine"
    assert main(["calibrate", str(robot), str(poses), *STATED, "-o", str(other), "--force"]) == 0
    assert load(other).name == "ur5"


def test_what_is_refused(poses: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    ur5 = ROBOTS / "ur5.yaml"
    few = tmp_path / "few.csv"
    few.write_text("\n".join(poses.read_text(encoding="utf-8").splitlines()[:4]), encoding="utf-8")

    assert "few.csv: 3 rows measure 18 numbers, too few for" in refusal(capsys, ur5, few, "--angle", "rad")
    assert "names nothing" in refusal(capsys, ur5, poses, "--fit", "tehta")
    assert "there is no frame 'elbo'" in refusal(capsys, ur5, poses, "--angle", "rad", "--frame", "elbo")
    assert "tips; name one with --frame (" in refusal(capsys, ROBOTS / "hand.yaml", poses)
    assert "which the tool does not move" in refusal(capsys, ur5, poses, "--frame", "elbow", "--fit", "tool")
    assert "cannot be read" in refusal(capsys, ur5, tmp_path / "no.csv")
    assert "is not a picture" in refusal(capsys, ur5, poses, "--plot", "x.pdf", status=2)
    assert "is not an uncertainty" in refusal(capsys, ur5, poses, "--sigma", "0.05", status=2)
    metres = refusal(capsys, ur5, poses, "--angle", "rad", "--length", "mm")
    assert "poses.csv:2: a typical measured length is" in metres
    assert "write the unit in the header" in metres
    assert "no joint turns by more than" in refusal(capsys, ur5, poses)


def test_outliers_are_named_by_their_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    _, arm = arm_of(ROBOTS / "ur5.yaml", "theta", "a", "d", "alpha")
    good = measured(arm, wrong(arm), joint_vectors(arm, 40))
    positions = good.positions.copy()
    positions[10] += [0, 0, 0.004]
    csv = write(tmp_path / "m.csv", replace(good, positions=positions))

    assert main(["calibrate", str(ROBOTS / "ur5.yaml"), str(csv), *STATED]) == 0

    printed = capsys.readouterr().out
    assert "1 outlier; measure again, or leave out:\n    line 12: " in printed


def test_without_a_compiler_numpy_finds_the_same(
    poses: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def none(*_: object) -> None:
        raise MissingToolError("there is no compiler")

    call = ["calibrate", str(ROBOTS / "ur5.yaml"), str(poses), *STATED, "--json"]
    assert main(call) == 0
    compiled = json.loads(capsys.readouterr().out)
    monkeypatch.setattr(artifacts, "build_extension", none)
    assert main(call) == 0
    plain = json.loads(capsys.readouterr().out)

    assert (compiled["backend"], plain["backend"]) == ("c", "numpy")
    for one, other in zip(compiled["parameters"], plain["parameters"], strict=True):
        assert other["after"] == pytest.approx(one["after"], abs=1e-3 * one["sigma"])


def test_without_scipy_the_extra_is_named(
    poses: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "scipy.optimize", None)

    said = refusal(capsys, ROBOTS / "ur5.yaml", poses, *STATED)

    assert "calibration needs scipy, which is not installed (pip install 'kinegen[calibrate]')" in said
