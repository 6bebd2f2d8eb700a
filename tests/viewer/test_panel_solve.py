"""The pure functions of the panels: turns, branches, search, singular values."""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from kinegen.io.load import load
from kinegen.tools.viewer.document import kernel_script, page_kernels
from kinegen.tools.viewer.panels import inverse_model
from tests.viewer.node import evaluate, needs_node

ROBOTS = Path(__file__).resolve().parents[2] / "robots"
SOLVE = ("numbers.js", "algebra.js", "solve.js", "spectrum.js")

pytestmark = needs_node


def rotation(about: list[float], angle: float) -> np.ndarray[Any, np.dtype[np.float64]]:
    x, y, z = np.array(about) / np.linalg.norm(about)
    skew = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    found = np.eye(4)
    found[:3, :3] = np.eye(3) + math.sin(angle) * skew + (1 - math.cos(angle)) * skew @ skew
    return found


@pytest.mark.parametrize("angle", [0.0, 1e-9, 1e-4, 1.0, 3.0, math.pi - 1e-9, math.pi])
def test_the_turn_between_two_frames(angle: float) -> None:
    about = np.array([0.36, -0.48, 0.8])
    start = rotation([1, 2, 3], 0.7)
    given = [start.ravel().tolist(), (rotation(list(about), angle) @ start).ravel().tolist()]
    found = np.array(
        evaluate(
            (
                "numbers.js",
                "algebra.js",
            ),
            "algebra.turnBetween(...given)",
            given,
        )
    )

    sign = -1 if angle == math.pi and found @ about < 0 else 1
    np.testing.assert_allclose(sign * found, angle * about, atol=3e-8)


def test_roll_pitch_and_yaw_give_the_pose_back() -> None:
    places = [[[1, 2, 3], [0.3, -0.4, 2.9]], [[0, 0, 0], [0, math.pi / 2, 1]], [[0, 0, 0], [0, -math.pi / 2, -1]]]
    both = "given.map(([at, turn]) => algebra.pose(at, turn)).map((pose) => [algebra.origin(pose), rollPitchYaw(pose)])"
    for found, expected in zip(
        evaluate(
            (
                "numbers.js",
                "algebra.js",
            ),
            both,
            places,
        ),
        places,
        strict=True,
    ):
        np.testing.assert_allclose(found[1], expected[1], atol=1e-12)
        assert found[0] == expected[0]


@pytest.mark.parametrize(
    ("value", "near", "limits", "expected"),
    [
        (0.1, 6.2, None, 0.1 + 2 * math.pi),
        (0.1, 6.2, [-1, 1], 0.1),
        (0.1, -12.0, [-7, 7], 0.1 - 2 * math.pi),
        (0.1, 3.0, None, 0.1),
    ],
)
def test_whole_turns_bring_a_joint_near_within_its_limits(
    value: float, near: float, limits: list[float] | None, expected: float
) -> None:
    found = evaluate(SOLVE, "solve.nearTurn(...given)", [value, near, 2 * math.pi, limits])

    assert found == pytest.approx(expected, abs=1e-15)


def test_eigenvalues_are_those_of_numpy() -> None:
    random = np.random.default_rng(3)
    matrices = [each @ each.T for each in (random.normal(size=(n, n)) for n in (1, 2, 3, 6, 21))]
    matrices += [np.zeros((3, 3)), np.diag([2.0, 2.0, 1.0]), np.ones((4, 4)), 1e-200 * np.eye(3) + 1e-200]
    found = evaluate(SOLVE, "given.map(spectrum.eigen)", [each.tolist() for each in matrices])

    for matrix, pairs in zip(matrices, found, strict=True):
        values = np.array([pair["value"] for pair in pairs])
        vectors = np.array([pair["vector"] for pair in pairs])
        scale = max(np.abs(matrix).max(), 1e-300)
        np.testing.assert_allclose(values / scale, np.linalg.eigvalsh(matrix)[::-1] / scale, atol=1e-12)
        np.testing.assert_allclose(vectors @ vectors.T, np.eye(len(matrix)), atol=1e-12)
        np.testing.assert_allclose(matrix @ vectors.T / scale, vectors.T * values / scale, atol=1e-12)


@cache
def arm(name: str) -> tuple[str, dict[str, Any]]:
    """The kernels of a robot as JavaScript that runs first, and what the page knows of its inverse."""
    kernels = page_kernels(load(ROBOTS / f"{name}.yaml"))
    return f"const kernels = {kernel_script(kernels)};", inverse_model(kernels)


ARM = """((model) => {
    const units = model.units, box = model.box;
    const arm = {
        dof: kernels.DOF, names: kernels.JOINTS, limits: kernels.LIMITS, branches: kernels.BRANCHES ?? [],
        periods: model.periods.map((each) => each ?? Infinity), units, reach: model.reach,
        readsAttitude: model.readsAttitude,
        pose: (q) => kernels.fk(q), jacobian: (q) => kernels.jacobian(q), inverse: (target) => kernels.inverse(target),
    };
    return {...arm, ...spectrum.usual((q) => solve.scaled(arm, q, 6), box)};
})(given.model)"""


