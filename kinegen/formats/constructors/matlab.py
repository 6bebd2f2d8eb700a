"""A robot as a MATLAB function that makes a rigidBodyTree (Robotics System Toolbox)."""

from __future__ import annotations

from kinegen.formats.constructors.chains import heading, numbers, plain_joints
from kinegen.robot.model import Robot


def write(robot: Robot) -> str:
    """Write MATLAB text.

    Args:
        robot: Any robot without followers.

    Raises:
        KinegenError: If it has a follower, or a joint that moves by a factor of its variable.
    """
    joints = plain_joints(robot, "MATLAB")
    lines = [
        f"function robot = {robot.name}()",
        *heading(robot, "%"),
        "robot = rigidBodyTree('DataFormat', 'row');",
        f"robot.BaseName = '{joints[0].parent}';",
    ]
    for joint in joints:
        kind = "fixed" if joint.turns is None else "revolute" if joint.turns else "prismatic"
        roll, pitch, yaw = joint.rpy
        turn = f"eul2tform([{numbers((yaw, pitch, roll))}], 'ZYX')"
        lines += [
            f"body = rigidBody('{joint.child}');",
            f"joint = rigidBodyJoint('{joint.name}', '{kind}');",
            f"setFixedTransform(joint, trvec2tform([{numbers(joint.xyz)}]) * {turn});",
        ]
        if joint.turns is not None:
            lines.append(f"joint.JointAxis = [0, 0, {joint.sign}];")
        if joint.limits:
            lines.append(f"joint.PositionLimits = [{numbers(joint.limits)}];")
        lines += ["body.Joint = joint;", f"addBody(robot, body, '{joint.parent}');"]
    return "\n".join([*lines, "end"]) + "\n"
