"""The numeric inverse of trees: targets of all tips, weights, parts that are free, groups of tips."""

from __future__ import annotations

import re
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from kinegen.backends.solver_parameters import tips_of
from kinegen.io.load import load
from kinegen.model.joint_bounds import joint_box
from kinegen.model.robot import JointType, Robot
from kinegen.verify import reference
from kinegen.verify.numeric_inverse_batches import tip_errors
from tests.numeric_inverse.conftest import Packages, robot_file

Floats = NDArray[np.float64]
BACKENDS = pytest.mark.parametrize("backend", ["c", "numpy"])
TREES = pytest.mark.parametrize("name", ["hand", "two_arms"])
COUNT = {"c": 300, "numpy": 40}
POINTS = (1.0, 0.0)


def reachable(name: str, count: int) -> tuple[Floats, Floats]:
    """Poses of all tips at random joint vectors, and other random joint vectors to start from."""
    robot = load(robot_file(name))
    low, high = np.array(joint_box(robot)).T
    q, start = np.random.default_rng(7).uniform(low, high, (2, count, robot.dof))
    return reference.pose(robot, q), start


def made(package: Packages, name: str, backend: str) -> tuple[ModuleType, Floats, Floats]:
    return package(name, backend), *reachable(name, COUNT[backend])


@TREES
@BACKENDS
def test_poses_of_all_tips_are_found(name: str, backend: str, package: Packages) -> None:
    tree, targets, start = made(package, name, backend)
    found = tree.numeric_inverse(targets, start)
    robot, tips = load(robot_file(name)), len(tree.TIPS)
    errors = tip_errors(robot, found.q, targets)
    most = np.array(tree.numeric_inverse.tolerances[0])[:, None] * 1.01

    assert tree.numeric_inverse.backend == backend
    assert found.q.shape == (len(targets), tree.DOF)
    assert found.position_error.shape == found.rotation_error.shape == (len(targets), tips)
    assert found.solved.mean() > 0.98
    assert (errors[found.solved] < most).all()
    np.testing.assert_allclose(found.position_error, errors[:, 0], atol=1e-6 * most[0, 0] * 1e6)
    np.testing.assert_allclose(found.rotation_error, errors[:, 1], atol=1e-9)
    assert (found.iterations >= 1).all()
    assert tree.within_limits(found.q).all()


@TREES
@BACKENDS
def test_what_is_free_may_be_anything(name: str, backend: str, package: Packages) -> None:
    tree, targets, start = made(package, name, backend)
    weights = [POINTS] * len(tree.TIPS)
    usual = tree.numeric_inverse(targets, start, weights=weights)
    targets[..., :3, :3] = np.nan
    targets[..., 3, :] = 0
    found = tree.numeric_inverse(targets, start, weights=weights)

    assert usual.solved.all()
    assert not usual.rotation_error.any()
    for got, wanted in zip(found, usual, strict=True):
        np.testing.assert_array_equal(got, wanted)


@BACKENDS
def test_a_tip_that_is_free_leaves_the_others_alone(backend: str, package: Packages) -> None:
    """One hand works and the other one is anywhere."""
    tree, targets, start = made(package, "two_arms", backend)
    targets[:, 1, :3, 3] = 1e6
    found = tree.numeric_inverse(targets, start, weights=[1, 0])

    assert found.solved.mean() > 0.98
    assert not found.position_error[:, 1].any()
    assert not tree.numeric_inverse(targets[:5], start[:5], restarts=1).solved.any()


@TREES
@BACKENDS
def test_a_step_is_that_of_weighted_damped_least_squares(name: str, backend: str, package: Packages) -> None:
    """Near the middle of all ranges, where no joint is slowed down; each group of tips by itself."""
    tree, robot = package(name, backend), load(robot_file(name))
    low, high = np.array(joint_box(robot)).T
    start = (low + high) / 2
    goal = start + np.random.default_rng(5).uniform(-0.02, 0.02, tree.DOF) * (high - low)
    weights = np.array([(1, 0.5), (0.25, 2), (3, 1), (1, 0), (0, 1)])[: len(tree.TIPS)]
    found = tree.numeric_inverse(tree.fk(goal), start, weights=weights, restarts=0, steps=2, tolerances=(0, 0))

    assert found.iterations == 2
    np.testing.assert_allclose(found.q, start + one_step(tree, robot, start, goal, weights), rtol=0, atol=1e-8)


