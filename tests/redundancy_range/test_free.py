"""Redundancies without limits, and with several turns: the proof takes them, and nearest is nearest."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from kinegen.backends.redundancy_range import SAMPLES, samples_of
from kinegen.backends.scalar_types import ScalarType
from kinegen.derive.inverse.derive import branches_of, family_of
from kinegen.errors import ProofError
from kinegen.io.load import loads
from kinegen.model.outputs import REDUNDANCY_RANGE, Quantity
from kinegen.runtime.extension import load_package
from kinegen.runtime.vendored import _range_search, _redundancy_range
from kinegen.verify import proof, redundancy_range
from tests.builds.workshop import make, set_machine, write_robot

SPINDLE = """\
kinegen: 1
name: spindle_arm
convention: standard
units: {length: m, angle: deg}
joints:
  - {name: a1, theta: q, d: 0.4, a: 0.025, alpha: -90, limits: [-170, 170]}
  - {name: a2, theta: q, d: 0,   a: 0.455, alpha: 0,   limits: [-190, 45]}
  - {name: a3, theta: q, d: 0,   a: 0.025, alpha: -90, limits: [-210, 66]}
  - {name: a4, theta: q, d: 0.42, a: 0,    alpha: 90,  limits: [-185, 185]}
  - {name: a5, theta: q, d: 0,   a: 0,     alpha: -90, limits: [-120, 120]}
  - {name: a6, theta: q, d: 0.09, a: 0,    alpha: 0,   limits: [-350, 350]}
  - {name: spin, ets: [Tx(0.11), Tz(0.06), Ry(35), Rz(q)]}
redundancy: spin
"""
"""An arm with a spindle whose angle is given, and turns without end."""


def test_a_spindle_without_limits_is_proven_and_the_nearest_solution_is_the_nearest(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Distances have steps where a whole turn of joint 6 comes within its limits; a minimum is beside one."""
    set_machine(monkeypatch, tmp_path / "cache")
    monkeypatch.setattr(proof, "_solve", lambda *_: ([], ""))
    monkeypatch.setattr(redundancy_range, "TARGETS", 40)
    monkeypatch.setattr(redundancy_range, "FEWEST", 1)
    path = write_robot(tmp_path, SPINDLE)
    built = make(path, tmp_path, quantities=(Quantity.POSE, REDUNDANCY_RANGE), reals=(ScalarType.DOUBLE,))

    assert built.proof.holds
    arm = load_package(built.folder)
    q = np.random.default_rng(9).uniform(-1, 1, (2, 40, 7)) * np.radians([160, 45, 60, 180, 110, 340, 180])
    found, exists = arm.inverse(arm.fk(q[0]), nearest=q[1])
    values = np.linspace(-np.pi, np.pi, 400)
    assert exists.all()
    for target, near, own in zip(arm.fk(q[0]), q[1], found, strict=True):
        others, valid = arm.inverse(np.broadcast_to(target, (400, 4, 4)), values, nearest=near)
        least = ((others[valid] - near) ** 2).sum(axis=1).min()
        assert ((own - near) ** 2).sum() <= least * (1 + 1e-9)


@pytest.mark.parametrize(
    ("limits", "motion", "values"),
    [
        ("", "q", [-3.0, 0.5]),
        ("", "2*q", [-1.5, 0.5]),
        ("", "0.5*q", [6.0, 0.5]),
        (", limits: [-400, 400]", "q", [-6.0, 6.0]),
    ],
)
def test_only_a_redundancy_without_limits_is_brought_into_one_turn(
    limits: str, motion: str, values: list[float]
) -> None:
    text = SPINDLE.replace("Rz(q)]", f"Rz({motion})]{limits}")
    robot = loads(text, "arm.yaml")
    trial = redundancy_range._Trial(robot, "C double", SimpleNamespace(), "double")
    low, high = trial._span()
    turned = np.array(values) + (0 if limits else trial._turn())

    np.testing.assert_allclose(trial._unwound(turned), values, atol=1e-12)
    assert low <= min(values)
    assert max(values) <= high


@pytest.mark.parametrize(
    ("limits", "count"), [("", SAMPLES), (", limits: [-10, 10]", SAMPLES), (", limits: [-480, 450]", 43)]
)
def test_every_turn_of_a_range_has_as_many_samples(limits: str, count: int) -> None:
    robot = loads(SPINDLE.replace("Rz(q)]", f"Rz(q)]{limits}"), "arm.yaml")

    assert samples_of(robot, branches_of(robot, family_of(robot)), ScalarType.DOUBLE) == count


@pytest.mark.parametrize(
    ("values", "wanted"),
    [
        ("0000000000", []),
        ("1111111111", [(0, 9)]),
        ("0110000110", [(1, 2), (7, 8)]),
        ("0110110110", [(1, 8)]),
        ("1010100000", [(0, 4)]),
        ("0000000001", [(9, 9)]),
    ],
)
def test_intervals_that_rounding_parts_are_one(values: str, wanted: list[tuple[int, int]]) -> None:
    """Where a joint touches its limit, gaps of rounding took up the intervals that there is room for."""
    at = np.arange(10.0)
    valid = np.array([[each == "1"] * 8 for each in values])
    limits = SimpleNamespace(given=6, gap=2.5)
    found = object.__new__(_redundancy_range.RedundancyRange)
    found.inverse, found.kernel, found.branches, found.most = None, None, 8, 16
    found._search, found._limits = (), {np.dtype(float): limits}
    intervals, counts = np.zeros((8, 16, 2)), np.zeros(8, np.uint8)
    stretches = _range_search.Stretches(slice(None), at, at, valid)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(_redundancy_range, "on_line", lambda *_: stretches)
        found._in_numpy(np.eye(4), intervals, counts)

    assert counts.tolist() == [len(wanted)] * 8
    assert [tuple(each) for each in intervals[3, : counts[3]]] == wanted


@pytest.mark.parametrize("gap", [1e-7, 1e-3, 1e-2])
def test_the_middle_of_an_interval_may_be_in_a_gap_too_narrow_to_be_found(gap: float) -> None:
    robot = loads(SPINDLE, "arm.yaml")
    intervals, counts = np.full((1, 8, 16, 2), np.nan, np.float32), np.zeros((1, 8), int)
    intervals[0, 0, 0], counts[0, 0] = (0.1, 0.5), 1

    class Found:
        def __call__(self, _: object) -> tuple[object, object]:
            return intervals, counts

        def inverse(self, _: object, values: Any) -> tuple[None, Any]:
            return None, np.repeat(np.abs(values - 0.3)[:, None] > gap, 8, axis=1)

    trial = redundancy_range._Trial(robot, "C float", Found(), "float")
    if gap < 5e-3:
        trial._require_middles(np.eye(4)[None], "singular")
        return
    with pytest.raises(ProofError, match="in whose middle the inverse is not valid"):
        trial._require_middles(np.eye(4)[None], "singular")
