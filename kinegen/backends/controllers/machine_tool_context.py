"""What the templates of a machine tool for LinuxCNC are given: finished strings."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.controllers.context import UNLIMITED, short
from kinegen.backends.controllers.hal import INWARDS, OUTWARDS, HalContext, joint_speeds, parameters_of
from kinegen.backends.controllers.machine import INCH, MILLIMETRES
from kinegen.backends.controllers.machine_tool import WORDS, Mill
from kinegen.backends.scalar_types import ScalarType
from kinegen.model.dh_conversion.elementary_transforms import seen_chain
from kinegen.model.expression_parser import evaluate
from kinegen.model.expression_values import FLOAT64
from kinegen.model.joint_bounds import reach
from kinegen.model.robot import TOOL, JointType, JointVariable, Robot
from kinegen.support.dataclass import dataclass
from kinegen.support.naming import (
    c_file,
    function,
)
from kinegen.verify import reference


@dataclass(frozen=True, slots=True)
class MillJoint:
    """A joint as LinuxCNC counts it; numbers are in degrees and millimetres.

    Attributes:
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
        motors: The joints as LinuxCNC counts them.
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
    motors: tuple[MillJoint, ...]
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
    joints = {place: _joint(robot.variables[place], index, place, mill, millimetres) for index, place in _counted(mill)}
    way = _way(robot, mill)
    bare = {parameter.name: 0.0 for parameter in mill_hal(robot, mill).parameters if parameter.is_tool}
    zero = reference.pose(way, np.zeros((1, robot.dof)), bare)[0, 0, :3, 3] * millimetres
    far = reach(way) * millimetres
    step = float(f"{min(_stroke(joints[place], far) for place in mill.slides) / 20:.1g}")
    source = c_file(robot.name, "c", real)
    pose, pose_jacobian = (function(robot.name, each.function, real) for each in mill.quantities)
    return MillContext(
        sources=(source,),
        objects=(source.removesuffix(".c") + ".o",),
        tool=mill.tool if mill.workpiece else TOOL,
        workpiece=mill.workpiece or robot.root,
        pose=pose,
        pose_jacobian=pose_jacobian,
        motors=tuple(joints[place] for place in mill.order),
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


def _counted(mill: Mill) -> tuple[tuple[int, int], ...]:
    return tuple(enumerate(mill.order))


def _joint(variable: JointVariable, index: int, place: int, mill: Mill, millimetres: float) -> MillJoint:
    turns, letter = variable.type is JointType.REVOLUTE, mill.letters[place]
    scale = math.pi / 180 if turns else 1 / millimetres
    limits = [float(evaluate(each, {}, FLOAT64)) / scale for each in variable.limits or ()]
    low, high = limits or (-UNLIMITED, UNLIMITED)
    # Slides begin in the middle of their strokes, the others at zero, where the words of the world are theirs.
    home = (low + high) / 2 if place in mill.slides else min(max(0.0, low), high)
    nudge = 5 if home + 5 <= high else -5
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
        home=short(round(home, 3)),
        nudge=str(nudge),
        nudge_back=str(-nudge),
    )


def _stroke(joint: MillJoint, far: float) -> float:
    return min(float(joint.high) - float(joint.low), far)
