"""`make robots`: a sample of the robots is built and verified, and all of them on request."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from scripts import robots, sampling

ALL = sorted(path.stem for path in (Path(__file__).resolve().parent.parent / "robots").glob("*.yaml"))


@pytest.fixture
def built(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The robots that a run at the commit `now` builds."""
    found: list[str] = []

    def build(paths: list[Path]) -> str:
        found.extend(path.stem for path in paths)
        return ""

    monkeypatch.setattr(robots, "OUTPUT", tmp_path / "build" / "robots")
    monkeypatch.setattr(robots, "build", build)
    monkeypatch.setattr(robots.sampling, "commit", lambda: "now")
    monkeypatch.setattr(sys, "argv", ["robots.py"])
    return found


def test_a_sample_is_built(built: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    sample = [name for name in ALL if sampling.is_in_sample(name, "now")]

    assert robots.main() == 0
    assert 0 < len(sample) < len(ALL) / 3
    assert sorted(built) == sample
    assert capsys.readouterr().out.startswith(f"{len(sample)} of {len(ALL)} robots are built and verified")


def test_all_are_built_on_request(built: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "argv", ["robots.py", "--every", "--jobs", "1"])

    assert robots.main() == 0
    assert built == ALL


@pytest.mark.usefixtures("built")
def test_a_robot_that_fails_is_told(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(robots, "build", lambda _: "error: no")

    assert robots.main() == 1
    assert "error: no" in capsys.readouterr().out
