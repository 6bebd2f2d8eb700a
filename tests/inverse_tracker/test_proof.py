"""A build proves its tracker, in each number type and form; a wrong one cannot pass."""

from __future__ import annotations

from pathlib import Path

import pytest

from kinegen.backends.scalar_types import ScalarType
from kinegen.model.outputs import INVERSE_TRACKER
from kinegen.verify import inverse_tracker as proof
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


ARM = """\
kinegen: 1
name: tooled
convention: standard
units: {length: m, angle: deg}
parameters:
  tool_x: {value: 0.1, runtime: true}
  tool_z: {value: 0.1, runtime: true}
  tool_pitch: {value: 90, dimension: angle, runtime: true}
joints:
  - {name: waist,    d: 0.4, a: 0,   alpha: 90,  theta: q}
  - {name: shoulder, d: 0,   a: 0.4, alpha: 0,   theta: q}
  - {name: elbow,    d: 0,   a: 0,   alpha: 90,  theta: q}
  - {name: forearm,  d: 0.4, a: 0,   alpha: -90, theta: q}
  - {name: bend,     d: 0,   a: 0,   alpha: 90,  theta: q}
  - {name: turn,     d: 0.1, a: 0,   alpha: 0,   theta: q}
tool: {xyz: [tool_x, 0, tool_z], rpy: [0, tool_pitch, 0]}
"""


def test_joint_speeds_with_another_tool_are_held_to_the_reach_of_the_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The tool is a runtime parameter; what lengths count beside angles is a constant of the kernels."""
    monkeypatch.setattr(proof, "FEWER", 1)
    (tmp_path / "tooled.yaml").write_text(ARM)
    options = {"quantities": (INVERSE_TRACKER,), "reals": (ScalarType.DOUBLE,), "compile": False}

    built = make(tmp_path / "tooled.yaml", tmp_path, **options).proof

    found = [each for each in built.comparisons if each.quantity == INVERSE_TRACKER]
    assert [each.target for each in found] == [
        "NumPy double, along paths",
        "NumPy double, along paths, other parameters",
    ]
