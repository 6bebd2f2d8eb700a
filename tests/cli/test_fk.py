"""`kinegen fk`: joint values in, a pose out."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from kinegen.io.load import load
from kinegen.ui.cli import main
from kinegen.verify import reference
from tests.cli.commands import ROBOTS, TWO

PUMA = str(ROBOTS / "puma560.yaml")


@pytest.fixture
def two(tmp_path: Path) -> str:
    """A revolute and a prismatic joint, both with limits."""
    path = tmp_path / "two.yaml"
    path.write_text(TWO, encoding="utf-8")
    return str(path)


def matrices(text: str) -> dict[str, np.ndarray]:
    """The printed matrices by their headings."""
    found = {}
    for part in text.split("\n\n"):
        lines = part.splitlines()
        found[lines[0]] = np.array([[float(word) for word in line.split()] for line in lines[1:5]])
    return found


def test_the_whole_answer(two: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["fk", two, "-pi/2", "0.25"]) == 0
    assert capsys.readouterr().out == (
        "base_T_tool\n"
        " 0.000000000000  0.000000000000  -1.000000000000   0.000000000000\n"
        "-1.000000000000  0.000000000000   0.000000000000  -0.500000000000\n"
        " 0.000000000000  1.000000000000   0.000000000000   0.250000000000\n"
        " 0.000000000000  0.000000000000   0.000000000000   1.000000000000\n"
        "position 0, -0.5, 0.25 m\n"
        "angles taken in deg, the unit of the file\n"
    )


def test_it_is_the_pose_of_the_reference(capsys: pytest.CaptureFixture[str]) -> None:
    q = [0.1, -0.2, 0.3, -0.4, 0.5, -0.6]

    assert main(["fk", PUMA, "--radians", *map(str, q)]) == 0

    printed = matrices(capsys.readouterr().out)["base_T_tool"]
    assert np.abs(printed - reference.pose(load(PUMA), q)[0, 0]).max() < 1e-12


@pytest.mark.parametrize(
    ("unit", "values", "taken"),
    [
        ("deg", ["-90", "0.25"], "angles taken in deg, the unit of the file"),
        ("deg", ["-pi/2", "0.25"], "angles taken in deg, the unit of the file"),
        ("deg", ["--deg", "-90", "0.25"], "angles taken in deg, as asked"),
        ("deg", ["--radians", "-pi/2", "0.25"], "angles taken in rad, as asked"),
        ("rad", ["-pi/2", "0.25"], "angles taken in rad, the unit of the file"),
        ("rad", ["-pi/2", "0.25", "--rad"], "angles taken in rad, as asked"),
        ("rad", ["--degrees", "-90", "0.25"], "angles taken in deg, as asked"),
        ("rad", ["--angle", "deg", "-90,0.25"], "angles taken in deg, as asked"),
        ("deg", ["-90,", "0.25"], "angles taken in deg, the unit of the file"),
        ("deg", ["-90, 0.25", "--angle", "deg", "--deg"], "angles taken in deg, as asked"),
    ],
)
def test_angles_are_in_the_unit_of_the_file_or_the_one_asked(
    unit: str, values: list[str], taken: str, two: str, capsys: pytest.CaptureFixture[str]
) -> None:
    path = Path(two)
    in_degrees = path.read_text(encoding="utf-8")
    main(["fk", two, "-90", "0.25"])
    pose = capsys.readouterr().out.splitlines()[:-1]
    if unit == "rad":
        text = in_degrees.replace("angle: deg", "angle: rad").replace("[-90, 90]", "[-2, 2]")
        path.write_text(text.replace("alpha: 90", "alpha: pi/2"), encoding="utf-8")
    assert main(["fk", two, *values]) == 0

    assert capsys.readouterr().out.splitlines() == [*pose, taken]


def test_a_robot_without_angles_takes_none(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["fk", str(ROBOTS / "cartesian.yaml"), "0.1", "0.2", "0.3"]) == 0
    assert "angles" not in capsys.readouterr().out


@pytest.mark.parametrize("name", ["elbow", "3"])
def test_another_frame(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["fk", PUMA, "0", "-0.5", "0", "0", "0", "0", "--rad", "--frame", name]) == 0

    printed = matrices(capsys.readouterr().out)
    expected = reference.frames(load(PUMA), [0, -0.5, 0, 0, 0, 0])["elbow"][0]
    assert list(printed) == ["base_T_elbow"]
    assert np.abs(printed["base_T_elbow"] - expected).max() < 1e-12


def test_an_unknown_frame_is_an_error(two: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["fk", two, "0", "0", "--frame=hand"]) == 1
    assert capsys.readouterr().err == (
        "error: unknown frame 'hand' (expected base, turn, slide, tool, wrist, or a row number up to 2)\n"
    )


def test_a_tree_prints_every_tip(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["fk", str(ROBOTS / "hand.yaml"), *["0"] * 17]) == 0

    tips = load(ROBOTS / "hand.yaml").tips
    assert list(matrices(capsys.readouterr().out)) == [f"base_T_{tip}" for tip in tips]


def test_a_chain_without_joints_takes_no_values(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["fk", str(ROBOTS / "blocks.yaml")]) == 0
    assert capsys.readouterr().out.endswith("position 7, -8, 6 cm\n")


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (["0"], "two needs 2 joint values (turn [deg], slide [m]), 1 given"),
        (["0", "0", "0", "--radians"], "two needs 2 joint values (turn [rad], slide [m]), 3 given"),
        (["0", "--deg"], "two needs 2 joint values (turn [deg], slide [m]), 1 given"),
        (["atan2(0,1)", "--deg"], "two needs 2 joint values (turn [deg], slide [m]), 1 given"),
        (["0,0", "--deg", "--angle", "rad"], "--angle rad and angles in deg exclude each other"),
        (["x", "0"], "turn: 'x' is not a number"),
        (["0", "1/0"], "slide: division by zero"),
        (["1,5", "0"], "turn: ',' is not allowed in an expression (a decimal point is written '.')"),
        (["--", "--1", "-"], "slide: '-' is not an expression"),
        (["--foo", "0"], "No such option"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_wrong_values_are_wrong_usage(
    values: list[str], message: str, two: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["fk", two, *values]) == 2

    err = capsys.readouterr().err
    assert err.startswith(f"error: {message}"), err


@pytest.mark.parametrize(
    ("values", "warning"),
    [
        (["--rad", "2", "0"], "turn = 2 rad is 0.43 rad outside its limits, -1.5708 to 1.5708 rad"),
        (["100", "0"], "turn = 100 deg is 10 deg outside its limits, -90 to 90 deg"),
        (["0", "-0.1"], "slide = -0.1 m is 0.1 m outside its limits, 0 to 2 m"),
        (["0", "2.00000001"], "slide = 2 m is 1e-08 m outside its limits, 0 to 2 m"),
    ],
)
def test_limits_are_warned_of(values: list[str], warning: str, two: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["fk", two, *values]) == 0

    out, err = capsys.readouterr()
    assert err == f"warning: {warning}\n"
    assert out.startswith("base_T_tool\n")


def test_the_bounds_themselves_are_inside(two: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["fk", two, "--deg", "-90", "2"]) == 0
    assert capsys.readouterr().err == ""


def test_json_has_the_matrix_in_doubles_and_the_joint_values_in_radians(capsys: pytest.CaptureFixture[str]) -> None:
    q = ["0", "-90", "30", "0", "45", "0"]
    assert main(["fk", str(ROBOTS / "puma560.yaml"), *q, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert (found["angle"], found["robot"]["name"], found["outside"]) == ("deg", "puma560", [])
    assert found["q"] == pytest.approx([math.radians(float(each)) for each in q], rel=1e-15)
    (pose,) = found["poses"]
    assert (pose["frame"], pose["base"]) == ("tool", "base")
    expected = reference.fk(load(ROBOTS / "puma560.yaml"), found["q"])
    assert np.abs(np.array(pose["matrix"]) - expected).max() < 1e-14
    assert pose["matrix"][3] == [0, 0, 0, 1]
    assert pose["matrix"][0][1] == 0, "a zero is 0, and not what 50 digits leave of it"


def test_json_has_each_tip_and_names_joints_outside_their_limits(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["fk", str(ROBOTS / "planar_3r.yaml"), "0", "0", "0", "--frame", "1", "--json"]) == 0
    (pose,) = json.loads(capsys.readouterr().out)["poses"]
    assert pose["frame"] == load(ROBOTS / "planar_3r.yaml").rows[0].name

    assert main(["fk", str(ROBOTS / "hand.yaml"), *["3"] * 17, "--radians", "--json"]) == 0
    printed = capsys.readouterr()
    found = json.loads(printed.out)
    assert [each["frame"] for each in found["poses"]] == found["robot"]["tips"]
    assert len(found["outside"]) == printed.err.count("warning: ")
