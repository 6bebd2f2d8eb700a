"""`make robots`: all robots are built and proven, and a sample of them where that was done with the same sources."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from scripts import robots, sources

ALL = sorted(path.stem for path in (Path(__file__).resolve().parent.parent / "robots").glob("*.yaml"))


@pytest.fixture
def built(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The robots that a run builds, with sources of the digest `now`."""
    found: list[str] = []

    def build(paths: list[Path]) -> str:
        found.extend(path.stem for path in paths)
        return ""

    monkeypatch.setattr(robots, "PROVEN", tmp_path / "proven.txt")
    monkeypatch.setattr(robots, "OUTPUT", tmp_path / "build" / "robots")
    monkeypatch.setattr(robots, "build", build)
    monkeypatch.setattr(robots.sources, "digest", lambda *_: "now")
    monkeypatch.setattr(sys, "argv", ["robots.py"])
    return found


def test_all_are_built_of_sources_that_are_new_and_recorded(built: list[str]) -> None:
    robots.PROVEN.write_text("before\n", encoding="utf-8")

    assert robots.main() == 0
    assert sorted(built) == ALL
    assert robots.PROVEN.read_text(encoding="utf-8") == "now\n"


def test_a_sample_is_built_of_sources_that_are_known(built: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    robots.PROVEN.write_text("now\n", encoding="utf-8")
    sample = [name for name in ALL if sources.is_in_sample(name, "now")]

    assert robots.main() == 0
    assert 0 < len(sample) < len(ALL) / 3
    assert sorted(built) == sample
    assert capsys.readouterr().out.startswith(f"{len(sample)} robots are built and proven (a sample")


def test_all_are_built_on_request(built: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    robots.PROVEN.write_text("now\n", encoding="utf-8")
    monkeypatch.setattr(sys, "argv", ["robots.py", "--every", "--jobs", "1"])

    assert robots.main() == 0
    assert built == ALL


@pytest.mark.usefixtures("built")
def test_a_robot_that_fails_is_told_and_nothing_recorded(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(robots, "build", lambda paths: "error: no" if paths[0].stem == ALL[0] else "")

    assert robots.main() == 1
    assert "error: no" in capsys.readouterr().out
    assert not robots.PROVEN.exists()
