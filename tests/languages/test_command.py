"""`kinegen build --languages`: what it writes and removes, and what it says where nothing can be proven."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from kinegen.ui.cli import main
from tests.builds.workshop import write_robot


@pytest.fixture
def arm(tmp_path: Path) -> str:
    """A small robot."""
    return str(write_robot(tmp_path / "in"))


def build(arm: str, out: Path, capsys: pytest.CaptureFixture[str], *words: str) -> str:
    """What a build of the pose prints."""
    assert main(["build", arm, "--outputs", "pose", "--real", "double", "-o", str(out), *words]) == 0
    return capsys.readouterr().out


@pytest.mark.skipif(shutil.which("node") is None, reason="needs Node.js (Debian: apt-get install nodejs)")
def test_a_language_has_a_folder_and_rows_in_the_proof(
    arm: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    printed = build(arm, tmp_path, capsys, "-v", "--languages", "c,python,javascript")
    again = build(arm, tmp_path, capsys, "-v", "--languages", "javascript")

    assert {"arm.js", "arm.d.ts", "package.json"} < {path.name for path in (tmp_path / "arm" / "javascript").iterdir()}
    assert "JavaScript double, other parameters" in printed
    assert "compare" in again
    listed = json.loads((tmp_path / "arm" / "kinegen-manifest.json").read_text())["files"]
    assert "javascript/arm.js" in listed


def test_a_build_without_a_language_takes_its_files_away(
    arm: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    build(arm, tmp_path, capsys, "--no-compile", "--languages", "javascript")
    (tmp_path / "arm" / "javascript" / "mine.js").write_text("// of the user\n")
    build(arm, tmp_path, capsys, "--no-compile")

    left = (tmp_path / "arm" / "javascript").rglob("*")
    assert [path.name for path in left if path.is_file()] == ["mine.js"]


@pytest.mark.parametrize(("hidden", "reason"), [("compiler", "needs a C compiler"), ("node", "needs Node.js")])
def test_what_is_not_proven_says_so(
    arm: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    hidden: str,
    reason: str,
) -> None:
    monkeypatch.setattr("kinegen.verify.language_build.shutil.which", lambda _: None)
    words = ["--no-compile"] if hidden == "compiler" else []
    printed = build(arm, tmp_path, capsys, *words, "--languages", "javascript", "--json")

    (told,) = json.loads(printed)["builds"]
    assert any("written unverified" in note and reason in note for note in told["notes"])
    assert not any("JavaScript" in row["target"] for row in told["proof"]["comparisons"])


def test_an_unknown_language_is_refused(arm: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["build", arm, "--languages", "javascript,cobol"]) == 2
    known = "c, python, javascript, cpp, rust, matlab, cuda"
    assert f"unknown language 'cobol' (expected {known})" in capsys.readouterr().err


def test_packages_of_firmware_have_c_alone(arm: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["build", arm, "--package", "cmake", "--languages", "javascript"]) == 2
    assert "--package writes no other languages" in capsys.readouterr().err
