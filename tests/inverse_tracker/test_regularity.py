"""How regular the samples of a path are, by the columns of the Jacobian."""

from __future__ import annotations

import numpy as np
import pytest

from kinegen.io.load import loads
from kinegen.verify.tracker_paths import regularity

POLAR = loads(
    """
kinegen: 1
name: polar
convention: standard
units: {length: m, angle: deg}
joints:
  - {name: j1, theta: q, d: 0.4, a: 0, alpha: -90, limits: [-170, 170]}
  - {name: j2, theta: q, d: 0, a: 0, alpha: 90, limits: [-90, 90]}
  - {name: j3, theta: 0, d: q, a: 0, alpha: 0, limits: [0.2, 0.6]}
""",
    "polar.yaml",
)
"""Solved for the position of its tip, which joint 1 does not move where it is on axis 1."""


@pytest.mark.parametrize("tilt", [0.0, 1e-16, -1e-14, 1e-10])
def test_a_tip_on_axis_1_is_not_regular(tilt: float) -> None:
    assert regularity(POLAR, np.array([[0.3, tilt, 0.4]]))[0] == 0


@pytest.mark.parametrize("tilt", [1e-6, 0.5])
def test_a_tip_beside_it_is_regular(tilt: float) -> None:
    assert regularity(POLAR, np.array([[0.3, tilt, 0.4]]))[0] > 0.1
