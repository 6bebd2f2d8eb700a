"""The inverse that follows a path: continuity through singularities, limits, targets out of reach."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from kinegen import reference
from kinegen.emit.controllers.controller import Controller
from kinegen.emit.controllers.home import home_of, samples
from kinegen.emit.reals import Real
from tests.controllers.packages import Follower, kernels, write_package

ARMS = ("puma560", "ur5", "stanford", "scara4", "scara", "palletiser3", "cartesian", "puma560_mm")
FOLLOWED, OUT_OF_REACH, WOULD_LEAP = 1, 0, -1


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("follow")


@cache
def follower(place: Path, name: str) -> Follower:
    return Follower(write_package(place, name, Controller.LINUXCNC), name, Real.DOUBLE)


@cache
def size(name: str) -> float:
    """Half the distance of home from the base, in the file's length unit."""
    arm = kernels(name).robot
    return float(np.linalg.norm(reference.pose(arm, [home_of(arm)])[0, 0, :3, 3])) / 2


def moved(pose: NDArray[np.float64], step: NDArray[np.float64]) -> NDArray[np.float64]:
    other = pose.copy()
    other[:3, 3] += step
    return other


@pytest.mark.parametrize("name", ARMS)
def test_it_finds_the_joints_that_a_pose_is_from(name: str, place: Path) -> None:
    it = follower(place, name)
    for sample in samples(kernels(name).robot, 300):
        q = np.asarray(sample) + 0.013  # beside the grid, on which singularities are
        result, found = it.follow(it.pose(q), q + 1e-4)

        assert result == FOLLOWED
        np.testing.assert_allclose(found, q, atol=1e-7 * max(1, size(name)))


@pytest.mark.parametrize(("name", "singular"), [("puma560", 4), ("puma560_mm", 4), ("ur5", 4), ("stanford", 4)])
@pytest.mark.parametrize("seed", range(4))
def test_a_line_through_the_wrist_singularity_turns_no_joint_quickly(
    name: str, singular: int, seed: int, place: Path
) -> None:
    """2,001 steps, the middle one exactly at the singularity: each joint moves as smoothly as elsewhere."""
    it, rng = follower(place, name), np.random.default_rng(seed)
    q = np.array(home_of(kernels(name).robot)) + rng.uniform(-0.2, 0.2, 6)
    q[singular] = 0.0
    middle = it.pose(q)
    direction = rng.normal(size=3)
    direction *= 0.02 * size(name) / np.linalg.norm(direction)

    result, present = it.follow(moved(middle, direction), q + 0.3)
    assert result == FOLLOWED
    largest = 0.0
    for along in np.concatenate([np.arange(500, -501, -1), np.arange(-500, 501)]) / 500:
        target = moved(middle, along * direction)
        result, found = it.follow(target, present)
        assert result == FOLLOWED
        assert np.abs(it.pose(found) - target).max() < 4e-6 * max(1, size(name))
        largest = max(largest, float(np.abs(found - present).max()))
        present = found

    assert largest < 2e-3


@pytest.mark.parametrize("name", ["puma560", "ur5"])
def test_a_move_that_stays_aligned_keeps_what_the_target_leaves_open(name: str, place: Path) -> None:
    """The wrist stays in line along the whole path, and joints 4 and 6 stay where they were, not at 0."""
    it = follower(place, name)
    start = np.radians([20, -60, 70, 35, 0, 25])
    q = start
    for step in range(1, 400):
        goal = start + np.radians([step / 20, 0, 0, 0, 0, 0])
        result, found = it.follow(it.pose(goal), q)
        assert result == FOLLOWED
        assert np.abs(found - q).max() < 2e-3
        q = found
    np.testing.assert_allclose(q, goal, atol=1e-3)


@pytest.mark.parametrize("seed", range(6))
def test_the_waist_keeps_its_angle_where_the_wrist_is_above_it(seed: int, place: Path) -> None:
    """The wrist's centre of an arm without an offset passes through axis 1."""
    it = follower(place, "palletiser_straight")
    rng = np.random.default_rng(seed)
    q = np.array([rng.uniform(-1, 1), np.radians(60.0), np.radians(60.0)])
    middle = it.pose(q)
    outwards = np.array([np.cos(q[0]), np.sin(q[0]), 0.0]) * 20
    assert np.abs(middle[:2, 3]).max() < 1e-9
    last = None
    for along in np.arange(500, -501, -1) / 500:
        result, found = it.follow(moved(middle, along * outwards), q if last is None else last)
        assert result == FOLLOWED
        if last is not None:
            assert np.abs(found - last).max() < 1e-3
        last = found


@pytest.mark.parametrize("name", ARMS)
def test_targets_out_of_reach_are_refused(name: str, place: Path) -> None:
    it = follower(place, name)
    for q in samples(kernels(name).robot, 20):
        far = moved(it.pose(q), np.full(3, 1e4 * size(name)))
        assert it.follow(far, q)[0] == OUT_OF_REACH or name == "cartesian"  # which has no limits
        bad = it.pose(q)
        bad[0, 3] = np.nan
        assert it.follow(bad, q)[0] == OUT_OF_REACH


def test_a_straight_move_into_a_limit_ends_there_and_takes_no_other_branch(place: Path) -> None:
    """The PUMA's waist reaches 160 degrees; behind it the other shoulder could go on, half a turn away."""
    it = follower(place, "puma560")
    q = np.radians([158.0, -40, 70, 20, 40, 10])
    results = []
    for step in range(400):
        goal = np.radians([158.0 + step / 100, -40, 70, 20, 40, 10])
        result, found = it.follow(it.pose(goal), q)
        results.append(result)
        if result != FOLLOWED:
            break
        assert np.abs(found - q).max() < 1e-3
        q = found

    assert results[-1] in (WOULD_LEAP, OUT_OF_REACH)
    assert 195 <= len(results) <= 205


def test_a_far_target_takes_the_nearest_branch(place: Path) -> None:
    it = follower(place, "puma560")
    goal = np.radians([100.0, -100, 30, 60, 40, 10])

    result, found = it.follow(it.pose(goal), np.radians([80.0, -80, 40, 50, 30, 10]))

    assert result == FOLLOWED
    np.testing.assert_allclose(found, goal, atol=1e-9)
