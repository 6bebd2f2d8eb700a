"""What an inverse is given besides the pose: the values of joints that it does not solve for, or the arm angle."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from kinegen.errors import RobotFileError, quote
from kinegen.robot.digest import digest
from kinegen.robot.model import JointType, Robot

ARM_ANGLE = "arm_angle"
"""The angle of the elbow about the line from the shoulder to the wrist."""

JOINTS = 7
"""Six joints reach a pose; one more is what is given."""


def with_redundancy(robot: Robot, names: str | Iterable[str]) -> Robot:
    """Choose what an inverse is given besides the pose.

    Args:
        robot: The robot.
        names: Names of joints in the order in which their values are given, or `ARM_ANGLE`; in one text with commas, or
            one by one.

    Returns:
        The robot with that choice; whether there is a closed form with it is not known here.

    Raises:
        RobotFileError: If the robot has no such joint or too few joints, or no arm angle can be given.
    """
    text = joined(names.split(",") if isinstance(names, str) else names)
    check_redundancy(robot, text)
    found = replace(robot, redundancy=text)
    return replace(found, digest=digest(found))


def joined(names: Iterable[str]) -> str:
    """Names as `Robot.redundancy` has them: with commas, without blanks."""
    return ",".join(name.strip() for name in names)


def check_redundancy(robot: Robot, text: str) -> None:
    """Refuse a choice that no robot of this kind can have.

    Args:
        robot: The robot.
        text: As `Robot.redundancy` has it.

    Raises:
        RobotFileError: As `with_redundancy`.
    """
    names, known = text.split(","), [variable.name for variable in robot.variables]
    for place, name in enumerate(names):
        if name not in (*known, ARM_ANGLE):
            expected = f"{', '.join(known)} or {ARM_ANGLE}"
            raise RobotFileError(f"redundancy: there is no joint {quote(name)} (expected {expected})")
        if name in names[:place]:
            raise RobotFileError(f"redundancy: joint {quote(name)} is named twice")
    if ARM_ANGLE in names and ARM_ANGLE not in known:
        _check_arm_angle(robot, names)
    elif len(names) >= robot.dof:
        raise RobotFileError("redundancy: all joints are given, so that none is left to solve for")


def _check_arm_angle(robot: Robot, names: list[str]) -> None:
    if len(names) > 1:
        raise RobotFileError(f"redundancy: {ARM_ANGLE} is given alone, without joints")
    if robot.is_tree:
        raise RobotFileError(f"redundancy: {ARM_ANGLE} is for robots with one tip, this has {len(robot.tips)}")
    if robot.dof != JOINTS:
        count = f"{robot.dof} joint variable{'s' * (robot.dof != 1)}"
        raise RobotFileError(f"redundancy: the robot has {count}, expected {JOINTS} for {ARM_ANGLE}")


def given_units(robot: Robot) -> tuple[tuple[str, str], ...]:
    """What the inverse is given besides the pose, in order: a joint or the arm angle, and the unit of its value."""
    shifts = {each.name for each in robot.variables if each.type is JointType.PRISMATIC}
    return tuple((name, robot.units.length if name in shifts else "rad") for name in robot.given)
