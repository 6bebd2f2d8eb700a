"""How tests of controllers are given to processes, LinuxCNC first and to one; and what judged each package."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.controllers.contract import CONTRACTS, judged_by
from tests.controllers.halrun import SERIAL


@pytest.fixture
def tmp_path(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Path]:
    """For LinuxCNC a folder elsewhere: each pytest that begins closes the folder of all to other users."""
    if SERIAL.mark in request.node.iter_markers(SERIAL.name):
        with tempfile.TemporaryDirectory(prefix="kinegen-") as folder:
            yield Path(folder)
    else:
        yield tmp_path


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """With `--dist loadgroup` the others go by file, since those of a file share what they compile.

    LinuxCNC mostly waits, and takes longest: it begins first, with `--no-loadscope-reorder`.
    """
    if not config.pluginmanager.hasplugin("xdist"):
        return
    for item in filter(_is_ours, items):
        if not item.get_closest_marker(SERIAL.name):
            item.add_marker(pytest.mark.xdist_group(item.path.stem))
    items.sort(key=lambda item: not (_is_ours(item) and SERIAL.mark in item.iter_markers(SERIAL.name)))


def _is_ours(item: pytest.Item) -> bool:
    return item.get_closest_marker("controllers") is not None


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    """`make test-controllers` says what it judged each package by."""
    if config.getoption("markexpr") == "controllers":
        terminalreporter.section("what the packages were judged by")
        for path in sorted(CONTRACTS.glob("*.yaml")):
            terminalreporter.write_line(judged_by(path.stem))
