"""The same cache for all builds of these tests, which shares what was compiled and proven."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.builds.workshop import set_machine


@pytest.fixture(autouse=True)
def _machine(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> None:
    set_machine(monkeypatch, tmp_path_factory.getbasetemp() / "user-cache")
    Path(tmp_path_factory.getbasetemp() / "user-cache").mkdir(exist_ok=True)
