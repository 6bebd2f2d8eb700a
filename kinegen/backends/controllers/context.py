"""What the templates of a controller are given besides the robot and the names of its kernels: finished strings."""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.controllers.controller import Controller
from kinegen.backends.controllers.kernel_calls import ControlledLinks, Drive, Follow, drive_of, follow_of, links_of
from kinegen.backends.controllers.machine import INCH, MachineJoint, machine_of, machine_unit
from kinegen.backends.inverse import NEAREST_FUNCTION, branches_of
from kinegen.backends.redundancy_range import ANY, RANGES
from kinegen.backends.scalar_types import ScalarType
from kinegen.errors import KinegenError
from kinegen.model.expression_parser import evaluate
from kinegen.model.expression_values import FLOAT64
from kinegen.model.outputs import Kind, Quantity
from kinegen.model.robot import Robot
from kinegen.model.variants import ARM_ANGLE
from kinegen.support.dataclass import dataclass
from kinegen.support.naming import (
    c_file,
    function,
    macro,
    range_file,
)

UNLIMITED = 1e6
"""A limit, in degrees or millimetres, for a joint that the file gives none."""


@dataclass(frozen=True, slots=True)
class ControlledJoint:
    """A joint or a motor as templates print it; numbers are in machine units but where `scale` leads out of them.

    What is in C: `degrees` and `radians` are machine units in its variable, with an angle in degrees or in radians,
    `from_degrees` the units with radians in those with degrees, `part` what leads from the variable to radians, or to
    parts of the reach.
    """

    index: int
    number: str
    name: str
    turns: bool
    unit: str
    scale: str
    kind: str
    low: str
    high: str
    home: str
    home_kernel: str
    switches: tuple[str, str]
    travel: str
    degrees: str
    radians: str
    from_degrees: str
    part: str


@dataclass(frozen=True, slots=True)
class ControlledParameter:
    """A runtime parameter as templates print it: `value` is in `unit`, `scale` kernel units in one of these.

    In ROS: `in_metres` is its value in `metric`, radians or metres, and `metre` kernel units in one of these.
    """

    index: int
    name: str
    unit: str
    value: str
    scale: str
    metric: str
    in_metres: str
    metre: str


@dataclass(frozen=True, slots=True)
class ControllerContext:
    """Holds what every template of a controller is given, as `m`.

    Attributes:
        sources: C sources besides the glue.
        objects: What the compiler makes of the sources of the kernel.
        follow: The inverse that follows a path.
        motors: What motors count: readings of actuators, or the joints themselves.
        drive: What is called of its actuators; None for an arm without.
        motor: What a motor is called in options and texts: a motor, or the joint that it moves alone.
        pass_parameters: Their address as an argument, and a comma; empty where there are none.
        coordinates: Axes of the world.
        letters: What grblHAL calls its axes.
        words: Their places in it, counting x, y, z, a, b, c.
        units: The units of the motors.
        millimetres: Millimetres in the file's length unit, as a literal.
        inches: Inches in it, as a literal.
        metres: Metres in it, as a literal.
        tilt: Angles a and b of the tool in radians, as literals.
        turned_at_zero: Angle c in radians with all joints at 0, as a literal; empty where the tool's tilt varies.
        turning: Its derivatives by the joints, as literals.
        reach: The reach in millimetres.
        home: x, y, z of the tool at home in millimetres.
        step: About a twentieth of the reach in millimetres, for moves of the example.
        half_step: Half of it.
        feed: A feed in millimetres a minute at which that takes one and a half seconds.
    """

    sources: tuple[str, ...]
    objects: tuple[str, ...]
    follow: Follow
    joints: tuple[ControlledJoint, ...]
    motors: tuple[ControlledJoint, ...]
    drive: Drive | None
    motor: str
    parameters: tuple[ControlledParameter, ...]
    pass_parameters: str
    links: ControlledLinks
    coordinates: str
    letters: str
    words: tuple[int, ...]
    units: str
    millimetres: str
    inches: str
    metres: str
    tilt: tuple[str, str]
    turned_at_zero: str
    turning: tuple[str, ...]
    reach: str
    home: tuple[str, ...]
    step: str
    half_step: str
    feed: str


