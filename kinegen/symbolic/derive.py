"""The symbolic stage: a robot and a quantity in, expressions out."""

from __future__ import annotations

from kinegen.outputs import Quantity
from kinegen.robot.model import Robot
from kinegen.symbolic.expressions import Expressions
from kinegen.symbolic.forward import derive_frames
from kinegen.symbolic.pose import derive_pose
from kinegen.symbolic.position import derive_position


def derive(robot: Robot, quantity: Quantity) -> Expressions:
    """Derive one kinematic quantity.

    Args:
        robot: The robot.
        quantity: What to derive.

    Returns:
        Exact expressions in joint variables and runtime parameters.
    """
    match quantity:
        case Quantity.POSE:
            return derive_pose(robot)
        case Quantity.FRAMES:
            return derive_frames(robot)
        case Quantity.POSITION:
            return derive_position(robot)
