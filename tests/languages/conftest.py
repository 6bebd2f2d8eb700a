"""The tests of languages share one cache of compiled and proven packages, and take no tools from the machine."""

import pytest


@pytest.fixture(autouse=True)
def _machine(machine: None) -> None:
    """Asks for the shared fixture in every test of this folder."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """`--dist loadgroup` gives one process all tests of a robot, whose kernels are derived once then."""
    for item in items:
        call = getattr(item, "callspec", None)
        if call is not None and "name" in call.params and item.get_closest_marker("languages"):
            item.add_marker(pytest.mark.xdist_group(call.params["name"]))
