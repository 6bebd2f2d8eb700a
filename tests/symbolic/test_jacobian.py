"""The Jacobian of any robot, in every reference, is what the reference differentiates; and it costs little."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kinegen.derive.dispatch import derive
from kinegen.errors import KinegenError
from kinegen.io.load import load, loads
from kinegen.ir.lower import lower, runtime_defaults
from kinegen.ir.program import count
from kinegen.model.outputs import Kind, Quantity, Reference
from kinegen.model.robot import Robot
from kinegen.verify import reference
from tests.chains import robots
from tests.evaluation import as_poses, run

ROBOTS = Path(__file__).parents[2] / "robots"
POSES = 4
ROUNDING = 1e-12  # six links of about a metre, rates up to two, some dozens of operations each

references = st.sampled_from(Reference)


def joint_vectors(robot: Robot) -> np.ndarray:
    """Random ones, and two at which many arms are singular."""
    q = np.random.default_rng(11).uniform(-4, 4, (POSES, robot.dof))
    q[0], q[1] = 0, np.pi / 2
    return q


def jacobians(robot: Robot, q: np.ndarray, quantity: Quantity) -> np.ndarray:
    """The Jacobians that a kernel gives, shape (N, frames, 6, dof)."""
    program = lower(derive(robot, quantity))
    frames = len(program.signature.frames)
    found = run(robot, program, q, runtime_defaults(robot)) if robot.dof else np.zeros((len(q), 0))
    return found.reshape(len(q), frames, 6, robot.dof)


def expected(robot: Robot, q: np.ndarray, frames: tuple[str, ...], seen: Reference) -> np.ndarray:
    judge = reference.Kinematics(robot, q)
    return np.stack([judge.jacobian(frame, seen) for frame in frames], axis=1)


def operations(name: str, quantity: Quantity) -> int:
    counted = count(lower(derive(load(ROBOTS / f"{name}.yaml"), quantity)))
    assert counted.divisions == 0
    return counted.multiplications + counted.additions


@given(robots(), references)
@settings(max_examples=12)
def test_jacobian_of_any_chain_or_tree_is_the_derivative_of_the_reference(robot: Robot, seen: Reference) -> None:
    q = joint_vectors(robot)
    found = jacobians(robot, q, Quantity(Kind.JACOBIAN, seen))

    np.testing.assert_allclose(found, expected(robot, q, robot.tips, seen), atol=ROUNDING, rtol=0)


@given(robots(), references)
@settings(max_examples=10)
def test_pose_and_jacobian_of_one_call_are_those_of_the_reference(robot: Robot, seen: Reference) -> None:
    q = joint_vectors(robot)
    found = run(robot, lower(derive(robot, Quantity(Kind.FK_JACOBIAN, seen))), q, runtime_defaults(robot))
    tips = len(robot.tips)
    poses, rest = as_poses(found[:, : 12 * tips], tips), found[:, 12 * tips :].reshape(POSES, tips, 6, robot.dof)

    np.testing.assert_allclose(poses, reference.pose(robot, q)[:, :, :3], atol=ROUNDING, rtol=0)
    np.testing.assert_allclose(rest, expected(robot, q, robot.tips, seen), atol=ROUNDING, rtol=0)


@pytest.mark.parametrize("seen", Reference)
def test_a_pose_beside_a_jacobian_ends_in_the_attitude_of_its_own_fold(seen: Reference) -> None:
    """The constant turns after the joint merge into its axis in the pose, and stay apart in the Jacobian."""
    robot = loads(
        "kinegen: 1\nname: merged\nconvention: modified\nunits: {length: m, angle: deg}\njoints:\n"
        "  - {name: j, convention: hayati, theta: q - 30, a: 0, alpha: pi/3, beta: 2*atan(1/2)}\n"
        "base: {xyz: [0.1, 0, 0], rpy: [0, 12.5, -90]}\ntool: {xyz: [-0.25, 0.17, 0.1], rpy: [90, -90, 30]}\n",
        "merged.yaml",
    )
    q = joint_vectors(robot)
    found = [
        run(robot, lower(derive(robot, Quantity(kind, seen))), q, ()) for kind in (Kind.FK_JACOBIAN, Kind.JACOBIAN)
    ]

    np.testing.assert_allclose(as_poses(found[0][:, :12], 1), reference.pose(robot, q)[:, :, :3], atol=ROUNDING, rtol=0)
    np.testing.assert_allclose(found[0][:, 12:], found[1], atol=ROUNDING, rtol=0)


@given(robots(most_rows=4), references, st.data())
@settings(max_examples=10)
def test_jacobian_of_any_frame_is_the_derivative_of_the_reference(
    robot: Robot, seen: Reference, data: st.DataObject
) -> None:
    q = joint_vectors(robot)
    frame = data.draw(st.sampled_from(robot.frame_names))
    found = jacobians(robot, q, Quantity(Kind.JACOBIAN, seen, frame))

    np.testing.assert_allclose(found, expected(robot, q, (frame,), seen), atol=ROUNDING, rtol=0)


@given(robots(most_rows=4))
@settings(max_examples=6)
def test_spatial_jacobian_is_the_adjoint_of_the_pose_times_the_body_jacobian(robot: Robot) -> None:
    q = joint_vectors(robot)
    body, spatial = (jacobians(robot, q, Quantity(Kind.JACOBIAN, seen)) for seen in (Reference.LOCAL, Reference.WORLD))
    poses = reference.pose(robot, q)
    rotation, position = poses[..., :3, :3], poses[..., :3, 3]
    adjoint = np.zeros((*poses.shape[:2], 6, 6))
    adjoint[..., :3, :3] = adjoint[..., 3:, 3:] = rotation
    adjoint[..., :3, 3:] = np.cross(position[..., None, :], rotation, axisb=-2, axisc=-2)

    np.testing.assert_allclose(adjoint @ body, spatial, atol=10 * ROUNDING, rtol=0)


@pytest.mark.parametrize("seen", Reference)
@pytest.mark.parametrize("name", ["hand", "screw", "blocks", "jaco2", "calibrated_2r", "stanford"])
def test_jacobians_of_robots_of_every_kind(name: str, seen: Reference) -> None:
    robot = load(ROBOTS / f"{name}.yaml")
    q = joint_vectors(robot)
    found = jacobians(robot, q, Quantity(Kind.JACOBIAN, seen))

    # Some of these files are in millimetres.
    np.testing.assert_allclose(found, expected(robot, q, robot.tips, seen), atol=1000 * ROUNDING, rtol=0)


def test_a_joint_that_others_follow_moves_them_too() -> None:
    lines = (
        "kinegen: 1",
        "name: finger",
        "convention: standard",
        "units: {length: m, angle: deg}",
        "joints:",
        "  - {name: knuckle, alpha: 0, a: 0.04, d: 0, theta: q}",
        "  - {name: middle, alpha: 0, a: 0.03, d: 0, theta: 2/3*knuckle}",
        "  - {name: slide, alpha: 0, a: 0, d: -0.01*knuckle, theta: 0}",
    )
    robot = loads("\n".join(lines), "finger.yaml")
    q = np.array([[0.3]])
    first, both = q[0, 0], q[0, 0] * 5 / 3
    found = jacobians(robot, q, Quantity(Kind.JACOBIAN))[0, 0, :, 0]

    x = -0.04 * np.sin(first) - 0.03 * 5 / 3 * np.sin(both)
    y = 0.04 * np.cos(first) + 0.03 * 5 / 3 * np.cos(both)
    np.testing.assert_allclose(found, [x, y, -0.01, 0, 0, 5 / 3], atol=1e-15)


@pytest.mark.parametrize("frame", ["base", "station"])
def test_a_fixed_frame_has_columns_of_zeros(frame: str) -> None:
    text = (ROBOTS / "ur5.yaml").read_text(encoding="utf-8") + "frames:\n  station: {parent: base, xyz: [1, 0, 0]}\n"
    robot = loads(text, "ur5.yaml")
    for kind in (Kind.JACOBIAN, Kind.FK_JACOBIAN):
        for seen in Reference:
            entries = derive(robot, Quantity(kind, seen, frame)).entries
            assert entries[-36:] == (0,) * 36


def test_a_frame_that_does_not_exist_lists_those_that_do() -> None:
    with pytest.raises(KinegenError, match=r"unknown frame 'elbw' \(expected base, base_turn, shoulder, elbow, "):
        derive(load(ROBOTS / "ur5.yaml"), Quantity(Kind.JACOBIAN, frame="elbw"))


# Robot; multiplications and additions of pose and Jacobian beyond the pose alone, in the axes of the base.
BEYOND_THE_POSE = [("puma560", 16), ("ur5", 17), ("panda", 58), ("iiwa14", 47)]


@pytest.mark.parametrize(("name", "most"), BEYOND_THE_POSE)
def test_a_jacobian_costs_little_beside_the_pose(name: str, most: int) -> None:
    assert operations(name, Quantity(Kind.FK_JACOBIAN)) - operations(name, Quantity.POSE) <= most


def test_puma_needs_no_more_angles_for_its_jacobian() -> None:
    puma = load(ROBOTS / "puma560.yaml")
    for seen in Reference:
        program = lower(derive(puma, Quantity(Kind.FK_JACOBIAN, seen)))
        assert {angle.label for angle in program.angles} == {"1", "2", "23", "4", "5", "6"}


def test_the_tip_of_a_wrist_at_its_centre_does_not_move_with_the_wrist() -> None:
    entries = derive(load(ROBOTS / "puma560.yaml"), Quantity(Kind.JACOBIAN)).entries

    for row in range(3):
        assert entries[6 * row + 3 : 6 * row + 6] == (0, 0, 0)
