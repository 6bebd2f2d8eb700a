"""Targets that leave a joint free: it is chosen within the limits of every joint that it moves."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from kinegen.io.load import loads
from kinegen.model.joint_bounds import joint_box
from kinegen.model.robot import Robot
from kinegen.verify import reference
from kinegen.verify.free_joint_samples import on_an_axis
from tests.inverse.arms import Arm, Floats, arm_of, errors, evaluate, joint_vectors

ROBOTS = Path(__file__).parents[2] / "robots"

IRB = ((0.29, 0, -90, 0), (0, 0.27, 0, -90), (0, 0.07, -90, 0), (0.302, 0, 90, 0), (0, 0, -90, 0), (0.072, 0, 0, 180))
"""Distance, length and twist of each row, and the offset of its joint: a small arm whose waist has no offset."""


UR = (
    (0.1625, 0, 90, 0),
    (0, -0.425, 0, 0),
    (0, -0.3922, 0, 0),
    (0.1333, 0, 90, 0),
    (0.0997, 0, -90, 0),
    (0.0996, 0, 0, 0),
)
LONG_HAND = (UR[0], (0, -0.2, 0, 0), (0, -0.25, 0, 0), UR[3], (0.4, 0, -90, 0), UR[5])
NO_HAND = (*UR[:4], (0, 0, -90, 0), UR[5])
NO_DEPTH = (*UR[:3], (0, 0, 90, 0), *UR[4:])
"""Arms with axes 2, 3 and 4 parallel: a UR5e, and with a long hand, none, and no depth."""


def arm_with(rows: tuple[tuple[float, ...], ...], limits: tuple[tuple[float, float] | None, ...]) -> Arm:
    """The arm of a standard table in m and deg."""
    return arm_of(loads(arm_text(rows, limits), "arm.yaml"))


def arm_text(rows: tuple[tuple[float, ...], ...], limits: tuple[tuple[float, float] | None, ...]) -> str:
    """The file of such an arm."""
    lines = (
        f"  - {{name: j{number}, theta: q + {theta}, d: {d}, a: {a}, alpha: {alpha}{_limits(own)}}}"
        for number, ((d, a, alpha, theta), own) in enumerate(zip(rows, limits, strict=True), start=1)
    )
    head = "kinegen: 1\nname: arm\nconvention: standard\nunits: {length: m, angle: deg}\njoints:"
    return "\n".join([head, *lines])


def _limits(own: tuple[float, float] | None) -> str:
    return f", limits: [{own[0]}, {own[1]}]" if own else ""


def unsolved(arm: Arm, q: Floats) -> int:
    """How many poses of joint vectors within the limits have no valid solution; every valid one leads to its pose."""
    targets = reference.pose(arm.robot, q)[:, 0]
    given = reference.redundancy(arm.robot, q) if arm.robot.redundancy else None
    solutions, valid = evaluate(arm, targets, given)
    assert errors(arm, solutions, targets)[valid != 0].max() < 1e-11
    return int((~(valid != 0).any(axis=1)).sum())


def planted(robot: Robot, count: int, **joints: float) -> Floats:
    """Random joint vectors within the limits, with some joints `q1`, `q2`, ... at a value."""
    q = joint_vectors(robot, count, 8)
    for name, value in joints.items():
        q[:, int(name[1:]) - 1] = value
    return q


@pytest.mark.parametrize("bend", [0.0, np.pi])
@pytest.mark.parametrize(
    ("fourth", "sixth"),
    [
        ((-70, 230), (-45, 45)),
        ((30, 160), (-40, 100)),
        ((60, 200), (10, 120)),
        ((-150, -20), (-100, 60)),
        ((-100, 100), (-100, 100)),
        ((-10, 250), (-100, 30)),
        ((100, 420), (-20, 300)),
    ],
)
def test_a_wrist_in_line_keeps_the_limits_of_both_joints(
    bend: float, fourth: tuple[float, float], sixth: tuple[float, float]
) -> None:
    """The limit of joint 6 that is nearer may leave joint 4 outside its own where the other one does not."""
    arm = arm_with(IRB, (None, None, None, fourth, None, sixth))

    assert unsolved(arm, planted(arm.robot, 300, q5=bend)) == 0


def test_a_shoulder_and_a_wrist_in_line_keep_their_limits_too() -> None:
    text = (ROBOTS / "iiwa14_arm_angle.yaml").read_text(encoding="utf-8")
    for old, new in (("-90, limits: [-170, 170]", "-90, limits: [-60, 120]"), ("[-175, 175]", "[-10, 100]")):
        text = text.replace(old, new)
    text = text.replace("90,  limits: [-170, 170]", "90,  limits: [-30, 20]")
    arm = arm_of(loads(text, "arm.yaml"))

    assert unsolved(arm, planted(arm.robot, 300, q2=0.0)) == 0
    assert unsolved(arm, planted(arm.robot, 300, q6=0.0)) == 0


def test_arms_whose_nearer_limit_will_do_have_no_statements_for_the_other_one() -> None:
    """With equal limits of joint 4 on either side of its start, the nearer limit of joint 6 is never the wrong one."""
    equal, uneven = (arm_with(IRB, (*[None] * 3, own, None, (-45, 45))) for own in ((-150, 150), (-70, 230)))

    assert len(uneven.program.statements) - len(equal.program.statements) > 10


def on_axis_1(arm: Arm, count: int) -> Floats:
    """Random joint vectors within the limits whose third joint brings the wrist's centre onto axis 1."""
    low, high = np.array(joint_box(arm.robot)).T
    q = joint_vectors(arm.robot, 20 * count, 5)
    lean = np.arcsin(-IRB[1][1] * np.sin(q[:, 1]) / np.hypot(IRB[2][1], IRB[3][0]))
    lean[::2] = np.pi - lean[::2]
    q[:, 2] = lean - np.arctan2(IRB[3][0], IRB[2][1]) - q[:, 1]
    q = q[(q[:, 2] >= low[2]) & (q[:, 2] <= high[2])][:count]
    poses = reference.pose(arm.robot, q)[:, 0]
    assert np.abs(poses[:, :2, 3] - IRB[5][0] * poses[:, :2, 2]).max() < 1e-15
    return q


