"""What each number of an input may be, where a function is analysed: limits of the file, or what stands for them."""

from __future__ import annotations

import math
from dataclasses import dataclass

from kinegen.emit.actuators import ARRAY as ACTUATORS
from kinegen.outputs import Array
from kinegen.robot.actuators.extent import reading_ranges
from kinegen.robot.dimension import Dimension
from kinegen.robot.extent import joint_box, reach
from kinegen.robot.model import JointType, Robot

Box = tuple[tuple[float, float], ...]
"""Lower and upper bound of each of some numbers."""

TURNS = 2
"""How far a revolute joint without limits is taken to turn, to either side."""

RATE, ACCELERATION = 100.0, 10_000.0
"""Largest rate and acceleration of a joint, in rad or lengths for a second, to either side."""

FAR = 2
"""How many times the reach of the robot the coordinates of points and targets go."""

_READING = 1e6
"""Largest reading of an actuator whose range nothing says."""


@dataclass(frozen=True, slots=True)
class InputRange:
    """What one number of an input may be.

    Attributes:
        name: Of the joint, the actuator, or the entry, such as `base_T_tool[3]`.
        low: Lower bound.
        high: Upper bound.
        unit: `rad`, a length, one of these for a second or its square, or empty for a bare number.
        source: `limits` of the file, or `assumed`.
    """

    name: str
    low: float
    high: float
    unit: str
    source: str


def joint_range(robot: Robot) -> Box:
    """What is proved of which joint values: the limits, or what stands for them.

    Returns:
        Lower and upper bound of each joint variable, in radians or the file's length unit. Without limits: `TURNS`
        turns to either side, or for a prismatic joint the sum of the robot's lengths.
    """
    half = TURNS * 2 * math.pi
    return tuple(
        (-half, half) if variable.limits is None and variable.type is not JointType.PRISMATIC else bounds
        for variable, bounds in zip(robot.variables, joint_box(robot), strict=True)
    )


def input_ranges(robot: Robot, array: Array) -> tuple[InputRange, ...]:
    """The range of each number of an input, those of the last row of a matrix among them.

    Args:
        robot: The robot.
        array: The input.

    Returns:
        One range for each stored number, in order.
    """
    if array.is_pose:
        return _pose_ranges(robot, array)
    if array.name == ACTUATORS:
        return _reading_ranges(robot)
    if array.shape == (robot.dof,) and array.name in ("q", "qd", "qdd"):
        return _joint_ranges(robot, array.name)
    far = FAR * reach(robot)
    names = (f"{array.name}[{index}]" for index in range(array.stored))
    return tuple(InputRange(name, -far, far, robot.units.length, "assumed") for name in names)


def _joint_ranges(robot: Robot, name: str) -> tuple[InputRange, ...]:
    """Joint values, or their rates or accelerations."""
    most = {"qd": RATE, "qdd": ACCELERATION}.get(name)
    found = []
    for variable, (low, high) in zip(robot.variables, joint_range(robot), strict=True):
        unit = robot.units.length if variable.type is JointType.PRISMATIC else "rad"
        if most is None:
            source = "assumed" if variable.limits is None else "limits"
            found.append(InputRange(variable.name, low, high, unit, source))
        else:
            unit += "/s" if name == "qd" else "/s^2"
            found.append(InputRange(f"{name} of {variable.name}", -most, most, unit, "assumed"))
    return tuple(found)


def _reading_ranges(robot: Robot) -> tuple[InputRange, ...]:
    units = {Dimension.LENGTH: robot.units.length, Dimension.ANGLE: "rad", Dimension.NUMBER: ""}
    found = []
    for reading, (low, high) in zip(robot.actuators.readings, reading_ranges(robot), strict=True):
        source = "limits" if math.isfinite(low) and math.isfinite(high) else "assumed"
        bounds = max(low, -_READING), min(high, _READING)
        found.append(InputRange(reading.name, *bounds, units[reading.dimension], source))
    return tuple(found)


def _pose_ranges(robot: Robot, array: Array) -> tuple[InputRange, ...]:
    """Rotation entries between -1 and 1, each by itself; positions as far as `FAR` times the reach."""
    far, found = FAR * reach(robot), []
    for index in range(array.stored):
        row, column = divmod(index % 16, 4)
        name = f"{array.name}[{index}]"
        if row == 3:
            found.append(InputRange(name, float(column == 3), float(column == 3), "", "assumed"))
        elif column == 3:
            found.append(InputRange(name, -far, far, robot.units.length, "assumed"))
        else:
            found.append(InputRange(name, -1.0, 1.0, "", "assumed"))
    return tuple(found)
