"""The URDF writer: a plain reading of what is written gives the poses of every frame."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings

from kinegen.errors import KinegenError
from kinegen.io.link_writers import write_urdf
from kinegen.io.load import load, loads
from kinegen.model.dh_conversion.link_tree import METRES
from kinegen.model.robot import ROOT, JointType, Robot
from kinegen.verify import reference
from tests.chains import robots

ROBOTS = sorted((Path(__file__).parents[2] / "robots").glob("*.yaml"))


def turn(axis: int, angle: float) -> np.ndarray:
    """The rotation about a coordinate axis, shape (4, 4)."""
    found = np.eye(4)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    found[i, i] = found[j, j] = np.cos(angle)
    found[j, i] = np.sin(angle)
    found[i, j] = -found[j, i]
    return found


def shift(xyz: np.ndarray) -> np.ndarray:
    """A translation, shape (4, 4)."""
    found = np.eye(4)
    found[:3, 3] = xyz
    return found


def numbers(text: str | None) -> np.ndarray:
    return np.array([float(each) for each in (text or "0 0 0").split()])


def link_poses(text: str, values: dict[str, float]) -> dict[str, np.ndarray]:
    """The poses of all links, as the documentation of URDF defines them; lengths in metres."""
    root = ET.fromstring(text)  # noqa: S314
    names = [link.get("name") for link in root.findall("link")]
    joints = root.findall("joint")
    children = [joint.find("child").get("link") for joint in joints]
    assert len(set(names)) == len(names)
    assert len({joint.get("name") for joint in joints}) == len(joints)
    assert sorted(children) == sorted(set(names) - {names[0]}), "each link but the first is the child of one joint"
    found = {names[0]: np.eye(4)}
    for joint in joints:
        origin = joint.find("origin")
        xyz, rpy = (numbers(None if origin is None else origin.get(key)) for key in ("xyz", "rpy"))
        pose = (
            found[joint.find("parent").get("link")] @ shift(xyz) @ turn(2, rpy[2]) @ turn(1, rpy[1]) @ turn(0, rpy[0])
        )
        kind, mimic = joint.get("type"), joint.find("mimic")
        if kind != "fixed":
            value = (
                values[joint.get("name")]
                if mimic is None
                else values[mimic.get("joint")] * float(mimic.get("multiplier"))
            )
            axis = numbers(joint.find("axis").get("xyz"))
            assert abs(axis).tolist() == [0, 0, 1]
            assert (joint.find("limit") is not None) == (kind != "continuous")
            move = shift(axis * value) if kind == "prismatic" else turn(2, axis[2] * value)
            pose = pose @ move
        found[joint.find("child").get("link")] = pose
    return found


def furthest(robot: Robot, text: str) -> float:
    """The greatest difference of any frame, in metres, relative to the size of the robot."""
    rng = np.random.default_rng(1)
    metres = float(METRES[robot.units.length])
    worst = 0.0
    for _ in range(5):
        q = rng.uniform(-1, 1, robot.dof)
        slides = [each.type is JointType.PRISMATIC for each in robot.variables]
        values = {
            each.name: float(x) * (metres if s else 1.0) for each, x, s in zip(robot.variables, q, slides, strict=True)
        }
        links = link_poses(text, values)
        for name, pose in reference.frames(robot, q).items():
            if name == "wrist" and name not in links:
                continue
            scaled = pose[0].copy()
            scaled[:3, 3] *= metres
            size = 1 + np.abs(scaled).max()
            worst = max(worst, np.abs(links["base_link" if name == ROOT else name] - scaled).max() / size)
    return worst


@pytest.mark.parametrize("path", ROBOTS, ids=lambda path: path.stem)
def test_every_frame_of_the_robots_of_the_project(path: Path) -> None:
    robot = load(path)

    assert furthest(robot, write_urdf(robot)) < 1e-14


@settings(max_examples=25, deadline=None, suppress_health_check=list(HealthCheck))
@given(robots(most_rows=6))
def test_every_frame_of_random_robots(robot: Robot) -> None:
    try:
        text = write_urdf(robot)
    except KinegenError as error:
        assert "times its variable" in str(error)  # noqa: PT017
        return
    assert furthest(robot, text) < 1e-13


def test_exact_decimals_stay_as_they_are_and_others_are_named() -> None:
    robot = loads(
        "kinegen: 1\nname: r\nconvention: modified\nunits: {length: mm, angle: deg}\n"
        "joints:\n  - {name: one, a: 0, alpha: 0, d: 333, theta: q, limits: [-90, 90]}\n"
        "  - {name: two, a: 1/3, alpha: 90, d: 0.089159, theta: q}\n",
        "r.yaml",
    )

    text = write_urdf(robot)

    assert 'xyz="0 0 0.333"' in text
    assert "0.000089159" in text
    assert 'lower="-1.5707963267948966192" upper="1.5707963267948966192"' in text
    assert "joint two: rounded to 20 digits: 0.00033333333333333333333" in text


def test_a_joint_with_a_factor_is_one_line() -> None:
    robot = loads(
        "kinegen: 1\nname: r\nconvention: modified\nunits: {length: m, angle: deg}\n"
        "joints:\n  - {name: one, a: 0, alpha: 0, d: 0, theta: 2*q}\n",
        "r.yaml",
    )

    with pytest.raises(KinegenError, match=r"joint one turns by 2.0 times its variable"):
        write_urdf(robot)


def test_what_a_urdf_cannot_hold_is_said() -> None:
    assert "the actuators are left out" in write_urdf(load(ROBOTS[0].parent / "palletiser.yaml"))
    assert "parameter tilt is a constant here" in write_urdf(load(ROBOTS[0].parent / "calibrated_2r.yaml"))
    assert "joint lift has no limits" in write_urdf(load(ROBOTS[0].parent / "cartesian.yaml"))
