"""The tests of languages share one cache of compiled and proven packages, and take no tools from the machine.

Tests marked `proves` are tried with those robots and languages that `proven` says are due, and what passes is recorded.
"""

from __future__ import annotations

import pytest

from tests.languages import proven

_passed: set[tuple[str, str]] = set()


@pytest.fixture(autouse=True)
def _machine(machine: None) -> None:
    """Asks for the shared fixture in every test of this folder."""


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--every-robot", action="store_true", help="tries robots again whose bytes have passed before")


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    for marker in metafunc.definition.iter_markers("proves"):
        every = metafunc.config.getoption("--every-robot", default=False)
        among = marker.kwargs.get("among")
        pairs = [
            (language, name)
            for language in marker.args
            for name in proven.due(language, every=every)
            if among is None or name in among
        ]
        metafunc.parametrize(("language", "name"), pairs)


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """`--dist loadgroup` gives one process all tests of a robot, whose kernels are derived once then."""
    for item in items:
        call = getattr(item, "callspec", None)
        if call is not None and "name" in call.params and item.get_closest_marker("languages"):
            if config.pluginmanager.hasplugin("xdist"):
                item.add_marker(pytest.mark.xdist_group(call.params["name"]))
            if item.get_closest_marker("proves"):
                item.user_properties.append(("proven", (call.params["name"], call.params["language"])))


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    if report.when == "call" and report.passed:
        _passed.update(tuple(value) for name, value in report.user_properties if name == "proven")


def pytest_sessionfinish(session: pytest.Session) -> None:
    """The process that hears of all reports writes the record."""
    if _passed and not hasattr(session.config, "workerinput"):
        proven.add(_passed)
