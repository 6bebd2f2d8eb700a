"""What the inverse of an arm with seven joints is given besides the pose: the value of a joint, or the arm angle."""

from __future__ import annotations

from dataclasses import replace

from kinegen.errors import RobotFileError, quote
from kinegen.robot.digest import digest
from kinegen.robot.model import Robot

ARM_ANGLE = "arm_angle"
"""The angle of the elbow about the line from the shoulder to the wrist."""

JOINTS = 7
"""Six joints reach a pose; one more is what is given."""


def with_redundancy(robot: Robot, name: str) -> Robot:
    """Choose what an inverse is given besides the pose.

    Args:
        robot: The robot.
        name: Name of a joint, or `ARM_ANGLE`.

    Returns:
        The robot with that choice; whether there is a closed form with it is not known here.

    Raises:
        RobotFileError: If the robot has not seven joints and one tip, or no such joint.
    """
    check_redundancy(robot, name)
    found = replace(robot, redundancy=name)
    return replace(found, digest=digest(found))


def check_redundancy(robot: Robot, name: str) -> None:
    """Refuse a choice that no robot of this kind can have; arguments as for `with_redundancy`.

    Raises:
        RobotFileError: As `with_redundancy`.
    """
    if robot.is_tree:
        raise RobotFileError(f"redundancy: the robot has {len(robot.tips)} tips, not one")
    if robot.dof != JOINTS:
        count = f"{robot.dof} joint variable{'s' * (robot.dof != 1)}"
        raise RobotFileError(f"redundancy: the robot has {count}, expected {JOINTS}")
    known = [variable.name for variable in robot.variables]
    if name not in (*known, ARM_ANGLE):
        raise RobotFileError(
            f"redundancy: there is no joint {quote(name)} (expected {', '.join(known)} or {ARM_ANGLE})"
        )
