"""Folded arms: the wrist's centre as near to axis 2 as the links let it, on targets that are off by their rounding."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from kinegen.derive.inverse.singular_configurations import boundaries
from kinegen.io.load import load
from kinegen.model.joint_bounds import joint_box
from kinegen.verify import reference
from tests.inverse.arms import Arm, Floats, arm_of, errors, evaluate
from tests.inverse.test_free_joints import arm_with

ROBOTS = Path(__file__).parents[2] / "robots"


@cache
def puma_with(forearm: float, depth: float = 0.15) -> Arm:
    """A PUMA without an offset of the elbow and without limits, its wrist's centre at a depth beside axis 1."""
    rows = ((0, 0, -90, 0), (depth, 0.4318, 0, 0), (0, 0, -90, 0), (forearm, 0, 90, 0), (0, 0, -90, 0), (0.1, 0, 0, 0))
    return arm_with(rows, (None,) * 6)


def folded(arm: Arm, count: int) -> Floats:
    """Random joint vectors of an arm with parallel axes 2 and 3, folded."""
    low, high = np.array(joint_box(arm.robot)).T
    q = np.random.default_rng(12).uniform(low, high, (count, arm.robot.dof))
    ((index, values),) = boundaries(arm.family)
    for value in values:
        q[:, index] = value
        apart = np.linalg.norm(reference.frames(arm.robot, q[:1])[arm.robot.rows[3].name][0, :3, 3])
        if apart < 0.2:
            return q
    raise AssertionError("not folded")


@pytest.mark.parametrize("kind", [np.float64, np.float32])
@pytest.mark.parametrize("apart", [1e-10, 1e-7, 2e-6, 1e-5, 1e-3])
def test_links_that_are_nearly_equal_reach_all_that_they_reach(apart: float, kind: type) -> None:
    """The wrist's centre is beside axis 1: its distance from axis 2 is a root, and is off by the root of rounding."""
    arm = puma_with(0.4318 * (1 + apart))
    q = folded(arm, 500)
    targets = reference.pose(arm.robot, q)[:, 0].astype(kind)
    solutions, valid = evaluate(arm, targets)

    assert (valid != 0).any(axis=1).all()
    worst = errors(arm, solutions.astype(float), targets.astype(float))[valid != 0].max()
    assert worst < (1e-12 if kind is np.float64 else 1.5e-5)


@pytest.mark.parametrize("kind", [np.float64, np.float32])
def test_a_stretched_arm_reaches_up_beside_the_axis_of_its_waist(kind: type) -> None:
    """With an offset of the waist its distance from axis 2 follows the root, and no elbow has room for that."""
    rows = ((0, 0.1, -90, 0), (0.1, 0.4, 0, 0), (0, 0, -90, 0), (0.4, 0, 90, 0), (0, 0, -90, 0), (0.1, 0, 0, 0))
    arm = arm_with(rows, (None,) * 6)
    generator = np.random.default_rng(14)
    q = generator.uniform(-3, 3, (3000, 6))
    away = generator.choice([-1, 1], len(q)) * 10.0 ** -generator.integers(2, 16, len(q))
    q[:, 1], q[:, 2] = generator.choice([-1, 1], len(q)) * (np.arccos(-0.1 / 0.8) + away), -np.pi / 2
    targets = reference.pose(arm.robot, q)[:, 0].astype(kind)
    solutions, valid = evaluate(arm, targets)

    assert (valid != 0).any(axis=1).all()
    worst = errors(arm, solutions.astype(float), targets.astype(float))[valid != 0].max()
    assert worst < (1e-12 if kind is np.float64 else 1.5e-5)


@pytest.mark.parametrize("apart", [2e-6, 1e-5])
def test_in_single_precision_a_point_comes_to_an_axis_that_nearly_equal_links_leave_free(apart: float) -> None:
    """Solutions were valid and not finite."""
    arm = puma_with(0.4318 * (1 + apart), 0.0)
    targets = reference.pose(arm.robot, folded(arm, 500))[:, 0].astype(np.float32)
    targets[0] = np.eye(4)
    targets[0, 2, 3] = 0.1
    solutions, valid = evaluate(arm, targets)

    assert (valid != 0).any(axis=1).all()
    assert np.isfinite(solutions[valid != 0]).all()
    assert errors(arm, solutions.astype(float), targets.astype(float))[valid != 0].max() < 2e-5


@pytest.mark.parametrize(("kind", "noise"), [(np.float64, 5e-14), (np.float32, 2e-7)])
def test_a_folded_puma_560_reaches_targets_that_are_off_by_their_rounding(kind: type, noise: float) -> None:
    """Two in five were out of reach: they were nearer to axis 2 than the arm folds, by what their position is off."""
    arm = arm_of(load(ROBOTS / "puma560.yaml"))
    q = folded(arm, 2000)
    targets = reference.pose(arm.robot, q)[:, 0]
    targets[:, :3, 3] += np.random.default_rng(13).uniform(-noise, noise, (len(q), 3))
    solutions, valid = evaluate(arm, targets.astype(kind))

    assert (valid != 0).any(axis=1).mean() > 0.999
    assert errors(arm, solutions.astype(float), targets)[valid != 0].max() < 10 * noise + 5e-15
