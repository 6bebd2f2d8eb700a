"""What the glue calls of the kernels: the poses and Jacobians of links, and the inverse that follows a path."""

from __future__ import annotations

import json
import math
from fractions import Fraction

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.controllers.controller import ACTUATORS, NEEDED, Controller
from kinegen.backends.controllers.machine import Machine, home_of
from kinegen.backends.inverse import NEAREST_FUNCTION
from kinegen.backends.scalar_types import ScalarType
from kinegen.model.actuator_limits import reading_ranges
from kinegen.model.outputs import POSE_AND_JACOBIAN, Kind, Quantity
from kinegen.model.robot import TOOL, Robot
from kinegen.support.dataclass import dataclass
from kinegen.support.naming import (
    c_file,
    default_params,
    function,
    guard,
    macro,
    params_type,
    prefix,
    selftest_file,
    vectors_file,
)
from kinegen.verify import reference


@dataclass(frozen=True, slots=True)
class KernelNames:
    """Holds what the kernels of a robot are called in C, as templates have it in `kernels`.

    `robot`: name of the robot. `scalar`: number type. `has_parameters`: whether they take runtime parameters.
    """

    robot: str
    scalar: ScalarType
    has_parameters: bool

    @property
    def real(self) -> str:
        """The number type in C."""
        return self.scalar.value

    @property
    def upper(self) -> str:
        """Return what macros for this number type begin with."""
        return prefix(self.robot, self.scalar).upper()

    @property
    def dof(self) -> str:
        """Macro of the number of joints."""
        return macro(self.robot, "DOF")

    @property
    def model(self) -> str:
        """Macro of the number that the robot file is known by."""
        return macro(self.robot, "MODEL")

    @property
    def header(self) -> str:
        """The header."""
        return c_file(self.robot, "h", self.scalar)

    @property
    def source(self) -> str:
        """The C source."""
        return c_file(self.robot, "c", self.scalar)

    @property
    def selftests(self) -> tuple[str, ...]:
        """Files of the self-test."""
        return selftest_file(self.robot, self.scalar), vectors_file(self.robot, self.scalar)

    @property
    def selftest(self) -> str:
        """The program that runs it."""
        return self.selftests[0].removesuffix(".c")

    @property
    def params_type(self) -> str:
        """Type of the runtime parameters."""
        return params_type(self.robot, self.scalar)

    @property
    def default_params(self) -> str:
        """Their values of the robot file."""
        return default_params(self.robot, self.scalar)

    @property
    def pass_params(self) -> str:
        """The runtime parameters as an argument and a comma; empty where there are none."""
        return "params, " * self.has_parameters


@dataclass(frozen=True, slots=True)
class ControlledLink:
    """A name that a pose or Jacobian is asked by.

    `name`: the name as a string literal of C++. `plain`: the same without quotes, for READMEs. `frame`: place of its
    frame among those of the output `frames`; -1 for the base.
    """

    name: str
    plain: str
    frame: int


@dataclass(frozen=True, slots=True)
class ControlledLinks:
    """Holds what templates are given of the links, as `m.links`.

    `named`: every name: the base, frames, and links of the file that the robot comes from. `tool`: place of the tool
    among the frames. `base`: name of the base for YAML and for messages. `tip`: name of the tool likewise. `base_name`:
    name of the base without quotes, for READMEs. `tip_name`: name of the tool likewise. `count`: number of frames.
    `at_rest`: whether no joint moves a frame. `frames`: the function for the poses of all frames. `jacobians`: the
    function for the Jacobian of each frame; empty for that of the tool.
    """

    named: tuple[ControlledLink, ...]
    tool: int
    base: str
    tip: str
    base_name: str
    tip_name: str
    count: int
    at_rest: tuple[bool, ...]
    frames: str
    jacobians: tuple[str, ...]


def needed(robot: Robot, controller: Controller) -> tuple[Quantity, ...]:
    """Return the outputs that a package calls."""
    actuators = ACTUATORS if robot.actuators.readings else ()
    wanted = (*NEEDED, *actuators)
    if controller is Controller.MOVEIT2:
        ranges = (Quantity(Kind.REDUNDANCY_RANGE),) * bool(robot.redundancy)
        return Quantity(Kind.POSE), Quantity.FRAMES, Quantity(Kind.INVERSE), *actuators, *ranges
    if controller is not Controller.ROS2_CONTROL:
        return wanted
    jacobians = (Quantity(Kind.JACOBIAN, frame=name) for name in robot.frame_names if name != TOOL)
    return (*wanted, Quantity.FRAMES, *jacobians)


def links_of(robot: Robot, real: ScalarType) -> ControlledLinks:
    """Return the links of an arm."""
    frames = robot.frame_names
    # A link of the file comes before a joint or frame of the same name, since ROS asks for links.
    names = {robot.root: -1} | {name: place for place, name in enumerate(frames)}
    places = dict(names)
    links = {link: places[frame] for link, frame in robot.links if frame in places}
    own = {place: link for link, place in reversed(links.items())}
    tool = places[TOOL]
    moving = reference.Kinematics(robot, [home_of(robot)])
    base, tip = own.get(-1, robot.root), own.get(tool, TOOL)
    return ControlledLinks(
        named=tuple(
            ControlledLink(_literal(name), _literal(name)[1:-1], place)
            for name, place in sorted((names | links).items())
        ),
        tool=tool,
        base=_literal(base),
        tip=_literal(tip),
        base_name=_literal(base)[1:-1],
        tip_name=_literal(tip)[1:-1],
        count=len(frames),
        at_rest=tuple(not moving.jacobian(name).any() for name in frames),
        frames=function(robot.name, Quantity.FRAMES.function, real),
        jacobians=tuple(
            "" if name == TOOL else function(robot.name, Quantity(Kind.JACOBIAN, frame=name).function, real)
            for name in frames
        ),
    )