FIVE = ((0.07, 0, 90, 0), (0, 0.15, 0, 0), (0, 0.19, 0, 0), (0, 0, 90, 90), (0.09, 0, 0, 0))
"""An arm with a waist, three parallel axes and a roll."""


@pytest.mark.parametrize(("first", "fifth"), [((-90, 90), (-60, 60)), ((20, 120), (30, 160)), ((-30, 40), (-200, -40))])
@pytest.mark.parametrize("way", [0.0, np.pi])
def test_a_hand_of_five_joints_along_axis_1_keeps_the_limits_of_joints_1_and_5(
    first: tuple[float, float], fifth: tuple[float, float], way: float
) -> None:
    arm = arm_with(FIVE, (first, (-180, 180), (-140, 140), None, fifth))
    q = planted(arm.robot, 200)
    q[:, 1] = np.pi / 2 - np.angle(0.15 + 0.19 * np.exp(1j * q[:, 2]))
    q[:, 3] = way - np.pi / 2 - q[:, 1] - q[:, 2]

    assert unsolved(arm, q) == 0


MEETING = ((300, 0, 60, 0), (0, 400, 90, 0), (100, 200, 45, 0), (300, 0, -90, 0), (0, 0, 90, 0), (100, 0, 0, 0))
"""An arm in mm whose axes 1 and 2 meet."""


def test_an_arm_in_mm_keeps_its_digits_where_axis_1_is_nearly_free() -> None:
    """Nearer to axis 1 than the threshold, what the point is off by in mm must not turn the wrist by as much in rad."""
    text = arm_text(MEETING, ((-120, 200),) * 6).replace("length: m", "length: mm")
    arm = arm_of(loads(text, "arm.yaml"))
    q = on_an_axis(arm.robot, arm.family, 100)
    q[:, 2] += np.random.default_rng(3).normal(size=len(q)) * 2e-13
    targets = reference.pose(arm.robot, q)[:, 0]
    solutions, valid = evaluate(arm, targets)
    rotations = reference.pose(arm.robot, solutions[valid != 0])[:, 0, :3, :3]
    wanted = np.broadcast_to(targets[:, None, :3, :3], (*valid.shape, 3, 3))[valid != 0]

    assert len(q) == 100
    assert (valid != 0).any(axis=1).all()
    assert np.abs(rotations - wanted).max() < 1e-12


EQUAL_LINKS = ((0, 0, 90, 0), (0, 0.43, 0, 0), (0.15, 0, 90, 90), (0.43, 0, -90, 0), (0, 0, 90, 0), (0.06, 0, 0, 0))
"""An arm with a shoulder beside axis 1, whose forearm folds onto its upper arm."""


def test_a_folded_arm_beside_axis_1_keeps_the_limits_of_its_wrist() -> None:
    """Its wrist is on axis 2, and as near to axis 1 as the shoulder lets it be: rounding must not decide joint 2."""
    limits = ((-160, 160), (-45, 225), (-225, 45), (-100, 100), (-100, 100), (-100, 100))
    arm = arm_with(EQUAL_LINKS, limits)
    q = planted(arm.robot, 400, q3=-np.pi)

    assert unsolved(arm, q) == 0
    assert unsolved(arm, q + np.array([0, 0, 1e-3, 0, 0, 0])) == 0


