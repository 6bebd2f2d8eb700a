"""`kinegen check`: what is told of good files, and of bad ones."""

from __future__ import annotations

from pathlib import Path

import pytest

from kinegen.cli import main
from tests.cli.commands import BAD, ROBOTS, TWO


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """A good file that a test may change."""
    path = tmp_path / "two.yaml"
    path.write_text(TWO, encoding="utf-8")
    return path


def test_a_good_file_is_summed_up(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", str(file)]) == 0
    assert capsys.readouterr() == (
        f"{file}: ok, 2 joint variables (1 revolute, 1 prismatic), 2 rows, reach at most 2.5 m\n",
        "",
    )


@pytest.mark.parametrize("path", sorted(ROBOTS.glob("*.yaml")), ids=lambda path: path.stem)
def test_our_own_robots_pass_without_notes(path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", str(path)]) == 0
    assert capsys.readouterr().out.count("\n") == 1


@pytest.mark.parametrize(
    ("name", "fact"),
    [
        ("blocks", "no joint variables, 3 rows"),
        ("hand", "17 joint variables (17 revolute), 26 rows, 5 tips"),
        ("standard_frames", "2 named frames"),
        ("calibrated_2r", "5 runtime parameters"),
        ("screw", "lead of spindle 0.005 m a turn"),
    ],
)
def test_what_is_special_is_told(name: str, fact: str, capsys: pytest.CaptureFixture[str]) -> None:
    main(["check", str(ROBOTS / f"{name}.yaml")])

    assert f", {fact}" in capsys.readouterr().out


def test_a_nearly_special_angle_is_a_note_with_its_line(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file.write_text(TWO.replace("alpha: 0, a: L1", "alpha: 89.9999, a: L1"), encoding="utf-8")

    assert main(["check", str(file)]) == 0
    assert capsys.readouterr().out.splitlines()[1] == (
        f"{file}:9: note: alpha of joint 1 (turn) is 89.9999 deg, close to 90, and kept as it is; "
        "the difference moves the tip by up to 3.5e-06 m and turns it by 1.7e-06 rad"
    )


def test_radians_in_a_file_in_degrees_are_a_note(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file.write_text(TWO.replace("alpha: 0, a: L1", "alpha: 1.5708, a: L1"), encoding="utf-8")

    assert main(["check", str(file)]) == 0
    assert capsys.readouterr().out.splitlines()[1] == (
        f"{file}:9: note: alpha of joint 1 (turn) is 1.5708 deg, close to the number pi/2; "
        "if radians were meant, write 90"
    )


def test_the_tool_has_no_line(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file.write_text(TWO + "tool: {rpy: [0, 90.01, 0]}\n", encoding="utf-8")
    main(["check", str(file)])

    assert capsys.readouterr().out.splitlines()[1].startswith(f"{file}: note: Ry of tool is 90.01 deg, close to 90")


def test_after_a_bad_file_the_others_are_read(file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bad = tmp_path / "bad.yaml"
    bad.write_text(BAD, encoding="utf-8")

    assert main(["check", str(bad), str(file)]) == 1

    out, err = capsys.readouterr()
    assert out.startswith(f"{file}: ok, ")
    assert err.startswith(f"error: {bad}:10: joint 2 (slide): unknown key 'alhpa'")
    assert err.endswith("\n1 of 2 files have errors\n")
