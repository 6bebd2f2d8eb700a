"""Proofs take minutes, so they run only where someone asks for them: `make prove`, or pytest with this folder named."""

from __future__ import annotations

from pathlib import Path

import pytest

SLOW = ("test_eva.py", "test_controls.py", "test_command.py")
"""The files whose tests need Frama-C."""


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave the slow ones out unless they are asked for."""
    if any("prove" in argument for argument in config.args):
        return
    here = Path(__file__).resolve().parent
    slow = [item for item in items if item.path.parent == here and item.path.name in SLOW]
    config.hook.pytest_deselected(items=slow)
    items[:] = [item for item in items if item not in slow]
