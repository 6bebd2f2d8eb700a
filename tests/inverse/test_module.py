"""The inverse of a package: targets are checked, the nearest solution is chosen, and a wrong kernel is refused."""

from __future__ import annotations

import inspect
import pickle
import re
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.files import emit_files
from kinegen.backends.scalar_types import ScalarType
from kinegen.derive.dispatch import derive
from kinegen.errors import ProofError
from kinegen.io.load import load, loads
from kinegen.ir.lower import lower, runtime_defaults
from kinegen.model.joint_bounds import reach
from kinegen.model.outputs import Kind, Quantity
from kinegen.model.robot import Robot
from kinegen.runtime.extension import lay_out, load_package
from kinegen.verify import closed_form_inverse as proof
from kinegen.verify.closed_form_inverse import try_inverse
from kinegen.verify.vectors import compute_vectors

ROBOTS = Path(__file__).parents[2] / "robots"
INVERSE = Quantity(Kind.INVERSE)
ROBOT = load(ROBOTS / "ur5.yaml")


def write(folder: Path, change: tuple[str, str] = ("", ""), robot: Robot = ROBOT) -> ModuleType:
    """The package of a robot, a UR5 by default, in NumPy alone, with one place of its formulas changed."""
    programs = tuple(lower(derive(robot, quantity)) for quantity in (Quantity.POSE, INVERSE))
    kernels = RobotPrograms(robot, programs, runtime_defaults(robot))
    folder, files = folder / robot.name, {**emit_files(kernels, (ScalarType.DOUBLE,), compute_vectors(kernels)).files}
    if change[0]:
        files["_numpy.py"] = re.sub(*change, files["_numpy.py"])
    lay_out(folder, files)
    return load_package(folder)


@pytest.fixture(scope="module")
def ur5(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ModuleType]:
    return write(tmp_path_factory.mktemp("package"))


def joints(count: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-2 * np.pi, 2 * np.pi, (count, 6))


def test_solutions_and_their_names(ur5: ModuleType) -> None:
    q = joints(50)
    solutions, valid = ur5.inverse(ur5.fk(q))

    assert solutions.shape == (50, 8, 6)
    assert valid.dtype == bool
    assert len(ur5.BRANCHES) == 8
    np.testing.assert_allclose(ur5.fk(solutions[valid]), np.repeat(ur5.fk(q), valid.sum(axis=1), axis=0), atol=1e-9)


def test_the_nearest_solution_takes_whole_turns_within_the_limits(ur5: ModuleType) -> None:
    q = joints(200, 1)
    found, exists = ur5.inverse(ur5.fk(q), nearest=q + 1e-3)

    assert exists.all()
    np.testing.assert_allclose(found, q, atol=1e-6)
    assert np.abs(found).max() <= 2 * np.pi + 1e-9


def test_one_target_one_start(ur5: ModuleType) -> None:
    q = joints(1, 2)[0]
    found, exists = ur5.inverse(ur5.fk(q), nearest=q)

    assert exists.shape == ()
    np.testing.assert_allclose(found, q, atol=1e-9)
    far = np.eye(4)
    far[0, 3] = 5
    found, exists = ur5.inverse(far, nearest=q)
    assert not exists
    assert np.isnan(found).all()


def _spoilt(row: int, column: int, value: float) -> np.ndarray:
    target = np.eye(4)
    target[row, column] = value
    return target


