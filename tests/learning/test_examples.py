"""The programs of docs/learning.md run, and print what the page shows."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.learning.conftest import package

pytestmark = pytest.mark.learning

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "learning.md").read_text(encoding="utf-8")
SHOWN = re.compile(r"<!-- file: (\S+) -->\n```python\n(.*?)```\n\nIt prints, [^\n]*\n\n```text\n(.*?)```", re.S)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the package of the page is."""
    folder = tmp_path_factory.mktemp("page")
    package(folder, "ur5", "pose jacobian hessian")
    return folder


def test_the_page_shows_three_programs() -> None:
    assert len(SHOWN.findall(PAGE)) == 3


@pytest.mark.parametrize(("name", "text", "printed"), SHOWN.findall(PAGE), ids=lambda each: each[:30].split("\n")[0])
def test_programs_of_the_page_print_what_it_shows(folder: Path, name: str, text: str, printed: str) -> None:
    path = ROOT / name
    done = subprocess.run(
        [sys.executable, path],
        env={**os.environ, "PYTHONPATH": str(folder)},
        capture_output=True,
        text=True,
        check=False,
    )

    assert text == path.read_text(encoding="utf-8")
    assert done.returncode == 0, done.stderr
    # How many of a thousand come near is a matter of the last bits; everything else is not.
    counts = re.compile(r"\b[1-9]\d\d (?=of)")
    assert counts.sub("N ", done.stdout) == counts.sub("N ", printed)
