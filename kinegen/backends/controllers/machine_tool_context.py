"""What the templates of a machine tool for LinuxCNC are given: finished strings."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.controllers.context import UNLIMITED, ControlledJoint, controlled_joints, short
from kinegen.backends.controllers.hal import INWARDS, OUTWARDS, HalContext, joint_speeds, motor_speeds, parameters_of
from kinegen.backends.controllers.kernel_calls import Drive, drive_of, room
from kinegen.backends.controllers.machine import INCH, MILLIMETRES, driven_samples, has_readings, motors_of
from kinegen.backends.controllers.machine_tool import WORDS, Mill
from kinegen.backends.scalar_types import ScalarType
from kinegen.model.dh_conversion.elementary_transforms import seen_chain
from kinegen.model.expression_parser import evaluate
from kinegen.model.expression_values import FLOAT64
from kinegen.model.joint_bounds import joint_box, reach
from kinegen.model.robot import TOOL, JointType, Robot
from kinegen.support.dataclass import dataclass
from kinegen.support.naming import (
    c_file,
    function,
)
from kinegen.verify import reference

_NUDGE = 5
"""Degrees or millimetres by which the example moves a joint."""


@dataclass(frozen=True, slots=True)
class MillJoint:
    """A joint by its word; numbers are in degrees and millimetres.

    Attributes:
        index: Its place among LinuxCNC's joints, where these are no motors: the order of words.
        place: Its place in the joint vector.
        name: Its name in the robot file.
        letter: Its word.
        member: The member of the world that has this word.
        turns: Whether it turns.
        unit: `deg` or `mm`.
        kind: What the INI file calls it.
        low: Lower limit.
        high: Upper limit.
        home: Where the example begins.
        nudge: A little that it may move from there.
        nudge_back: The same backwards.
    """

    index: int
    place: int
    name: str
    letter: str
    member: str
    turns: bool
    unit: str
    kind: str
    low: str
    high: str
    home: str
    nudge: str
    nudge_back: str


@dataclass(frozen=True, slots=True)
class MillContext:
    """Holds what every template of a machine tool is given, as `m`.

    Attributes:
        sources: C sources besides the glue.
        objects: What the compiler makes of them.
        tool: The frame of the tool.
        workpiece: The frame of the workpiece.
        pose: The function for the pose.
        pose_jacobian: The function for the pose with its Jacobian.
        axes: The joints in the order of their words.
        motors: What LinuxCNC calls joints: readings of actuators, or the joints themselves in this order.
        motor: What such a joint is called in texts.
        drive: What is called of the actuators; None for a machine without.
        slack: How far rounding may move each joint of the joint vector beyond its limits.
        clamp: The function that brings joint values back to their limits.
        slides: Those that X, Y and Z are solved for, in this order.
        words: The other ones.
        coordinates: The words of all joints.
        origin: x, y and z of the workpiece's frame in the world, in millimetres, without a tool.
        millimetres: Millimetres in the file's length unit, as a literal.
        inches: Inches in it, as a literal.
        reach: The reach in millimetres.
        step: A fraction of the shortest stroke in millimetres, for moves of the example.
        half_step: Half of it.
        feed: A feed in millimetres a minute.
    """

    sources: tuple[str, ...]
    objects: tuple[str, ...]
    tool: str
    workpiece: str
    pose: str
    pose_jacobian: str
    axes: tuple[MillJoint, ...]
    motors: tuple[MillJoint, ...] | tuple[ControlledJoint, ...]
    motor: str
    drive: Drive | None
    slack: tuple[str, ...]
    clamp: str
    slides: tuple[MillJoint, ...]
    words: tuple[MillJoint, ...]
    coordinates: str
    origin: tuple[str, ...]
    millimetres: str
    inches: str
    reach: str
    step: str
    half_step: str
    feed: str


def mill_hal(robot: Robot, mill: Mill) -> HalContext:
    """Return its pins.

    Raises KinegenError if names are too long for HAL.
    """
    way = _way(robot, mill)
    speeds = [joint_speeds(way)[place] for place in mill.order]
    if mill.driven:
        speeds = motor_speeds(robot, _home(robot, mill), reach(way))
    signs = INWARDS if mill.towards_holder else OUTWARDS
    return HalContext(
        parameters=parameters_of(robot, way, signs),
        tool=True,
        signs=signs,
        kinds=2,
        speeds=tuple(short(speed) for speed, _ in speeds),
        accelerations=tuple(short(acceleration) for _, acceleration in speeds),
    )


def _way(robot: Robot, mill: Mill) -> Robot:
    """Return the chain from workpiece to tool."""
    return seen_chain(robot, mill.tool, mill.workpiece) if mill.workpiece else robot


def mill_context(kernels: RobotPrograms, mill: Mill) -> MillContext:
    """Return everything the templates lay out."""
    robot, real = kernels.robot, ScalarType.DOUBLE
    millimetres = MILLIMETRES[robot.units.length]
    home = _home(robot, mill)
    joints = {place: _joint(robot, index, place, mill, home) for index, place in enumerate(mill.order)}
    axes = tuple(joints[place] for place in mill.order)
    way = _way(robot, mill)
    bare = {parameter.name: 0.0 for parameter in mill_hal(robot, mill).parameters if parameter.is_tool}
    zero = reference.pose(way, np.zeros((1, robot.dof)), bare)[0, 0, :3, 3] * millimetres
    far = reach(way) * millimetres
    step = float(f"{min(_stroke(joints[place], far) for place in mill.slides) / 20:.1g}")
    source = c_file(robot.name, "c", real)
    pose, pose_jacobian = (function(robot.name, each.function, real) for each in mill.quantities[:2])
    return MillContext(
        sources=(source,),
        objects=(source.removesuffix(".c") + ".o",),
        tool=mill.tool if mill.workpiece else TOOL,
        workpiece=mill.workpiece or robot.root,
        pose=pose,
        pose_jacobian=pose_jacobian,
        axes=axes,
        motors=controlled_joints(motors_of(robot, home, millimetres), robot.name, real) or axes,
        motor="motor" if mill.driven else "joint",
        drive=drive_of(robot, real),
        slack=tuple(room(real, *ends) for ends in joint_box(robot)),
        clamp=function(robot.name, "clamp", real),
        slides=tuple(joints[place] for place in mill.slides),
        words=tuple(joints[place] for place in mill.order if place not in mill.slides),
        coordinates="".join(sorted(mill.letters, key=WORDS.index)),
        origin=tuple(short(-float(each)) for each in zero),
        millimetres=real.literal(Fraction(millimetres)),
        inches=str(millimetres / INCH),
        reach=short(far),
        step=short(step),
        half_step=short(step / 2),
        feed=short(step * 40),
    )


def _scale(robot: Robot, place: int) -> float:
    """Return what a degree or a millimetre is in the kernels."""
    turns = robot.variables[place].type is JointType.REVOLUTE
    return math.pi / 180 if turns else 1 / MILLIMETRES[robot.units.length]


def _limits(robot: Robot, place: int) -> tuple[float, float]:
    """Return the limits of a joint in degrees or millimetres."""
    scale = _scale(robot, place)
    found = [float(evaluate(each, {}, FLOAT64)) / scale for each in robot.variables[place].limits or ()]
    low, high = found or (-UNLIMITED, UNLIMITED)
    return low, high


def _home(robot: Robot, mill: Mill) -> tuple[float, ...]:
    """Return where the example begins, in the units of kernels, where actuators can bring it about."""
    home = []
    for place in range(robot.dof):
        low, high = _limits(robot, place)
        # Slides begin in the middle of their strokes, the others at zero, where the words of the world are theirs.
        begin = (low + high) / 2 if place in mill.slides else min(max(0.0, low), high)
        home.append(round(begin, 3) * _scale(robot, place))
    if not mill.driven or has_readings(robot, home):
        return tuple(home)
    box = np.ptp(joint_box(robot), axis=1)
    return min(driven_samples(robot), key=lambda each: float(np.abs((np.array(each) - home) / box).max()))


def _nudge(robot: Robot, place: int, home: tuple[float, ...]) -> int:
    """Return a little that a joint may move from home, in degrees or millimetres."""
    forth = np.array(home)
    forth[place] += _NUDGE * _scale(robot, place)
    is_free = forth[place] / _scale(robot, place) <= _limits(robot, place)[1]
    return _NUDGE if is_free and (not robot.actuators.readings or has_readings(robot, tuple(forth))) else -_NUDGE


def _joint(robot: Robot, index: int, place: int, mill: Mill, home: tuple[float, ...]) -> MillJoint:
    variable, letter = robot.variables[place], mill.letters[place]
    turns = variable.type is JointType.REVOLUTE
    low, high = _limits(robot, place)
    nudge = _nudge(robot, place, home)
    return MillJoint(
        index=index,
        place=place,
        name=variable.name,
        letter=letter,
        member=f"tran.{letter.lower()}" if letter in "XYZ" else letter.lower(),
        turns=turns,
        unit="deg" if turns else "mm",
        kind="ANGULAR" if turns else "LINEAR",
        low=short(low),
        high=short(high),
        home=short(round(home[place] / _scale(robot, place), 3)),
        nudge=str(nudge),
        nudge_back=str(-nudge),
    )


def _stroke(joint: MillJoint, far: float) -> float:
    return min(float(joint.high) - float(joint.low), far)