@pytest.mark.parametrize(
    "limits",
    [
        [(-165, 165), (-110, 110), (-110, 70), (-160, 160), (-120, 120), (-400, 400)],
        [(-165, 165), (-110, 110), (-110, 70), (-160, 160), (-60, 60), None],
        [(-165, 165), (-110, 110), (-110, 70), (-60, 60), (-120, 120), (-100, 100)],
        [(-65, 165), (-110, 110), (-110, 70), (-60, 120), (-20, 100), (30, 140)],
        [(100, 300), (-110, 110), (-110, 70), (100, 320), (-90, -10), (-190, -20)],
        [(-15, 15), (-110, 110), (-110, 70), (-60, 60), (10, 90), (30, 170)],
        [None, (-110, 110), (-110, 70), None, (-30, 40), None],
    ],
)
def test_with_the_wrist_on_axis_1_that_joint_is_where_the_wrist_keeps_its_limits(
    limits: list[tuple[float, float] | None],
) -> None:
    arm = arm_with(IRB, tuple(limits))
    q = on_axis_1(arm, 300)

    assert len(q) == 300
    assert unsolved(arm, q) == 0


@pytest.mark.parametrize("joint", ["joint_1", "joint_7"])
@pytest.mark.parametrize("limits", ["[-170, 170]", "[-100, 60]"])
def test_a_stretched_arm_of_seven_joints_keeps_the_limits_of_the_joints_after_the_elbow(
    joint: str, limits: str
) -> None:
    """Joint 3 is free there, and joints 5 to 7, or 2 to 1 seen from the tool, follow it."""
    text = (ROBOTS / "iiwa14.yaml").read_text(encoding="utf-8")
    text = text.replace("parameters:", f"redundancy: {joint}\nparameters:", 1).replace("[-170, 170]", limits)
    arm = arm_of(loads(text, "arm.yaml"))

    assert limits in text
    assert unsolved(arm, planted(arm.robot, 300, q4=0.0)) == 0


def test_an_arm_that_cannot_bring_its_wrist_onto_an_axis_has_no_statements_for_that() -> None:
    """A shift of the arm beside its waist keeps the wrist off axis 1; so do limits of the elbow."""
    limits = ((-165, 165), (-110, 110), (-110, 70), (-160, 160), (-120, 120), (-400, 400))
    shifted = ((*IRB[0],), (0.01, *IRB[1][1:]), *IRB[2:])
    raised = ((-165, 165), (40, 80), (-30, 10), *limits[3:])
    counts = [
        len(arm_with(rows, own).program.statements) for rows, own in ((IRB, limits), (shifted, limits), (IRB, raised))
    ]

    assert counts[0] > 1.3 * max(counts[1:])


ANY = (-360, 360)
NARROW = ((-20, 40), (-80, -30), (20, 70), (-100, -20), ANY, (-30, 20))


@pytest.mark.parametrize(
    ("rows", "limits"),
    [
        (UR, (ANY, (-180, 0), (-180, 0), ANY, ANY, ANY)),
        (UR, (ANY, (-150, -30), (-150, -30), ANY, ANY, ANY)),
        (UR, ((-170, 170), (-120, 135), (-150, 150), (-185, 185), ANY, (-350, 350))),
        (UR, ((-170, 170), (-100, 10), (0, 150), (-185, 185), ANY, (30, 300))),
        (UR, (ANY, ANY, ANY, (-90, 90), None, (0, 180))),
        (UR, NARROW),
        (LONG_HAND, (ANY, (-150, -30), (-150, 150), (-170, 170), ANY, ANY)),
        (NO_HAND, NARROW),
        (NO_DEPTH, ((100, 250), (-120, 135), (-150, 150), (-100, 100), ANY, (-50, 300))),
    ],
)
def test_with_axes_4_and_6_parallel_joints_2_to_6_keep_their_limits(
    rows: tuple[tuple[float, ...], ...], limits: tuple[tuple[float, float] | None, ...]
) -> None:
    """The target leaves open where the hand points, and joints 2, 3, 4 and 6 all follow it."""
    arm = arm_with(rows, limits)

    for bend in (0.0, np.pi):
        assert unsolved(arm, planted(arm.robot, 300, q5=bend)) == 0


def test_limits_of_a_turn_or_more_cost_a_ur_type_no_statement() -> None:
    free, turning = (len(arm_with(UR, (own,) * 6).program.statements) for own in (None, ANY))

    assert free == turning
