"""Single precision keeps the solutions of double: joints at their limits, arms stretched and folded."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from kinegen.derive.inverse.derive import family_of
from kinegen.derive.inverse.singular_configurations import boundaries
from kinegen.derive.inverse.tolerances import thresholds_of
from kinegen.io.load import load
from kinegen.model.joint_bounds import joint_box, reach
from kinegen.verify import reference
from tests.inverse.arms import Arm, Floats, arm_of, distances, errors, evaluate

ROBOTS = Path(__file__).parents[2] / "robots"


@cache
def arm(name: str) -> Arm:
    return arm_of(load(ROBOTS / f"{name}.yaml"))


def inside(name: str, count: int) -> Floats:
    """Joint vectors well within the limits."""
    low, high = np.array(joint_box(arm(name).robot)).T
    middle, half = (low + high) / 2, (high - low) / 2
    return np.random.default_rng(7).uniform(middle - 0.9 * half, middle + 0.9 * half, (count, len(low)))


@pytest.mark.parametrize("name", ["puma560", "kr5", "tx60"])
def test_a_joint_exactly_at_its_limit_is_kept(name: str) -> None:
    box = joint_box(arm(name).robot)
    for index in range(arm(name).robot.dof):
        for limit in box[index]:
            q = inside(name, 400)
            q[:, index] = limit
            solutions, valid = evaluate(arm(name), reference.pose(arm(name).robot, q)[:, 0].astype(np.float32))
            own = ((distances(arm(name), solutions, q) < 1e-2) & (valid != 0)).any(axis=1)

            assert (valid != 0).any(axis=1).all()
            assert own.mean() > 0.99


@pytest.mark.parametrize("name", ["puma560", "kr5", "tx60", "ur5", "scara", "al5d", "motoman_l3", "planar_3r"])
@pytest.mark.parametrize("bend", [0.0, 1e-6, 1e-4, 1e-3])
def test_the_stretched_and_the_folded_arm_have_solutions(name: str, bend: float) -> None:
    for index, values in boundaries(arm(name).family):
        for value in values:
            q = inside(name, 1000)
            q[:, index] = value + bend
            low, high = joint_box(arm(name).robot)[index]
            if not low < value + bend < high:
                continue
            poses = reference.pose(arm(name).robot, q)[:, 0]
            solutions, valid = evaluate(arm(name), poses.astype(np.float32))

            assert (valid != 0).any(axis=1).all()
            assert errors(arm(name), solutions.astype(float), poses)[valid != 0].max() < 3e-5 * max(
                1.0, reach(arm(name).robot)
            )


def test_thresholds_follow_the_arm_and_the_number_type() -> None:
    family = family_of(arm("puma560").robot)
    near, far = (thresholds_of(family, length) for length in (1.0, 3.0))

    assert near.condition < far.condition
    assert float(near.within.subs(dict.fromkeys(near.within.free_symbols, 0))) < 2e-7
    assert 1e-3 < float(near.within.subs(dict.fromkeys(near.within.free_symbols, 1))) < 5e-3
