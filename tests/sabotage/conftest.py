"""Attempts at sources with which all were refused before are made again as a sample.

`passed.txt` is the digest of these sources: of what builds and proves, and of the attempts. While it is true, one
attempt in seven is made; `make test-sabotage PYTEST_OPTIONS=--every-attempt` makes all. A run of all that passes writes
it.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

import pytest

from scripts import sources

PASSED = Path(__file__).with_name("passed.txt")
FOLDER = "tests/sabotage"
_reported: dict[str, set[str]] = {"passed": set(), "other": set()}


@cache
def _sources() -> str:
    places = sorted(f"{FOLDER}/{path.name}" for path in PASSED.parent.glob("*.py"))
    return sources.digest([*places, f"{FOLDER}/robots", "tests/inverse/robots"], ["kinegen.cli.build"])


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--every-attempt", action="store_true", help="makes attempts again that were refused before")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    if config.getoption("markexpr") != "sabotage" or config.getoption("--every-attempt", default=False):
        return
    if not PASSED.exists() or PASSED.read_text(encoding="utf-8").strip() != _sources():
        return
    left_out = [item for item in items if not _is_tried(item.nodeid)]
    config.hook.pytest_deselected(items=left_out)
    items[:] = [item for item in items if _is_tried(item.nodeid)]


def _is_tried(name: str) -> bool:
    """Whether a test is made although its sources have not changed."""
    return not name.startswith(FOLDER) or "[" not in name or sources.is_in_sample(name, _sources())


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    if report.nodeid.startswith(FOLDER):
        if report.failed or report.skipped:
            _reported["other"].add(report.nodeid)
        elif report.when == "call":
            _reported["passed"].add(report.nodeid)


def pytest_sessionfinish(session: pytest.Session) -> None:
    """The process that hears of all reports writes the record."""
    if hasattr(session.config, "workerinput") or not _reported["passed"] or _reported["other"]:
        return
    from tests.sabotage.test_sabotage import ALTERED, SETTINGS

    if len(_reported["passed"]) == len(ALTERED) + len(SETTINGS) + 1:
        PASSED.write_text(f"{_sources()}\n", encoding="utf-8")
