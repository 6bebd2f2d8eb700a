"""Emitted files on disk, once for all tests of a process."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from kinegen.backends.scalar_types import ScalarType
from tests.emit.emitted import NAMES, SMALL, texts
from tests.folders import folders


@pytest.fixture(scope="session")
def folder_of(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """The folder of a robot's files; tests write only beside it."""
    return folders(tmp_path_factory.mktemp("emitted"), texts)


@pytest.fixture(params=NAMES)
def name(request: pytest.FixtureRequest) -> str:
    """Every robot that the emitters are tried with."""
    return str(request.param)


@pytest.fixture(params=SMALL)
def small(request: pytest.FixtureRequest) -> str:
    """A few robots with every kind of interface but the tree."""
    return str(request.param)


@pytest.fixture(params=list(ScalarType))
def real(request: pytest.FixtureRequest) -> ScalarType:
    """Both number types."""
    return ScalarType(request.param)


@pytest.fixture
def folder(name: str, folder_of: Callable[[str], Path]) -> Path:
    """The files of the robot of this test."""
    return folder_of(name)
