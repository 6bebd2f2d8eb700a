"""Tests with a record: a sample of them is tried while it is true, and a run of all that passes writes it."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from scripts import sources
from tests.sampled import RECORDED

ROOT = Path(__file__).resolve().parent.parent

CONFTEST = """
from pathlib import Path
import pytest
from tests import sampled

sampled.TESTS = Path(__file__).parent / "own"
RECORDED = sampled.Recorded(Path(__file__).with_name("passed.txt"), ("heavy",), (), lambda name: "always" in name)

def pytest_addoption(parser):
    parser.addoption("--every", action="store_true")

def pytest_configure(config):
    shared = getattr(config, "workerinput", None)
    digest = (lambda: "now") if shared is None else (lambda: shared[sampled.SHARED])
    config.pluginmanager.register(sampled.Sample(RECORDED, digest))
"""

HEAVY = """
import pytest

def test_always(): pass

@pytest.mark.parametrize("place", range(70))
def test_heavy(place): assert place != {wrong}
"""


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """70 tests of a folder with a record, one there that is tried always, and one elsewhere."""
    for name, text in {
        "conftest.py": CONFTEST,
        "pytest.ini": "[pytest]\n",
        "heavy/test_heavy.py": HEAVY.format(wrong=-1),
        "light/conftest.py": "",
        "light/test_light.py": "def test_light(): pass\n",
    }.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text, encoding="utf-8")
    return tmp_path


def passed(project: Path, *options: str) -> int:
    """How many tests pass in a run; the record may change."""
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:randomly", *(options or ("heavy", "light"))]
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "PYTEST_ADDOPTS": ""}
    done = subprocess.run(command, cwd=project, env=environment, capture_output=True, text=True, check=False)
    found = re.search(r"(\d+) passed", done.stdout)
    assert found, done.stdout + done.stderr
    return int(found[1])


def record(project: Path) -> str:
    path = project / "passed.txt"
    return path.read_text(encoding="utf-8").strip() if path.exists() else ""


@pytest.mark.parametrize("processes", ["0", "2"])
def test_a_run_of_all_is_recorded_and_the_next_one_is_a_sample(project: Path, processes: str) -> None:
    names = [f"heavy/test_heavy.py::test_heavy[{place}]" for place in range(70)]
    sample = [name for name in names if sources.is_in_sample(name, "now")]

    assert passed(project, "-n", processes, "heavy", "light") == 72
    assert record(project) == "now"
    assert passed(project, "-n", processes, "heavy", "light") == 2 + len(sample)
    assert passed(project, "-n", processes, "--every", "heavy", "light") == 72
    assert 0 < len(sample) < 25


@pytest.mark.parametrize("options", [("light",), ("-k", "heavy", "heavy"), ("heavy/test_heavy.py",)])
def test_a_part_of_them_is_not_recorded(project: Path, options: tuple[str, ...]) -> None:
    passed(project, *options)

    assert record(project) == ""


@pytest.mark.parametrize("processes", ["0", "2"])
def test_a_failure_is_not_recorded(project: Path, processes: str) -> None:
    (project / "heavy" / "test_heavy.py").write_text(HEAVY.format(wrong=3), encoding="utf-8")

    assert passed(project, "-n", processes, "heavy", "light") == 71
    assert record(project) == ""


def test_other_sources_have_all_tried_again(project: Path) -> None:
    (project / "passed.txt").write_text("before\n", encoding="utf-8")

    assert passed(project) == 72
    assert record(project) == "now"


@pytest.mark.parametrize("mark", RECORDED)
def test_the_folders_with_a_record_are_there_and_have_such_tests(mark: str) -> None:
    for folder in RECORDED[mark].folders:
        texts = [path.read_text(encoding="utf-8") for path in (ROOT / folder).glob("test_*.py")]
        assert any(f"mark.{mark}" in text for text in texts), folder
