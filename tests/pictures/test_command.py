"""`kinegen view` when the name of its output is that of a picture."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from kinegen.ui import cli

ROOT = Path(__file__).resolve().parent.parent.parent
PUMA, SCARA = (str(ROOT / "robots" / f"{name}.yaml") for name in ("puma560", "scara"))


def test_it_writes_a_picture(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "arm.svg"

    assert cli.main(["view", SCARA, "-o", str(path), "--frames", "--dimensions", "--q", "30,45,0.1"]) == 0

    out = capsys.readouterr().out
    assert out.startswith(f"wrote {path}\n")
    assert "inches" in out
    svg = path.read_text(encoding="utf-8")
    assert "<!-- θ₂ = q2 = 45° -->" in svg
    assert "<!-- 1 shoulder" in svg


@pytest.mark.parametrize(("name", "start"), [("a.png", b"\x89PNG"), ("a.pdf", b"%PDF"), ("A.SVG", b"<?xml")])
def test_the_ending_decides(tmp_path: Path, name: str, start: bytes) -> None:
    assert cli.main(["view", SCARA, "-o", str(tmp_path / name)]) == 0
    assert (tmp_path / name).read_bytes().startswith(start)
    # A picture of kinegen may be replaced.
    assert cli.main(["view", SCARA, "-o", str(tmp_path / name), "--side", "-60,20"]) == 0


def test_postures_of_several_q_are_drawn(tmp_path: Path) -> None:
    path = tmp_path / "arm.svg"

    assert cli.main(["view", SCARA, "-o", str(path), "--q", "0,0,0", "--q", "90,-30,0.1"]) == 0
    assert 'id="joint-elbow-posture-2"' in path.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["-o", "a.jpg"], "the name ends in .jpg (expected .html for a page, or .svg, .png, .pdf for a picture)"),
        (["-o", "a.html", "--frames"], "--frames is for pictures"),
        (["-o", "a.html", "--q", "0,0,0", "--q", "0,0,1"], "more than one --q is for pictures"),
        (["-o", "a.svg", "--outputs", "twist"], "--outputs and --workspace are for pages"),
        (["-o", "a.svg", "--q", "0,0"], "scara needs 3 joint values"),
        (["-o", "a.svg", "--q", "nan,0,0"], "'nan' is not a number"),
        (["-o", "a.svg", "--side", "above"], "'above' is not a side"),
        (["-o", "a.svg", "--size", "inf"], "size is inf"),
        (["-o", "a.svg", "--rows", "hip"], "scara has no row 'hip'"),
    ],
)
def test_one_line_says_what_is_wrong(
    arguments: list[str],
    message: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)

    assert cli.main(["view", SCARA, *arguments]) in (1, 2)

    printed = capsys.readouterr()
    assert message in printed.err
    assert printed.err.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_a_picture_of_somebody_else_stays(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "photo.png"
    path.write_bytes(b"\x89PNG something else")

    assert cli.main(["view", SCARA, "-o", str(path)]) == 1
    assert path.read_bytes() == b"\x89PNG something else"
    assert "--force" in capsys.readouterr().err


def test_without_matplotlib_one_line_says_what_to_install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)

    assert cli.main(["view", PUMA, "-o", str(tmp_path / "arm.svg")]) == 1

    expected = "error: a figure needs matplotlib, which is not installed (pip install 'kinegen[plot]')\n"
    assert capsys.readouterr().err == expected
