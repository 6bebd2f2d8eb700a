"""`make commits` warns about messages that are hard to read later, and blocks nothing unless it is asked to."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from scripts.check_commits import Commit, main, problems


def found(message: str, files: int = 1) -> list[str]:
    """The problems of a commit."""
    return list(problems(Commit("123456789", message, tuple(f"kinegen/{number}.py" for number in range(files)))))


@pytest.mark.parametrize(
    ("message", "files"),
    [
        ("Square roots keep their bits", 1),
        ("x" * 72, 12),
        ("Square roots keep their bits\n\nThe processor's own root rounds in the same way.", 100),
        (f"Square roots keep their bits\n\n{'x' * 120}", 1),
    ],
)
def test_a_good_message_passes(message: str, files: int) -> None:
    assert found(message, files) == []


@pytest.mark.parametrize(
    ("message", "problem"),
    [
        ("", "has no message"),
        ("x" * 73, "the subject has 73 characters (at most 72)"),
        ("Roots; sines; pages", "'Roots; sines; pages': the subject has a semicolon; one idea a commit"),
        ("Square roots keep their bits.", "ends with a full stop"),
        ("fixup! Square roots", "is to be joined with another one"),
        ("WIP roots", "is to be joined with another one"),
        ("Square roots\nkeep their bits", "no empty line after the subject"),
        (f"Square roots\n\n{'x' * 121}", "lines of more than 120 characters"),
    ],
)
def test_what_makes_a_message_hard_to_read_is_named(message: str, problem: str) -> None:
    (line,) = found(message)

    assert problem in line


def test_a_commit_of_many_files_says_why() -> None:
    assert found("Roots", 13) == ["'Roots': 13 files without a body; say why"]
    assert list(problems(Commit("123456789", "Roots", ("generated/a.h",) * 100))) == []


@pytest.fixture
def repository(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A repository with a commit on main and two on a branch."""
    monkeypatch.chdir(tmp_path)
    for key, value in {"AUTHOR": "A", "COMMITTER": "C"}.items():
        monkeypatch.setenv(f"GIT_{key}_NAME", value)
        monkeypatch.setenv(f"GIT_{key}_EMAIL", f"{value}@example.com")
    monkeypatch.setenv("GIT_CONFIG_GLOBAL", "/dev/null")
    git("init", "-q", "-b", "main")
    git("commit", "-q", "--allow-empty", "-m", "First; of main")
    git("switch", "-q", "-c", "work")
    git("commit", "-q", "--allow-empty", "-m", "Roots keep their bits")
    git("commit", "-q", "--allow-empty", "-m", "Roots; sines")
    return tmp_path


def git(*arguments: str) -> None:
    subprocess.run(("git", *arguments), check=True)


def test_the_commits_after_main_are_looked_at(repository: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert repository.is_dir()
    assert main([]) == 0

    out = capsys.readouterr().out
    assert "'Roots; sines': the subject has a semicolon" in out
    assert out.endswith("2 commits after main, 1 warnings\n")


@pytest.mark.usefixtures("repository")
def test_another_base_can_be_named(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["HEAD", "--strict"]) == 0
    assert main(["HEAD~1"]) == 0

    assert capsys.readouterr().out.endswith("1 commits after HEAD~1, 1 warnings\n")


@pytest.mark.usefixtures("repository")
def test_strict_fails_on_a_warning() -> None:
    assert main(["--strict"]) == 1


@pytest.mark.usefixtures("repository")
def test_a_base_that_is_not_there_is_an_error(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["nowhere"]) == 2

    assert capsys.readouterr().err == "error: 'nowhere' is not a commit of this repository\n"


@pytest.mark.usefixtures("repository")
def test_without_upstream_and_main_a_base_is_asked_for(capsys: pytest.CaptureFixture[str]) -> None:
    git("branch", "-q", "-D", "main")

    assert main([]) == 2
    assert "name the base" in capsys.readouterr().err
