"""Paths through, beside and onto singularities, to the edge of the reach, beyond limits, and back."""

from __future__ import annotations

import math
from types import ModuleType

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.inverse_tracker.conftest import Packages

FloatArray = NDArray[np.float64]

ALIGNED = np.array([0.3, -0.9, 0.4, 0.4, 0.0, -0.2])
"""The PUMA with its wrist aligned, far from other singularities."""

BENT = np.array([0, 0, 0, 0, 0.01, 0])

REGULAR = np.array([0.3, -0.6, 1.2, 0.4, 0.5, 0.2])

FOLLOWED, LAGGING = 1, 2


@pytest.fixture(params=["c", "numpy"])
def puma(request: pytest.FixtureRequest, package: Packages) -> ModuleType:
    return package("puma560", request.param)


def turned(axis: int, angle: float) -> FloatArray:
    """A rotation about an axis, as a 4x4 matrix."""
    found = np.eye(4)
    first, second = (axis + 1) % 3, (axis + 2) % 3
    found[first, first] = found[second, second] = math.cos(angle)
    found[second, first], found[first, second] = math.sin(angle), -math.sin(angle)
    return found


def across(puma: ModuleType, beside: float, count: int = 61) -> tuple[FloatArray, FloatArray]:
    """A start and targets whose tool axis passes the aligned one at an angle."""
    middle = puma.fk(ALIGNED) @ turned(0, beside)
    targets = np.array([middle @ turned(1, angle) for angle in np.linspace(-0.2, 0.2, count)])
    start, exists = puma.inverse(targets[0], nearest=ALIGNED)
    assert exists
    return start, targets


@pytest.mark.parametrize("beside", [0.0, 1e-9])
def test_joints_go_straight_on_through_a_wrist_singularity(puma: ModuleType, beside: float) -> None:
    start, targets = across(puma, beside)
    tracker = puma.inverse_tracker(start)
    path = tracker.follow(targets)

    assert (path.status == FOLLOWED).all()
    assert np.abs(np.diff(path.q, axis=0)).max() < 0.02
    assert path.rotation_error.max() < 1e-7
    assert tracker.changes == 1
    assert puma.BRANCHES[path.branch[0]].split(", wrist")[0] == puma.BRANCHES[path.branch[-1]].split(", wrist")[0]
    assert path.q[0, 4] * path.q[-1, 4] < 0


def test_joints_that_a_singular_target_leaves_open_do_not_jump_for_a_step(puma: ModuleType) -> None:
    """A line of joint vectors with joints 4 and 6 at rest, one of them exactly where the wrist is in line."""
    ends = REGULAR + np.outer([1, -1], [-0.05, 0, 0, 0, 0.4, 0]) - [0, 0, 0, 0, 0.5, 0]
    line = np.linspace(*ends, 201)
    path = puma.inverse_tracker(line[0]).follow(puma.fk(line))

    assert abs(line[100, 4]) < 1e-12
    assert (path.status == FOLLOWED).all()
    np.testing.assert_allclose(path.q[95:106], line[95:106], atol=1e-6)


@pytest.mark.parametrize("beside", [1e-5, 1e-3, 5e-3])
def test_speed_is_bounded_beside_a_wrist_singularity(puma: ModuleType, beside: float) -> None:
    start, targets = across(puma, beside)
    tracker = puma.inverse_tracker(start, max_step=0.05)
    path = tracker.follow(targets)

    assert np.abs(np.diff(path.q, axis=0)).max() <= 0.05 + 1e-14
    assert set(path.status) == {FOLLOWED, LAGGING}
    lagging = path.status == LAGGING
    assert (path.rotation_error[lagging] > 1e-8).all()
    assert path.rotation_error.max() < 2 * beside
    assert path.status[-1] == FOLLOWED
    assert np.allclose(puma.fk(path.q[-1]), targets[-1], atol=1e-12)


def test_a_start_at_a_singularity_is_open_until_the_path_leaves_it(puma: ModuleType) -> None:
    tracker = puma.inverse_tracker(ALIGNED)
    assert tracker.branch == -1
    still = tracker.step(puma.fk(ALIGNED))
    assert still.status == FOLLOWED
    assert np.allclose(still.q, ALIGNED, atol=1e-7)

    left = tracker.step(puma.fk(ALIGNED + BENT))
    assert left.branch >= 0
    assert np.allclose(left.q, ALIGNED + BENT, atol=1e-7)


def test_the_edge_of_the_reach_ends_the_branch_and_the_way_back_keeps_it(puma: ModuleType) -> None:
    targets = np.repeat(puma.fk(REGULAR)[None], 80, axis=0)
    targets[:, :3, 3] *= np.linspace(1, 4, 80)[:, None]
    tracker = puma.inverse_tracker(REGULAR)
    branch = tracker.branch
    path = tracker.follow(targets)
    ends = int(np.argmax(path.status != FOLLOWED))

    assert 0 < ends < 80
    assert set(path.status[ends:]) == {0}
    assert (path.q[ends:] == path.q[ends - 1]).all()
    assert path.position_error[-1] > 0.03
    assert np.allclose(tracker.follow(targets[:ends][::-1]).q[-1], REGULAR, atol=1e-9)
    assert tracker.branch == branch


