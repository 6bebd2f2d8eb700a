"""What the constructors have in common: joints without followers, and numbers as text."""

from __future__ import annotations

from kinegen.errors import KinegenError, shown
from kinegen.robot.model import Robot
from kinegen.tables.joints import Decimal, Joint, joints_of


def plain_joints(robot: Robot, tool: str) -> tuple[Joint, ...]:
    """The joints of a robot, parents first.

    Args:
        robot: Any robot.
        tool: The tool that the text is for, for the message.

    Raises:
        KinegenError: If a joint follows another one, in one line.
    """
    joints = joints_of(robot)
    for joint in joints:
        if joint.mimic:
            raise KinegenError(
                f"joint {joint.name} follows {joint.mimic[0]}, which this text for {tool} cannot say; write URDF"
            )
    return joints


def heading(robot: Robot, mark: str) -> list[str]:
    """Comment lines that say where the text is from."""
    source = f" from {shown(robot.source)}" if robot.source else ""
    return [f"{mark} {robot.name}{source}, in metres and radians."]


def numbers(values: tuple[Decimal, ...], separator: str = ", ") -> str:
    """Numbers on one line."""
    return separator.join(value.text for value in values)


def is_zero(values: tuple[Decimal, ...]) -> bool:
    """Whether all of some numbers are zero."""
    return all(value.text == "0" for value in values)
