"""What a module of LinuxCNC has in HAL: the pins of runtime parameters, lengths of the tool, and joint speeds."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from kinegen.backends.controllers.machine import MILLIMETRES, home_of, machine_unit, samples
from kinegen.errors import KinegenError
from kinegen.model.expression_parser import evaluate
from kinegen.model.expression_values import FLOAT64, Dimension
from kinegen.model.joint_bounds import reach
from kinegen.model.robot import TOOL, JointType, Parameter, Robot
from kinegen.support.compat import StrEnum
from kinegen.support.dataclass import dataclass
from kinegen.support.naming import macro
from kinegen.verify import reference

_SAME = 1e-9
_OTHER = 0.3
"""What other parameters are changed by to see whether one is a length of the tool whatever they are."""

OUTWARDS = ("", "-", "-")
"""Signs of a tool whose z axis leads out of the flange: half a turn about x."""

INWARDS = ("", "", "")
"""Signs of a tool whose z axis leads from its tip to its holder."""

_Frames = Mapping[str, NDArray[np.float64]]
_Trials = Sequence[tuple[_Frames, _Frames]]


class ToolLength(StrEnum):
    """Holds what a runtime parameter is for the length of the tool.

    The first three are those of arms that are solved for a point of the tool.

    `DOWN`: it shifts the tip down by what it grows, in every pose. `UP`: it shifts the tip up. `ALONG`: it shifts the
    tip along the last link, whose direction is not the same in every pose. `TABLE`: it shifts the tip away from the
    holder, and the tool table sets it. `ADDED`: it does so too, but the tool's own length cannot be told from others,
    so the tool table adds to it. `NONE`: it is no length of the tool.
    """

    DOWN = "down"
    UP = "up"
    ALONG = "along"
    TABLE = "table"
    ADDED = "added"
    NONE = ""


def tool_lengths(way: Robot, parameters: Sequence[Parameter], signs: Sequence[str]) -> tuple[ToolLength, ...]:
    """Return what each parameter is for the length of the tool.

    `way`: the chain that ends in the tool. `signs`: how the tool points, `OUTWARDS` or `INWARDS`; empty where the arm
    is solved for a point of the tool.
    """
    trials = {each.name: _trials(way, each) for each in parameters if each.dimension is Dimension.LENGTH}
    if not signs:
        return tuple(_shift(way, trials[each.name]) if each.name in trials else ToolLength.NONE for each in parameters)
    lengths = [name for name, tried in trials.items() if _is_length(way, tried, signs)]
    own = [name for name in lengths if _is_behind(way, trials[name], len(way.rows))]
    tool = (own if len(own) == 1 and len(lengths) > 1 else lengths) if lengths else []
    kind = ToolLength.TABLE if len(tool) == 1 else ToolLength.ADDED
    return tuple(
        kind if each.name in tool else ToolLength.ADDED if each.name in lengths else ToolLength.NONE
        for each in parameters
    )


def _trials(way: Robot, parameter: Parameter) -> _Trials:
    """Return the frames at samples of the joints, before and after the parameter grows by the reach.

    Twice, with other values of the other parameters too, because it must be a length whatever these are, such as angles
    of the tool.
    """
    size = reach(way)
    here = np.array(list(samples(way)))
    values = {each.name: float(evaluate(each.value, {}, FLOAT64)) for each in way.runtime_parameters}
    others = {name: value + _OTHER for name, value in values.items()}
    return [
        (
            reference.frames(way, here, settings),
            reference.frames(way, here, settings | {parameter.name: settings[parameter.name] + size}),
        )
        for settings in (values, others)
    ]


def _is_behind(way: Robot, trials: _Trials, count: int) -> bool:
    """Return whether a parameter leaves the links of the first rows where they are.

    Where every tool hangs vertically, the height of a base would shift the tip as the length of a tool does.
    """
    return all((before[row.name] == after[row.name]).all() for before, after in trials for row in way.rows[:count])


def _changes(way: Robot, trials: _Trials) -> NDArray[np.float64]:
    """Return how the tip moves in its own axes while the parameter grows by one, as (samples, 4, 4)."""
    changes = np.concatenate([np.linalg.solve(before[TOOL], after[TOOL]) for before, after in trials])
    changes[:, :3, 3] /= reach(way)
    return changes


def _is_length(way: Robot, trials: _Trials, signs: Sequence[str]) -> bool:
    """Return whether a parameter is behind the last joint and shifts the tool away from its holder by what it grows."""
    if not _is_behind(way, trials, len(way.rows) - 1):
        return False
    expected = np.eye(4)
    expected[2, 3] = 1.0 if tuple(signs) == OUTWARDS else -1.0
    return bool(np.abs(_changes(way, trials) - expected).max() <= _SAME)


def _shift(way: Robot, trials: _Trials) -> ToolLength:
    """Return how a parameter shifts the tip of an arm that is solved for a point of the tool."""
    size = reach(way)
    moves = np.concatenate([(after[TOOL] - before[TOOL])[:, :3, 3] / size for before, after in trials])
    for kind, height in ((ToolLength.DOWN, -1.0), (ToolLength.UP, 1.0)):
        if np.abs(moves - np.array([0.0, 0.0, height])).max() <= _SAME:
            return kind
    changes = _changes(way, trials)
    shifted = np.abs(np.linalg.norm(changes[:, :3, 3], axis=1) - 1.0).max() <= _SAME
    same = np.abs(changes - changes[0]).max() <= _SAME and np.abs(changes[0, :3, :3] - np.eye(3)).max() <= _SAME
    along = shifted and same and np.ptp(moves, axis=0).max() > _SAME and _is_behind(way, trials, len(way.rows) - 1)
    return ToolLength.ALONG if along else ToolLength.NONE


LONGEST_NAME = 47
"""Characters of a name in HAL of LinuxCNC 2.9."""

_NUDGE = 1e-6


@dataclass(frozen=True, slots=True)
class HalParameter:
    """A runtime parameter as a pin.

    `name`: the parameter, which is also the member of the struct in C. `pin`: the pin, without the name of the module.
    `unit`: its unit there, in words. `scale`: what leads from the kernel's unit to that of the pin, as an expression of
    C. `length`: what it is for the length of the tool.
    """

    index: int
    name: str
    pin: str
    unit: str
    scale: str
    length: ToolLength

    @property
    def is_tool(self) -> bool:
        """Return whether the tool table sets it, with its pin at 0."""
        return self.length is ToolLength.TABLE


@dataclass(frozen=True, slots=True)
class HalContext:
    """Holds what templates of LinuxCNC are given besides the robot, as `h`.

    `tool`: whether there are pins for the offset of the tool. `signs`: what leads from the axes of the tool to those of
    its offset, which have z from its tip to its holder; empty where the offset moves the world alone, because the arm
    is solved for a point of the tool. `kinds`: the number of kinematics between which motion can switch. `speeds`:
    highest speeds of LinuxCNC's joints for a simulated machine, in their units a second: those of motors while every
    joint turns once a second. `accelerations`: highest accelerations likewise.
    """

    parameters: tuple[HalParameter, ...]
    tool: bool
    signs: tuple[str, ...]
    kinds: int
    speeds: tuple[str, ...]
    accelerations: tuple[str, ...]


_UNITS = {Dimension.LENGTH: "machine units", Dimension.ANGLE: "degrees", Dimension.NUMBER: ""}
_SCALES = {Dimension.LENGTH: "MACHINE_UNITS", Dimension.ANGLE: "RADIAN"}
"""Macros of the glue, which begin with the name of the robot as its others do."""


def parameters_of(robot: Robot, way: Robot, signs: Sequence[str]) -> tuple[HalParameter, ...]:
    """Return the pins of the runtime parameters.

    `way`: the chain that ends in its tool. `signs`: how the tool points, see `HalContext`. Raises KinegenError if a
    name is longer than those of HAL.
    """
    lengths = tool_lengths(way, robot.runtime_parameters, signs)
    parameters = tuple(
        HalParameter(
            index=index,
            name=parameter.name,
            pin=f"param.{parameter.name.replace('_', '-')}",
            unit=_UNITS[parameter.dimension],
            scale=macro(robot.name, scale) if (scale := _SCALES.get(parameter.dimension)) else "1.0",
            length=length,
        )
        for index, (parameter, length) in enumerate(zip(robot.runtime_parameters, lengths, strict=True))
    )
    _require_short(robot, ["tool-offset.x", "servo-period", "max-speed.00", *(each.pin for each in parameters)])
    return parameters


def arm_hal(robot: Robot, coordinates: str) -> HalContext:
    """Return the pins of an arm.

    `coordinates`: the axes of the world that it moves. Raises KinegenError if names are too long for HAL.
    """
    signs: tuple[str, ...] = ()
    if coordinates == "XYZABC":
        signs = OUTWARDS
    elif coordinates == "XYZC":
        signs = INWARDS if reference.pose(robot, [home_of(robot)])[0, 0, 2, 2] > 0.5 else OUTWARDS
    parameters = parameters_of(robot, robot, signs)
    driven = bool(robot.actuators.readings)
    speeds = motor_speeds(robot, home_of(robot), reach(robot)) if driven else joint_speeds(robot)
    return HalContext(
        parameters=parameters,
        tool=bool(signs or parameters),
        signs=signs,
        kinds=1,
        speeds=tuple(f"{speed:.6g}" for speed, _ in speeds),
        accelerations=tuple(f"{acceleration:.6g}" for _, acceleration in speeds),
    )


def joint_speeds(robot: Robot) -> list[tuple[float, float]]:
    """Return speeds and accelerations of joints for a simulation, in degrees and mm: a turn a second, or the reach."""
    far = reach(robot) * MILLIMETRES[robot.units.length]
    return [(far, far) if each.type is JointType.PRISMATIC else (360.0, 3600.0) for each in robot.variables]


def motor_speeds(robot: Robot, home: Sequence[float], far: float) -> list[tuple[float, float]]:
    """Return those of motors while all joints have theirs, at home; differences of the readings.

    `home`: joint values. `far`: the reach, in the file's length unit.
    """
    scales = [machine_unit(each.dimension, MILLIMETRES[robot.units.length])[1] for each in robot.actuators.readings]
    turned = [far if each.type is JointType.PRISMATIC else 2 * math.pi for each in robot.variables]
    here = reference.readings(robot, [home])[0].astype(float)
    there = [reference.readings(robot, [np.array(home) + _NUDGE * row])[0].astype(float) for row in np.diag(turned)]
    rates = np.abs(np.array(there) - here).sum(axis=0) / _NUDGE / scales
    return [(float(f"{rate:.6g}"), float(f"{10 * rate:.6g}")) for rate in rates]


def _require_short(robot: Robot, pins: Sequence[str]) -> None:
    """Refuse names that HAL does not take, which only the machine would say."""
    longest = max((f"{robot.name}_kins.{pin}" for pin in pins), key=len)
    if len(longest) > LONGEST_NAME:
        raise KinegenError(
            f"no LinuxCNC package for {robot.name}: the name of pin {longest} has {len(longest)} characters, and HAL "
            f"takes {LONGEST_NAME}; give the robot or the parameter a shorter name",
            robot.source,
        )
