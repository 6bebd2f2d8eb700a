"""The first or last joint that a pose leaves free: the solution nearest to a joint vector keeps what that has."""

from __future__ import annotations

import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from kinegen.backends.c.kernel import emit_kernel
from kinegen.backends.scalar_types import ScalarType
from kinegen.derive.inverse.derive import family_of
from kinegen.derive.inverse.singular_configurations import free_end
from kinegen.driver.pipeline import lower_file
from kinegen.errors import ProofError
from kinegen.io.load import load, loads
from kinegen.model.joint_bounds import joint_box
from kinegen.model.outputs import Kind, Quantity
from kinegen.model.robot import TOOL, Robot
from kinegen.verify import nearest, reference
from kinegen.verify.free_joint_samples import joints_freed
from tests.builds.workshop import ROBOTS, assemble, set_machine
from tests.inverse.test_free_joints import IRB, UR, arm_text

INVERSE = Quantity(Kind.INVERSE)
LIMITED = ((-150, 150), (-180, 10), (-140, 140), (-150, 150), (-180, 180), (-100, 170))
"""Degrees of a UR whose limits exclude many angles of the hand."""

SMALL = ((-165, 165), (-110, 110), (-90, 70), (-160, 160), (-120, 120), (-400, 400))
"""Degrees of a small arm without an offset of the waist."""


OWN = {
    "limited": arm_text(UR, LIMITED),
    "small": arm_text(IRB, SMALL),
    "away": arm_text(IRB, ((20, 300), *SMALL[1:])),
}


def packed(name: str, folder: Path, *, compiled: bool = False) -> tuple[ModuleType, Robot]:
    """The package and the robot of a file of the repository, or of a table here."""
    path = ROBOTS / name
    if name in OWN:
        path = folder / name
        path.with_suffix(".yaml").write_text(OWN[name].replace("name: arm", f"name: {name}"), encoding="utf-8")
    package = assemble(
        str(path) if name in OWN else name, folder, compiled=compiled, quantities=(Quantity.POSE, INVERSE)
    )
    return package, load(path.with_suffix(".yaml"))


@pytest.fixture(scope="module", params=["limited", "small", "away", "ur5", "kr5"])
def arm(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[ModuleType, Robot]:
    return packed(request.param, tmp_path_factory.mktemp("packages"))


def freed(robot: Robot, count: int) -> Any:
    """Joint vectors within the limits: the wrist's centre on axis 1, or axes 4 and 6 of a UR parallel."""
    q = joints_freed(robot, family_of(robot), 4 * count)[:count]
    values = np.linalg.svd(reference.Kinematics(robot, q).jacobian(TOOL), compute_uv=False)

    assert len(q) == count
    assert values[:, -1].max() < 1e-12
    return q


def poses(robot: Robot, q: Any) -> Any:
    return reference.pose(robot, q)[:, 0]


def test_a_joint_vector_that_reaches_the_target_is_kept(arm: tuple[ModuleType, Robot]) -> None:
    package, robot = arm
    q = freed(robot, 200)
    found, exists = package.inverse(poses(robot, q), nearest=q)

    assert exists.all()
    np.testing.assert_allclose(found, q, atol=1e-9)
    np.testing.assert_array_equal(package.inverse(poses(robot, q[:1])[0], nearest=q[0])[0], found[0])


def test_single_precision_keeps_it_too(arm: tuple[ModuleType, Robot]) -> None:
    package, robot = arm
    q = freed(robot, 200)
    found, exists = package.inverse(poses(robot, q).astype(np.float32), nearest=q.astype(np.float32))
    off = np.abs(found - q).max(axis=1)

    # Where a wrist is nearly in line, rounding of the target alone turns its joints by much more.
    assert exists.all()
    assert np.median(off) < 1e-4
    np.testing.assert_allclose(poses(robot, found.astype(float)), poses(robot, q), atol=1e-4)


def test_a_path_through_the_set_has_no_leap(arm: tuple[ModuleType, Robot]) -> None:
    package, robot = arm
    low, high = np.array(joint_box(robot)).T
    q = freed(robot, 60)
    inside = ((q > low + 0.02) & (q < high - 0.02)).all(axis=1)
    q = q[inside]
    assert len(q) > 20
    way = np.random.default_rng(4).uniform(-0.01, 0.01, q.shape)
    here = q - way
    for share in (-1, -0.5, -0.1, 0, 0.1, 0.5, 1):
        wanted = q + share * way
        here, exists = package.inverse(poses(robot, wanted), nearest=here)

        # In the set itself the end stays where it was before, and the others follow it.
        assert exists.all()
        np.testing.assert_allclose(here, wanted, atol=1e-8 if share else 0.05)


def test_a_wanted_joint_beyond_its_limits_is_followed_as_far_as_they_allow(arm: tuple[ModuleType, Robot]) -> None:
    package, robot = arm
    end = free_end(family_of(robot))
    assert end is not None
    q = freed(robot, 100)
    wanted = q.copy()
    wanted[:, end.joint] = joint_box(robot)[end.joint][1] + 0.3
    found, exists = package.inverse(poses(robot, q), nearest=wanted)
    usual = package.inverse(poses(robot, q), nearest=q)[0]

    assert exists.all()
    assert package.within_limits(np.clip(found, *np.array(joint_box(robot)).T)).all()
    np.testing.assert_allclose(found, np.clip(found, *np.array(joint_box(robot)).T), atol=1e-6)
    np.testing.assert_allclose(poses(robot, found), poses(robot, q), atol=1e-10)
    assert (((found - wanted) ** 2).sum(axis=1) <= ((usual - wanted) ** 2).sum(axis=1) + 1e-9).mean() > 0.3


def test_other_poses_have_the_bits_that_they_had(arm: tuple[ModuleType, Robot]) -> None:
    package, robot = arm
    low, high = np.array(joint_box(robot)).T
    q, wanted = np.random.default_rng(5).uniform(low, high, (2, 300, robot.dof))
    found, exists = package.inverse(poses(robot, q), nearest=wanted)
    kernel = package.inverse
    formula = sys.modules[f"{package.__name__}._numpy"].inverse
    nearer = sys.modules[f"{package.__name__}._runtime._nearest"]
    plain = nearer.NearestFormula(formula, kernel.turnings, 1, kernel.sharings)
    *before, was = plain(poses(robot, q)[:, :3].reshape(300, 12).T.copy(), wanted.T.copy())

    np.testing.assert_array_equal(found.T, before)
    np.testing.assert_array_equal(exists, was > 0)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e300])
