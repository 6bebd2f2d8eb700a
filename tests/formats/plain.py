"""A plain evaluation of URDF, for comparison: what the format says, in floats, with nothing of kinegen."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET

import numpy as np

URDF_TWO = """\
<robot name="two">
  <link name="world"/>
  <link name="plate"/>
  <link name="lower"><visual><geometry><mesh filename="/dev/zero"/></geometry></visual></link>
  <link name="upper"/>
  <link name="flange"/>
  <link name="finger"/>
  <joint name="left-hip joint" type="revolute">
    <parent link="plate"/>
    <child link="lower"/>
    <origin xyz="0 0 0.089159" rpy="0 1.5708 0"/>
    <axis xyz="0 -1 0"/>
    <limit lower="-3.14" upper="3.14" effort="1" velocity="1"/>
  </joint>
  <joint name="mount" type="fixed">
    <parent link="world"/>
    <child link="plate"/>
  </joint>
  <joint name="slide" type="prismatic">
    <parent link="lower"/>
    <child link="upper"/>
    <origin xyz="0.1 0.2 0.3" rpy="0.1 -0.2 3.141"/>
    <axis xyz="1 2 -2"/>
    <limit lower="0" upper="0.5" effort="1" velocity="1"/>
  </joint>
  <joint name="end" type="fixed">
    <parent link="upper"/>
    <child link="flange"/>
    <origin xyz="0 0 0.05" rpy="0.3 0 0"/>
  </joint>
  <joint name="finger_joint" type="prismatic">
    <parent link="lower"/>
    <child link="finger"/>
    <origin xyz="0 0.02 0"/>
    <axis xyz="0 1 0"/>
    <limit lower="0" upper="0.5" effort="1" velocity="1"/>
    <mimic joint="slide" multiplier="-0.5" offset="0.01"/>
  </joint>
</robot>
"""


def turn(axis: np.ndarray, angle: float) -> np.ndarray:
    """A rotation about an axis of any length, by Rodrigues' formula."""
    x, y, z = axis / np.linalg.norm(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    pose = np.eye(4)
    pose[:3, :3] = np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross
    return pose


def shift(vector: np.ndarray) -> np.ndarray:
    """A translation."""
    pose = np.eye(4)
    pose[:3, 3] = vector
    return pose


def _numbers(element: ET.Element | None, key: str, usual: str) -> np.ndarray:
    return np.array([float(word) for word in (usual if element is None else element.get(key, usual)).split()])


def _value(joint: ET.Element, joints: dict[str, ET.Element], q: dict[str, float]) -> float:
    mimic = joint.find("mimic")
    if mimic is None:
        return q.get(joint.get("name", ""), 0.0)
    master = _value(joints[mimic.get("joint", "")], joints, q)
    return float(mimic.get("multiplier", "1")) * master + float(mimic.get("offset", "0"))


def plain_urdf(text: str, q: dict[str, float]) -> dict[str, np.ndarray]:
    """The pose of each link in the root link.

    Args:
        text: URDF.
        q: Values of joints by name; zero for the others.
    """
    robot = ET.fromstring(text)  # noqa: S314 - text of these tests
    joints = {joint.get("name", ""): joint for joint in robot.findall("joint")}
    children = {joint.find("child").get("link"): joint for joint in joints.values()}  # type: ignore[union-attr]
    poses: dict[str, np.ndarray] = {}

    def pose(link: str) -> np.ndarray:
        if link not in poses:
            joint = children.get(link)
            poses[link] = np.eye(4) if joint is None else pose(joint.find("parent").get("link")) @ local(joint)  # type: ignore[union-attr, arg-type]
        return poses[link]

    def local(joint: ET.Element) -> np.ndarray:
        origin = joint.find("origin")
        x, y, z = np.eye(3)
        roll, pitch, yaw = _numbers(origin, "rpy", "0 0 0")
        fixed = shift(_numbers(origin, "xyz", "0 0 0")) @ turn(z, yaw) @ turn(y, pitch) @ turn(x, roll)
        axis, value = _numbers(joint.find("axis"), "xyz", "1 0 0"), _value(joint, joints, q)
        if joint.get("type") in ("revolute", "continuous"):
            return fixed @ turn(axis, value)
        if joint.get("type") == "prismatic":
            return fixed @ shift(axis / np.linalg.norm(axis) * value)
        return fixed

    for link in robot.findall("link"):
        pose(link.get("name", ""))
    return poses
