"""How far a joint of a valid solution may be beyond its limit: as far as rounding moves it, or not at all."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import kinegen
from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.inverse import notes_of, turnings
from kinegen.backends.scalar_types import ScalarType
from kinegen.derive.dispatch import derive
from kinegen.io.format import ReadOptions
from kinegen.io.load import loads
from kinegen.ir.lower import lower
from kinegen.model.joint_bounds import joint_box, reach
from kinegen.model.outputs import INVERSE_TRACKER, Kind, Quantity
from kinegen.model.robot import JointType, Robot
from kinegen.model.variants import with_strict_limits
from kinegen.verify import inverse_tracker
from kinegen.verify.closed_form_inverse import rooms_of
from kinegen.verify.reference import pose
from tests.builds.workshop import make, set_machine, write_robot
from tests.evaluation import run

HEAD = "kinegen: 1\nname: arm\nconvention: standard\nunits: {length: mm, angle: deg}\njoints:\n"

SCARA = (
    HEAD
    + """\
  - {name: J1, theta: q, d: 177, a: 175, alpha: 0, limits: [-155, 155]}
  - {name: J2, theta: q, d: 0, a: 175, alpha: 180, limits: [-145, 145]}
  - {name: J3, theta: 0, d: q, a: 0, alpha: 0, limits: [0, 150]}
  - {name: J4, theta: q, d: 0, a: 0, alpha: 0, limits: [-360, 360]}
"""
)

COLUMN = (
    HEAD
    + """\
  - {name: turn, theta: q, d: 0, a: 0, alpha: 0, limits: [-170, 170]}
  - {name: lift, theta: 0, d: q, a: 0, alpha: -90, limits: [100, 900]}
  - {name: stroke, theta: 0, d: q, a: 0, alpha: 0, limits: [200, 700]}
"""
)

GANTRY = (
    HEAD
    + """\
  - {name: x, theta: 0, d: q, a: 0, alpha: -90, limits: [0, 300]}
  - {name: y, theta: -90, d: q, a: 0, alpha: -90, limits: [0, 200]}
  - {name: z, theta: 0, d: q, a: 0, alpha: 0, limits: [0, 50]}
"""
)

POLAR = (
    HEAD
    + """\
  - {name: turn, theta: q, d: 0, a: 0, alpha: -90, limits: [-170, 170]}
  - {name: tilt, theta: q, d: 0, a: 0, alpha: 90, limits: [-100, 100]}
  - {name: stroke, theta: 0, d: q, a: 0, alpha: 0, limits: [200, 700]}
"""
)

ARMS = {
    "scara": (SCARA, (2,)),
    "column": (COLUMN, (1, 2)),
    "gantry": (GANTRY, (0, 1, 2)),
    "polar": (POLAR, (2,)),
}
"""Each with the joints that are a sum of coordinates of the target, or a distance."""


def valid_at(robot: Robot, q: np.ndarray) -> np.ndarray:
    """Whether targets of joint vectors (N, dof) have a solution there, in the kernel's operations."""
    program = lower(derive(robot, Quantity(Kind.INVERSE)))
    entries = run(robot, program, pose(robot, q)[:, 0, :3].reshape(len(q), 12))
    count = len(program.signature.branches.names) if program.signature.branches else 0
    joints = entries[:, :-count].reshape(len(q), count, robot.dof)
    near = np.abs(joints - q[:, None]).max(axis=2) < 1e-3
    return np.asarray((near & (entries[:, -count:] > 0)).any(axis=1))


@pytest.mark.parametrize("name", ARMS)
def test_a_joint_that_is_a_coordinate_ends_at_its_limit(name: str) -> None:
    """Both solutions and whole turns end there: 8,192 and 64 roundings of the reach, which are 1e-9 mm and 4e-3 mm."""
    text, copied = ARMS[name]
    robot = loads(text, "arm.yaml")
    for real in ScalarType:
        rooms = rooms_of(robot, Quantity(Kind.INVERSE), real.value)
        branches = lower(derive(robot, Quantity(Kind.INVERSE))).signature.branches
        assert branches is not None
        ends = turnings(robot, branches, real)
        for joint in copied:
            assert rooms[joint] <= (3.9e-6 if real is ScalarType.FLOAT else 9.2e-13) * reach(robot)
            high = joint_box(robot)[joint][1]
            assert 0 < ends[joint].highest - high <= 1.1 * rooms[joint] + 1e-4 * (real is ScalarType.FLOAT)
    limits = np.array(joint_box(robot))
    q = np.array([limits.mean(axis=1) + 0.1] * 2)
    for joint in copied:
        at = q.copy()
        at[:, joint] = limits[joint, 1] + np.array([0, 1e-5])
        assert valid_at(robot, at).tolist() == [True, False], joint


