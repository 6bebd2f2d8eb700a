"""A cache of compiled extensions for the tests alone, and a robot that was built before."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from tests.builds.workshop import make, set_machine, write_robot


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
def built(tmp_path_factory: pytest.TempPathFactory, cache_home: Path) -> Path:
    """The output of an earlier build of the small arm; not to be written to."""
    with pytest.MonkeyPatch.context() as patch:
        set_machine(patch, cache_home)
        folder = tmp_path_factory.mktemp("built")
        make(write_robot(folder / "in"), folder / "out")
    return folder / "out"


@pytest.fixture
def earlier(built: Path, tmp_path: Path) -> Path:
    """A copy of that output, which the next build would change: an old extension, and one file that is edited."""
    shutil.copytree(built, tmp_path / "out")
    with (tmp_path / "out" / "arm" / "arm.c").open("a", encoding="utf-8") as file:
        file.write("/* of an earlier build */\n")
    return tmp_path / "out"
