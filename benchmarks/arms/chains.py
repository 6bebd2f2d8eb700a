"""Chains of fixed transforms and axes, as other packages have them in floating point, as robots.

A chain is written as URDF and read like any other file. What floating point left of decimal numbers is cleared before:
lengths and angles are rounded to nine decimals, and angles within 1e-7 rad of whole degrees become these.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kinegen.io.format import ReadOptions
from kinegen.io.load import loads
from kinegen.model.robot import Robot

Array = NDArray[np.float64]

PLACES = 9
"""Decimals of metres and radians that are kept."""

NEAR = 1e-7
"""How near an angle must be to whole degrees to be taken as them, in rad."""


@dataclass(frozen=True, slots=True)
class Link:
    """A joint: what comes before it, its motion, and what comes after it.

    Attributes:
        before: Fixed transform, 4x4, in metres.
        axis: Direction of the axis after it.
        turns: Whether the joint turns; otherwise it shifts.
        after: Fixed transform, 4x4.
        limits: Bounds of the variable; None without.
    """

    before: Array
    axis: tuple[float, float, float]
    turns: bool
    after: Array
    limits: tuple[float, float] | None


def robot_of(name: str, links: list[Link]) -> Robot:
    """The robot with these joints, called `joint_1` and so on."""
    lines = [f'<robot name="{name}">', '<link name="base_link"/>']
    parent, rest = "base_link", np.eye(4)
    for number, link in enumerate(links, 1):
        child, kind = f"link_{number}", "revolute" if link.turns else "prismatic"
        kind = "continuous" if link.limits is None and link.turns else kind
        lines.append(f'<link name="{child}"/><joint name="joint_{number}" type="{kind}">')
        lines.append(f'<parent link="{parent}"/><child link="{child}"/>{_origin(rest @ link.before)}')
        lines.append(f'<axis xyz="{_numbers(_cleaned(np.array(link.axis)))}"/>')
        low, high = link.limits or (-1, 1)
        if kind != "continuous":
            lines.append(f'<limit lower="{low!r}" upper="{high!r}" effort="1" velocity="1"/>')
        lines.append("</joint>")
        parent, rest = child, link.after
    lines.append('<link name="tool"/><joint name="to_tool" type="fixed">')
    lines.append(f'<parent link="{parent}"/><child link="tool"/>{_origin(rest)}</joint></robot>')
    return loads("\n".join(lines), f"{name}.urdf", ReadOptions())


def _origin(pose: Array) -> str:
    return f'<origin xyz="{_numbers(np.round(pose[:3, 3], PLACES) + 0.0)}" rpy="{_numbers(_angles(pose[:3, :3]))}"/>'


def _numbers(values: Array) -> str:
    return " ".join(repr(float(value)) for value in values)


def _cleaned(direction: Array) -> Array:
    """A direction whose entries beside 0 and 1 are these."""
    near = np.round(direction)
    return np.where(np.abs(direction - near) < NEAR, near, direction) + 0.0


def _angles(rotation: Array) -> Array:
    """Roll, pitch and yaw."""
    across = math.hypot(rotation[0, 0], rotation[1, 0])
    pitch = math.atan2(-rotation[2, 0], across)
    if across < NEAR:
        roll, yaw = math.atan2(-rotation[1, 2], rotation[1, 1]), 0.0
    else:
        roll, yaw = math.atan2(rotation[2, 1], rotation[2, 2]), math.atan2(rotation[1, 0], rotation[0, 0])
    found = np.array([roll, pitch, yaw])
    whole = np.radians(np.round(np.degrees(found)))
    return np.where(np.abs(found - whole) < NEAR, whole, np.round(found, PLACES)) + 0.0
