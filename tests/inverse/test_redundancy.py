"""Arms with some joints, or the arm angle, given: every solution leads back, and none is missed."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kinegen.derive.dispatch import derive
from kinegen.derive.inverse.classification import NotClosedForm, recognise
from kinegen.derive.inverse.family import Family
from kinegen.errors import KinegenError
from kinegen.io.load import load, loads
from kinegen.model.outputs import Kind, Quantity
from kinegen.model.robot import Robot
from kinegen.model.variants import with_redundancy
from kinegen.verify import reference
from kinegen.verify.branches import require_names
from tests.inverse.arms import REDUNDANT, Arm, arm_of, distances, errors, evaluate, joint_vectors, robots

ROBOTS = Path(__file__).parents[2] / "robots"
PANDA, IIWA = (load(ROBOTS / f"{name}.yaml") for name in ("panda_joint_7", "iiwa14_arm_angle"))

FREE = replace(IIWA, variables=tuple(replace(each, limits=None) for each in IIWA.variables))
"""Without limits, which would refuse a joint value that is no number."""

REASONS = {
    ("panda", "joint_4"): "redundancy: joint_4 is in the middle of the chain, only joint_1 or joint_7 can be given",
    ("panda", "arm_angle"): (
        "not an arm with an arm angle: joints 5, 6, 7 do not meet in one point: axis 7 misses the other two by 0.088"
    ),
    ("panda", "joint_1"): (
        "not an arm with a spherical wrist: joints 5, 6, 7 do not meet in one point: axis 7 misses the other two by "
        "0.088"
    ),
}


@pytest.mark.parametrize("kind", REDUNDANT)
def test_every_solution_leads_back_and_none_is_missed(kind: str) -> None:
    @settings(max_examples=3)
    @given(robots(kind), st.integers(0, 10**6))
    def check(robot: Robot, seed: int) -> None:
        arm = arm_of(robot)
        q = joint_vectors(robot, 200, seed)
        values = reference.redundancy(robot, q)
        solutions, solved = _solve(arm, q, values)

        assert np.where(solved, distances(arm, solutions, q), np.inf).min(axis=1).max() < 1e-6
        require_names(robot, arm.family.branches, arm.family, "the formula", solutions, solved)
        held = arm.family.held
        if held is not None:
            own = solutions[..., [joint.number - 1 for joint in held.joints]]
            np.testing.assert_array_equal(own, np.broadcast_to(values.reshape(len(q), 1, -1), own.shape))
        else:
            found = reference.redundancy(robot, solutions[solved])
            apart = found - np.repeat(values, solved.sum(axis=1))
            assert np.abs((apart + np.pi) % (2 * np.pi) - np.pi).max() < 1e-6

    check()


def _solve(arm: Arm, q: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Solutions for the poses of joint vectors, all of which lead back."""
    poses = reference.pose(arm.robot, q)[:, 0]
    solutions, valid = evaluate(arm, poses, values)
    solved = valid != 0

    assert set(np.unique(valid)) <= {0.0, 1.0}
    assert np.isfinite(solutions[solved]).all()
    assert errors(arm, solutions, poses)[solved].max() < 1e-9
    return solutions, solved


@pytest.mark.parametrize("robot", [PANDA, IIWA], ids=lambda robot: robot.name)
def test_any_value_leads_back(robot: Robot) -> None:
    """What is given need not be that of a known joint vector: there may then be no solution, but never a wrong one."""
    arm, q = arm_of(robot), joint_vectors(robot, 500, 1)
    values = np.random.default_rng(2).uniform(-2.5, 2.5, len(q))
    _, solved = _solve(arm, q, values)

    assert 0.2 < solved.any(axis=1).mean() < 1


@pytest.mark.parametrize("robot", [PANDA, IIWA, FREE], ids=["panda", "iiwa", "without limits"])
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_what_is_no_number_is_not_solved(robot: Robot, value: float) -> None:
    poses = reference.pose(robot, joint_vectors(robot, 100, 3))[:, 0]

    assert not evaluate(arm_of(robot), poses, np.full(100, value))[1].any()


def test_a_joint_outside_its_limits_is_not_solved() -> None:
    poses = reference.pose(PANDA, joint_vectors(PANDA, 100, 4))[:, 0]
    for value, holds in ((2.8973, True), (2.9, False), (-2.8973, True), (-2.9, False)):
        assert evaluate(arm_of(PANDA), poses, np.full(100, value))[1].any() == holds


