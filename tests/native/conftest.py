"""The made-up robots, and packages of real ones, built once for all tests."""

from __future__ import annotations

import functools
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import pytest

from kinegen.errors import MissingToolError
from kinegen.runtime.compiler import find_compiler
from kinegen.runtime.extension import load_package
from tests.native.packages import FLAGS, write_package
from tests.native.sample import Sample

SAMPLES = {
    "chain": Sample("chain"),
    "tree": Sample("tree", tips=3),
    "fixed": Sample("fixed", dof=0),
    "runtime": Sample("runtime", parameter=True),
    "runtime_tree": Sample("runtime_tree", dof=2, tips=2, parameter=True),
    "double": Sample("double", reals=("double",)),
    "single": Sample("single", reals=("float",), parameter=True),
    "several": Sample("several", several=True),
    "several_tips": Sample("several_tips", dof=2, tips=2, parameter=True, several=True),
    "several_fixed": Sample("several_fixed", dof=0, several=True),
}


@functools.cache
def has_compiler() -> bool:
    """Whether this machine can compile."""
    try:
        find_compiler()
    except MissingToolError:
        return False
    return True


needs_compiler = pytest.mark.skipif(not has_compiler(), reason="no C compiler on this machine")


@pytest.fixture(scope="session")
def cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A cache of compiled extensions for these tests alone."""
    return tmp_path_factory.mktemp("cache")


@pytest.fixture(scope="session")
def load(tmp_path_factory: pytest.TempPathFactory, cache: Path) -> Callable[[str, str], ModuleType]:
    """Build and import a sample for a backend; each once."""
    known: dict[tuple[str, str], ModuleType] = {}

    def get(name: str, backend: str) -> ModuleType:
        if backend == "c" and not has_compiler():
            pytest.skip("no C compiler on this machine")
        if (name, backend) not in known:
            folder = SAMPLES[name].write(tmp_path_factory.mktemp(backend), cache, native=backend == "c")
            known[name, backend] = load_package(folder)
        return known[name, backend]

    return get


@pytest.fixture(scope="session")
def robot(tmp_path_factory: pytest.TempPathFactory, cache: Path) -> Callable[[str, str], ModuleType]:
    """Build and import the package of a real robot, for flags by name or `numpy`; each once."""
    known: dict[tuple[str, str], ModuleType] = {}

    def get(name: str, flags: str) -> ModuleType:
        if flags != "numpy" and not has_compiler():
            pytest.skip("no C compiler on this machine")
        if (name, flags) not in known:
            folder = write_package(name, FLAGS.get(flags), tmp_path_factory.mktemp("robot"), cache)
            known[name, flags] = load_package(folder)
        return known[name, flags]

    return get


@pytest.fixture(params=["c", "numpy"])
def backend(request: pytest.FixtureRequest) -> str:
    """Both ways to compute."""
    return str(request.param)


@pytest.fixture
def chain(load: Callable[[str, str], ModuleType], backend: str) -> ModuleType:
    """A chain of three joints."""
    return load("chain", backend)
