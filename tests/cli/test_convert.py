"""`kinegen convert`, and robot files of other formats in the other commands."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from kinegen.io.format import ReadOptions
from kinegen.io.load import load
from kinegen.ui.cli import main
from kinegen.verify import reference
from tests.formats.plain import URDF_TWO


@pytest.fixture
def arm(tmp_path: Path) -> Path:
    """A URDF file."""
    path = tmp_path / "arm.urdf"
    path.write_text(URDF_TWO)
    return path


def test_the_report_lists_what_changed_and_what_was_kept(arm: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["convert", str(arm)]) == 0
    printed = capsys.readouterr().out
    changed, kept = printed.split("close to a special value, and kept")
    assert "joint 'left-hip joint', rpy[1]" in changed
    assert "pi/2" in changed
    assert "3.141 " in kept
    assert "left-hip joint -> left_hip_joint" in kept
    assert "nothing is written" in kept
    assert list(arm.parent.iterdir()) == [arm]


def test_what_is_written_is_the_same_robot(arm: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = arm.parent / "arm.yaml"
    assert main(["convert", str(arm), "--tip", "flange", "-o", str(out)]) == 0
    capsys.readouterr()
    assert main(["convert", str(arm), "--tip", "flange", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert load(out).digest == document["digest"]
    assert document["links"]["flange"] == "tool"
    assert [each["text"] for each in document["kept"]] == ["3.141"]
    assert document["effect"] == pytest.approx(sum(each["effect"] for each in document["changed"]))


@pytest.mark.parametrize("suffix", ["yaml", "urdf"])
@pytest.mark.parametrize("convention", ["standard", "modified", "ets"])
def test_conventions_keep_the_pose(convention: str, suffix: str, arm: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = arm.parent / f"table.{suffix}"
    arguments = ["convert", str(arm), "--tip", "flange", "--convention", convention]
    assert main([*arguments, "-o", str(out)]) == 0
    assert f"{convention} rows; every pose stays the same" in capsys.readouterr().out
    before = load(arm, ReadOptions(tips=("flange",)))
    after = load(out, ReadOptions(tips=("flange",) if suffix == "urdf" else (), snap=0.0))
    for q in ([0.0, 0.1], [1.2, 0.4]):
        first, second = (reference.frames(robot, q)["tool"] for robot in (before, after))
        np.testing.assert_allclose(second, first, atol=1e-13)


def test_an_existing_file_is_kept_unless_forced(arm: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = arm.parent / "arm.yaml"
    out.write_text("mine")
    assert main(["convert", str(arm), "-o", str(out)]) == 1
    assert "the file exists; choose another name, or overwrite it with --force" in capsys.readouterr().err
    assert out.read_text() == "mine"
    assert main(["convert", str(arm), "-o", str(out), "--force"]) == 0
    assert load(out).dof == 2
    before = arm.read_text()
    assert main(["convert", str(arm), "-o", str(arm), "--force"]) == 1
    assert "this is an input, which is never overwritten" in capsys.readouterr().err
    assert arm.read_text() == before


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("-o", "arm.stl"), "is not a suffix of a format that can be written"),
        (("--snap", "a lot"), "is not an angle"),
        (("--snap", "-1"), "is not an angle"),
        (("--package-path", "here"), "expected NAME=DIR"),
    ],
)
def test_wrong_arguments(
    arm: Path, arguments: tuple[str, ...], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["convert", str(arm), *arguments]) == 2
    assert message in capsys.readouterr().err


def test_snap_takes_more_or_nothing(arm: Path, capsys: pytest.CaptureFixture[str]) -> None:
    counts = []
    for snap in ("0", "1e-9", "0.1deg"):
        assert main(["convert", str(arm), "--snap", snap, "--json"]) == 0
        counts.append(len(json.loads(capsys.readouterr().out)["changed"]))
    assert counts == [0, 1, 2]


def test_other_commands_take_the_file_and_say_what_changed(arm: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["fk", str(arm), "--tip", "flange", "0.1", "-0.2"]) == 0
    captured = capsys.readouterr()
    assert "base_T_tool" in captured.out
    assert captured.err.count("note: 1 rounded number replaced by the exact one") == 1
    assert captured.err.count(str(arm)) == 1
    assert captured.err.splitlines()[0].endswith("; --snap 0 keeps them, 'kinegen convert' lists them")
    assert main(["check", str(arm), "--snap", "0"]) == 0
    captured = capsys.readouterr()
    assert "2 joint variables" in captured.out
    assert not captured.err


def test_a_build_from_urdf_is_recognised_until_its_options_change(
    arm: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    build = ["build", str(arm), "-o", str(arm.parent / "out"), "--no-compile", "--real", "double", "--outputs", "pose"]
    for tip, same in (("flange", False), ("flange", True), ("lower", False)):
        assert main([*build, "--tip", tip]) == 0
        assert ("nothing has changed" in capsys.readouterr().out) == same
    assert (arm.parent / "out" / "two" / "two.h").exists()


def test_arguments_of_xacro(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "arm.xacro"
    path.write_text(
        '<robot name="arm" xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:arg name="side" default="left"/>'
        '<link name="a"/><link name="b"/><joint name="$(arg side)_hip" type="continuous"><parent link="a"/>'
        '<child link="b"/></joint></robot>'
    )
    assert main(["fk", str(path), "side:=right", "0"]) == 0
    capsys.readouterr()
    assert main(["convert", "side:=right", str(path), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["links"] == {"a": "base", "b": "tool"}


@pytest.mark.parametrize(
    ("tool", "text"),
    [("toolbox", "from roboticstoolbox import"), ("pinocchio", "import pinocchio as pin"), ("matlab", "rigidBodyTree")],
)
def test_program_text_for_other_tools(arm: Path, tool: str, text: str) -> None:
    out = arm.parent / "arm.txt"

    assert main(["convert", str(arm), "--tip", "flange", "--to", tool, "-o", str(out)]) == 0
    assert text in out.read_text(encoding="utf-8")


def test_program_text_needs_a_file(arm: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["convert", str(arm), "--to", "matlab"]) == 2
    assert "--to needs the file to write: -o OUT" in capsys.readouterr().err
