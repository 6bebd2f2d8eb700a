"""Emitted files on disk."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest

from tests.fixed.kernels import NAMES, texts


@pytest.fixture(scope="session")
def folder_of(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """The folder of a robot's files; tests write only beside it."""
    root = tmp_path_factory.mktemp("integers")

    @cache
    def folder(name: str) -> Path:
        (root / name).mkdir()
        for file, text in texts(name).items():
            (root / name / file).write_text(text, encoding="utf-8", newline="\n")
        return root / name

    return folder


@pytest.fixture(params=NAMES)
def name(request: pytest.FixtureRequest) -> str:
    """Every robot that the integer kernels are tried with."""
    return str(request.param)


@pytest.fixture
def folder(name: str, folder_of: Callable[[str], Path]) -> Path:
    """The files of the robot of this test."""
    return folder_of(name)
