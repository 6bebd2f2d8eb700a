"""Packages with the numeric inverse, compiled once and in NumPy."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from types import ModuleType

import pytest

from kinegen.driver.pipeline import build
from kinegen.driver.results import BuildOptions
from kinegen.model.outputs import NUMERIC_INVERSE, Quantity
from kinegen.runtime.extension import load_package
from kinegen.runtime.flags import Flags
from kinegen.verify import numeric_inverse as proof
from tests.builds.workshop import ROBOTS, set_machine

Packages = Callable[[str, str], ModuleType]


def robot_file(name: str) -> Path:
    """A robot of these tests, or one of `robots/`."""
    own = Path(__file__).parent / "robots" / f"{name}.yaml"
    return own if own.exists() else ROBOTS / f"{name}.yaml"


@pytest.fixture(scope="session")
def package(tmp_path_factory: pytest.TempPathFactory, cache_home: Path) -> Packages:
    """A package of a robot by its name and backend, `c` or `numpy`."""

    @cache
    def made(name: str, backend: str) -> ModuleType:
        folder = tmp_path_factory.mktemp(f"{name}_{backend}")
        with pytest.MonkeyPatch.context() as patch:
            set_machine(patch, cache_home)
            patch.setattr(proof, "TARGETS", 60)
            options = BuildOptions(
                output=folder,
                quantities=(Quantity.POSE, NUMERIC_INVERSE),
                compile=backend == "c",
                flags=Flags(march=None, optimisation="1"),
            )
            return load_package(build(robot_file(name), options, lambda _: None).folder)

    return made
