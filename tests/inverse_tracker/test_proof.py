"""A build proves its tracker, in each number type and form; a wrong one cannot pass."""

from __future__ import annotations

from pathlib import Path

import pytest

from kinegen.outputs import INVERSE_TRACKER
from kinegen.verify import tracker as proof
from tests.builds.workshop import ROBOTS, make, set_machine


@pytest.mark.parametrize(
    "name",
    [
        "puma560",
        *(
            pytest.param(name, marks=pytest.mark.long)
            for name in ("ur5", "stanford", "al5d", "puma560_mm", "planar_3r")
        ),
    ],
)
def test_both_ways_are_proven_and_the_count_is_told(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(proof, "LINES", 12)
    monkeypatch.setattr(proof, "FEWER", 3)
    set_machine(monkeypatch, tmp_path / "cache")
    built, again = (make(ROBOTS / f"{name}.yaml", tmp_path, quantities=(INVERSE_TRACKER,)).proof for _ in range(2))
    found = [comparison for comparison in built.comparisons if comparison.quantity == INVERSE_TRACKER]

    assert [each.target for each in found] == [
        *("C double, along paths", "NumPy double, along paths", "C float, along paths", "NumPy float, along paths"),
    ]
    assert all(each.poses > 0 for each in found)
    assert any(line.startswith("inverse tracker: ") for line in built.counts)
    assert again == built
