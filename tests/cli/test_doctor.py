"""`kinegen doctor`: what is printed, what is written, and what is refused."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from kinegen.io.load import load
from kinegen.ui.cli import main
from kinegen.verify import reference
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
    assert out[3].startswith("  file as given: max error 0.04")
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


def test_the_changed_file_is_written_where_asked(
    wrong: Path, poses: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "mended.yaml"

    assert main(["doctor", str(wrong), "--poses", poses, "--write", str(out)]) == 0
    assert capsys.readouterr().out.endswith(f"\n\nwrote {out}: {wrong} with the change above\n")
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
    assert capsys.readouterr().out.endswith(f"\nwrote {out}: {file} with explanation {right}\n")
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
        (("--pose", "0 0 0 0 0 0 = 1 2 3", "--tolerance-angle", "3"), 2, "'3' is not an angle (expected 0.2deg; units"),
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


IRB = """\
kinegen: 1
name: irb
convention: standard
units: {length: mm, angle: deg}
joints:
  - {name: A1, theta: q, d: 290, a: 0, alpha: -90}
  - {name: A2, theta: q - 90, d: 0, a: 270, alpha: 0}
  - {name: A3, theta: q, d: 0, a: 70, alpha: -90}
  - {name: A4, theta: q, d: 302, a: 0, alpha: 90}
"""


def written(folder: Path, table: str, joints: np.ndarray, head: str, form: str = "", bad: int = -1) -> list[str]:
    """The files of a table and of poses of the arm above, of which one may be 36 mm off."""
    rows = [[*line.joints, *line.position, *line.orientation] for line in lines(IRB, joints, form, 2)]
    if bad >= 0:
        rows[bad][4] += 36
    (folder / "irb.yaml").write_text(table, encoding="utf-8")
    (folder / "poses.csv").write_text(
        "\n".join([head, *(",".join(map(str, row)) for row in rows), ""]), encoding="utf-8"
    )
    return [str(folder / "irb.yaml"), "--poses", str(folder / "poses.csv")]


def test_one_bad_pose_is_told_with_the_errors_of_all(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = written(tmp_path, IRB, some_joints(IRB, 10), "q1,q2,q3,q4,X,Y,Z", bad=4)

    assert main(["doctor", *arguments]) == 1
    out = capsys.readouterr().out
    assert (
        "9 of 10 poses agree with the file as it is; measure the others again, or leave them out:\n  line 6: 36 mm off"
        in out
    )
    assert "the errors of each pose, in the file as it is:\n  line  position [mm]\n     6             36\n" in out
    assert "kinegen calibrate" not in out

    assert main(["doctor", *arguments, "--json"]) == 1
    found = json.loads(capsys.readouterr().out)["unexplained"]
    assert [each["line"] for each in found["most_agree"]["errors"] if not each["fits"]] == [6]
    assert [each["line"] for each in found["errors"]] == list(range(2, 12))
    assert found["calibrate"] == []


def test_the_command_that_is_named_finds_the_zeros(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    table = IRB.replace("q - 90", "q - 88").replace("theta: q, d: 302", "theta: q - 2, d: 302")
    arguments = written(
        tmp_path, table, some_joints(IRB, 12), "A1,A2,A3,A4,x,y,z,A,B,C".replace("A,B,C", "roll,pitch,yaw"), "rpy"
    )

    assert main(["doctor", *arguments]) == 1
    out = capsys.readouterr().out
    assert "small errors of several zeros of joints (theta) explain the poses; fit them:" in out
    (command,) = [line.split() for line in out.splitlines() if line.startswith("  kinegen calibrate ")]
    assert command[2:] == [arguments[0], arguments[2], "--fit", "theta", "--angle", "deg", "--length", "mm"]
    assert main([*command[1:], "--json"]) == 0
    found = {each["name"]: each["after"] - each["before"] for each in json.loads(capsys.readouterr().out)["parameters"]}
    assert np.degrees(found["theta_A2"]) == pytest.approx(-2, abs=0.01)
    assert np.degrees(found["theta_A4"]) == pytest.approx(2, abs=0.01)


def test_lines_that_are_not_in_the_file_are_not_printed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A URDF has no table, so a difference of one would be of another file."""
    urdf = tmp_path / "arm.urdf"
    links = "".join(f'<link name="l{place}"/>' for place in range(4))
    joints = "".join(
        f'<joint name="j{place}" type="continuous"><parent link="l{place}"/><child link="l{place + 1}"/>'
        f'<origin xyz="0.{place + 1} 0.1 0.2" rpy="{0.3 * place} 0 0"/>'
        f'<axis xyz="0 {place % 2} {1 - place % 2}"/></joint>'
        for place in range(3)
    )
    urdf.write_text(f'<robot name="arm">{links}{joints}</robot>', encoding="utf-8")
    robot = load(urdf)
    q = np.random.default_rng(2).uniform(-2, 2, (5, 3)).round(3)
    pose = reference.frames(robot, q * [1, -1, 1])[robot.tips[0]]
    rows = [",".join(f"{value:.5f}" for value in (*a, *b)) for a, b in zip(q, pose[:, :3, 3], strict=True)]
    (tmp_path / "poses.csv").write_text("\n".join(["j0,j1,j2,x,y,z", *rows, ""]), encoding="utf-8")

    assert main(["doctor", str(urdf), "--poses", str(tmp_path / "poses.csv")]) == 0
    out = capsys.readouterr().out
    assert "joint 2 (j1): the other direction" in out
    assert "--write OUT.yaml writes a robot file with it" in out
    assert "+++" not in out
    assert "@@" not in out


COUPLED = """\
actuators:
  readings: {t1: angle, t2: angle, t3: angle, t4: angle}
  joints:
    - {joint: A1, form: gear, actuator: t1, ratio: 1}
    - {joints: [A2, A3], form: coupling, actuators: [t2, t3], matrix: [[1, 0], [1, 1]]}
    - {joint: A4, form: gear, actuator: t4, ratio: 1}
"""


def test_actuators_are_not_passed_over_in_silence(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """What the pendant shows are readings, where joint 3 counts from the ground."""
    said = some_joints(IRB, 5)
    moved = said + np.outer(said[:, 1], [0, 0, 1, 0])
    arguments = written(tmp_path, IRB + COUPLED, moved, "A1,A2,A3,A4,x,y,z")
    assert main(["doctor", *arguments]) == 0
    assert "the file has actuators; the poses give joint values, so actuators are left out" in capsys.readouterr().out

    table = (tmp_path / "poses.csv").read_text(encoding="utf-8").splitlines()
    rows = [[*map(str, q), *line.split(",")[4:]] for q, line in zip(said, table[1:], strict=True)]
    (tmp_path / "poses.csv").write_text("\n".join([table[0], *map(",".join, rows), ""]), encoding="utf-8")
    assert main(["doctor", *arguments]) == 0
    out = capsys.readouterr().out
    assert "joint A3 is at its value in the poses plus that of A2 (coupled joints: `actuators:` of a robot file)" in out
