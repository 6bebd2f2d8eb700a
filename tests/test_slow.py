"""The list of slow tests: it names tests that exist, and a run that times them writes it."""

from __future__ import annotations

import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from tests import slow

ROOT = Path(__file__).resolve().parents[1]


def took(seconds: float, node: str, when: str = "call") -> Any:
    return SimpleNamespace(duration=seconds, nodeid=node, when=when)


def test_the_list_names_tests_that_exist() -> None:
    for line in slow.SLOW.read_text(encoding="utf-8").splitlines():
        file, _, function = line.partition("::")
        text = (ROOT / file).read_text(encoding="utf-8")
        name = re.escape(function.rpartition("::")[2])
        assert not function or re.search(rf"^ *def {name}\(", text, re.MULTILINE), line


def test_other_targets_run_what_make_test_leaves_out() -> None:
    expression = re.search(r'"-m", "(.+?)"', (ROOT / "pyproject.toml").read_text(encoding="utf-8"))

    assert expression
    assert sorted(re.findall(r"not (\w+)", expression[1])) == sorted([*slow.ELSEWHERE, "slow"])


def test_a_recorded_test_is_slow_by_its_mean_or_by_what_its_file_sets_up(tmp_path: Path) -> None:
    recorder = slow.Recorder(tmp_path / "slow.txt")
    for report in (
        took(0.6, "tests/test_a.py::test_mixed[1]"),
        took(0.1, "tests/test_a.py::test_mixed[2]"),
        took(0.3, "tests/test_a.py::test_long[1]", "setup"),
        took(0.3, "tests/test_a.py::test_long[1]"),
        took(2.0, "tests/test_b.py::test_first", "setup"),
        took(0.1, "tests/test_b.py::test_second"),
        took(0.8, "tests/test_b.py::test_third"),
    ):
        recorder.pytest_runtest_logreport(report)
    recorder.pytest_sessionfinish()

    assert recorder.listed.read_text(encoding="utf-8").splitlines() == [
        "tests/test_a.py::test_long",
        "tests/test_b.py",
    ]


def test_what_is_listed_is_marked(tmp_path: Path) -> None:
    listed, marked = tmp_path / "slow.txt", []
    listed.write_text("tests/test_a.py::test_long\ntests/test_b.py\n", encoding="utf-8")
    nodes = ["tests/test_a.py::test_long[1]", "tests/test_a.py::test_longer", "tests/test_b.py::Two::test_any"]

    items: Any = [
        SimpleNamespace(
            nodeid=node,
            add_marker=lambda mark, node=node: marked.append((node, mark)),
            get_closest_marker=lambda name, node=node: name == "long" and node.endswith("[2]"),
        )
        for node in (*nodes, "tests/test_a.py::test_long[2]")
    ]
    slow.mark(items, listed)

    assert marked == [(nodes[0], pytest.mark.slow), (nodes[2], pytest.mark.slow)]
