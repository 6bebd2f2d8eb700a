"""Packages with the inverse along a path, compiled once and in NumPy."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from types import ModuleType

import pytest

from kinegen.driver.pipeline import build
from kinegen.driver.results import BuildOptions
from kinegen.model.outputs import INVERSE_TRACKER, Quantity
from kinegen.runtime.extension import load_package
from kinegen.runtime.flags import Flags
from kinegen.verify import inverse_tracker as proof
from tests.builds.workshop import ROBOTS, set_machine

Packages = Callable[[str, str], ModuleType]


@pytest.fixture(scope="session")
def package(tmp_path_factory: pytest.TempPathFactory, cache_home: Path) -> Packages:
    """A package of a robot of `robots/` by its name and backend, `c` or `numpy`."""

    @cache
    def made(name: str, backend: str) -> ModuleType:
        folder = tmp_path_factory.mktemp(f"{name}_{backend}")
        with pytest.MonkeyPatch.context() as patch:
            set_machine(patch, cache_home)
            patch.setattr(proof, "LINES", 8)
            patch.setattr(proof, "FEWER", 1)
            options = BuildOptions(
                output=folder,
                quantities=(Quantity.POSE, INVERSE_TRACKER),
                compile=backend == "c",
                flags=Flags(march=None, optimisation="1"),
            )
            return load_package(build(Path(ROBOTS / f"{name}.yaml"), options, lambda _: None).folder)

    return made
