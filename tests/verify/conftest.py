"""The same cache and the same earlier build as for the tests of builds."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from tests.builds.workshop import ARM, make, set_machine, write_robot


@pytest.fixture(scope="session")
def cache_home(tmp_path_factory: pytest.TempPathFactory, request: pytest.FixtureRequest) -> Path:
    """One for all processes of a run."""
    own = tmp_path_factory.getbasetemp()
    folder = (own.parent if hasattr(request.config, "workerinput") else own) / "user-cache"
    folder.mkdir(exist_ok=True)
    return folder


@pytest.fixture(autouse=True)
def _machine(cache_home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The same on every machine: no cross compiler, and no compiler that somebody named."""
    set_machine(monkeypatch, cache_home)


@pytest.fixture(scope="session")
def built_before(tmp_path_factory: pytest.TempPathFactory, cache_home: Path) -> Path:
    """The output of a build of the small arm as it was, with another length; not to be written to."""
    with pytest.MonkeyPatch.context() as patch:
        set_machine(patch, cache_home)
        folder = tmp_path_factory.mktemp("built-before")
        make(write_robot(folder / "in", ARM.replace("0.25", "0.125")), folder / "out")
    return folder / "out"


@pytest.fixture
def earlier(built_before: Path, tmp_path: Path) -> Path:
    """A copy of the output of an earlier build, which the next build would change."""
    shutil.copytree(built_before, tmp_path / "out")
    return tmp_path / "out"
