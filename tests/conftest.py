"""What all tests share: the same examples of Hypothesis on every machine, objects and small builds made once."""

from __future__ import annotations

import gc
import os
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import settings

from kinegen.runtime.compiler import Compiler
from tests import slow
from tests.builds.workshop import ARM, make, set_machine, write_robot
from tests.objects import remembering
from tests.sampled import sample_of

# A red run has to be red again when somebody looks into it. To search further, now and then:
# HYPOTHESIS_PROFILE=explore make test
settings.register_profile("repeatable", derandomize=True, deadline=None, print_blob=True)
settings.register_profile("explore", max_examples=2_000, deadline=None, print_blob=True)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "repeatable"))


def pytest_addoption(parser: pytest.Parser) -> None:
    """With `--record-slow` the list of slow tests is written anew; with `--every` no test is left out of a sample."""
    parser.addoption("--every", action="store_true", help="try all tests, instead of a sample that the commit draws")
    parser.addoption("--record-slow", action="store_true", help="time the tests, and write tests/slow.txt")


def pytest_configure(config: pytest.Config) -> None:
    """The process that hears of all tests records them; marks with a sample have a plugin."""
    sample = sample_of(config)
    if sample is not None:
        config.pluginmanager.register(sample)
    if config.getoption("--record-slow") and not hasattr(config, "workerinput"):
        config.pluginmanager.register(slow.Recorder())


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Before `-m` chooses among them; a run that writes the list takes them all."""
    if not config.getoption("--record-slow"):
        slow.mark(items)


def pytest_collection_finish() -> None:
    """Thousands of tests and modules stay to the end; the collector of garbage need not visit them again and again."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(100_000, 50, 50)


def shared_folder(factory: pytest.TempPathFactory, config: pytest.Config, name: str) -> Path:
    """A folder that all processes of a run share."""
    own = factory.getbasetemp()
    folder = (own.parent if hasattr(config, "workerinput") else own) / name
    folder.mkdir(exist_ok=True)
    return folder


@pytest.fixture(scope="session")
def cache_home(tmp_path_factory: pytest.TempPathFactory, pytestconfig: pytest.Config) -> Path:
    """One for all processes of a run."""
    return shared_folder(tmp_path_factory, pytestconfig, "user-cache")


@pytest.fixture(scope="session", autouse=True)
def _objects(tmp_path_factory: pytest.TempPathFactory, pytestconfig: pytest.Config) -> Iterator[None]:
    """What compilers make of the same text is made once for all processes of a run."""
    with pytest.MonkeyPatch.context() as patch:
        store = shared_folder(tmp_path_factory, pytestconfig, "objects")
        patch.setattr(Compiler, "run", remembering(Compiler.run, store))
        yield


@pytest.fixture
def machine(cache_home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
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