@pytest.mark.parametrize("joint", [0, 3])
def test_a_limit_ends_the_branch_and_is_named(puma: ModuleType, joint: int) -> None:
    q = np.repeat(REGULAR[None], 40, axis=0)
    limit = puma.LIMITS[joint][1]
    q[:, joint] = np.linspace(limit - 0.4, limit + 0.4, 40)
    tracker = puma.inverse_tracker(q[0])
    path = tracker.follow(puma.fk(q))

    assert (path.status[:20] == FOLLOWED).all()
    assert path.status[20] == -1
    assert path.joint[20] == joint
    assert tracker.step(puma.fk(q[20])).joint == joint
    assert path.q[:, joint].max() <= limit + 1e-9


def test_refused_targets_change_nothing(puma: ModuleType) -> None:
    tracker = puma.inverse_tracker(REGULAR)
    target = puma.fk(REGULAR + 0.01)
    for number in (math.nan, math.inf, -math.inf):
        for place in range(12):
            spoilt = target.copy()
            spoilt.flat[place] = number
            step = tracker.step(spoilt)
            assert step.status == -3
            assert step.position_error == 1e30
    assert (tracker.q == REGULAR).all()
    assert tracker.step(target).status == FOLLOWED


def test_whole_turns_continue(package: Packages) -> None:
    ur5 = package("ur5", "c")
    q = np.repeat(np.array([0.2, -1.1, 1.2, -0.7, 0.9, 0.3])[None], 200, axis=0)
    q[:, 5] = np.linspace(-6.2, 6.2, 200)
    path = ur5.inverse_tracker(q[0]).follow(ur5.fk(q))

    assert (path.status == FOLLOWED).all()
    assert np.allclose(path.q, q, atol=1e-9)


def test_no_max_step_of_zero_moves_a_joint(puma: ModuleType) -> None:
    most = np.array([1, 1, 1, 0, 1, 1]) * 0.1
    path = puma.inverse_tracker(REGULAR, max_step=most).follow(puma.fk(REGULAR + np.full((3, 6), 0.02)))

    assert (path.status == LAGGING).all()
    assert (path.q[:, 3] == REGULAR[3]).all()


def test_speeds_are_those_of_the_jacobian_and_damped_at_a_singularity(puma: ModuleType) -> None:
    twist = np.array([0.1, -0.2, 0.05, 0.3, 0.2, -0.1])
    free = puma.inverse_tracker(REGULAR).speeds(twist)
    bounded = puma.inverse_tracker(REGULAR).speeds(twist, max_speed=np.abs(free.qd) / 4)

    assert np.allclose(puma.fk_jacobian(REGULAR)[1] @ free.qd, twist)
    assert np.abs(free.residual).max() < 1e-9
    assert free.factor == 1
    assert bounded.factor == pytest.approx(0.25)

    damped = puma.inverse_tracker(ALIGNED).speeds(twist)
    assert np.abs(damped.qd).max() < 10
    assert np.abs(damped.residual).max() > 1e-3
    assert puma.inverse_tracker(REGULAR).speeds(twist * math.nan).factor == 0


def test_single_precision_and_numpy_decide_alike(package: Packages) -> None:
    compiled, plain = (package("puma560", backend) for backend in ("c", "numpy"))
    start, targets = across(compiled, 1e-3)
    for real in (np.float64, np.float32):
        paths = [each.inverse_tracker(start.astype(real), max_step=0.05).follow(targets) for each in (compiled, plain)]
        assert paths[0].q.dtype == real
        assert (paths[0].status == paths[1].status).all()
        assert np.allclose(paths[0].q, paths[1].q, atol=1e-6 if real is np.float64 else 5e-3)


def test_a_joint_that_is_given_besides_the_target(package: Packages) -> None:
    panda = package("panda_joint_7", "c")
    low, high = np.array(panda.LIMITS).T
    q = (low + high) / 2 + np.linspace(0, 0.3, 30)[:, None]
    tracker = panda.inverse_tracker(q[0])
    path = tracker.follow(panda.fk(q), q[:, 6])

    assert (path.status == FOLLOWED).all()
    assert np.allclose(path.q, q, atol=1e-8)
    with pytest.raises(TypeError, match="takes no redundancy"):
        package("puma560", "c").inverse_tracker(REGULAR, redundancy=1.0)


@pytest.mark.parametrize(
    ("arguments", "options", "message"),
    [
        ((np.zeros(5),), {}, r"q0 has shape \(5,\), expected \(6,\)"),
        ((np.full(6, np.nan),), {}, "q0 is not a joint vector within the limits"),
        ((np.full(6, 3.0),), {}, "q0 is not a joint vector within the limits"),
        ((REGULAR,), {"max_step": -1}, "max_step is -1, expected numbers that are not negative"),
        ((REGULAR,), {"max_step": [1, 2]}, r"max_step has shape \(2,\)"),
    ],
)
def test_bad_arguments_are_told(
    puma: ModuleType, arguments: tuple[object], options: dict[str, object], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        puma.inverse_tracker(*arguments, **options)
    with pytest.raises(ValueError, match=r"base_T_tool has shape \(3, 3\)"):
        puma.inverse_tracker(REGULAR).step(np.eye(3))
