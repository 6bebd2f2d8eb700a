"""The posture that a robot is shown in at first, and how far its joints go."""

from __future__ import annotations

import numpy as np
import pytest

from kinegen.io.load import load, loads
from kinegen.model.actuator_limits import reading_box, reading_ranges
from kinegen.model.joint_bounds import joint_box
from kinegen.model.robot import Robot
from kinegen.tools.pictures import home
from kinegen.tools.pictures.postures import home_readings, joint_ranges
from kinegen.verify import reference
from kinegen.verify.reference.actuators import Actuation
from tests.viewer.pages import ROBOTS

DRIVEN = ("differential_wrist", "motoman_l3", "palletiser", "wire_arm")


def robot(name: str) -> Robot:
    return load(ROBOTS / f"{name}.yaml")


@pytest.mark.parametrize("name", DRIVEN)
def test_the_first_posture_is_one_that_the_actuators_reach(name: str) -> None:
    arm = robot(name)
    readings = home_readings(arm)

    low, high = np.array(reading_ranges(arm)).T
    assert ((readings >= low - 1e-12) & (readings <= high + 1e-12)).all()
    np.testing.assert_allclose(Actuation(arm, readings).joints[0], home(arm), atol=1e-9)


@pytest.mark.parametrize("name", DRIVEN)
def test_joints_without_limits_go_as_far_as_their_actuators(name: str) -> None:
    arm = robot(name)
    box = np.array(reading_box(arm))
    vectors = np.random.default_rng(2).uniform(box[:, 0], box[:, 1], (3000, len(box)))
    joints = np.asarray(Actuation(arm, vectors).joints, dtype=float)
    low, high = np.array(joint_ranges(arm)).T

    assert (joints >= low - 1e-9).all()
    assert (joints <= high + 1e-9).all()
    assert ((home(arm) >= low) & (home(arm) <= high)).all()
    # No wider than is needed: random vectors come near to the ends, or nearer than the corners of a box let them.
    assert (np.ptp(joints, axis=0) > 0.6 * (high - low)).all()


def test_a_motoman_is_shown_clear_of_the_ground() -> None:
    arm = robot("motoman_l3")
    heights = {name: found[0, 2, 3] for name, found in reference.frames(arm, home(arm)).items()}
    moved = ("joint_3", "joint_4", "joint_5", "tool")

    assert min(heights[name] for name in moved) > 0.25 * 1.1


def test_a_robot_that_reaches_zero_is_shown_there() -> None:
    for name in ("differential_wrist", "wire_arm", "puma560", "scara"):
        assert not home(robot(name)).any(), name
    # The Panda's fourth joint cannot be straight.
    limits = joint_box(robot("panda"))
    assert home(robot("panda"))[3] == limits[3][1] < 0


def test_the_first_posture_can_be_changed_without_an_effect_on_the_next() -> None:
    arm = robot("motoman_l3")
    first = home(arm)
    first[:] = 7
    home_readings(arm)[:] = 7

    assert not (home(arm) == 7).any()
    assert not (home_readings(arm) == 7).any()


def test_many_actuators_need_no_grid() -> None:
    names = [f"j{index}" for index in range(16)]
    rows = "\n".join(f"  - {{name: {name}, theta: q, d: 0, a: 0.1, alpha: 0}}" for name in names)
    readings = "\n".join(f"    m{name}: {{dimension: angle, limits: [10, 30]}}" for name in names)
    drives = "\n".join(f"    - {{joint: {name}, value: 2*m{name}}}" for name in names)
    arm = loads(
        "kinegen: 1\nname: snake\nconvention: standard\nunits: {length: m, angle: deg}\n"
        f"joints:\n{rows}\nactuators:\n  readings:\n{readings}\n  joints:\n{drives}\n",
        "snake.yaml",
    )

    np.testing.assert_allclose(np.degrees(joint_ranges(arm)), [[20, 60]] * 16)
    np.testing.assert_allclose(np.degrees(home(arm)), [40] * 16)


HINGE = """\
kinegen: 1
name: hinge
convention: standard
units: {length: m, angle: deg}
joints:
  - {name: hinge, theta: q, d: 0, a: 1, alpha: 0LIMITS}
actuators:
  readings: {motor: {dimension: RANGE}}
  joints: [{joint: hinge, value: VALUE}]
"""


@pytest.mark.parametrize(
    ("limits", "reading", "value", "posture", "ends"),
    [
        ("", "number", "2*motor + 400", 0, (-180, 180)),
        ("", "angle, limits: [10, 50]", "2*motor + 400", 460, (420, 500)),
        (", limits: [10, 20]", "angle, limits: [15, 40]", "motor", 19.17, (10, 20)),
        (", limits: [10, 20]", "angle, limits: [30, 40]", "motor", 10, (10, 20)),
    ],
    ids=["no bounds", "turned by more than a turn", "half of the range", "limits that nothing reaches"],
)
def test_ranges_and_limits_of_any_kind_give_a_posture(
    limits: str, reading: str, value: str, posture: float, ends: tuple[float, float]
) -> None:
    text = HINGE.replace("LIMITS", limits).replace("RANGE", reading).replace("VALUE", value)
    arm = loads(text, "hinge.yaml")

    assert np.degrees(home(arm)) == pytest.approx([posture], abs=0.01)
    assert np.degrees(joint_ranges(arm)[0]) == pytest.approx(ends, abs=1e-6)
