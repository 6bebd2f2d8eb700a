"""A robot as Python text for the Robotics Toolbox for Python: a `Robot` of elementary transforms.

It is the form that takes any chain exactly; a `DHRobot` has no place for the base and the frames behind a fixed row.
"""

from __future__ import annotations

from kinegen.errors import KinegenError
from kinegen.formats.constructors.chains import heading, is_zero, numbers, plain_joints
from kinegen.robot.model import TOOL, Robot
from kinegen.tables.joints import Joint


def write(robot: Robot) -> str:
    """Write Python text.

    Args:
        robot: A chain without followers.

    Raises:
        KinegenError: If it is a tree or has a follower, or a joint that moves by a factor of its variable.
    """
    if robot.is_tree:
        raise KinegenError(
            f"robot {robot.name} has {len(robot.tips)} tips, and the text for the Robotics Toolbox takes a chain"
        )
    by_child = {joint.child: joint for joint in plain_joints(robot, "the Robotics Toolbox")}
    chain: list[Joint] = []
    name = TOOL
    while name in by_child:
        chain.insert(0, by_child[name])
        name = by_child[name].parent
    parts = [text for joint in chain for text in _transforms(joint)]
    limits = [joint.limits for joint in chain if joint.turns is not None]
    lines = [
        *heading(robot, "#"),
        "from roboticstoolbox import ET, ETS, Robot",
        "",
        "",
        "def make_robot():",
        "    ets = ETS([",
        *(f"        {part}," for part in parts),
        "    ])",
        f'    robot = Robot(ets, name="{robot.name}")',
    ]
    if limits and all(limits):
        rows = [numbers(tuple(pair[end] for pair in limits if pair)) for end in (0, 1)]
        lines.append(f"    robot.qlim = [[{rows[0]}], [{rows[1]}]]")
    return "\n".join([*lines, "    return robot"]) + "\n"


def _transforms(joint: Joint) -> list[str]:
    """Fixed transforms that do something, and the motion."""
    found = [f"ET.t{axis}({value.text})" for axis, value in zip("xyz", joint.xyz, strict=True) if not is_zero((value,))]
    turns = tuple(zip("xyz", joint.rpy, strict=True))[::-1]
    found += [f"ET.R{axis}({value.text})" for axis, value in turns if not is_zero((value,))]
    if joint.turns is not None:
        found.append(f"ET.{'R' if joint.turns else 't'}z({'flip=True' if joint.sign < 0 else ''})")
    return found
