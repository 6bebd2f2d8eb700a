"""The tests of builds share one cache of compiled and proven packages, and take no tools from the machine."""

import pytest


@pytest.fixture(autouse=True)
def _machine(machine: None) -> None:
    """Asks for the shared fixture in every test of this folder."""
