"""`Robot` -> URDF: links named after the robot's frames, in metres and radians.

A number that is not a decimal, such as pi/2 or sqrt(2), is printed with 20 digits, which reads as the same double and
which the reader of kinegen takes for the same angle. The comment at the top says what is rounded and what a URDF
cannot hold.
"""

from __future__ import annotations

from xml.sax.saxutils import quoteattr

from kinegen.errors import shown
from kinegen.robot.model import Robot
from kinegen.tables.joints import Joint, joints_of


def write(robot: Robot) -> str:
    """Write a URDF.

    Args:
        robot: Any robot.

    Raises:
        KinegenError: If a joint cannot be one of a URDF, in one line.
    """
    joints = joints_of(robot)
    links = dict.fromkeys(name for joint in joints for name in (joint.parent, joint.child))
    lines = ['<?xml version="1.0"?>', *_comment(robot, joints), f"<robot name={quoteattr(robot.name)}>"]
    lines += [f"  <link name={quoteattr(name)}/>" for name in links]
    for joint in joints:
        lines += _joint(joint)
    return "\n".join([*lines, "</robot>"]) + "\n"


def notes(robot: Robot, joints: tuple[Joint, ...]) -> tuple[str, ...]:
    """What the text says less exactly than the robot, or not at all."""
    found = [
        f"joint {joint.name}: rounded to 20 digits: {', '.join(each.text for each in joint.decimals if not each.exact)}"
        for joint in joints
        if not all(each.exact for each in joint.decimals)
    ]
    found += [f"parameter {each.name} is a constant here" for each in robot.runtime_parameters]
    found += ["the actuators are left out"] if robot.actuators.readings else []
    found += [
        f"joint {joint.name} has no limits; a prismatic joint of a URDF must have some, 1 km here"
        for joint in joints
        if joint.turns is False and joint.limits is None
    ]
    return tuple(found)


def _comment(robot: Robot, joints: tuple[Joint, ...]) -> list[str]:
    source = [f"From {shown(robot.source)}, in metres and radians."] if robot.source else ["In metres and radians."]
    said = [*source, *notes(robot, joints)]
    return ["<!--", *(f"  {line.replace('--', '- -')}" for line in said), "-->"]


def _joint(joint: Joint) -> list[str]:
    """One joint; a turn without limits is continuous."""
    kind = "fixed"
    if joint.turns is not None:
        kind = "prismatic" if not joint.turns else "revolute" if joint.limits else "continuous"
    lines = [f'  <joint name={quoteattr(joint.name)} type="{kind}">']
    origin = [" ".join(each.text for each in triple) for triple in (joint.xyz, joint.rpy)]
    lines += [f'    <origin xyz="{origin[0]}" rpy="{origin[1]}"/>'] if set(" ".join(origin)) != {"0", " "} else []
    lines += [f"    <parent link={quoteattr(joint.parent)}/>", f"    <child link={quoteattr(joint.child)}/>"]
    if joint.turns is not None:
        lines.append(f'    <axis xyz="0 0 {joint.sign}"/>')
    if kind in ("revolute", "prismatic"):
        low, high = (each.text for each in joint.limits) if joint.limits else ("-1000", "1000")
        lines.append(f'    <limit lower="{low}" upper="{high}" effort="0" velocity="0"/>')
    if joint.mimic:
        lines.append(f'    <mimic joint={quoteattr(joint.mimic[0])} multiplier="{joint.mimic[1].text}" offset="0"/>')
    return [*lines, "  </joint>"]