def controller_context(kernels: RobotPrograms, controller: Controller) -> ControllerContext:
    """Return everything the templates lay out.

    Raises KinegenError if no such controller can move it.
    """
    robot, real = kernels.robot, controller.reals[0]
    machine = machine_of(kernels, controller)
    follow = follow_of(kernels, machine, real)
    sources = c_file(robot.name, "c", real), follow.source
    step = float(f"{machine.reach * machine.millimetres / 20:.1g}")
    return ControllerContext(
        sources=sources,
        objects=tuple(name.removesuffix(".c") + ".o" for name in sources),
        follow=follow,
        joints=controlled_joints(machine.joints, robot.name, real),
        motors=controlled_joints(machine.motors, robot.name, real),
        drive=drive_of(robot, real),
        motor="motor" if robot.actuators.readings else "joint",
        parameters=_parameters(robot, machine.millimetres, real),
        pass_parameters="&parameters, " if robot.runtime_parameters else "",
        links=links_of(robot, real),
        coordinates=machine.coordinates,
        letters="XYZABCUV",
        words=tuple(map("XYZABC".index, machine.coordinates)),
        units=" or ".join(dict.fromkeys(joint.unit for joint in machine.motors)),
        millimetres=real.literal(Fraction(machine.millimetres)),
        inches=str(machine.millimetres / INCH),
        metres=real.literal(Fraction(machine.millimetres) / 1000),
        tilt=(real.literal(Fraction(machine.tilt[0])), real.literal(Fraction(machine.tilt[1]))),
        turned_at_zero="".join(real.literal(Fraction(each)) for each in machine.turning[:1]),
        turning=tuple(real.literal(Fraction(each)) for each in machine.turning[1:]),
        reach=short(machine.reach * machine.millimetres),
        home=tuple(map(short, machine.home[:3])),
        step=short(step),
        half_step=short(step / 2),
        feed=short(step * 40),
    )


_KINDS = {"deg": "ANGULAR", "mm": "LINEAR", "unit": "LINEAR"}
_DEGREES = {"deg": "{}_DEGREES", "mm": "{}_MILLIMETRES", "unit": "1.0F"}
_RADIANS = {"deg": "1.0", "mm": "{}_MILLIMETRES", "unit": "1.0"}
_FROM_DEGREES = {"deg": "0.017453292519943295", "mm": "1.0", "unit": "1.0"}
_PARTS = {"deg": "1.0", "mm": "{0}_MILLIMETRES / {0}_REACH", "unit": "1.0"}


def controlled_joints(joints: Sequence[MachineJoint], robot: str, real: ScalarType) -> tuple[ControlledJoint, ...]:
    """Return the joints or motors as templates print them, with macros that begin with the name of the robot."""
    upper = robot.upper()
    return tuple(
        ControlledJoint(
            index=joint.index,
            number=str(joint.index + 1),
            name=joint.name,
            turns=joint.turns,
            unit=joint.unit,
            scale=real.literal(Fraction(joint.scale)),
            kind=_KINDS[joint.unit],
            low=short(-UNLIMITED if joint.low is None else joint.low),
            high=short(UNLIMITED if joint.high is None else joint.high),
            home=short(joint.home),
            home_kernel=ScalarType.DOUBLE.literal(Fraction(joint.home) * Fraction(joint.scale)),
            travel=short(2 * UNLIMITED if joint.low is None or joint.high is None else joint.high - joint.low),
            switches=(_decimal(joint.low or 0.0), _decimal(joint.high or 0.0)),
            degrees=_DEGREES[joint.unit].format(upper),
            radians=_RADIANS[joint.unit].format(upper),
            from_degrees=_FROM_DEGREES[joint.unit],
            part=_PARTS[joint.unit].format(upper),
        )
        for joint in joints
    )


def _parameters(robot: Robot, millimetres: float, real: ScalarType) -> tuple[ControlledParameter, ...]:
    found = []
    for index, parameter in enumerate(robot.runtime_parameters):
        unit, scale = machine_unit(parameter.dimension, millimetres)
        value = float(evaluate(parameter.value, {}, FLOAT64))
        metric, metre = {"deg": ("rad", 1.0), "mm": ("m", 1000 / millimetres)}.get(unit, ("", 1.0))
        found.append(
            ControlledParameter(
                index=index,
                name=parameter.name,
                unit=unit,
                value=short(value / scale),
                scale=real.literal(Fraction(scale)),
                metric=metric or unit,
                in_metres=_yaml(value / metre),
                metre=ScalarType.DOUBLE.literal(Fraction(metre)),
            )
        )
    return tuple(found)


def _yaml(number: float) -> str:
    """Return a number that YAML and C read as one: the digits of YAML have a point before an exponent."""
    text = repr(number)
    return text if "." in text else text.replace("e", ".0e")


