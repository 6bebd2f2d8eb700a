"""The tests of languages share one cache of compiled and verified packages, and take no tools from the machine.

Tests marked `proves` with languages are tried with every robot of `robots/`; most runs try a sample of the robots, as
`tests/sampled.py` says.
"""

from __future__ import annotations

import pytest

from tests.builds.workshop import ROBOTS

NAMES = tuple(sorted(path.stem for path in ROBOTS.glob("*.yaml")))


@pytest.fixture(autouse=True)
def _machine(machine: None) -> None:
    """Asks for the shared fixture in every test of this folder."""


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    for marker in metafunc.definition.iter_markers("proves"):
        if marker.args:
            metafunc.parametrize(("language", "name"), [(each, name) for each in marker.args for name in NAMES])


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """`--dist loadgroup` gives one process all tests of a robot, whose kernels are derived once then."""
    if not config.pluginmanager.hasplugin("xdist"):
        return
    for item in items:
        call = getattr(item, "callspec", None)
        if call is not None and "name" in call.params and item.get_closest_marker("languages"):
            item.add_marker(pytest.mark.xdist_group(call.params["name"]))