@pytest.mark.parametrize("distance", [0.0, 1e-12, 1e-8, 1e-5])
@pytest.mark.parametrize("points", [(0.0, 0.0), (0.5, -1.0), (0.0, 2.0)])
def test_where_shoulder_and_wrist_are_on_axis_1(distance: float, points: tuple[float, float]) -> None:
    """Every arm angle has a solution there, and the elbow is where it says as far as that can be told."""
    arm = arm_of(FREE)
    bend, angle = points
    # The wrist above the shoulder: joint 2 turns the line upright that joint 4 has bent.
    turned = np.arctan2(0.4 * np.sin(bend), 0.42 + 0.4 * np.cos(bend))
    q = np.array([[0.3, -turned + distance, 0.0, -bend, 0.2, 0.7, -0.4]])
    q = np.concatenate([q, q * [1, -1, 1, -1, 1, 1, 1]])
    _, solved = _solve(arm, q, np.full(2, angle))

    assert solved.any(axis=1).all()


def test_the_arm_angle_turns_the_elbow_by_the_right_hand_rule() -> None:
    """An elbow above the line is at 0; at 90 deg it is on the right of a line that points forward."""
    q = np.zeros((1, 7))
    q[0, [1, 3]] = np.radians([20, 90])
    forward, elbow = _line_and_elbow(q)
    assert abs(elbow @ [0, 1, 0]) < 1e-12
    start = reference.redundancy(IIWA, q)[0]
    arm, pose = arm_of(IIWA), reference.pose(IIWA, q)[:, 0]
    for angle in (0.0, 0.4, -0.4, np.pi / 2):
        solutions, valid = evaluate(arm, pose, np.array([angle]))
        for solution in solutions[0][valid[0] != 0]:
            line, side = _line_and_elbow(solution[None])
            above = np.array([0, 0, 1]) - line[2] * line
            above /= np.linalg.norm(above)
            beside = np.cross(line, above)

            np.testing.assert_allclose(line, forward, atol=1e-9)
            np.testing.assert_allclose(side, np.cos(angle) * above + np.sin(angle) * beside, atol=1e-9)
    assert abs(start) < 1e-12 or abs(abs(start) - np.pi) < 1e-12


def _line_and_elbow(q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Unit vectors along the line from shoulder to wrist, and across it to the elbow, from the frames of the table."""
    frames = reference.frames(IIWA, q)
    shoulder, elbow, wrist = (frames[f"joint_{number}"][0, :3, 3] for number in (2, 4, 6))
    line = (wrist - shoulder) / np.linalg.norm(wrist - shoulder)
    side = elbow - shoulder - (elbow - shoulder) @ line * line
    return line, side / np.linalg.norm(side)


def test_the_robots_are_recognised() -> None:
    families = [recognise(robot) for robot in (PANDA, IIWA, with_redundancy(IIWA, "joint_1"))]

    assert all(isinstance(family, Family) for family in families)
    assert [family.name for family in families if isinstance(family, Family)] == [
        "arm whose axes 5, 6 meet, with spherical shoulder, joint_7 given",
        "S-R-S type: spherical shoulder, elbow and spherical wrist, arm angle given",
        "arm whose axes 2, 3 meet, with spherical wrist, joint_1 given",
    ]


@pytest.mark.parametrize(("name", "redundancy"), REASONS)
def test_the_failing_condition_is_named(name: str, redundancy: str) -> None:
    robot = with_redundancy(load(ROBOTS / f"{name}.yaml"), redundancy)
    unknown = recognise(robot)

    assert isinstance(unknown, NotClosedForm)
    assert REASONS[name, redundancy] in unknown.reasons
    with pytest.raises(KinegenError, match="has no closed-form inverse"):
        derive(robot, Quantity(Kind.INVERSE))


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        ("joint_4, theta: q, d: 0, ", "joint_4, theta: q, d: 0.01, ", "not in one plane square to axis 4"),
        ("d: d3, a: 0, ", "d: 0, a: 0, ", "axis 4 passes through the centre of the shoulder or of the wrist"),
        ("d: 0,  a: 0, alpha: 90,  limits: [-120, 120]}", "d: 0,  a: 0.01, alpha: 90}", "joints 1, 2, 3 do not meet"),
        ("joint_2, theta: q, d: 0,  a: 0, alpha: 90", "joint_2, theta: q, d: 0,  a: 0, alpha: 80", "at right angles"),
    ],
)
def test_an_arm_that_misses_a_condition_has_no_arm_angle(old: str, new: str, reason: str) -> None:
    text = (ROBOTS / "iiwa14_arm_angle.yaml").read_text().replace("d: 0,  a: 0, alpha: -90,", "d: 0, a: 0, alpha: -90,")
    assert old in text
    changed = text.replace(old, new, 1).replace("  d3: 0.42\n", "" if "d3" in old else "  d3: 0.42\n")
    unknown = recognise(loads(changed, "arm.yaml"))

    assert isinstance(unknown, NotClosedForm)
    assert any(reason in each for each in unknown.reasons), unknown.reasons


def test_the_digest_tells_redundancies_apart() -> None:
    plain = load(ROBOTS / "iiwa14.yaml")
    digests = {with_redundancy(plain, name).digest for name in ("joint_1", "joint_7", "arm_angle")}

    assert len({plain.digest, *digests}) == 4
