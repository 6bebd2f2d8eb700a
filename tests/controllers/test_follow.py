"""The inverse that follows a path: continuity through singularities, limits, targets out of reach."""

from __future__ import annotations

from copy import copy
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from kinegen.backends.controllers.controller import Controller
from kinegen.backends.controllers.machine import home_of, samples
from kinegen.backends.scalar_types import ScalarType
from kinegen.verify import reference
from tests.controllers.packages import Follower, kernels, write_package

ARMS = ("puma560", "ur5", "stanford", "scara4", "scara", "palletiser3", "cartesian", "puma560_mm")
FOLLOWED, OUT_OF_REACH, WOULD_LEAP = 1, 0, -1


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("follow")


@cache
def follower(place: Path, name: str) -> Follower:
    return Follower(write_package(place, name, Controller.LINUXCNC), name, ScalarType.DOUBLE)


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


@cache
def coupled(place: Path, real: ScalarType) -> Follower:
    """Two arms with actuators and runtime parameters, one in each number type."""
    name, controller = (
        ("coupled3", Controller.KLIPPER) if real is ScalarType.DOUBLE else ("splined4", Controller.GRBLHAL)
    )
    return Follower(write_package(place, name, controller), name, real, "chelper" if real is ScalarType.DOUBLE else "")


def test_readings_of_actuators_keep_their_limits_and_meet_them(place: Path) -> None:
    """Lift and lean reach their limits before the joints do; exactly there a target is followed."""
    it = coupled(place, ScalarType.DOUBLE)
    for lift, lean, result in [
        (128, 0, FOLLOWED),
        (128.001, 0, OUT_OF_REACH),
        (32, 0, FOLLOWED),
        (31.999, 0, OUT_OF_REACH),
        (90, -50, FOLLOWED),
        (70, 40, FOLLOWED),
        (70, 40.001, OUT_OF_REACH),
        (50, -70, FOLLOWED),
        (50, -70.001, OUT_OF_REACH),
    ]:
        q = np.radians([10, lift, lean - lift])
        assert it.follow(it.pose(q), q)[0] == result, (lift, lean)


def test_a_line_ends_at_the_limit_of_a_reading(place: Path) -> None:
    it = coupled(place, ScalarType.FLOAT)
    q, m2 = np.array([0.9, 2.5, 8.0, 0.3]), []
    for _ in range(400):
        q[0] += 0.001
        result, found = it.follow(it.pose(q), q)
        if result != FOLLOWED:
            break
        m2.append(-np.degrees(found[0] + found[1]))
    # The joints could go on; the second motor counts both.
    assert result == OUT_OF_REACH
    assert len(m2) > 30
    assert -200.001 < m2[-1] < -199.9


@pytest.mark.parametrize("real", list(ScalarType))
def test_runtime_parameters_are_an_argument_of_the_path_follower(real: ScalarType, place: Path) -> None:
    it = coupled(place, real)
    q = np.radians([10, 80, -100]) if real is ScalarType.DOUBLE else np.array([0.3, 0.7, 8.0, 0.2])
    usual = it.pose(q)
    other = copy(it)
    other.params = (it.params[0] + 30.0, it.params[1] - 5.0, *it.params[2:])
    longer = other.pose(q)

    assert np.linalg.norm((longer - usual)[:3, 3]) == pytest.approx(np.hypot(30, 5), rel=1e-5)
    result, found = other.follow(longer, q + 0.01)
    assert result == FOLLOWED
    np.testing.assert_allclose(found, q, atol=1e-7 if real is ScalarType.DOUBLE else 1e-3)
