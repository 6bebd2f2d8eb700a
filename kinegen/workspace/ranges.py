"""The range that each joint variable is sampled over."""

from __future__ import annotations

import math
from dataclasses import dataclass

from kinegen.errors import KinegenError
from kinegen.robot.extent import joint_box
from kinegen.robot.model import JointType, Robot


@dataclass(frozen=True, slots=True)
class Range:
    """What one joint variable runs through.

    Attributes:
        name: Its joint.
        type: Revolute, prismatic or screw.
        low: Its lower bound, in radians or the file's length unit.
        high: Its upper bound.
        limited: Whether a file gives these bounds; otherwise they are a full turn, or the sum of the lengths to either
            side.
    """

    name: str
    type: JointType
    low: float
    high: float
    limited: bool

    @property
    def bounds(self) -> tuple[float, float]:
        """How far a search may go: a joint that turns in place without limits has none; a screw climbs as it turns."""
        if self.limited or self.type is not JointType.REVOLUTE:
            return self.low, self.high
        return -math.inf, math.inf


def joint_ranges(robot: Robot, limits_from: Robot | None = None) -> tuple[Range, ...]:
    """The ranges of a robot's joint variables.

    Args:
        robot: The robot.
        limits_from: Another robot whose joints of the same names give the limits; the robot itself if left out.

    Returns:
        One range for each joint variable, in order.

    Raises:
        KinegenError: If the other robot lacks a joint, has one of another type, or measures lengths otherwise.
    """
    source = limits_from or robot
    known = dict(zip((variable.name for variable in source.variables), joint_box(source), strict=True))
    variables = {variable.name: variable for variable in source.variables}
    if source.units.length != robot.units.length:
        raise KinegenError(f"{source.source} measures in {source.units.length}, {robot.source} in {robot.units.length}")
    found = []
    for variable in robot.variables:
        other = variables.get(variable.name)
        if other is None or other.type is not variable.type:
            what = "no joint variable" if other is None else f"a {other.type} joint"
            raise KinegenError(
                f"{source.source} has {what} {variable.name!r}, expected a {variable.type} one as in {robot.source}"
            )
        found.append(Range(variable.name, variable.type, *known[variable.name], limited=other.limits is not None))
    return tuple(found)