def short(number: float) -> str:
    """Return a number with six digits after the point, without zeros at its end."""
    text = f"{number:.6f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


def _decimal(number: float) -> str:
    """Return the same with a point, so that a suffix of C can follow."""
    text = short(number)
    return text if "." in text else f"{text}.0"


_REAL = ScalarType.DOUBLE


@dataclass(frozen=True, slots=True)
class MoveitContext:
    """Holds what every template of `controllers/moveit2` is given, as `m`.

    Attributes:
        headers: Headers of the kernels.
        sources: Their C sources.
        drive: What is called of its actuators; None for an arm without.
        turns: A whole turn of each joint in radians, as literals; 0 for one that shifts.
        metres: Metres in the file's length unit, as a literal.
        reach: Upper bound on the reach in metres, as a literal.
        low: Array of lower limits.
        high: Array of upper limits.
        family: What such arms are called.
        branch_names: The branches.
        branches: Their number.
        reads_attitude: Whether the orientation of a target is read.
        redundancy: What the inverse is given besides the pose; empty without.
        given: Index of the joint that it is given; -1 without one.
        redundant_words: Why joints cannot be made redundant.
        inverse: The function for all branches.
        nearest: The function for the nearest solution.
        any: The same over all values of the redundancy.
        range: The function for the intervals of the redundancy.
        ranges: Intervals of a branch at most.
        compared: Joint vectors at which the model of MoveIt is compared.
    """

    headers: tuple[str, ...]
    sources: tuple[str, ...]
    joints: tuple[ControlledJoint, ...]
    parameters: tuple[ControlledParameter, ...]
    drive: Drive | None
    turns: tuple[str, ...]
    links: ControlledLinks
    metres: str
    reach: str
    low: str
    high: str
    family: str
    branch_names: tuple[str, ...]
    branches: int
    reads_attitude: bool
    redundancy: str
    given: int
    redundant_words: str
    inverse: str
    nearest: str
    any: str
    range: str
    ranges: int
    compared: int


def moveit_context(kernels: RobotPrograms) -> MoveitContext:
    """Return everything the templates lay out.

    Raises KinegenError if the robot has none.
    """
    robot, branches = kernels.robot, branches_of(kernels)
    if branches is None:
        raise KinegenError(f"no MoveIt 2 package for {robot.name}: it has no closed-form inverse", robot.source)
    machine = machine_of(kernels, Controller.MOVEIT2)
    metres = Fraction(machine.millimetres) / 1000
    given = next((each.index for each in robot.variables if each.name == robot.redundancy), -1)
    has_range = kernels.redundancy_range
    return MoveitContext(
        headers=(c_file(robot.name, "h", _REAL), *[range_file(robot.name, "h", _REAL)] * has_range),
        sources=(c_file(robot.name, "c", _REAL), *[range_file(robot.name, "c", _REAL)] * has_range),
        joints=controlled_joints(machine.joints, robot.name, _REAL),
        parameters=_parameters(robot, machine.millimetres, _REAL),
        drive=drive_of(robot, _REAL),
        turns=tuple(_REAL.literal(Fraction(0 if math.isinf(turn) else turn)) for turn in branches.turns),
        links=links_of(robot, _REAL),
        metres=_REAL.literal(metres),
        reach=_REAL.literal(Fraction(machine.reach) * metres),
        low=macro(robot.name, "LIMITS_LOW"),
        high=macro(robot.name, "LIMITS_HIGH"),
        family=branches.family,
        branch_names=branches.names,
        branches=len(branches.names),
        reads_attitude=branches.reads_attitude,
        redundancy=robot.redundancy,
        given=given,
        redundant_words=_redundant_words(robot.redundancy),
        inverse=function(robot.name, Quantity(Kind.INVERSE).function, _REAL),
        nearest=function(robot.name, NEAREST_FUNCTION, _REAL),
        any=function(robot.name, ANY, _REAL),
        range=function(robot.name, Quantity(Kind.REDUNDANCY_RANGE).function, _REAL),
        ranges=RANGES,
        compared=robot.dof + 9,
    )


def _redundant_words(redundancy: str) -> str:
    """Return why joints cannot be made redundant, as a message."""
    if not redundancy:
        return "no joint is redundant: the inverse is solved for all joints"
    if redundancy == ARM_ANGLE:
        return "no joint is redundant: the inverse is given the arm angle"
    return f"{redundancy} is the redundant joint, and no other can be"
