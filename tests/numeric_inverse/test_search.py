"""The numeric inverse finds joint values of reachable poses, within limits, the same in every way it is called."""

from __future__ import annotations

import pickle
import re
from collections.abc import Callable
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from kinegen.io.load import load
from kinegen.verify import reference
from tests.builds.workshop import ROBOTS

Floats = NDArray[np.float64]
Packages = Callable[[str, str], ModuleType]
ARMS = ("iiwa14", "ur5", *(pytest.param(name, marks=pytest.mark.long) for name in ("panda", "stanford")))
"""Seven joints; six with three parallel axes; seven with narrow limits; a prismatic joint."""


def ranges(package: ModuleType) -> Floats:
    return np.array([limits or (-np.pi, np.pi) for limits in package.LIMITS])


def reachable(name: str, package: ModuleType, count: int, seed: int = 7) -> tuple[Floats, Floats]:
    """Poses of random joint vectors, by the reference, and other random joint vectors to start from."""
    low, high = ranges(package).T
    generator = np.random.default_rng(seed)
    q, start = generator.uniform(low, high, (2, count, package.DOF))
    return reference.pose(load(ROBOTS / f"{name}.yaml"), q)[:, 0], start


@pytest.mark.parametrize("name", ARMS)
def test_reachable_poses_are_found_within_the_limits(name: str, package: Packages) -> None:
    arm = package(name, "c")
    targets, start = reachable(name, arm, 800)
    found = arm.numeric_inverse(targets, start)
    low, high = ranges(arm).T
    poses = reference.pose(load(ROBOTS / f"{name}.yaml"), found.q)[:, 0]

    assert found.solved.mean() > 0.99
    assert (found.q >= low).all() or name == "stanford"
    assert (found.q <= high).all() or name == "stanford"
    assert np.abs(poses - targets)[found.solved].max() < 3e-9
    assert (found.position_error[found.solved] < 2e-9).all()
    assert (found.rotation_error[found.solved] <= 1e-9).all()
    assert found.iterations.min() >= 1


def test_the_numpy_form_finds_as_much(package: Packages) -> None:
    arm = package("iiwa14", "numpy")
    targets, start = reachable("iiwa14", arm, 200)
    found = arm.numeric_inverse(targets, start)

    assert arm.numeric_inverse.backend == "numpy"
    assert found.solved.mean() > 0.99
    assert np.abs(arm.fk(found.q) - targets)[found.solved].max() < 3e-9


def test_errors_that_are_reported_are_those_of_the_joint_values(package: Packages) -> None:
    """Also where no solution exists: the nearest is given, and says how near it is."""
    arm = package("iiwa14", "c")
    targets, start = reachable("iiwa14", arm, 20)
    targets[:10, :3, 3] *= 3
    found = arm.numeric_inverse(targets, start, restarts=2)
    poses = arm.fk(found.q)
    way = np.linalg.norm(poses[:, :3, 3] - targets[:, :3, 3], axis=1)
    traces = np.trace(targets[:, :3, :3] @ poses[:, :3, :3].swapaxes(1, 2), axis1=1, axis2=2)

    assert not found.solved[:10].any()
    np.testing.assert_allclose(found.position_error, way, atol=1e-12)
    np.testing.assert_allclose(found.rotation_error, np.arccos(np.clip((traces - 1) / 2, -1, 1)), atol=1e-7)


def test_a_start_at_the_solution_stays_there(package: Packages) -> None:
    arm = package("ur5", "c")
    q = np.array([0.3, -1.0, 0.8, -0.4, 1.1, 0.2])
    found = arm.numeric_inverse(arm.fk(q), q)

    assert found.solved
    assert found.iterations == 1
    np.testing.assert_array_equal(found.q, q)


def test_equal_calls_give_equal_bits_for_any_threads_and_place_in_a_batch(package: Packages) -> None:
    arm = package("panda", "c")
    targets, start = reachable("panda", arm, 2500)
    once = arm.numeric_inverse(targets, start)

    np.testing.assert_array_equal(arm.numeric_inverse(targets, start, threads=3).q, once.q)
    np.testing.assert_array_equal(arm.numeric_inverse(targets[:100], start[:100]).q, once.q[:100])
    assert (arm.numeric_inverse(targets, start, seed=2).q != once.q).any()


def test_single_precision_stays_in_single_precision(package: Packages) -> None:
    arm = package("iiwa14", "c")
    targets, start = reachable("iiwa14", arm, 300)
    found = arm.numeric_inverse(targets.astype(np.float32), start)

    assert found.q.dtype == found.position_error.dtype == np.float32
    assert found.solved.mean() > 0.99
    assert np.abs(arm.fk(found.q.astype(float)) - targets)[found.solved].max() < 5e-5


def test_axes_of_the_batch_are_kept_and_starts_broadcast(package: Packages) -> None:
    arm = package("ur5", "c")
    targets, start = reachable("ur5", arm, 6)
    found = arm.numeric_inverse(targets.reshape(2, 3, 4, 4), start[0])

    assert found.q.shape == (2, 3, 6)
    assert found.solved.shape == found.iterations.shape == (2, 3)
    assert arm.numeric_inverse(targets[0]).q.shape == (6,)
    assert arm.numeric_inverse(targets[:0]).q.shape == (0, 6)
    assert pickle.loads(pickle.dumps(arm.numeric_inverse)) is arm.numeric_inverse  # noqa: S301 - our own


TURN = np.diag([-1.0, -1.0, 1.0, 1.0])
NOT_FINITE = np.eye(4)
NOT_FINITE = np.where(NOT_FINITE == 1, np.nan, NOT_FINITE)


@pytest.mark.parametrize(
    ("target", "message"),
    [
        (np.eye(3), "base_T_tool has shape (3, 3), expected (..., 4, 4)"),
        (NOT_FINITE, "base_T_tool has entries that are not finite"),
        (np.diag([1.0, 1.0, -1.0, 1.0]), "base_T_tool holds a reflection"),
        (np.diag([1.0, 2.0, 1.0, 1.0]), "base_T_tool has a rotation whose columns are not orthonormal"),
        (np.diag([1.0, 1.0, 1.0, 2.0]), "base_T_tool has a last row other than 0 0 0 1"),
        (np.stack([TURN, np.diag([1.0, 0.5, 1.0, 1.0])]), "base_T_tool[1] has a rotation"),
    ],
)
def test_what_is_no_pose_is_refused(target: Any, message: str, package: Packages) -> None:
    with pytest.raises(ValueError, match=re.escape(f"numeric_inverse: {message}")):
        package("ur5", "c").numeric_inverse(target)


@pytest.mark.parametrize("start", [np.zeros(5), np.zeros((4, 6))])
def test_starts_that_do_not_fit_are_refused(start: Floats, package: Packages) -> None:
    with pytest.raises(ValueError, match=r"numeric_inverse: start (has|of) shape"):
        package("ur5", "c").numeric_inverse(np.stack([TURN] * 3), start)
