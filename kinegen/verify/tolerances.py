"""How far a kernel may be from the reference."""

from __future__ import annotations

import math
from dataclasses import dataclass

from kinegen.robot.extent import joint_box
from kinegen.robot.model import JointType, Robot


@dataclass(frozen=True, slots=True)
class Tolerances:
    """Largest accepted errors: entries of a rotation as they are, positions relative to the robot's reach.

    Velocities and derivatives are measured likewise, by their own size; `expectation.expect` says how.

    Attributes:
        double: About 450 units of rounding. The longest chain in `robots/` loses twenty of them, a wrong sign or
            constant loses 1e13.
        float: About 17 units of rounding; seven joints lose about five.
    """

    double: float = 1e-13
    float: float = 2e-6


TOLERANCES = Tolerances()

UNITS = {"double": 2.0**-53, "float": 2.0**-24}
"""Relative error of one rounding."""

_TURN = 2 * math.pi * (1 + 1e-9)


def accepted_error(robot: Robot, real: str) -> float:
    """The largest accepted error of a robot's kernels.

    It is the one of `TOLERANCES`, as long as every joint stays within a turn to either side of zero. A joint that turns
    further adds what it costs to round its sums with the angles of parallel joints: a unit of rounding of the largest
    angle for each of the other joints. No kernel can be better, since the sums are what it takes the sine of.

    Args:
        robot: The robot.
        real: `double` or `float`.

    Returns:
        For entries of a rotation; for positions relative to the reach.
    """
    base = TOLERANCES.double if real == "double" else TOLERANCES.float
    box = zip(robot.variables, joint_box(robot), strict=True)
    angles = [max(-low, high) for variable, (low, high) in box if variable.type is not JointType.PRISMATIC]
    beyond = sum(angle for angle in angles if angle > _TURN)
    return base + UNITS[real] * beyond * max(1, len(angles) - 1)
