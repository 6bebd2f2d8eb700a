"""Targets that are singular, on the boundary, out of reach or none at all: what is chosen, and what is refused."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from kinegen.derive.inverse.singular_configurations import alignments, boundaries
from kinegen.io.load import load, loads
from kinegen.model.robot import TOOL
from kinegen.verify import reference
from tests.inverse.arms import Arm, Floats, arm_of, distances, errors, evaluate, joint_vectors

ROBOTS = Path(__file__).parents[2] / "robots"


@cache
def arm(name: str) -> Arm:
    return arm_of(load(ROBOTS / f"{name}.yaml"))


def poses(name: str, q: Floats) -> Floats:
    return reference.pose(arm(name).robot, q)[:, 0]


def apart_from_meeting_branches(arm: Arm, q: Floats) -> Floats:
    """Of some joint vectors those with the elbow bent and the wrist's centre beside axis 1.

    Elsewhere the rounding of the arm turns a wrist out of line, and its joints are where that little says.
    """
    for index, values in boundaries(arm.family):
        for value in values:
            q = q[np.abs(np.sin((q[:, index] - value) / 2)) > 0.05]
    jacobians = reference.Kinematics(arm.robot, q).jacobian(TOOL)
    return q[np.linalg.svd(jacobians[:, :, :3], compute_uv=False)[:, -1] > 0.01]


@pytest.mark.parametrize("name", ["puma560", "puma560_mm", "anthropomorphic_wrist", "stanford", "kr5", "tx60"])
def test_with_the_wrist_in_line_joint_4_stands_at_zero_and_joint_6_takes_the_sum(name: str) -> None:
    """Near the stretched arm, where rounding turns the wrist a little, any other sum may come out: it is left out."""
    ((index, (value, _)),) = alignments(arm(name).family)
    q = apart_from_meeting_branches(arm(name), joint_vectors(arm(name).robot, 300, 1))
    q[:, index] = value
    solutions, valid = evaluate(arm(name), poses(name, q))
    same_arm = (valid != 0) & (np.abs(solutions - q[:, None])[..., [0, 1, 2, 4]].max(axis=2) < 1e-13)
    chosen, given = solutions[same_arm], np.broadcast_to(q[:, None], solutions.shape)[same_arm]
    fourth, sixth = arm(name).family.axes.joints[3], arm(name).family.axes.joints[5]
    along = float(sum(a * b for a, b in zip(fourth.direction, sixth.direction, strict=True)))
    sums = chosen[:, 5] - given[:, 5] - along * float(fourth.rate * sixth.rate) * given[:, 3]

    assert len(chosen) > 50
    straight = chosen[:, 3] == 0  # and flipped, half a turn from there
    assert (np.abs(chosen[~straight, 3]) == np.pi).all()
    np.testing.assert_allclose(np.exp(1j * sums[straight]), 1, atol=1e-9)


@pytest.mark.parametrize("bend", [0.0, np.pi])
@pytest.mark.parametrize(
    "limits", ["[-100, 100]", "[-30, 80]", "[100, 200]", "[-170, 170]", "[-100, 260]", "[-180, 180]"]
)
@pytest.mark.parametrize("sign", ["q", "-q"])
def test_with_the_wrist_in_line_joint_6_keeps_its_limits(bend: float, limits: str, sign: str) -> None:
    """Joint 4 alone, or joint 6 alone, could not always make the sum of the two.

    Near the stretched and the folded arm rounding turns the wrist by more than a threshold: these are left out.
    """
    text = (ROBOTS / "puma560.yaml").read_text(encoding="utf-8")
    text = text.replace("theta: q, limits: [-110, 170]", "theta: q").replace(
        "theta: q, limits: [-100, 100]", "theta: q"
    )
    text = text.replace(
        "alpha: -90, a: 0,  d: 0,  theta: q}", f"alpha: -90, a: 0, d: 0, theta: {sign}, limits: {limits}}}"
    )
    narrow = arm_of(loads(text, "puma560.yaml"))
    q = apart_from_meeting_branches(narrow, joint_vectors(narrow.robot, 300, 4))
    q[:, 4] = bend
    targets = reference.pose(narrow.robot, q)[:, 0]
    solutions, valid = evaluate(narrow, targets)

    assert limits in text
    assert len(q) > 150
    assert (valid != 0).any(axis=1).all()
    assert errors(narrow, solutions, targets)[valid != 0].max() < 1e-12


def test_a_point_on_the_axis_of_the_waist_is_reached_with_joint_1_at_zero() -> None:
    target = np.array([[[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0.6], [0, 0, 0, 1.0]]])
    solutions, valid = evaluate(arm("anthropomorphic_wrist"), target)

    assert valid.any()
    assert (solutions[0, :4, 0] == 0).all()
    assert errors(arm("anthropomorphic_wrist"), solutions, target)[valid != 0].max() < 1e-9


@pytest.mark.parametrize("name", ["puma560", "kr5", "ur5", "al5d", "planar_3r", "scara", "anthropomorphic_arm"])
def test_the_stretched_arm_is_within_reach_although_rounding_may_put_it_outside(name: str) -> None:
    q = joint_vectors(arm(name).robot, 2000, 2)
    for index, values in boundaries(arm(name).family):
        for value in values:
            q[:, index] = value
            low, high = arm(name).family.axes.joints[index].limits or (-np.inf, np.inf)
            if low < value < high:
                solutions, valid = evaluate(arm(name), poses(name, q))

                assert (valid != 0).any(axis=1).all()
                assert errors(arm(name), solutions, poses(name, q))[valid != 0].max() < 1e-9


@pytest.mark.parametrize("name", ["scara", "anthropomorphic_arm"])
@pytest.mark.parametrize(("factor", "solved"), [(1 - 1e-6, 2), (1.0, 2), (1 + 1e-13, 2), (1 + 1e-9, 0), (1 + 1e-3, 0)])
def test_where_the_reach_ends(name: str, factor: float, solved: int) -> None:
    """The stretched arm along x: two solutions on it and within, none beyond."""
    target = poses(name, np.zeros((1, 3)))
    target[0, 0, 3] *= factor
    solutions, valid = evaluate(arm(name), target)

    assert (valid != 0)[0, :2].sum() == solved
    assert errors(arm(name), solutions, target)[valid != 0].max(initial=0.0) < 1e-9


@pytest.mark.parametrize("name", ["puma560", "ur5", "stanford", "al5d", "planar_3r", "scara", "cartesian"])
@pytest.mark.parametrize("spoilt", [np.nan, np.inf, -np.inf])
def test_a_target_with_a_number_that_is_none_has_no_solution(name: str, spoilt: float) -> None:
    good = poses(name, joint_vectors(arm(name).robot, 1, 3))
    reads_rotation = arm(name).family.aim == "pose"
    for row in range(3):
        for column in range(0 if reads_rotation else 3, 4):
            target = good.copy()
            target[0, row, column] = spoilt

            assert (evaluate(arm(name), target)[1] == 0).all()


AL5D = {"d1": 0.06858, "a3": 0.14679, "a4": 0.17751, "d5": 0.07719}


@pytest.mark.parametrize(
    ("x", "y", "z", "psi", "theta_5"),
    [(0.2, 0.05, 0.1, 0.3, 0.5), (-0.1, 0.21, 0.02, -1.1, -2.0), (0.0, -0.3, 0.1, 1.5, 1.0)],
)
def test_the_al5d_solves_the_formulas_of_its_document(x: float, y: float, z: float, psi: float, theta_5: float) -> None:
    """Wrist x, y, z, approach elevation psi and roll given: Lynxmotion AL5D lecture, with arc cosines corrected."""
    d1, a3, a4 = AL5D["d1"], AL5D["a3"], AL5D["a4"]
    r, theta_1 = np.hypot(x, y), np.arctan2(y, x)
    s = np.hypot(z - d1, r)
    alpha = np.arctan2(z - d1, r)
    beta = np.arccos((s**2 + a3**2 - a4**2) / (2 * s * a3))
    bend = np.arccos((s**2 - a3**2 - a4**2) / (2 * a3 * a4))
    down = [theta_1, alpha - beta, bend, psi - (alpha - beta) - bend, theta_5]
    up = [theta_1, alpha + beta, -bend, psi - (alpha + beta) + bend, theta_5]
    target = poses("al5d", np.array([down]))
    solutions, valid = evaluate(arm("al5d"), target)

    assert (valid[0, :2] != 0).all()
    np.testing.assert_allclose(poses("al5d", np.array([up])), target, atol=1e-12)
    assert distances(arm("al5d"), solutions[:, :1], np.array([up]))[0, 0] < 1e-9
    assert distances(arm("al5d"), solutions[:, 1:2], np.array([down]))[0, 0] < 1e-9


@pytest.mark.parametrize(("turn", "solved"), [(0.0, True), (1e-9, True), (1e-4, False), (0.3, False)])
def test_the_al5d_points_nowhere_but_in_the_plane_of_its_arm(turn: float, solved: bool) -> None:
    """a_x sin(theta_1) = a_y cos(theta_1): five joints leave one condition, turned away from about the vertical."""
    target = poses("al5d", np.array([[0.4, 0.9, -1.3, 0.2, 0.5]]))
    c, s = np.cos(turn), np.sin(turn)
    wrist = target[0, :3, 3] - AL5D["d5"] * target[0, :3, 2]
    target[0, :3, :3] = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ target[0, :3, :3]
    target[0, :3, 3] = wrist + AL5D["d5"] * target[0, :3, 2]

    assert (evaluate(arm("al5d"), target)[1] != 0).any() == solved


def test_straight_up_on_its_axis_the_al5d_keeps_its_waist_at_zero() -> None:
    target = np.eye(4)[None]
    target[0, 2, 3] = 0.3
    solutions, valid = evaluate(arm("al5d"), target)

    assert (solutions[0, :2, 0] == 0).all()
    assert (valid != 0).all()
    assert errors(arm("al5d"), solutions, target).max() < 1e-9


@pytest.mark.parametrize("tilt", [0.0, 1e-4, 0.5])
@pytest.mark.parametrize("rise", [0.0, 1e-4, 0.5])
def test_a_planar_arm_stays_in_its_plane(tilt: float, rise: float) -> None:
    target = poses("planar_3r", np.array([[0.3, 0.8, -0.4]]))
    c, s = np.cos(tilt), np.sin(tilt)
    target[0, :3, :3] = target[0, :3, :3] @ np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    target[0, 2, 3] += rise

    assert (evaluate(arm("planar_3r"), target)[1] != 0).all() == (tilt == rise == 0)


def test_limits_may_leave_no_branch() -> None:
    text = (ROBOTS / "anthropomorphic_arm.yaml").read_text(encoding="utf-8")
    robot = loads(text.replace("{name: waist,", "{name: waist, limits: [10, 20],"), "narrow.yaml")
    narrow = arm_of(robot)
    q = np.array([[np.radians(15), 0.3, 0.8], [np.radians(50), 0.3, 0.8]])
    _, valid = evaluate(narrow, reference.pose(robot, q)[:, 0])

    assert (valid != 0).any(axis=1).tolist() == [True, False]
