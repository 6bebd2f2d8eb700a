"""Two joints whose axes are in line share one angle: the solution nearest to a joint vector keeps what that has."""

from __future__ import annotations

import math
import sys
from fractions import Fraction
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from kinegen.backends.c.kernel import emit_kernel
from kinegen.backends.inverse import inverse_of, sharings
from kinegen.backends.scalar_types import ScalarType
from kinegen.derive.inverse.derive import family_of
from kinegen.derive.inverse.singular_configurations import in_line
from kinegen.driver.pipeline import lower_file
from kinegen.errors import ProofError
from kinegen.io.load import load
from kinegen.model.outputs import Kind, Quantity
from kinegen.runtime.vendored._nearest import NearestFormula
from kinegen.verify import nearest
from kinegen.verify.invocations import DTYPES, ways_to_call
from tests.builds.workshop import ROBOTS, assemble

INVERSE = Quantity(Kind.INVERSE)
TURN = 2 * math.pi


@pytest.fixture(scope="module")
def puma560(tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    folder = tmp_path_factory.mktemp("packages")
    return assemble("puma560", folder, compiled=False, quantities=(Quantity.POSE, INVERSE))


def in_line_wrists(arm: ModuleType, count: int) -> Any:
    """Joint vectors within the limits with joint 5 at 0, the elbow bent."""
    low, high = np.array([(-3.0, 3.0) if each is None else each for each in arm.LIMITS]).T
    q = np.random.default_rng(0).uniform(low, high, (count, arm.DOF))
    q[:, 2], q[:, 4] = np.where(q[:, 2] > 0, 0.5, 2.5), 0
    return q


def nearest_of(s: Any, wanted: Any, joints: Any, shared: Any) -> Any:
    """What is chosen where solutions (joints, N) are all that there are."""
    rows, others = [*s, np.ones_like(s[0])], ((1.0, 0.0, 0.0),) * len(joints)
    is_double = wanted.dtype == np.float64
    turnings, pairs = ((joints, others), (shared, ())) if is_double else ((others, joints), ((), shared))
    return NearestFormula(lambda *_: rows, turnings, 1, pairs)(np.zeros((12, s.shape[1])), wanted)


@pytest.mark.parametrize(
    ("name", "pairs"),
    [
        ("puma560", {(3, 4, 5)}),
        ("tx60", {(3, 4, 5)}),
        ("ur5", set()),
        ("scara", set()),
        ("panda_joint_7", {(0, 1, 2)}),
        ("iiwa14_arm_angle", {(0, 1, 2), (2, 3, 4), (4, 5, 6)}),
    ],
)
def test_neighbours_at_right_angles_that_meet_come_in_line(name: str, pairs: set[tuple[int, int, int]]) -> None:
    found = in_line(family_of(load(ROBOTS / f"{name}.yaml")))

    assert {(each.first, each.middle, each.last) for each in found} == pairs
    assert sum(each.are_opposed for each in found) == len(pairs)
    np.testing.assert_allclose([np.cos(each.at) ** 2 for each in found], 1)


def test_a_joint_vector_that_reaches_the_target_is_kept(puma560: ModuleType) -> None:
    q = in_line_wrists(puma560, 400)
    q[::7, 3] = puma560.LIMITS[3][1]
    q[1::7, 3:6:2] = math.pi / 2
    q[2::7, 5] = math.pi
    found, exists = puma560.inverse(puma560.fk(q), nearest=q)

    assert exists.all()
    np.testing.assert_allclose(found, q, atol=1e-9)


def test_a_path_through_an_exact_wrist_singularity_has_no_leap(puma560: ModuleType) -> None:
    q = in_line_wrists(puma560, 200)
    before = q + np.random.default_rng(1).normal(0, 1e-3, q.shape)
    before[:, 3] = np.clip(before[:, 3], *puma560.LIMITS[3])
    found, exists = puma560.inverse(puma560.fk(q), nearest=before)

    assert exists.all()
    np.testing.assert_allclose(found, before, atol=0.02)
    np.testing.assert_allclose(puma560.fk(found), puma560.fk(q), atol=1e-12)


def test_a_wanted_joint_outside_its_limits_stops_there(puma560: ModuleType) -> None:
    q = in_line_wrists(puma560, 100)
    wanted = q.copy()
    wanted[:, 3], wanted[:, 5] = puma560.LIMITS[3][1] + 0.2, q[:, 3] + q[:, 5] - puma560.LIMITS[3][1] - 0.2
    found, exists = puma560.inverse(puma560.fk(q), nearest=wanted)

    assert exists.all()
    assert puma560.within_limits(found).all()
    np.testing.assert_allclose(found[:, 3], puma560.LIMITS[3][1], atol=1e-9)
    np.testing.assert_allclose(found[:, 5], wanted[:, 5] + 0.2, atol=1e-9)


@pytest.mark.parametrize("real", list(ScalarType))
def test_two_joints_exactly_at_their_limits_are_kept(real: ScalarType) -> None:
    """Their sum is more than a turn from the one at rest, and the largest that limits allow."""
    kernels = lower_file(ROBOTS / "iiwa14_arm_angle.yaml", (INVERSE,))
    found = inverse_of(kernels)
    assert found is not None
    dtype, (pair, *_) = DTYPES[str(real)].type, sharings(kernels.robot, found[1], real)
    turn, high = dtype(real.round(Fraction(TURN))), np.array(pair.high[:2], dtype)
    rounding = 2 * np.finfo(dtype).eps * np.arange(-2, 3, dtype=dtype)
    s = np.array([0 * rounding, 0 * rounding, high[0] + high[1] - turn + rounding], dtype)
    w = np.array([[high[0]] * 5, [0] * 5, [high[1]] * 5], dtype)
    joints = tuple((float(turn), -float(end), float(end)) for end in (high[0], dtype(2), high[1]))
    shared = ((0, 1, 2, 1, 0.0, pair.near, pair.low, pair.high),)
    q = nearest_of(s, w, joints, shared)

    np.testing.assert_allclose(q[:3], w, atol=8 * np.finfo(dtype).eps)


@pytest.mark.parametrize("sign", [-1, 1])
def test_two_joints_are_as_near_as_their_limits_allow(sign: int) -> None:
    """Held against all whole turns, with what one joint has over moved to the other as far as its limits allow."""
    largest = 1e300
    generator = np.random.default_rng(2)
    for first, last in (((-2.0, 2.0), (-4.0, 1.0)), ((-7.0, 6.0), (-largest, largest)), ((-0.3, 0.4), (-3.5, 3.4))):
        inner = max(last[0], -4.0), min(last[1], 4.0)
        own = last if sign > 0 else (-last[1], -last[0])
        low, high = ((end, each, min(max(end + each, -largest), largest)) for end, each in zip(first, own, strict=True))
        s, w = (
            np.array([generator.uniform(*first, 300), np.zeros(300), generator.uniform(*inner, 300)]) for _ in range(2)
        )
        total = s[0] + sign * s[2]
        w[2, ::2] = (sign * (total - w[0]))[::2]
        joints = ((TURN, *first), (TURN, -3.0, 3.0), (TURN, *last))
        shared = ((0, 1, 2, sign, 0.0, 1e-13, low, high),)
        *found, _ = nearest_of(s, w, joints, shared)
        q, alone = np.array(found), np.array(s)
        away = (q[0] + sign * q[2] - total) / TURN
        apart = ((q - w) ** 2).sum(axis=0)
        is_within = (w[2] >= last[0]) & (w[2] <= last[1])

        np.testing.assert_allclose(away, np.round(away), atol=1e-12)
        assert ((q[0] >= first[0]) & (q[0] <= first[1]) & (q[2] >= last[0]) & (q[2] <= last[1])).all()
        assert (apart <= ((alone - w) ** 2).sum(axis=0) + 1e-12).all()
        np.testing.assert_allclose(apart[::2][is_within[::2]], 0, atol=1e-20)


def test_the_proof_refuses_a_choice_that_leaves_a_joint_at_rest(
    puma560: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    robot = load(ROBOTS / "puma560.yaml")
    rooms = np.full(robot.dof, 1e-6)
    nearest.require_nearest(robot, family_of(robot), puma560, INVERSE, "double", rooms, None)
    (way,) = (way for way in ways_to_call(puma560, INVERSE, "double") if way.is_plain)
    formula = sys.modules[f"{puma560.__name__}._runtime._nearest"].NearestFormula
    assert way.kernel.sharings[0]
    monkeypatch.setattr(formula, "_share", lambda *_: None)
    with pytest.raises(ProofError, match="reaches the target as well"):
        nearest.require_nearest(robot, family_of(robot), puma560, INVERSE, "double", rooms, None)


@pytest.mark.parametrize(("name", "is_said"), [("puma560", True), ("ur5", False)])
def test_the_header_names_the_joints_that_share_an_angle(name: str, is_said: bool) -> None:
    header = emit_kernel(lower_file(ROBOTS / f"{name}.yaml", (INVERSE,)), ScalarType.DOUBLE)[f"{name}.h"]

    assert (" ".join(header.replace(" *", " ").split()).find("coincide (q[3] and q[5])") >= 0) == is_said
