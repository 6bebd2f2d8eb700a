"""A robot as links and joints for other tools: URDF, Robotics Toolbox for Python, Pinocchio, MATLAB."""

from __future__ import annotations

from dataclasses import replace
from xml.sax.saxutils import quoteattr

from kinegen.errors import KinegenError, shown
from kinegen.model.dh_conversion.link_tree import Decimal, Joint, joints_of
from kinegen.model.dh_conversion.motion_tree import fresh
from kinegen.model.robot import TOOL, Robot
from kinegen.model.variants import link_of


def write_urdf(robot: Robot) -> str:
    """Write a URDF: links named as in the file that they come from, or after frames, in metres and radians.

    A number that is not a decimal, such as pi/2 or sqrt(2), is printed with 20 digits, which reads as the same double
    and which the reader of kinegen takes for the same angle. The comment at the top says what is rounded and what a
    URDF cannot hold.

    Raises:
        KinegenError: If a joint cannot be one of a URDF, in one line.
    """
    joints = _with_links(robot, joints_of(robot))
    links = dict.fromkeys(name for joint in joints for name in (joint.parent, joint.child))
    lines = ['<?xml version="1.0"?>', *_comment(robot, joints), f"<robot name={quoteattr(robot.name)}>"]
    lines += [f"  <link name={quoteattr(name)}/>" for name in links]
    for joint in joints:
        lines += _joint(joint)
    return "\n".join([*lines, "</robot>"]) + "\n"


def notes(robot: Robot, joints: tuple[Joint, ...]) -> tuple[str, ...]:
    """Return what the text says less exactly than the robot, or not at all."""
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


def _with_links(robot: Robot, joints: tuple[Joint, ...]) -> tuple[Joint, ...]:
    """Name links as in the file of the robot; other frames keep their names where free."""
    if not robot.links:
        return joints
    named = link_of(robot)
    last = robot.rows[-1].name if robot.rows else ""
    both = {named[each] for each in (last, TOOL) if each in named}
    if not robot.is_tree and not robot.tool and len(both) == 1:
        # The tool is the last link: a link of its own would be one more than the file has.
        named[last] = named[TOOL] = both.pop()
    taken = [link for link, _ in robot.links]
    for name in dict.fromkeys(name for joint in joints for name in (joint.parent, joint.child)):
        if name not in named:
            named[name] = fresh(name, taken)
            taken.append(named[name])
    called = (replace(joint, parent=named[joint.parent], child=named[joint.child]) for joint in joints)
    return tuple(joint for joint in called if joint.parent != joint.child)


def _comment(robot: Robot, joints: tuple[Joint, ...]) -> list[str]:
    source = [f"From {shown(robot.source)}, in metres and radians."] if robot.source else ["In metres and radians."]
    said = [*source, *notes(robot, joints)]
    return ["<!--", *(f"  {line.replace('--', '- -')}" for line in said), "-->"]


def _joint(joint: Joint) -> list[str]:
    """Return one joint; a turn without limits is continuous."""
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


def plain_joints(robot: Robot, tool: str) -> tuple[Joint, ...]:
    """Return the joints of a robot, parents first, and refuse one that follows another; `tool` is for the message."""
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
    """Tell whether all of some numbers are zero."""
    return all(value.text == "0" for value in values)


def write_toolbox(robot: Robot) -> str:
    """Write a `Robot` of elementary transforms, as Python text.

    The form takes any chain exactly; a `DHRobot` has no place for the base and the frames behind a fixed row.

    Raises:
        KinegenError: If it is a tree or has a follower, or a joint that moves by a factor of its variable.
    """
    if robot.is_tree:
        raise KinegenError(
            f"robot {robot.name} has {len(robot.tips)} tips, and the text for the Robotics Toolbox takes a chain"
        )
    # The chain from the tool back to the base.
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
        # The toolbox wants all lower limits, then all upper ones.
        rows = [numbers(tuple(pair[end] for pair in limits if pair)) for end in (0, 1)]
        lines.append(f"    robot.qlim = [[{rows[0]}], [{rows[1]}]]")
    return "\n".join([*lines, "    return robot"]) + "\n"


def _transforms(joint: Joint) -> list[str]:
    """List the fixed transforms that do something, and the motion."""
    found = [f"ET.t{axis}({value.text})" for axis, value in zip("xyz", joint.xyz, strict=True) if not is_zero((value,))]
    turns = tuple(zip("xyz", joint.rpy, strict=True))[::-1]
    found += [f"ET.R{axis}({value.text})" for axis, value in turns if not is_zero((value,))]
    if joint.turns is not None:
        found.append(f"ET.{'R' if joint.turns else 't'}z({'flip=True' if joint.sign < 0 else ''})")
    return found


def write_pinocchio(robot: Robot) -> str:
    """Write a Python function that makes a Pinocchio model; frames are frames of the model.

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


def write_matlab(robot: Robot) -> str:
    """Write a MATLAB function that makes a rigidBodyTree (Robotics System Toolbox).

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
