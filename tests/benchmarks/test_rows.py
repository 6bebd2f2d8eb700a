"""The table of build times against the number of rows."""

from __future__ import annotations

import pytest

from benchmarks.rows import ALL, SIZES, arm, stage_times, table
from kinegen.io.load import loads


@pytest.mark.parametrize("rows", SIZES)
def test_the_arms_load_and_have_so_many_joints(rows: int) -> None:
    robot = loads(arm(rows), "made.yaml")

    assert robot.dof == rows


def test_every_stage_has_its_processor_time_and_its_column() -> None:
    times = stage_times(1, "position")
    lines = list(table("position", (1, 2), lambda rows, _: times | {"all": rows * times["all"]}))

    assert {"load", "derive", "lower", "emit", "prove", "write", "all", "wait"} <= set(times)
    assert sum(seconds for name, seconds in times.items() if name not in ALL) <= times["all"]
    assert times["wait"] > 0
    assert [line.split()[0] for line in lines[1:]] == ["1", "2"]
    assert len(lines[1].split()) == len(lines[0].split()) - 1
    assert lines[2].split()[-2] == f"{2 * times['all']:.2f}"
