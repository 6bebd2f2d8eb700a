"""Emitted files on disk."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from tests.fixed.kernels import NAMES, texts
from tests.folders import folders


@pytest.fixture(scope="session")
def folder_of(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """The folder of a robot's files; tests write only beside it."""
    return folders(tmp_path_factory.mktemp("integers"), texts)


@pytest.fixture(params=NAMES)
def name(request: pytest.FixtureRequest) -> str:
    """Every robot that the integer kernels are tried with."""
    return str(request.param)


@pytest.fixture
def folder(name: str, folder_of: Callable[[str], Path]) -> Path:
    """The files of the robot of this test."""
    return folder_of(name)