@pytest.mark.parametrize(
    ("target", "reason"),
    [
        (_spoilt(1, 3, np.nan), "not finite"),
        (_spoilt(0, 1, 0.1), "not orthonormal"),
        (np.diag([1.0, 1.0, -1.0, 1.0]), "reflection"),
        (np.eye(4) * 2, "last row"),
        (np.eye(3), r"shape \(3, 3\)"),
        (np.stack([np.eye(4), _spoilt(2, 2, np.inf)]), r"base_T_tool\[1\]"),
    ],
)
def test_what_is_no_pose_is_refused(ur5: ModuleType, target: np.ndarray, reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        ur5.inverse(target)


def test_other_uses_are_refused_in_words(ur5: ModuleType) -> None:
    with pytest.raises(ValueError, match="nearest has shape"):
        ur5.inverse(np.eye(4), nearest=np.zeros(5))
    with pytest.raises(ValueError, match="nearest cannot be combined with out"):
        ur5.inverse(np.eye(4), nearest=np.zeros(6), out=(np.empty((8, 6)), np.empty(8)))


def test_nearest_may_be_called_q0(ur5: ModuleType) -> None:
    q = joints(20)
    targets = ur5.fk(q)
    found, exists = ur5.inverse(targets, q0=q + 1e-3)

    assert exists.all()
    np.testing.assert_array_equal(found, ur5.inverse(targets, nearest=q + 1e-3)[0])
    np.testing.assert_array_equal(
        ur5.inverse(base_T_tool=targets[0], q0=list(q[0]))[0], ur5.inverse(targets[0], nearest=q[0])[0]
    )
    assert ur5.inverse(targets, q0=None)[0].shape == (20, 8, 6)
    assert {"nearest", "q0"} <= {*inspect.signature(ur5.inverse).parameters}
    with pytest.raises(TypeError, match="inverse: nearest and q0 are the same argument, expected one of them"):
        ur5.inverse(targets, nearest=q, q0=q)
    with pytest.raises(ValueError, match="nearest has shape"):
        ur5.inverse(targets, q0=np.zeros(5))


def test_it_is_pickled_by_name(ur5: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, ur5.__name__, ur5)
    assert pickle.loads(pickle.dumps(ur5.inverse)) is ur5.inverse  # noqa: S301 - our own bytes


def test_the_proof_counts_what_it_tried(ur5: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(proof, "TARGETS", 3000)
    (trial,) = try_inverse(ROBOT, ur5, INVERSE, "double")

    assert trial.position_error < 1e-12 * reach(ROBOT)
    assert trial.rotation_error < 1e-12
    names = ["singular and extreme", "stretched or folded", "aligned", "at a limit", "on the way to a singular set"]
    assert [name for name, _, _ in trial.special] == names
    assert all(solved == tried for _, tried, solved in trial.special)
    assert proof.counts_line(trial).startswith("inverse: 3,000 random targets")


@pytest.mark.parametrize(
    ("change", "outcome"),
    [
        ((r"(t\d+) = _atan2\((\w+), (\w+)\)", r"\1 = _atan2(-\2, \3)"), "misses the joint vectors"),
        (
            (r"np\.where\((t\d+) < (?:1000000000000000\.0|\(9e-08 if single else 9e-12\)), .*", r"np.ones_like(\1)"),
            "solves for targets with NaN",
        ),
        (
            (
                r"np\.where\(\s*(?!t\d+ < 1000000)[^,]*, (t\d+)\.dtype\.type\(1\.0\)[^\n]*\)(?:\n    \))?(?=\n)",
                r"np.ones_like(\1)",
            ),
            "solves for targets out of reach",
        ),
    ],
)
def test_a_wrong_inverse_cannot_pass(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, change: tuple[str, str], outcome: str
) -> None:
    monkeypatch.setattr(proof, "TARGETS", 1000)
    with pytest.raises(ProofError, match=outcome):
        try_inverse(ROBOT, write(tmp_path, change), INVERSE, "double")


def test_a_direction_that_is_chosen_where_there_is_one_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Poses are then off by as much as the target is from the singular set: 2e-10 rad at most."""
    monkeypatch.setattr(proof, "TARGETS", 100)
    threshold = r"5\.16987882845642\d*e-26"
    (trial,) = try_inverse(ROBOT, write(tmp_path, (threshold, "1e-20")), INVERSE, "double")

    assert 1e-12 < trial.rotation_error < 1e-9
    assert trial.rotation_error > trial.accepted


def test_a_target_that_its_rounding_moves_far_is_no_miss(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A stroke of some micrometres, at whose middle two branches meet: targets say little of the first two joints."""
    text = (ROBOTS / "spherical_arm.yaml").read_text().replace("d: q,", "d: q, limits: [-0.00001, 0.00001],")
    robot = loads(text, "arm.yaml")
    monkeypatch.setattr(proof, "TARGETS", 1000)
    (trial,) = try_inverse(robot, write(tmp_path, robot=robot), INVERSE, "double")

    assert trial.position_error < 1e-9
    assert 0 < trial.moved < 1000
    assert f"came from (rounding moved {trial.moved:,}, near singular poses), " in proof.counts_line(trial)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e17, -7e4])