def one_step(tree: ModuleType, robot: Robot, start: Floats, goal: Floats, weights: Floats) -> Floats:
    """J^T (J J^T + l I)^-1 e for each group, with rows weighted and joints counted in their strides."""
    size, tips = tree.numeric_inverse.reach, tips_of(robot)
    pose, jacobian = tree.fk_jacobian(start)
    between = tree.fk(goal)[:, :3, :3] @ pose[:, :3, :3].swapaxes(1, 2)
    skew = (between - between.swapaxes(1, 2))[:, [2, 0, 1], [1, 2, 0]]
    sines = np.linalg.norm(skew, axis=1) / 2
    turned = skew / 2 * (np.arcsin(sines) / sines)[:, None]
    rows = np.repeat(weights, 3, axis=1) * ([3 / size] * 3 + [1] * 3)
    e = np.concatenate([tree.fk(goal)[:, :3, 3] - pose[:, :3, 3], turned], axis=1) * rows
    strides = [size / 3 if each.type is JointType.PRISMATIC else 1.0 for each in robot.variables]
    columns, moves = jacobian * rows[..., None] * strides, np.zeros(tree.DOF)
    for group in range(tips.groups):
        own = np.flatnonzero(np.array(tips.tip_groups) == group)
        matrix, error = columns[own].reshape(-1, tree.DOF), e[own].ravel()
        damped = matrix @ matrix.T + (0.1 * error @ error + 1e-12) * np.eye(len(error))
        moves += matrix.T @ np.linalg.solve(damped, error) * strides
    return moves


@BACKENDS
def test_tips_without_common_joints_do_not_disturb_each_other(backend: str, package: Packages) -> None:
    """Four fingers reach their targets although the thumb has one that it cannot reach."""
    tree, targets, start = made(package, "hand", backend)
    targets[:, 0, :3, 3] += 1000
    found = tree.numeric_inverse(targets, start, restarts=4)

    assert not found.solved.any()
    assert (found.position_error[:, 1:] < 1e-6).mean() > 0.98
    assert (found.position_error[:, 0] > 100).all()


@BACKENDS
def test_results_take_the_axes_and_the_type_of_the_targets(backend: str, package: Packages) -> None:
    tree, targets, start = made(package, "hand", backend)
    single = tree.numeric_inverse(targets[:6].reshape(2, 3, 5, 4, 4).astype(np.float32), start[0])
    alone = tree.numeric_inverse(targets[0], start[0])

    assert single.q.dtype == single.position_error.dtype == np.float32
    assert single.q.shape == (2, 3, 17)
    assert single.position_error.shape == (2, 3, 5)
    assert alone.solved.shape == alone.iterations.shape == ()
    assert alone.rotation_error.shape == (5,)
    assert tree.numeric_inverse(targets[:0]).position_error.shape == (0, 5)
    assert np.array_equal(tree.numeric_inverse(targets[0], q0=start[0]).q, tree.numeric_inverse(targets[0], start[0]).q)
    assert repr(tree.numeric_inverse).endswith(f"base_T_tips (5, 4, 4), start (17,) to (17,), backend {backend}>")


@BACKENDS
def test_out_and_bind_fill_the_arrays_that_they_are_given(backend: str, package: Packages) -> None:
    tree, targets, start = made(package, "two_arms", backend)
    targets, start = targets[:4], start[:4]
    usual = tree.numeric_inverse(targets, start, weights=[1, 2])
    out = type(usual)(*(np.empty_like(np.asarray(entry)) for entry in usual))
    tree.numeric_inverse.bind(targets, start, *out, weights=[1, 2])()

    for given, entry in zip(out, usual, strict=True):
        np.testing.assert_array_equal(given, entry)
    with pytest.raises(TypeError, match=r"bind takes 7 arrays \(base_T_tips, start, q"):
        tree.numeric_inverse.bind(targets, start)
    with pytest.raises(ValueError, match="out for q shares memory with start"):
        tree.numeric_inverse(targets, out.q, out=out)


