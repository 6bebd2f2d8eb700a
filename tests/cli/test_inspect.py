"""`kinegen inspect`: the family with its branches and constants, or what is missing."""

from __future__ import annotations

import pytest

from kinegen.cli import main
from tests.cli.commands import ROBOTS


def test_a_family_with_its_branches_and_constants(capsys: pytest.CaptureFixture[str]) -> None:
    file = ROBOTS / "puma560.yaml"

    assert main(["inspect", str(file)]) == 0
    text = capsys.readouterr().out
    assert text.startswith(f"{file}: arm with parallel axes 2, 3 and spherical wrist\n")
    assert "    0  shoulder left, elbow up, wrist no-flip\n" in text
    assert "    7  shoulder right, elbow down, wrist flip\n" in text
    assert "    from axis 2 to axis 3                       0.4318  m\n" in text


def test_what_is_missing_and_what_serves_instead(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["inspect", str(ROBOTS / "iiwa14.yaml"), str(ROBOTS / "scara.yaml")]) == 0
    text = capsys.readouterr().out
    assert "iiwa14.yaml: no closed-form inverse\n  no family of closed forms has the joints RRRRRRR\n" in text
    assert "The numeric inverse works for every arm: kinegen build --outputs numeric_inverse\n" in text
    assert "scara.yaml: SCARA, joints RRP\n" in text


def test_a_tree_has_a_numeric_inverse_of_all_tips(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["inspect", str(ROBOTS / "hand.yaml")]) == 0
    text = capsys.readouterr().out
    assert "  The numeric inverse takes targets of all tips: kinegen build --outputs numeric_inverse\n" in text
    assert "works for every arm" not in text


def test_a_bad_file_is_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["inspect", "nowhere.yaml"]) == 1
    assert capsys.readouterr().err.count("\n") == 1
