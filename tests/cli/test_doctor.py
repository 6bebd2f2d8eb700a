"""`kinegen doctor`: what is printed, what is written, and what is refused."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from kinegen.cli import main
from tests.cli.commands import ROBOTS
from tests.doctor.arms import csv, lines, robot_text, same_robot, some_joints

PUMA = robot_text("puma560")
WRONG = PUMA.replace("a: a3", "a: -a3")


@pytest.fixture
def poses(tmp_path: Path) -> str:
    """Six poses of a PUMA 560."""
    path = tmp_path / "poses.csv"
    path.write_text(csv(PUMA, lines(PUMA, some_joints(PUMA))), encoding="utf-8")
    return str(path)


@pytest.fixture
def wrong(tmp_path: Path) -> Path:
    """Its file with the other sign of a3."""
    path = tmp_path / "arm.yaml"
    path.write_text(WRONG, encoding="utf-8")
    return path


def test_the_whole_answer(wrong: Path, poses: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["doctor", str(wrong), "--poses", poses]) == 0

    out = capsys.readouterr().out.splitlines()
    assert out[:3] == [
        f"{wrong}: puma560, 6 poses",
        "  joint values in deg (the unit of the file), positions in m (the unit of the file),",
        "  orientations as roll, pitch, yaw of Rz(yaw) Ry(pitch) Rx(roll)",
    ]
    assert out[3].startswith("  as it is: worst 0.04")
    assert out[4:7] == ["one explanation agrees with all poses", "", "joint 4 (forearm): the other sign of a"]
    assert "  -  - {name: forearm,    alpha: -90, a: -a3, d: d4, theta: q, limits: [-110, 170]}" in out
    assert "  +  - {name: forearm,    alpha: -90, a: a3, d: d4, theta: q, limits: [-110, 170]}" in out


def test_a_right_file(poses: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["doctor", str(ROBOTS / "puma560.yaml"), "--poses", poses]) == 0
    assert "the file agrees with the poses" in capsys.readouterr().out


def test_json_says_the_same(wrong: Path, poses: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["doctor", str(wrong), "--poses", poses, "--json"]) == 0

    found = json.loads(capsys.readouterr().out)
    assert found["verdict"] == "found"
    assert found["poses"] == {"count": 6, "angle": "deg", "length": "m", "orientation": "rpy"}
    assert not found["before"]["fits"]
    (finding,) = found["findings"]
    assert finding["changes"] == ["joint 4 (forearm): the other sign of a"]
    assert finding["fits"]
    assert finding["text"] == PUMA
    assert found["written"] is None


def test_nothing_is_written_unless_asked(wrong: Path, poses: str, tmp_path: Path) -> None:
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}

    assert main(["doctor", str(wrong), "--poses", poses]) == 0
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_the_changed_file_is_written_where_asked(wrong: Path, poses: str, tmp_path: Path) -> None:
    out = tmp_path / "mended.yaml"

    assert main(["doctor", str(wrong), "--poses", poses, "--write", str(out)]) == 0
    assert out.read_text(encoding="utf-8") == PUMA
    assert main(["doctor", str(out), "--poses", poses]) == 0


def test_line_ends_of_windows_are_kept(wrong: Path, poses: str, tmp_path: Path) -> None:
    wrong.write_bytes(WRONG.replace("\n", "\r\n").encode())
    out = tmp_path / "mended.yaml"

    assert main(["doctor", str(wrong), "--poses", poses, "--write", str(out)]) == 0
    assert out.read_bytes() == PUMA.replace("\n", "\r\n").encode()


def test_inputs_are_never_overwritten(
    wrong: Path, poses: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    link = tmp_path / "link.yaml"
    link.hardlink_to(wrong)
    for out in (str(wrong), poses, str(link), str(tmp_path / "x" / ".." / "arm.yaml")):
        assert main(["doctor", str(wrong), "--poses", poses, "--write", out]) == 1
        assert (
            capsys.readouterr().err
            == f"error: {out}: this is an input, which is never overwritten; choose another name\n"
        )
    assert wrong.read_text(encoding="utf-8") == WRONG


def test_an_existing_file_is_kept_unless_forced(
    wrong: Path, poses: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "mended.yaml"
    out.write_text("mine", encoding="utf-8")

    assert main(["doctor", str(wrong), "--poses", poses, "--write", str(out)]) == 1
    assert "the file exists; choose another name, or overwrite it with --force" in capsys.readouterr().err
    assert out.read_text(encoding="utf-8") == "mine"
    assert main(["doctor", str(wrong), "--poses", poses, "--write", str(out), "--force"]) == 0
    assert out.read_text(encoding="utf-8") == PUMA


def test_several_explanations_are_not_written_until_one_is_taken(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "arm.yaml"
    file.write_text(PUMA.replace("d: d3, theta: q", "d: d3, theta: -q"), encoding="utf-8")
    joints = np.zeros((1, 6))
    joints[0, :3] = 30, -45, 90
    (line,) = lines(PUMA, joints, "")
    text = f"{' '.join(map(str, line.joints))} = {' '.join(map(str, line.position))}"
    out = tmp_path / "out.yaml"

    assert main(["doctor", str(file), "--pose", text, "--write", str(out)]) == 1
    printed = capsys.readouterr()
    assert "the poses cannot separate" in printed.out
    assert "measure at:\n  waist " in printed.out
    assert printed.err == f"{out}: not written: there is not one explanation\n"
    assert not out.exists()

    answer = ["doctor", str(file), "--pose", text, "--json"]
    assert main(answer) == 1
    texts = [finding["text"] for finding in json.loads(capsys.readouterr().out)["findings"]]
    right = next(place for place, each in enumerate(texts, start=1) if each is not None and same_robot(each, PUMA))
    assert main(["doctor", str(file), "--pose", text, "--write", str(out), "--take", str(right)]) == 1
    assert same_robot(out.read_text(encoding="utf-8"), PUMA)
    assert main(["doctor", str(file), "--pose", text, "--write", str(out), "--force", "--take", "99"]) == 1
    assert "so --take 99 is not one of them" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "status", "message"),
    [
        ((), 2, "there are no poses: give --poses FILE.csv or --pose 'Q... = X Y Z'"),
        (("--pose", "1 2"), 1, "expected joint values, '=' and a position"),
        (("--poses", "nowhere.csv"), 1, "nowhere.csv: cannot be read: no such file or directory"),
        (("--pose", "0 0 0 0 0 0 = 1 2 3", "--tolerance", "-1"), 2, "-1 is not a tolerance"),
        (("--pose", "0 0 0 0 0 0 = 1 2 3", "--tolerance", "nan"), 2, "nan is not a tolerance"),
        (("--pose", "0 0 0 0 0 0 = 1 2 3", "--frame", "gripper"), 1, "unknown frame 'gripper'"),
        (("--pose", "0 0 0 0 0 0 = 1 2 3 9 0 0 0"), 1, "the quaternion has length 9"),
    ],
)
def test_wrong_arguments_are_one_line(
    arguments: tuple[str, ...], status: int, message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["doctor", str(ROBOTS / "puma560.yaml"), *arguments]) == status

    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1


def test_a_tree_asks_for_its_tip_and_takes_one(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    hand = robot_text("hand")
    file = ROBOTS / "hand.yaml"
    poses = tmp_path / "poses.csv"
    joints = some_joints(hand)
    poses.write_text(csv(hand, lines(hand, joints, frame="index_tip")), encoding="utf-8")

    assert main(["doctor", str(file), "--poses", str(poses)]) == 2
    assert "several tips; give --frame, one of " in capsys.readouterr().err
    assert main(["doctor", str(file), "--poses", str(poses), "--frame", "index_tip"]) == 0


def test_a_robot_that_does_not_move(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "post.yaml"
    file.write_text(
        "kinegen: 1\nname: post\nconvention: standard\nunits: {length: m, angle: deg}\n"
        "joints: [{name: top, theta: 0, d: 1, a: 0, alpha: 0}]\n",
        encoding="utf-8",
    )

    assert main(["doctor", str(file), "--pose", "= 0 0 1"]) == 1
    assert "has no joint that moves" in capsys.readouterr().err


def test_poses_of_another_robot_are_not_explained(poses: str, capsys: pytest.CaptureFixture[str]) -> None:
    """Nothing that is only a little nearer is shown as if it were an explanation."""
    pose = "30 -45 90 0 0 0 = 0.5 0.1 0.2"

    assert main(["doctor", str(ROBOTS / "puma560.yaml"), "--pose", pose]) == 1
    out = capsys.readouterr().out
    assert (
        "no small change makes the file agree with the poses\nnothing that was tried reduces the errors to a tenth\n"
        in out
    )
    assert "not tried: the base unknown: that takes more poses" in out
    assert "+++" not in out


def test_a_proposed_joint_value_has_no_negative_zero(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "arm.yaml"
    file.write_text(PUMA.replace("d: d3, theta: q", "d: d3, theta: -q"), encoding="utf-8")
    main(["doctor", str(file), "--pose", "30 -45 90 0 0 0 = 0.1383 0.2477 0.6101"])

    assert " -0," not in capsys.readouterr().out