@pytest.mark.parametrize("name", ARMS)
def test_millimetres_give_an_angle_no_more_room(name: str) -> None:
    robot = loads(ARMS[name][0], "arm.yaml")
    axes = [each.type is JointType.REVOLUTE for each in robot.variables]
    rooms = rooms_of(robot, Quantity(Kind.INVERSE), "float")

    assert np.all(rooms[axes] < 3e-3)


def test_headers_name_the_joints_and_the_unit() -> None:
    robot = loads(SCARA, "arm.yaml")
    program = lower(derive(robot, Quantity(Kind.INVERSE)))
    lines = [
        " ".join(line.split())
        for line in notes_of(RobotPrograms(robot, (program,), ()), program, 110, (ScalarType.FLOAT,))
    ]

    start = next(place for place, line in enumerate(lines) if line.startswith("Rounding may move"))
    assert lines[start + 1 : start + 4] == ["2.7e-03 rad: J1, J2", "2.6e-03 mm: J3", "Targets:"]
    strict = with_strict_limits(robot)
    program = lower(derive(strict, Quantity(Kind.INVERSE)))
    words = " ".join(notes_of(RobotPrograms(strict, (program,), ()), program, 110, (ScalarType.FLOAT,)))
    assert "Limits are strict" in words
    assert "Rounding may move" not in words


@pytest.mark.parametrize("name", ARMS)
def test_strict_limits_leave_no_room(name: str) -> None:
    robot = with_strict_limits(loads(ARMS[name][0], "arm.yaml"))

    assert not rooms_of(robot, Quantity(Kind.INVERSE), "float").any()
    assert robot.digest != loads(ARMS[name][0], "arm.yaml").digest
    assert robot.digest == loads(ARMS[name][0], "arm.yaml", ReadOptions(strict_limits=True)).digest
    limits = np.array(joint_box(robot))
    q = np.array([limits.mean(axis=1) + 0.1] * 3)
    for joint in range(robot.dof):
        at = q.copy()
        beyond = 1e-9 if robot.variables[joint].type.value == "revolute" else 1e-6
        at[1:, joint] = limits[joint, 1] + np.array([-beyond, beyond])
        if not 1 < limits[joint, 1] / np.pi < 3:  # a joint of two turns is brought within them
            assert valid_at(robot, at).tolist() == [True, True, False], joint


def test_a_strict_package_calls_nothing_valid_that_its_limits_refuse(tmp_path: Path) -> None:
    with pytest.MonkeyPatch.context() as patch:
        set_machine(patch, tmp_path / "cache")
        robot = kinegen.load(SCARA, strict_limits=True)
        arm = kinegen.compile(robot, "pose,inverse", real="float")
    random = np.random.default_rng(1)
    low, high = np.array(arm.LIMITS).T
    q = np.clip(random.uniform(low - 0.2, high + 0.2, (4000, 4)), low - 1e-5, high + 1e-5)
    solutions, valid = arm.inverse(arm.fk(q))
    nearest, exists = arm.inverse(arm.fk(q), nearest=q)

    assert valid.any()
    assert arm.within_limits(solutions)[valid].all()
    assert exists.any()
    assert arm.within_limits(nearest[exists]).all()


def test_the_tracker_of_a_small_arm_keeps_to_what_its_kernels_state(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(inverse_tracker, "LINES", 8)
    set_machine(monkeypatch, tmp_path / "cache")
    path = write_robot(tmp_path, SCARA)
    built = make(path, tmp_path, quantities=(INVERSE_TRACKER,), reals=(ScalarType.FLOAT,), compile=False)
    (line,) = (each for each in built.proof.counts if each.startswith("inverse tracker"))

    # Strokes in mm are parts of the reach where solutions are told apart, or floats would have no path to follow.
    assert int(line.split()[2].replace(",", "")) > 100