@BACKENDS
def test_parameters_vary_along_a_batch(backend: str, package: Packages) -> None:
    tree = package("two_arms", backend)
    widths = np.array([0.15, 0.2, 0.3])
    q = np.random.default_rng(3).uniform(0.1, 0.5, (3, tree.DOF))
    targets = tree.fk(q, params=tree.Params(shoulder=widths))
    found = tree.numeric_inverse(targets, q + 0.05, params=tree.Params(shoulder=widths))
    other = tree.numeric_inverse(targets[0], q + 0.05, params=tree.Params(shoulder=widths))

    assert found.solved.all()
    assert other.q.shape == (3, tree.DOF)
    np.testing.assert_allclose(tree.fk(found.q, params=tree.Params(shoulder=widths)), targets, atol=1e-8)


BAD: tuple[tuple[dict[str, Any], type[Exception], str], ...] = (
    ({"weights": np.ones(4)}, ValueError, "weights has shape (4,), expected (5,) or (5, 2)"),
    ({"weights": np.ones((5, 3))}, ValueError, "weights has shape (5, 3)"),
    ({"weights": [1, 1, 1, 1, -1]}, ValueError, "weights holds -1, expected numbers from 0 to 1e+06"),
    ({"weights": [1, 1, np.nan, 1, 1]}, ValueError, "weights holds nan"),
    ({"weights": [1, 1, 1, 1, 2e6]}, ValueError, "weights holds 2e+06"),
    ({"weights": "heavy"}, TypeError, "weights has strings"),
    ({"base_T_tips": np.eye(4)}, ValueError, "base_T_tips has shape (4, 4), expected (..., 5, 4, 4)"),
    ({"base_T_tips": np.full((5, 4, 4), np.nan)}, ValueError, "base_T_tips[0] has entries that are not finite"),
    ({"base_T_tips": np.full((5, 4, 4), 1j)}, TypeError, "base_T_tips has entries of type complex128"),
    ({"params": (1.0,)}, TypeError, "params is given, but the robot has no runtime parameters"),
    ({"start": np.zeros(3)}, ValueError, "start has shape (3,), expected (..., 17)"),
    ({"restarts": -1}, ValueError, "restarts is -1"),
)


@BACKENDS
@pytest.mark.parametrize(("options", "error", "message"), BAD, ids=[message for _, _, message in BAD])
def test_arguments_are_checked(
    backend: str, options: dict[str, Any], error: type[Exception], message: str, package: Packages
) -> None:
    given = {"base_T_tips": np.tile(np.eye(4), (5, 1, 1)), **options}
    with pytest.raises(error, match=re.escape(message)):
        package("hand", backend).numeric_inverse(**given)


def test_both_forms_of_the_equations_are_chosen() -> None:
    hand, arms = (tips_of(load(robot_file(name))) for name in ("hand", "two_arms"))

    assert hand.by_joints
    assert hand.groups == 5
    assert hand.moving == ((0, 1, 2, 3, 4), (5, 6, 7), (8, 9, 10), (11, 12, 13), (14, 15, 16))
    assert hand.first[:6] == (0, 0, 0, 3, 3, 3)
    assert not arms.by_joints
    assert arms.groups == 1
    assert set(arms.moving[0]) & set(arms.moving[1]) == {0, 1}
    assert len(arms.first) == 12


@pytest.mark.parametrize("name", ["hand", "two_arms", "trunnion_mill"])
def test_joints_that_move_a_tip_are_those_of_the_jacobian(name: str) -> None:
    robot = load(robot_file(name))
    low, high = np.array(joint_box(robot)).T
    q = np.random.default_rng(1).uniform(low, high, (3, robot.dof))
    for tip, moving in zip(robot.tips, tips_of(robot).moving, strict=True):
        columns = reference.Kinematics(robot, q).jacobian(tip)
        moved = np.flatnonzero(np.abs(columns).max(axis=(0, 1)) > 1e-12)

        assert tuple(moved) == moving


def test_the_same_bits_for_any_threads_and_place(package: Packages) -> None:
    tree, targets, start = made(package, "two_arms", "c")
    targets, start = np.tile(targets, (4, 1, 1, 1)), np.tile(start, (4, 1))
    whole = tree.numeric_inverse(targets, start, restarts=2)
    shared = tree.numeric_inverse(targets, start, restarts=2, threads=3)
    part = tree.numeric_inverse(targets[:33], start[:33], restarts=2)

    for one, other, short in zip(whole, shared, part, strict=True):
        np.testing.assert_array_equal(one, other)
        np.testing.assert_array_equal(one[:33], short)
