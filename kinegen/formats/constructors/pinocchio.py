"""A robot as a Python function that makes a Pinocchio model; frames are frames of the model."""

from __future__ import annotations

from kinegen.formats.constructors.chains import heading, numbers, plain_joints
from kinegen.robot.model import Robot


def write(robot: Robot) -> str:
    """Write Python text.

    Args:
        robot: Any robot without followers.

    Raises:
        KinegenError: If it has a follower, or a joint that moves by a factor of its variable.
    """
    joints = plain_joints(robot, "Pinocchio")
    lines = [
        *heading(robot, "#"),
        "import numpy as np",
        "import pinocchio as pin",
        "",
        "",
        "def make_model():",
        "    model = pin.Model()",
        f'    model.name = "{robot.name}"',
        f'    links = {{"{joints[0].parent}": (0, pin.SE3.Identity())}}',
        "",
        "    def add(name, parent, child, xyz, rpy, joint=None, low=None, high=None):",
        "        at, placement = links[parent]",
        "        placement = placement * pin.SE3(pin.rpy.rpyToMatrix(*rpy), np.array(xyz))",
        "        if joint is not None:",
        "            at = model.addJoint(at, joint, placement, name)",
        "            if low is not None:",
        "                model.lowerPositionLimit[model.joints[at].idx_q] = low",
        "                model.upperPositionLimit[model.joints[at].idx_q] = high",
        "            placement = pin.SE3.Identity()",
        "        links[child] = at, placement",
        "        model.addFrame(pin.Frame(child, at, placement, pin.FrameType.OP_FRAME))",
        "",
    ]
    for joint in joints:
        kind = ""
        if joint.turns is not None:
            motion = "Revolute" if joint.turns else "Prismatic"
            kind = f", pin.JointModel{motion}Unaligned(np.array([0.0, 0.0, {joint.sign}.0]))"
        kind += f", {numbers(joint.limits)}" if joint.limits else ""
        place = f"[{numbers(joint.xyz)}], [{numbers(joint.rpy)}]"
        lines.append(f'    add("{joint.name}", "{joint.parent}", "{joint.child}", {place}{kind})')
    return "\n".join([*lines, "    return model"]) + "\n"
