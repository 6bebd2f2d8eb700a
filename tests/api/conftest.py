"""A cache of the tests alone, for all of them."""

from __future__ import annotations

import pytest


@pytest.fixture(autouse=True)
def _machine(machine: None) -> None:
    """See `machine`."""
