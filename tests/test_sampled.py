"""Targets with many tests alike try a sample that the commit draws, and all of them on request."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from scripts import sampling

ROOT = Path(__file__).resolve().parent.parent

CONFTEST = """
import pytest
from tests import sampled

sampled.SAMPLED = {"heavy": lambda item: item.nodeid if "[" in item.nodeid else None}
sampled.sampling.commit = lambda: "now"

def pytest_addoption(parser):
    parser.addoption("--every", action="store_true")

def pytest_configure(config):
    sample = sampled.sample_of(config)
    if sample is not None:
        config.pluginmanager.register(sample)
"""

HEAVY = """
import pytest

@pytest.mark.heavy
def test_always(): pass

@pytest.mark.heavy
@pytest.mark.parametrize("place", range(70))
def test_heavy(place): pass

def test_light(): pass
"""


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """70 tests of a mark that are sampled, one of it that is tried always, and one without it."""
    for name, text in {
        "conftest.py": CONFTEST,
        "pytest.ini": "[pytest]\nmarkers = heavy\n",
        "test_heavy.py": HEAVY,
    }.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    return tmp_path


def passed(project: Path, *options: str) -> set[str]:
    """The tests that pass in a run."""
    command = [sys.executable, "-m", "pytest", "-v", "-p", "no:randomly", *options]
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "PYTEST_ADDOPTS": ""}
    done = subprocess.run(command, cwd=project, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return set(re.findall(r"test_heavy\.py::\w+(?:\[\d+\])?", done.stdout))


@pytest.mark.parametrize("processes", ["0", "2"])
def test_a_run_of_a_mark_is_a_sample(project: Path, processes: str) -> None:
    names = [f"test_heavy.py::test_heavy[{place}]" for place in range(70)]
    sample = {name for name in names if sampling.is_in_sample(name, "now")}

    assert passed(project, "-n", processes, "-m", "heavy") == sample | {"test_heavy.py::test_always"}
    assert 0 < len(sample) < 25


@pytest.mark.parametrize(("options", "count"), [(("-m", "heavy", "--every"), 71), ((), 72)])
def test_all_are_tried_on_request_and_without_the_mark(project: Path, options: tuple[str, ...], count: int) -> None:
    assert len(passed(project, *options)) == count


def test_a_sample_is_a_seventh_and_another_one_for_another_commit() -> None:
    names = [f"robot {number}" for number in range(7000)]
    first, second = ({name for name in names if sampling.is_in_sample(name, of)} for of in ("1", "2"))

    assert 800 < len(first) < 1200
    assert 50 < len(first & second) < 250


def test_the_commit_is_that_of_the_repository(tmp_path: Path) -> None:
    command = ["git", "-c", "user.name=a", "-c", "user.email=a@b.org"]
    for words in (["init", "-q"], ["commit", "-q", "--allow-empty", "-m", "Begin"]):
        subprocess.run([*command, *words], cwd=tmp_path, check=True)
    head = subprocess.run(["git", "rev-parse", "HEAD"], cwd=tmp_path, capture_output=True, text=True, check=True)

    assert sampling.commit(tmp_path) == head.stdout.strip()
    assert len(head.stdout.strip()) >= 40


def test_a_copy_without_history_has_a_sample_too(tmp_path: Path) -> None:
    assert sampling.commit(tmp_path) == ""
