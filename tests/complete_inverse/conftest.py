"""Packages with the complete inverse, compiled once and in NumPy."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from types import ModuleType

import pytest

from benchmarks.complete import OTHERS
from kinegen.driver.pipeline import build
from kinegen.driver.results import BuildOptions
from kinegen.model.outputs import COMPLETE_INVERSE, Quantity
from kinegen.runtime.extension import load_package
from kinegen.runtime.flags import Flags
from kinegen.verify import complete_inverse as proof
from tests.builds.workshop import ROBOTS, set_machine

Packages = Callable[[str, str], ModuleType]

OWN = Path(__file__).parent / "robots"


def file_of(name: str) -> Path:
    """The file of a robot of `robots/`, or of one that only the benchmark or these tests have."""
    return next(path for folder in (ROBOTS, OTHERS, OWN) if (path := folder / f"{name}.yaml").exists())


@pytest.fixture(scope="session")
def package(tmp_path_factory: pytest.TempPathFactory, cache_home: Path) -> Packages:
    """A package of a robot by its name, see `file_of`, and backend, `c` or `numpy`."""

    @cache
    def made(name: str, backend: str) -> ModuleType:
        folder = tmp_path_factory.mktemp(f"{name}_{backend}")
        with pytest.MonkeyPatch.context() as patch:
            set_machine(patch, cache_home)
            patch.setattr(proof, "TARGETS", 100)
            patch.setattr(proof, "FEWER", 10)
            patch.setattr(proof, "SPECIAL", 60)
            patch.setattr(proof, "FEWER_SPECIAL", 12)
            options = BuildOptions(
                output=folder,
                quantities=(Quantity.POSE, COMPLETE_INVERSE),
                compile=backend == "c",
                flags=Flags(march=None, optimisation="1"),
            )
            return load_package(build(file_of(name), options, lambda _: None).folder)

    return made
