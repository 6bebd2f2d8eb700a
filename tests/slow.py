"""Which tests `make test` leaves to `make test-slow`: those that take over 0.4 seconds, most of which build a package.

A line of `slow.txt` is the file and the function of a test, or a file where its tests share something that takes long
to make. `make test PYTEST_OPTIONS=--record-slow` runs all, times them and writes the list anew.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from pathlib import Path

import pytest

SLOW = Path(__file__).with_name("slow.txt")

ELSEWHERE = (
    "boards",
    "browser",
    "controllers",
    "counts",
    "imports",
    "languages",
    "learning",
    "long",
    "notebooks",
    "sabotage",
    "windows",
)
"""Marks of tests that other targets run."""

SECONDS = 0.4
"""What a test may take in the mean over its parameters, with what it sets up, and still be quick."""

SHARED_SECONDS = 1.5
"""What a test may set up; where it takes longer, others in the file wait for the same."""


def mark(items: Iterable[pytest.Item], listed: Path = SLOW) -> None:
    """Mark the tests of the list.

    Args:
        items: Tests that were collected.
        listed: The list.
    """
    names = frozenset(listed.read_text(encoding="utf-8").splitlines())
    for item in items:
        if not names.isdisjoint(_names(item.nodeid)) and not any(map(item.get_closest_marker, ELSEWHERE)):
            item.add_marker(pytest.mark.slow)


def _names(node: str) -> tuple[str, str]:
    """The file of a test, and the file with the function."""
    return node.partition("::")[0], node.partition("[")[0]


class Recorder:
    """Writes the list after a run.

    Args:
        listed: The list.
    """

    def __init__(self, listed: Path = SLOW) -> None:
        self.listed = listed
        self._seconds: dict[str, float] = defaultdict(float)
        self._tests: dict[str, set[str]] = defaultdict(set)
        self._shared: dict[str, float] = defaultdict(float)

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Add what a test took, with what it set up and put away."""
        file, function = _names(report.nodeid)
        self._seconds[function] += report.duration
        self._tests[function].add(report.nodeid)
        if report.when == "setup":
            self._shared[file] = max(self._shared[file], report.duration)

    def pytest_sessionfinish(self) -> None:
        """Write the list."""
        files = {file for file, seconds in self._shared.items() if seconds > SHARED_SECONDS}
        functions = {name for name, seconds in self._seconds.items() if seconds > SECONDS * len(self._tests[name])}
        found = sorted(files | {name for name in functions if name.partition("::")[0] not in files})
        self.listed.write_text("".join(f"{name}\n" for name in found), encoding="utf-8")