def test_nothing_is_near_to_what_is_no_joint_vector(arm: tuple[ModuleType, Robot], value: float) -> None:
    package, robot = arm
    wanted = freed(robot, 12)
    targets = poses(robot, wanted)
    for row in range(6):
        wanted[row, row] = value
    found, exists = package.inverse(targets, nearest=wanted)

    assert not exists[:6].any()
    assert np.isnan(found[:6]).all()
    np.testing.assert_allclose(found[6:], wanted[6:], atol=1e-9)


@pytest.mark.parametrize("name", ["limited", "small"])
def test_compiled_functions_keep_it_one_by_one_and_in_batches(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    set_machine(monkeypatch, tmp_path / "cache")
    package, robot = packed(name, tmp_path, compiled=True)
    free = freed(robot, 70)
    low, high = np.array(joint_box(robot)).T
    q = np.random.default_rng(6).uniform(low, high, (140, robot.dof))
    q[::2] = free
    targets = poses(robot, q)
    batch, exists = package.inverse(targets, nearest=q)
    single = np.array([package.inverse(target, nearest=near)[0] for target, near in zip(targets, q, strict=True)])

    assert exists.all()
    np.testing.assert_allclose(batch, q, atol=1e-7)
    np.testing.assert_allclose(batch[::2], free, atol=1e-9)
    np.testing.assert_array_equal(single, batch)


def test_the_proof_refuses_a_choice_that_leaves_the_joint_at_rest(
    arm: tuple[ModuleType, Robot], monkeypatch: pytest.MonkeyPatch
) -> None:
    package, robot = arm
    rooms = np.full(robot.dof, 1e-6)
    nearest.require_nearest(robot, family_of(robot), package, INVERSE, "double", rooms, None)
    formula = sys.modules[f"{package.__name__}._runtime._nearest"].NearestFormula
    monkeypatch.setattr(formula, "_where_free", lambda *_: np.zeros(0, int))
    with pytest.raises(ProofError, match="reaches the target as well"):
        nearest.require_nearest(robot, family_of(robot), package, INVERSE, "double", rooms, None)


@pytest.mark.parametrize(
    ("name", "joint"),
    [("ur16e", 5), ("fanuc_10l", 0), ("puma560", None), ("al5d", 0), ("iiwa14_arm_angle", None), ("scara", None)],
)
def test_an_end_is_free_where_the_others_follow_it(name: str, joint: int | None) -> None:
    end = free_end(family_of(load(ROBOTS / f"{name}.yaml")))

    assert (None if end is None else end.joint) == joint


def test_limits_without_zero_leave_the_last_joint_where_it_is() -> None:
    limits = (*LIMITED[:5], (10, 120))

    assert free_end(family_of(loads(arm_text(UR, limits), "arm.yaml"))) is None


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("ur5", "axis of q[5] is parallel"),
        ("kr5", "axis of q[0]"),
        ("al5d", "the last axis and the point"),
        ("scara", ""),
    ],
)
def test_the_header_says_which_joint_is_kept(name: str, words: str) -> None:
    header = emit_kernel(lower_file(ROBOTS / f"{name}.yaml", (INVERSE,)), ScalarType.DOUBLE)[f"{name}.h"]
    text = " ".join(header.replace(" *", " ").split())

    assert words in text
    assert ("leaves that joint free" in text) == bool(words)
