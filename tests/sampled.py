"""Targets with hundreds of tests alike try one in seven of them, drawn by the commit; `--every` tries all.

So each commit tries others, and `make full`, which a release needs, tries all.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import pytest

from scripts import sampling

QUICK = "scara"
"""The robot that is tried in every language each time: quick, with inverses and both types of joints."""


def _of_a_robot(item: pytest.Item) -> str | None:
    """All languages of a robot are tried in the same run, which derives its kernels once."""
    robot: str = item.callspec.params["name"] if item.get_closest_marker("proves") else QUICK  # type: ignore[attr-defined]
    return None if robot == QUICK else robot


LONG = "readings[driven7]"
"""What a test of a controller ends with for which compilers take minutes."""

SAMPLED: Mapping[str, Callable[[pytest.Item], str | None]] = {
    "controllers": lambda item: item.nodeid if item.nodeid.endswith(LONG) else None,
    "languages": _of_a_robot,
    "long": lambda item: item.nodeid,
    "sabotage": lambda item: item.nodeid if "[" in item.nodeid else None,
}
"""By the mark of a run: what a test is drawn by, None for one that is tried in every run."""

SHARED = "kinegen_commit"
"""Where the other processes of a run find the commit."""


@dataclass(eq=False, frozen=True)
class Sample:
    """The plugin of a run of one mark; pytest keeps plugins in sets.

    Attributes:
        drawn_by: See `SAMPLED`.
        commit: The digest of the commit.
    """

    drawn_by: Callable[[pytest.Item], str | None]
    commit: str

    @pytest.hookimpl(trylast=True)
    def pytest_collection_modifyitems(self, config: pytest.Config, items: list[pytest.Item]) -> None:
        """Leave out what is not drawn, of the tests that have the mark."""
        tried = set(filter(self.is_tried, items))
        config.hook.pytest_deselected(items=[item for item in items if item not in tried])
        items[:] = [item for item in items if item in tried]

    def is_tried(self, item: pytest.Item) -> bool:
        """Whether a test is tried."""
        name = self.drawn_by(item)
        return name is None or sampling.is_in_sample(name, self.commit)

    @pytest.hookimpl(optionalhook=True)
    def pytest_configure_node(self, node: Any) -> None:
        """Have another process of the run draw the same, whatever is committed meanwhile."""
        node.workerinput[SHARED] = self.commit


def sample_of(config: pytest.Config) -> Sample | None:
    """The plugin for the mark of a run; None where every test is tried."""
    drawn_by = SAMPLED.get(config.getoption("markexpr"))
    if drawn_by is None or config.getoption("every"):
        return None
    shared: dict[str, str] = getattr(config, "workerinput", {})
    return Sample(drawn_by, shared.get(SHARED) or sampling.commit())
