"""Tests that belong together are given to one process, by `--dist loadgroup` with these versions and our hooks."""

from __future__ import annotations

import importlib
import os
import subprocess
import sys
from pathlib import Path

import pytest

GROUPING = """\
import pytest

@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items):
    for item in items:
        item.add_marker(pytest.mark.xdist_group(str(item.callspec.params["number"] % 2)))
"""

TESTS = """\
import os
from pathlib import Path
import pytest

@pytest.mark.parametrize("number", range(8))
def test_number(number):
    with Path("done").open("a") as file:
        file.write(f"{number % 2} {os.getpid()}\\n")
"""


def test_a_group_is_given_to_one_process(tmp_path: Path) -> None:
    """pytest 9.2 with xdist 3.8 spreads groups over all processes, without a word."""
    for name, text in {"conftest.py": GROUPING, "test_it.py": TESTS, "pytest.ini": "[pytest]\n"}.items():
        (tmp_path / name).write_text(text)
    words = [sys.executable, "-m", "pytest", "-q", "-n", "2", "--dist", "loadgroup", "-p", "no:cacheprovider"]
    environment = {name: value for name, value in os.environ.items() if not name.startswith("PYTEST_")}
    done = subprocess.run(words, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)

    assert done.returncode == 0, done.stdout + done.stderr
    rows = [line.split() for line in (tmp_path / "done").read_text().splitlines()]
    assert len(rows) == 8
    assert all(len({process for group, process in rows if group == each}) == 1 for each in "01")


@pytest.mark.parametrize("folder", ["controllers", "languages", "windows"])
def test_groups_are_named_before_xdist_reads_them(folder: str) -> None:
    hook = importlib.import_module(f"tests.{folder}.conftest").pytest_collection_modifyitems

    assert hook.pytest_impl["tryfirst"]