def _literal(name: str) -> str:
    """Return a name in quotes, for C++ and YAML."""
    return json.dumps(name, ensure_ascii=False)


_ROUNDING = {ScalarType.DOUBLE: "1e-9", ScalarType.FLOAT: "1e-5"}
"""How far beyond its range a reading may be, relative to the larger end: a target may lead exactly to that end."""


@dataclass(frozen=True, slots=True)
class Drive:
    """Holds what is called of the actuators of a robot, which has some.

    `readings`: the function for their readings, by joint values. `joints`: the function for joint values, by readings.
    `clamp`: the function that brings readings back into their range. `low`: what macros call the lowest readings.
    `high`: the highest readings likewise. `actuators`: macro of the number of readings. `rooms`: how far rounding may
    move each reading beyond its range.
    """

    readings: str
    joints: str
    clamp: str
    low: str
    high: str
    actuators: str
    rooms: tuple[str, ...]


def drive_of(robot: Robot, real: ScalarType) -> Drive | None:
    """Return what is called of the actuators; None for a robot that is driven at its joints."""
    if not robot.actuators.readings:
        return None
    stem = prefix(robot.name, real)
    return Drive(
        readings=function(robot.name, Kind.JOINTS_TO_ACTUATORS.value, real),
        joints=function(robot.name, Kind.ACTUATORS_TO_JOINTS.value, real),
        clamp=function(robot.name, "clamp_actuators", real),
        low=macro(stem, "ACTUATORS_LOW"),
        high=macro(stem, "ACTUATORS_HIGH"),
        actuators=macro(robot.name, "ACTUATORS"),
        rooms=tuple(room(real, low, high) for low, high in reading_ranges(robot)),
    )


def room(real: ScalarType, *ends: float) -> str:
    """Return what rounding does to a reading at an end of its range."""
    sizes = [abs(end) for end in ends if math.isfinite(end)]
    return real.literal(Fraction(_ROUNDING[real]) * Fraction(max(sizes, default=0.0) or 1.0))


_AMOUNTS = {ScalarType.DOUBLE: ("3e-8", "3e-6"), ScalarType.FLOAT: ("3e-5", "3e-4")}
"""How far a target may be moved to keep joints that it leaves open, in radians or parts of the reach: the least that is
surely beyond the thresholds of the kernels, and the most that no machine notices."""

_SINGULAR = {ScalarType.DOUBLE: "1e-9", ScalarType.FLOAT: "1e-5"}
"""Product of squared sines between the columns of the Jacobian below which a joint vector counts as singular."""

_LEAP = "0.2"
"""A joint that moves further than so many radians, or such a part of the reach, may have leapt."""

_SHORT = "0.02"
"""A step of the tool that is shorter than this, in radians and parts of the reach, must not make a joint leap."""


@dataclass(frozen=True, slots=True)
class Follow:
    """Holds what `controllers/_follow.*.jinja` are given, as `f`.

    Attributes:
        source: Its source.
        guard: Include guard of the header.
        fk: The pose.
        fk_jacobian: The pose with its Jacobian.
        nearest: The solution nearest to a joint vector.
        rows: Rows of the Jacobian that count: 3 for a position, 6 for a pose.
        scales: For each joint what a radian, or the reach, is in its variable.
        reach: The reach.
        amounts: How far targets are moved at singularities.
        singular: What counts as singular.
        leap: What counts as a leap.
        short: What counts as a short step.
        zero: 0 as a number of the type.
        one: 1 likewise.
        half: 1/2 likewise.
        tiny: What a squared length is taken for zero below.
        params: The runtime parameters as a parameter of a function, and a comma; empty where there are none.
    """

    name: str
    header: str
    source: str
    guard: str
    fk: str
    fk_jacobian: str
    nearest: str
    rows: int
    scales: tuple[str, ...]
    reach: str
    amounts: tuple[str, ...]
    singular: str
    leap: str
    short: str
    zero: str
    one: str
    half: str
    tiny: str
    params: str


def follow_of(kernels: RobotPrograms, machine: Machine, real: ScalarType) -> Follow:
    """Return the numbers of one arm."""
    robot = kernels.robot.name
    stem = prefix(robot, real)

    def number(text: str) -> str:
        return real.literal(Fraction(text))

    reach = real.literal(Fraction(machine.reach))
    header = f"{stem}_follow.h"
    return Follow(
        name=f"{stem}_follow",
        header=header,
        source=f"{stem}_follow.c",
        guard=guard(header),
        fk=function(robot, Quantity.POSE.function, real),
        fk_jacobian=function(robot, POSE_AND_JACOBIAN.function, real),
        nearest=function(robot, NEAREST_FUNCTION, real),
        rows=3 if machine.coordinates == "XYZ" else 6,
        scales=tuple(number("1") if joint.turns else reach for joint in machine.joints),
        reach=reach,
        amounts=tuple(map(number, _AMOUNTS[real])),
        singular=number(_SINGULAR[real]),
        leap=number(_LEAP),
        short=number(_SHORT),
        zero=number("0"),
        one=number("1"),
        half=number("0.5"),
        tiny=number("1e-30"),
        params=f"const {params_type(robot, real)} *const params, " if kernels.robot.runtime_parameters else "",
    )
