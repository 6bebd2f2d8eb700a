"""`kinegen inspect`: the family with its branches and constants, or what is missing."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest

from kinegen.ui.cli import main
from tests.cli.commands import ROBOTS


def test_a_family_with_its_branches_and_constants(capsys: pytest.CaptureFixture[str]) -> None:
    file = ROBOTS / "puma560.yaml"

    assert main(["inspect", str(file)]) == 0
    text = capsys.readouterr().out
    assert text.startswith(f"{file}: arm with parallel axes 2, 3 and spherical wrist\n")
    assert "    0  shoulder left, elbow up, wrist no-flip\n" in text
    assert "    7  shoulder right, elbow down, wrist flip\n" in text
    assert "    from axis 2 to axis 3                       0.4318  m\n" in text


def test_it_says_where_an_arm_is_singular(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["inspect", str(ROBOTS / "stanford.yaml"), str(ROBOTS / "cartesian.yaml")]) == 0
    text = " ".join(capsys.readouterr().out.split())
    assert "singular where (kinegen show --output singularities) s2 = 0 shoulder: the point where axes 4, 5" in text
    assert "q3 = 0 the point where axes 4, 5 and 6 meet is on axis 2 s5 = 0 wrist aligned: axes 4 and 6" in text
    assert "singular" not in text.partition("cartesian.yaml")[2], "a cartesian arm is singular nowhere"


@pytest.mark.parametrize("columns", ["200", "80", "60"])
def test_explanations_are_broken_between_words(
    columns: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """At 80 columns at most, also on a wide terminal; nothing is lost, and `no-flip` stays one word."""
    found = []
    for wide in (columns, "1000"):
        monkeypatch.setenv("COLUMNS", wide)
        assert main(["inspect", str(ROBOTS / "ur5.yaml"), str(ROBOTS / "puma560.yaml")]) == 0
        found.append(capsys.readouterr().out)

    prose = [line for line in found[0].splitlines() if str(ROBOTS) not in line]
    assert max(map(len, prose)) <= min(int(columns), 80)
    assert not any(line.endswith("-") for line in prose)
    assert found[0].split() == found[1].split()


@pytest.mark.parametrize("name", ["hand", "panda", "panda_joint_7", "iiwa14_arm_angle", "xarm6"])
def test_no_line_is_longer_than_eighty_characters(
    name: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(ROBOTS)
    assert main(["inspect", f"{name}.yaml"]) == 0
    lines = capsys.readouterr().out.splitlines()

    assert lines[0].startswith(f"{name}.yaml:")
    assert max(map(len, lines)) <= 80


def test_what_is_missing_and_what_serves_instead(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["inspect", str(ROBOTS / "iiwa14.yaml"), str(ROBOTS / "scara.yaml")]) == 0
    text = capsys.readouterr().out
    assert "iiwa14.yaml: no closed-form inverse\n  no closed form has the joints RRRRRRR\n" in text
    assert "numeric inverse, for every arm: kinegen build --outputs numeric_inverse\n" in text
    assert "scara.yaml: SCARA, joints RRP\n" in text


def test_a_tree_has_a_numeric_inverse_of_all_tips(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["inspect", str(ROBOTS / "hand.yaml")]) == 0
    text = capsys.readouterr().out
    assert "  numeric inverse, targets of all tips: kinegen build --outputs numeric_inverse\n" in text
    assert "works for every arm" not in text


def test_a_tree_can_be_cut_to_one_tip(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    urdf = tmp_path / "gripper.urdf"
    links = "".join(f'<link name="{name}"/>' for name in ("base", "left", "right"))
    joints = "".join(
        f'<joint name="{name}_slide" type="prismatic"><parent link="base"/><child link="{name}"/>'
        '<axis xyz="1 0 0"/><limit lower="0" upper="0.1" effort="1" velocity="1"/></joint>'
        for name in ("left", "right")
    )
    urdf.write_text(f'<robot name="gripper">{links}{joints}</robot>', encoding="utf-8")

    assert main(["inspect", str(urdf)]) == 0
    assert "  --tip NAME takes the arm from the base to one tip alone\n" in capsys.readouterr().out
    assert main(["inspect", str(ROBOTS / "hand.yaml")]) == 0
    assert "  --tip NAME takes the arm" in capsys.readouterr().out
    assert main(["inspect", str(ROBOTS / "puma560.yaml")]) == 0
    assert "--tip" not in capsys.readouterr().out


def test_a_bad_file_is_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["inspect", "nowhere.yaml"]) == 1
    assert capsys.readouterr().err.count("\n") == 1


def test_json_has_what_the_text_says_of_a_family(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["inspect", str(ROBOTS / "puma560.yaml"), "--json"]) == 0
    (entry,) = json.loads(capsys.readouterr().out)["files"]
    family = entry["family"]
    assert family["name"] == "arm with parallel axes 2, 3 and spherical wrist"
    assert (family["aim"], family["redundancy"], family["nearly"]) == ("pose", "", None)
    assert family["branches"][7] == "shoulder right, elbow down, wrist flip"
    assert {"text": "from axis 2 to axis 3", "value": 0.4318, "unit": "m", "runtime": []} in family["constants"]
    assert all(abs(each["value"]) <= 2 * math.pi for each in family["constants"] if each["unit"] == "rad")
    assert entry["outputs"] == [{"output": "inverse", "text": family["name"]}]
    assert {"zeros": ["s5 = 0"], "words": "wrist aligned: axes 4 and 6 coincide"} in entry["singular"]
    assert (entry["reasons"], entry["hints"]) == ([], [])


def test_json_names_what_serves_an_arm_without_a_family(capsys: pytest.CaptureFixture[str]) -> None:
    files = [str(ROBOTS / f"{name}.yaml") for name in ("xarm6", "iiwa14", "hand", "cartesian")]

    assert main(["inspect", *files, "--json"]) == 0
    six, seven, tree, slides = json.loads(capsys.readouterr().out)["files"]
    assert all(each["family"] is None and each["reasons"] for each in (six, seven, tree))
    assert [each["output"] for each in six["outputs"]] == ["numeric_inverse", "complete_inverse"]
    assert seven["hints"] == ["seven joints: --redundancy NAME gives one, or arm_angle, beside the pose"]
    assert [each["output"] for each in tree["outputs"]] == ["numeric_inverse"]
    assert (tree["singular"], slides["singular"]) == (None, [])
    assert (tree["rank"], slides["rank"], six["rank"]) == (None, 3, 6)


def test_it_says_that_the_rank_is_low_everywhere(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows = [f"  - {{name: j{number}, theta: q, d: 0, a: {number // 3}, alpha: 0}}" for number in (1, 2, 3)]
    file = tmp_path / "coaxial.yaml"
    head = ["kinegen: 1", "name: coaxial", "convention: standard", "units: {length: m, angle: deg}", "joints:"]
    file.write_text("\n".join([*head, *rows]), encoding="utf-8")

    assert main(["inspect", str(file)]) == 0
    assert "the rank of the Jacobian is 1 everywhere, with 3 joints" in capsys.readouterr().out
    assert main(["inspect", str(file), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["files"][0]["rank"] == 1


def test_json_says_how_near_an_arm_is_to_its_family(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "nearly.yaml"
    text = (ROBOTS / "ur5.yaml").read_text(encoding="utf-8")
    file.write_text(text.replace("alpha: 0, ", "alpha: 0.01,", 1), encoding="utf-8")

    assert main(["inspect", str(file), "--json"]) == 0
    (entry,) = json.loads(capsys.readouterr().out)["files"]
    nearly = entry["family"]["nearly"]
    (failing,) = nearly["failing"]
    assert failing["unit"] == "rad"
    assert failing["amount"] == pytest.approx(math.radians(0.01), rel=1e-3)
    assert nearly["distance"] > 0
    assert nearly["angle"] > 0
    assert nearly["newton_steps"] >= 1
    assert nearly["singular_below"] > 0
