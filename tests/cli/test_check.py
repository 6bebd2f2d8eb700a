"""`kinegen check`: what is told of good files, and of bad ones."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from kinegen.ui.cli import main
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


@pytest.mark.parametrize(
    ("entry", "words"),
    [
        (", limits: [0, 2]}", "reach at most 2.5 m"),
        ("}", "reach without a bound (slide without limits)"),
    ],
)
def test_a_slide_without_limits_has_no_reach(
    entry: str, words: str, file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file.write_text(TWO.replace(", limits: [0, 2]}", entry), encoding="utf-8")

    assert main(["check", str(file)]) == 0
    assert capsys.readouterr().out.endswith(f", {words}\n")


@pytest.mark.parametrize("path", sorted(ROBOTS.glob("*.yaml")), ids=lambda path: path.stem)
def test_our_own_robots_pass_without_notes(path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", str(path)]) == 0
    assert capsys.readouterr().out.count("\n") == 1


@pytest.mark.parametrize(
    ("name", "fact"),
    [
        ("blocks", "no joint variables (write q where one is, as in theta: q), 3 rows"),
        ("hand", "17 joint variables (17 revolute), 26 rows, 5 tips"),
        ("standard_frames", "2 named frames"),
        ("calibrated_2r", "5 runtime parameters"),
        ("screw", "lead of spindle 0.005 m/rev"),
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


def test_json_has_the_facts_of_each_file(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    other = file.with_name("other.yaml")
    other.write_text(TWO.replace(", limits: [0, 2]}", "}").replace("name: two", "name: other"), encoding="utf-8")

    assert main(["check", str(file), str(other), str(ROBOTS / "screw.yaml"), "--json"]) == 0
    two, endless, screw = json.loads(capsys.readouterr().out)["files"]
    assert (two["file"], two["ok"], two["rows"], two["reach"], two["unlimited"]) == (str(file), True, 2, 2.5, [])
    assert two["robot"]["joints"] == [{"name": "turn", "type": "revolute"}, {"name": "slide", "type": "prismatic"}]
    assert two["robot"]["units"] == {"length": "m", "angle": "rad"}
    assert (endless["reach"], endless["unlimited"]) == (None, ["slide"])
    assert screw["leads"]["spindle"] == pytest.approx(0.005)


def test_json_has_notes_with_their_lines(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file.write_text(TWO.replace("alpha: 90", "alpha: 89.9999"), encoding="utf-8")
    assert main(["check", str(file)]) == 0
    (line,) = capsys.readouterr().out.splitlines()[1:]

    assert main(["check", str(file), "--json"]) == 0
    (entry,) = json.loads(capsys.readouterr().out)["files"]
    (note,) = entry["notes"]
    assert line == f"{file}:{note['line']}: note: {note['text']}"


def test_json_of_a_bad_file_has_its_error_and_goes_on(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bad = file.with_name("bad.yaml")
    bad.write_text(TWO.replace("alpha", "alhpa", 1), encoding="utf-8")

    assert main(["check", str(bad), "--json"]) == 1
    alone = capsys.readouterr()
    assert main(["check", str(bad), str(file), "--json"]) == 1
    (entry, good) = json.loads(capsys.readouterr().out)["files"]
    assert json.loads(alone.out)["files"] == [entry]
    assert alone.err == f"error: {entry['error']}\n"
    assert entry["error"].startswith(f"{bad}:{entry['line']}: ")
    assert (entry["ok"], good["ok"]) == (False, True)
    assert entry.keys() == {"file", "ok", "error", "line"}
