"""Programs on emulated boards that do not end: tried again, and the reason is told with the figures."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import pytest

from kinegen.model.outputs import Quantity
from kinegen.ui.cli.build_report import cost_lines
from kinegen.verify.boards import cost, targets
from kinegen.verify.boards.targets import TARGETS, HungError, Target, run_program
from kinegen.verify.records import Cost, reasons

M4F = TARGETS["cortex-m4f"]

SLOW_ONCE = """
import sys, pathlib, time
been = pathlib.Path(sys.argv[1])
if not been.exists():
    been.touch()
    time.sleep(60)
print("spin 1")
"""


def emulated(code: str) -> Target:
    """A target whose emulator is a Python program that is given the path of the program."""
    return replace(M4F, emulator=replace(M4F.emulator, command=(sys.executable, "-c", code), stream="stdout"))


def test_a_program_that_does_not_end_in_time_is_run_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(targets, "SECONDS", (2, 60))

    assert run_program(emulated(SLOW_ONCE), tmp_path / "been") == ["spin 1"]


def test_one_that_never_ends_is_named_with_both_times(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(targets, "SECONDS", (0.1, 0.2))
    target = emulated("import time; time.sleep(60)")

    with pytest.raises(HungError, match=r"fk.elf on .* has not ended after 0.1 s, and not after 0.2 s"):
        run_program(target, tmp_path / "fk.elf")
    calls, stack, missing = cost._run(target, tmp_path / "fk.elf", 1)

    assert (calls, stack) == (None, 0)
    assert "has not ended after 0.1 s" in missing


def test_a_table_without_counts_says_why_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    entry = Cost(
        "cortex-m4f",
        "gcc 12",
        Quantity.POSE,
        "float",
        "-Os",
        1,
        2,
        3,
        None,
        "instructions",
        None,
        "there is no qemu",
    )

    assert reasons((entry, entry)) == ("no instructions: there is no qemu",)
    assert reasons((replace(entry, missing=""),)) == ()
    (*_, row, reason) = cost_lines(_Result((entry,)))  # type: ignore[arg-type]
    assert row.split()[-1] == "-"
    assert reason == "    no instructions: there is no qemu"


class _Result:
    """As much of a build's result as the table reads."""

    def __init__(self, costs: tuple[Cost, ...]) -> None:
        self.costs = costs
