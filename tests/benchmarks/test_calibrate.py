"""The calibration benchmark, on a few of its arms: what it promises for all of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from benchmarks.calibrate import HIGHEST, LOWEST, calibration


def test_parameters_are_found_as_well_as_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))

    found = [calibration(seed, tmp_path) for seed in range(3)]

    off = np.concatenate([each.off for each in found])
    chi_square = sum(each.chi_square for each in found) / sum(each.freedom for each in found)
    assert len(off) > 60
    assert np.abs(off).max() < 4
    assert np.mean(np.abs(off) < 3) > 0.97
    assert 0.75 < np.std(off) < 1.25
    assert LOWEST < chi_square < HIGHEST
    # Without noise nothing is left but what is far below the noise.
    assert max(each.residue for each in found) < 5e-6