@pytest.mark.parametrize(("name", "count"), [("puma560", 8), ("ur5", 8), ("stanford", 8), ("scara_hd", 2)])
def test_every_branch_of_a_reachable_pose_is_found(name: str, count: int) -> None:
    before, model = arm(name)
    robot = load(ROBOTS / f"{name}.yaml")
    start = [0.3 + 0.1 * place for place in range(robot.dof)]
    text = f"((arm) => solve.branches(arm, arm.pose(given.q), given.q))({ARM})"
    found = evaluate(SOLVE, text, {"model": model, "q": start}, before)

    assert len(found) == count
    assert sum(each["valid"] or each.get("drawable", False) for each in found) == count
    near = min(np.abs(np.array(each["q"]) - start).max() for each in found if each["valid"])
    assert near < 1e-9


def test_a_branch_beyond_its_limits_names_the_joint() -> None:
    before, model = arm("puma560")
    text = f"((arm) => solve.branches(arm, arm.pose(given.q), given.q))({ARM})"
    found = evaluate(SOLVE, text, {"model": model, "q": [0.3, 0.4, 0.5, 0.6, 0.7, 0.8]}, before)

    reasons = {each["reason"] for each in found if not each["valid"]}
    assert any(reason.startswith("outside the limits of ") for reason in reasons)
    assert "out of reach" not in reasons


def test_out_of_reach_has_no_branch() -> None:
    before, model = arm("puma560")
    target = np.eye(4)
    target[0, 3] = 5.0
    text = f"((arm) => solve.branches(arm, given.target, [0, 0, 0, 0, 0, 0]))({ARM})"
    found = evaluate(SOLVE, text, {"model": model, "target": target.ravel().tolist()}, before)

    assert {(each["valid"], each["reason"]) for each in found} == {(False, "out of reach")}


@pytest.mark.parametrize("name", ["puma560", "iiwa14"])
def test_the_search_finds_poses_nearby(name: str) -> None:
    before, model = arm(name)
    dof = len(model["units"])
    random = np.random.default_rng(5)
    low, high = np.array(model["box"]).T
    starts = random.uniform(low * 0.6, high * 0.6, (20, dof))
    goals = np.clip(starts + random.uniform(-0.3, 0.3, (20, dof)), low, high)
    text = f"((arm) => given.goals.map((goal, i) => solve.search(arm, given.starts[i], arm.pose(goal))))({ARM})"
    found = evaluate(SOLVE, text, {"model": model, "starts": starts.tolist(), "goals": goals.tolist()}, before)

    assert sum(each["reached"] for each in found) == 20
    joints = np.array([each["q"] for each in found])
    assert (joints >= low - 1e-12).all()
    assert (joints <= high + 1e-12).all()


def test_the_search_stretches_towards_what_is_out_of_reach() -> None:
    before, model = arm("iiwa14")
    target = np.eye(4)
    target[:3, 3] = 3, 0, 0.36
    text = f"((arm) => solve.search(arm, given.q, given.target, {{attitude: false, steps: 400}}))({ARM})"
    found = evaluate(SOLVE, text, {"model": model, "target": target.ravel().tolist(), "q": [0.1] * 7}, before)

    # The arm reaches 0.946 m from its shoulder, which is 0.36 m above the base.
    assert not found["reached"]
    assert found["length"] == pytest.approx(3 - 0.946, abs=1e-3)


def test_an_arm_of_five_joints_gets_the_position_of_a_pose() -> None:
    before, model = arm("al5d")
    target = rotation([1, 2, 3], 1.0)
    turned = "arm.pose(given.q).map((entry, place) => (place % 4 === 3 ? entry : given.turn[place]))"
    text = f"((arm) => solve.approach(arm, given.q, {turned}, true))({ARM})"
    given = {"model": model, "q": [0.1, 0.5, -0.8, 0.3, 0.2], "turn": target.ravel().tolist()}
    found = evaluate(SOLVE, text, given, before)

    assert not found["reached"]
    assert found["length"] < 1e-6


@pytest.mark.parametrize(
    ("name", "q", "rank", "names"),
    [
        ("puma560", [0.3, -0.5, 0.4, 0.2, 0.0, 0.1], 6, {"forearm", "flange"}),
        ("ur5", [0.3, -0.5, 0.4, 0.2, 0.0, 0.1], 6, {"shoulder", "elbow", "wrist_1", "wrist_3"}),
        ("planar_3r", [0.3, 0.0, 0.0], 3, None),
    ],
)
def test_a_singular_pose_names_its_joints(name: str, q: list[float], rank: int, names: set[str] | None) -> None:
    before, model = arm(name)
    text = f"((arm) => [arm.rank, spectrum.nearness(solve.scaled(arm, given.q, 6), arm), arm.names])({ARM})"
    found_rank, found, joints = evaluate(SOLVE, text, {"model": model, "q": q}, before)

    assert found_rank == rank
    if names is None:
        # Parallel axes in one line still turn the tool; only the position is singular.
        assert found["share"] < 1.0
        return
    assert found["share"] < 1e-6
    assert {joints[each["joint"]] for each in found["joints"]} <= names


def test_a_usual_pose_is_not_singular() -> None:
    before, model = arm("puma560")
    text = f"((arm) => spectrum.nearness(solve.scaled(arm, given.q, 6), arm))({ARM})"
    found = evaluate(SOLVE, text, {"model": model, "q": [0.1, -0.8, 0.5, 0.2, 1.0, 0.1]}, before)

    assert found["share"] > 0.5
