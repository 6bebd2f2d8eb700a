"""An arm that keeps its tool upright: its orientation is singular at every pose, in some coordinates."""

from __future__ import annotations

from pathlib import Path

import pytest

from kinegen.model.outputs import parse_quantity
from tests.builds.workshop import ROBOTS, make


@pytest.mark.parametrize("outputs", ["euler_zyz,axis_angle", "euler_zyz_jacobian,axis_angle_jacobian"])
def test_its_kernels_are_proven(outputs: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Rounding of the reference decides how two of its angles share their sum, which says nothing of what depends."""
    monkeypatch.setattr("kinegen.driver.pipeline.can_measure", lambda: False)
    quantities = tuple(map(parse_quantity, outputs.split(",")))
    result = make(ROBOTS / "palletiser.yaml", tmp_path, quantities=quantities)

    assert result.proof.holds
    assert {comparison.quantity for comparison in result.proof.comparisons} == set(quantities)
