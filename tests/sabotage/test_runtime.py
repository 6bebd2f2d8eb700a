"""Each alteration of the array handling makes a quick test fail; `make test-sabotage` runs this."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.sabotage.runtime import ALTERATIONS, BUILDING, Alteration

pytestmark = pytest.mark.sabotage

ROOT = Path(__file__).resolve().parents[2]
COPIED = ("kinegen", "tests", "robots", "templates", "pyproject.toml")
RUNTIME = "kinegen/runtime/vendored"


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The repository, as far as these tests need it."""
    folder = tmp_path_factory.mktemp("copy")
    for name in COPIED:
        if (ROOT / name).is_dir():
            shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
        else:
            shutil.copy(ROOT / name, folder / name)
    return folder


def tried(folder: Path, tests: str) -> subprocess.CompletedProcess[str]:
    """Run a file of tests in a copy, up to the first that fails."""
    quick = ["-m", "not slow", "--noconftest"] if tests not in BUILDING else ["-m", "not long"]
    options = ("-q", "-x", "-p", "no:cacheprovider", *quick)
    command = (sys.executable, "-B", "-m", "pytest", *options, tests)
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False, timeout=300)


@pytest.mark.parametrize("tests", sorted({each.tests for each in ALTERATIONS}))
def test_the_tests_pass_without_an_alteration(tests: str, copy: Path) -> None:
    done = tried(copy, tests)

    assert done.returncode == 0, done.stdout[-2000:]


@pytest.mark.parametrize("case", [pytest.param(each, id=each.name) for each in ALTERATIONS])
def test_an_altered_file_makes_a_test_fail(case: Alteration, copy: Path) -> None:
    path = copy / RUNTIME / case.file
    text = path.read_text(encoding="utf-8")
    assert text.count(case.old) == 1, f"{case.file} has {text.count(case.old)} matches of {case.old!r}"
    try:
        path.write_text(text.replace(case.old, case.new), encoding="utf-8")
        done = tried(copy, case.tests)
    finally:
        path.write_text(text, encoding="utf-8")

    assert done.returncode == 1, done.stdout[-2000:]
    assert " failed" in done.stdout or " error" in done.stdout


def test_every_alteration_has_a_name_of_its_own() -> None:
    assert len({each.name for each in ALTERATIONS}) == len(ALTERATIONS)
