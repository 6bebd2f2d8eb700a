"""The numbers that the doctor evaluates are those of the reference."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings

from kinegen.errors import KinegenError
from kinegen.io.load import load, loads
from kinegen.model.robot import Robot
from kinegen.tools.doctor.numeric_table import Mount, Setting, table_of
from kinegen.tools.doctor.residual import Batch, predicted_poses
from kinegen.verify import reference
from tests.chains import robots
from tests.doctor.arms import ROBOTS, robot_text


def setting(robot: Robot, **changed: object) -> Setting:
    values = {
        "convention": robot.convention,
        "table_angle": robot.units.angle,
        "table_length": robot.units.length,
        "joint_angle": "rad",
        "pose_angle": "rad",
        "pose_length": robot.units.length,
        "form": "",
    }
    return Setting(**{**values, **changed})  # type: ignore[arg-type]


def frames(robot: Robot, frame: str, q: np.ndarray, **changed: object) -> np.ndarray:
    """Poses as 3x4 matrices, shape (K, 3, 4)."""
    table = table_of(robot, frame)
    batch = Batch(table.constants[None], np.ones((1, len(table.slots))))
    return np.stack(predicted_poses(table, setting(robot, **changed), batch, q), axis=-1)[:, 0].transpose(1, 0, 2)


@pytest.mark.parametrize("path", sorted(ROBOTS.glob("*.yaml")), ids=lambda path: path.stem)
def test_every_robot_and_frame_as_the_reference_has_it(path: Path) -> None:
    robot = load(path)
    q = np.random.default_rng(1).uniform(-1, 1, (4, robot.dof))
    expected = reference.frames(robot, q)
    for frame in robot.frame_names:
        scale = max(1.0, float(np.abs(expected[frame]).max()))
        assert np.abs(frames(robot, frame, q) - expected[frame][:, :3]).max() < 1e-12 * scale


@settings(max_examples=40)
@given(robot=robots())
def test_random_robots_of_all_conventions(robot: Robot) -> None:
    q = np.random.default_rng(2).uniform(-1, 1, (3, robot.dof))
    expected = reference.frames(robot, q)
    for frame in robot.tips:
        assert np.abs(frames(robot, frame, q) - expected[frame][:, :3]).max() < 1e-10


def test_units_scale_what_they_should() -> None:
    """Millimetres in the table and metres in the poses; the stroke of a prismatic joint is in the unit of the poses."""
    text = robot_text("stanford")
    robot, q = loads(text, "arm.yaml"), np.array([[0.3, -0.4, 0.5, 0.1, 0.2, -0.3]])
    scaled = frames(robot, "tool", q, pose_length="mm", joint_angle="deg")
    units = np.where([variable.type == "prismatic" for variable in robot.variables], 1e-3, np.pi / 180)
    expected = reference.pose(robot, q * units)[:, 0, :3].copy()
    expected[:, :, 3] *= 1000

    assert np.abs(scaled - expected).max() < 1e-9


def test_a_base_that_is_reversed_or_dropped() -> None:
    text = robot_text("puma560") + "base: {xyz: [1, 2, 3], rpy: [10, 20, 30]}\n"
    robot, plain = loads(text, "arm.yaml"), loads(robot_text("puma560"), "arm.yaml")
    q = np.random.default_rng(3).uniform(-1, 1, (2, 6))
    bare = reference.pose(plain, q)[:, 0]
    base = reference.frames(robot, q)["tool"][0] @ np.linalg.inv(bare[0])

    assert np.abs(frames(robot, "tool", q, base=Mount.DROPPED) - bare[:, :3]).max() < 1e-12
    expected = np.linalg.inv(base) @ bare
    assert np.abs(frames(robot, "tool", q, base=Mount.REVERSED) - expected[:, :3]).max() < 1e-12


def test_an_unknown_frame_is_named() -> None:
    with pytest.raises(KinegenError, match="unknown frame 'elbwo'"):
        table_of(loads(robot_text("puma560"), "arm.yaml"), "elbwo")
