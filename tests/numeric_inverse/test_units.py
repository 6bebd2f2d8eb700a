"""A robot file may be in m or in mm: the search goes the same way."""

from __future__ import annotations

from types import ModuleType
from typing import Any

import numpy as np
import pytest

from kinegen.model.outputs import NUMERIC_INVERSE, Quantity
from kinegen.runtime.extension import load_package
from kinegen.verify import numeric_inverse as proof
from tests.builds.workshop import make, set_machine, write_robot

CRANE = """\
kinegen: 1
name: {name}
convention: standard
units: {{length: {unit}, angle: deg}}
joints:
  - {{name: slew, theta: q, d: {tower}, a: 0, alpha: 90}}
  - {{name: boom, theta: q, d: 0, a: {boom}, alpha: 0, limits: [-10, 80]}}
  - {{name: jib, theta: q, d: 0, a: {tower}, alpha: 90, limits: [-150, 0]}}
  - {{name: tele, theta: 0, d: q, a: 0, alpha: 0, limits: [0, {tower}]}}
  - {{name: rot, theta: q, d: 0, a: 0, alpha: 0}}
"""
UNITS = {"m": 1, "mm": 1000}
COUNT = 200


@pytest.fixture(scope="module", params=["c", "numpy"])
def cranes(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> dict[str, ModuleType]:
    """The crane in both units, proven at a few targets."""
    folder, found = tmp_path_factory.mktemp("cranes"), {}
    with pytest.MonkeyPatch.context() as patch:
        set_machine(patch, folder / "cache")
        patch.setattr(proof, "TARGETS", 60)
        for unit, scale in UNITS.items():
            text = CRANE.format(name=f"crane_{unit}", unit=unit, tower=3 * scale, boom=6 * scale)
            path = write_robot(folder, text, f"crane_{unit}.yaml")
            quantities = (Quantity.POSE, NUMERIC_INVERSE)
            found[unit] = load_package(
                make(path, folder / unit, quantities=quantities, compile=request.param == "c").folder
            )
    return found


@pytest.mark.parametrize("real", [np.float64, np.float32])
def test_an_arm_with_a_slide_is_solved_alike_in_m_and_in_mm(real: type, cranes: dict[str, Any]) -> None:
    low, high = np.array([(-3.1, 3.1), (-0.15, 1.3), (-2.5, -0.1), (0.1, 2.9), (-3.1, 3.1)]).T
    drawn = np.random.default_rng(3).uniform(low, high, (2, COUNT, 5))
    found = {}
    for unit, scale in UNITS.items():
        q, start = drawn * [1, 1, 1, scale, 1]
        search = cranes[unit].numeric_inverse
        result = search(search.kernel(q)[0].astype(real), start, tolerances=(1e-4 * scale, 1e-4))
        found[scale] = (result.solved, result.iterations, result.q / [1, 1, 1, scale, 1])
    (solved, steps, q), (other_solved, other_steps, other_q) = found.values()
    alike = steps == other_steps

    assert solved.mean() > 0.99
    np.testing.assert_array_equal(solved, other_solved)
    assert alike.mean() > 0.95  # rounding sends a few descents another way
    np.testing.assert_allclose(q[alike], other_q[alike], atol=1e-2)
