"""Tests that passed with the same sources before are tried again as a sample.

A record is the digest of the sources with which all tests of a mark in some folders passed: of what they try, of the
tests themselves, and of the libraries. While it is true, one test in seven is tried; `--every` tries all. A run of all
that passes writes the record.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import pytest

from scripts import sources

TESTS = Path(__file__).resolve().parent

OTHER_CHOICES = ("keyword", "deselect", "lf")
"""Options with which a run is not about all tests."""

SHARED = "kinegen_sources"
"""Where the other processes of a run find the digest."""


@dataclass(frozen=True)
class Recorded:
    """Tests with a record.

    Attributes:
        record: The file with the digest.
        folders: The folders with the tests.
        places: Further files and folders that decide what they say.
        every: Whether a test is tried in every run, from its name.
    """

    record: Path
    folders: tuple[str, ...]
    places: tuple[str, ...] = ()
    every: Callable[[str], bool] = lambda _: False

    def digest(self) -> str:
        """The digest of the present sources."""
        own = (path for folder in self.folders for path in (TESTS.parent / folder).iterdir())
        kept = sorted(path.relative_to(TESTS.parent).as_posix() for path in own if path.suffix != ".txt")
        return sources.digest([*kept, *self.places], ["kinegen.cli.build"])


RECORDED: Mapping[str, Recorded] = {
    "sabotage": Recorded(
        TESTS / "sabotage" / "passed.txt", ("tests/sabotage",), ("tests/inverse/robots",), lambda name: "[" not in name
    ),
    "long": Recorded(
        TESTS / "passed.txt",
        (
            *("tests/complete_inverse", "tests/emit", "tests/fleet", "tests/inverse", "tests/inverse_tracker"),
            *("tests/machine_tools", "tests/numeric_inverse", "tests/sincos", "tests/verify"),
        ),
        ("tests/conftest.py",),
    ),
}
"""By their marks. Not all long tests are in these folders: others are tried in every run."""


@dataclass(eq=False)
class Sample:
    """The plugin of a run of one mark; pytest keeps plugins in sets.

    Attributes:
        recorded: Its tests.
        digest: Makes or knows the digest of the sources.
    """

    recorded: Recorded
    digest: Callable[[], str]
    _wanted: set[str] = field(default_factory=set)
    _passed: set[str] = field(default_factory=set)
    _others: set[str] = field(default_factory=set)

    @cached_property
    def now(self) -> str:
        """The digest."""
        return self.digest()

    def pytest_collection_modifyitems(self, config: pytest.Config, items: list[pytest.Item]) -> None:
        """Leave out most tests whose sources have not changed."""
        if self._is_sample(config):
            left_out = [item for item in items if not self.is_tried(item.nodeid)]
            config.hook.pytest_deselected(items=left_out)
            items[:] = [item for item in items if self.is_tried(item.nodeid)]

    def is_tried(self, name: str) -> bool:
        """Whether a test is tried although its sources have not changed."""
        return not self._counts(name) or self.recorded.every(name) or sources.is_in_sample(name, self.now)

    def _is_sample(self, config: pytest.Config) -> bool:
        return not config.getoption("every") and sources.is_recorded(self.recorded.record, self.now)

    def _counts(self, name: str) -> bool:
        return name.startswith(tuple(f"{folder}/" for folder in self.recorded.folders))

    @pytest.hookimpl(optionalhook=True)
    def pytest_configure_node(self, node: Any) -> None:
        """Tell another process of the run the digest, which takes seconds."""
        node.workerinput[SHARED] = self.now

    # The record -------------------------------------------------------------------------------------------------------

    def pytest_collection_finish(self, session: pytest.Session) -> None:
        """Without other processes, this one knows what will be tried."""
        self._wanted.update(item.nodeid for item in session.items)

    @pytest.hookimpl(optionalhook=True)
    def pytest_xdist_node_collection_finished(self, ids: Sequence[str]) -> None:
        """With others, these tell."""
        self._wanted.update(ids)

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Note what passed."""
        if report.failed or report.skipped:
            self._others.add(report.nodeid)
        elif report.when == "call":
            self._passed.add(report.nodeid)

    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        """The process that hears of all reports writes the record, if all tests of the folders passed."""
        config = session.config
        if hasattr(config, "workerinput") or self._is_sample(config) or not self._are_all(config):
            return
        wanted, others = ({name for name in names if self._counts(name)} for names in (self._wanted, self._others))
        if wanted and wanted <= self._passed and not others:
            self.recorded.record.write_text(f"{self.now}\n", encoding="utf-8")

    def _are_all(self, config: pytest.Config) -> bool:
        """Whether a run is about all tests in the folders."""
        if any(config.getoption(option, default=None) for option in OTHER_CHOICES):
            return False
        folders = [TESTS.parent / folder for folder in self.recorded.folders]
        places = [(TESTS.parent / argument).resolve() for argument in config.args]
        return all(any(folder.is_relative_to(place) for place in places) for folder in folders)


def sample_of(config: pytest.Config) -> Sample | None:
    """The plugin for the mark of a run; None where that has no record."""
    recorded = RECORDED.get(config.getoption("markexpr"))
    if recorded is None:
        return None
    shared: dict[str, Any] | None = getattr(config, "workerinput", None)
    return Sample(recorded, recorded.digest if shared is None else lambda: str(shared[SHARED]))
