"""The doctor names what was planted: a small sample of what `benchmarks/doctor.py` measures."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.doctor import MISTAKES, cases, is_right, observed_by, random_arm
from kinegen.tools.doctor.diagnosis import Verdict, examine


@pytest.mark.parametrize("seed", [11, *(pytest.param(seed, marks=pytest.mark.long) for seed in (12, 13))])
def test_the_first_explanation_is_the_right_robot(seed: int) -> None:
    for wrong, found, first, among, _ in cases(6, seed):
        assert first or (found.verdict is Verdict.AMBIGUOUS and among), wrong.planted


@pytest.mark.long
@pytest.mark.parametrize("name", MISTAKES)
def test_each_mistake_is_named_where_it_has_an_effect(name: str) -> None:
    rng = np.random.default_rng(21)
    effective = 0
    while effective < 2:
        arm = random_arm(rng)
        wrong = MISTAKES[name](arm, rng)
        observed = observed_by(arm, wrong, rng)
        found = examine(wrong.text(), "arm.yaml", observed, "tool")
        if not found.start.fits:
            effective += 1
            assert is_right(found.findings[0], arm, wrong)


def test_the_judge_of_the_benchmark_refuses_a_wrong_robot() -> None:
    """A judge that says yes to everything would make the figures worthless."""
    rng = np.random.default_rng(5)
    arm = random_arm(rng)
    wrong = MISTAKES["sign of a"](arm, rng)
    while wrong == arm:
        wrong = MISTAKES["sign of a"](arm, rng)
    observed = observed_by(arm, wrong, rng)
    found = examine(wrong.text(), "arm.yaml", observed, "tool", most=1)
    other = MISTAKES["direction of a joint"](arm, rng)

    assert is_right(found.findings[0], arm, wrong)
    assert not is_right(found.findings[0], other, wrong)