def test_what_is_not_a_joint_vector_has_no_nearest_solution(ur5: ModuleType, value: float) -> None:
    q = joints(6, 3)
    near = q.copy()
    near[1::2, 2] = value
    found, exists = ur5.inverse(ur5.fk(q), nearest=near)

    assert exists.tolist() == [True, False] * 3
    assert np.isnan(found[1::2]).all()
    np.testing.assert_allclose(found[::2], q[::2], atol=1e-9)
    single, one = ur5.inverse(ur5.fk(q[1]), nearest=near[1])
    assert not one
    assert np.isnan(single).all()


@pytest.mark.parametrize("kind", [bool, float])
@pytest.mark.parametrize("count", [None, 3])
def test_bound_arrays_hold_truth_values_or_numbers(ur5: ModuleType, kind: type, count: int | None) -> None:
    poses = ur5.fk(joints(3, 4)) if count else ur5.fk(joints(3, 4))[0]
    solutions, valid = ur5.inverse(poses)
    found, holds = np.empty_like(solutions), np.full(valid.shape, 7).astype(kind)
    bound = ur5.inverse.bind(poses, found, holds)
    bound()

    np.testing.assert_array_equal(holds, valid)
    np.testing.assert_array_equal(found[valid], solutions[valid])
    poses[..., 0, 3] = 1e6
    bound()
    assert not holds.any()
    holds.flags.writeable = False
    with pytest.raises(ValueError, match="out for valid is read-only"):
        ur5.inverse.bind(poses, found, holds)
    with pytest.raises(TypeError, match="out for valid is of type int64, expected bool"):
        ur5.inverse.bind(poses, found, np.empty(valid.shape, np.int64))


def test_out_takes_the_truth_values_that_a_call_returns(ur5: ModuleType) -> None:
    poses = ur5.fk(joints(5, 4))
    solutions, valid = ur5.inverse(poses)
    out = np.empty_like(solutions), np.empty_like(valid)
    returned = ur5.inverse(poses, out=out)

    assert returned is out
    np.testing.assert_array_equal(out[1], valid)
    np.testing.assert_array_equal(out[0][valid], solutions[valid])
    numbers = np.empty(valid.shape)
    ur5.inverse(poses, out=(out[0], numbers))
    np.testing.assert_array_equal(numbers, valid)
    with pytest.raises(ValueError, match="out for valid has shape"):
        ur5.inverse(poses, out=(out[0], valid[:2]))
    valid.flags.writeable = False
    with pytest.raises(ValueError, match="out for valid is read-only"):
        ur5.inverse(poses, out=(out[0], valid))


@pytest.mark.parametrize(
    "rotation",
    [np.eye(3) * 2, np.eye(3) * 1.001, np.diag([1.0, 1.0, -1.0]), -np.eye(3), np.zeros((3, 3))],
    ids=["twice", "scaled", "mirrored", "inverted", "zeros"],
)
@pytest.mark.parametrize("kind", [np.float64, np.float32])
def test_the_formula_itself_solves_nothing_that_is_not_a_pose(
    ur5: ModuleType, kind: type, rotation: np.ndarray
) -> None:
    poses = ur5.fk(joints(20, 5))
    assert ur5.inverse(poses.astype(kind), check=False)[1].any(axis=1).all()
    poses[:, :3, :3] = poses[:, :3, :3] @ rotation

    assert not ur5.inverse(poses.astype(kind), check=False)[1].any()
