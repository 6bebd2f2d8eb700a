"""How far the actuators of a robot go: what their readings can be, and the box over which kernels are compared.

In: a `Robot` with actuators. Out: floats in the units of the kernels.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from kinegen.robot.actuators.allowed import allowed_by_joints
from kinegen.robot.actuators.model import Coupling, FourBar, Reading, Triangle
from kinegen.robot.dimension import Dimension
from kinegen.robot.expressions import Expression, evaluate
from kinegen.robot.extent import joint_box
from kinegen.robot.floats import FLOATS
from kinegen.robot.model import Robot

MARGIN = 0.01
"""Share of the way of a linkage that is left out at either end: at a dead centre every rounding error is boundless."""


Range = tuple[float, float]


def reading_ranges(robot: Robot) -> tuple[Range, ...]:
    """What each reading can be.

    Args:
        robot: The robot; runtime parameters have the values of the file.

    Returns:
        A lower and an upper bound for each reading: the limits of the file, or what those of its joints allow; where
        it drives a triangle no more than lets that close; infinite where nothing is known.
    """
    return tuple(_range(robot, reading) for reading in robot.actuators.readings)


def reading_box(robot: Robot) -> tuple[Range, ...]:
    """The box of actuator vectors over which kernels are compared.

    Args:
        robot: The robot.

    Returns:
        The ranges, where linkages stay clear of their dead centres by `MARGIN`. A reading without any bound goes as far
        as takes one of its joints from end to end of its box, or else half a turn or 1 to either side.
    """
    box = []
    for reading in robot.actuators.readings:
        low, high = _met(_limits(reading), *_closing(robot, reading, MARGIN))
        far = _far(robot, reading)
        box.append((low if math.isfinite(low) else -far, high if math.isfinite(high) else far))
    return tuple(box)


def _range(robot: Robot, reading: Reading) -> Range:
    own = allowed_by_joints(robot, reading) if reading.limits is None else _limits(reading)
    return _met(own, *_closing(robot, reading, 0.0))


def _value(robot: Robot, expression: Expression) -> float:
    values = {entry.name: evaluate(entry.value, {}, FLOATS) for entry in robot.parameters}
    return float(evaluate(expression, values, FLOATS))


def _limits(reading: Reading) -> Range:
    if reading.limits is None:
        return -math.inf, math.inf
    low, high = (float(evaluate(limit, {}, FLOATS)) for limit in reading.limits)
    return low, high


def _met(*ranges: Range) -> Range:
    return max(low for low, _ in ranges), min(high for _, high in ranges)


def _closing(robot: Robot, reading: Reading, margin: float) -> list[Range]:
    """The ranges within which the linkages that a reading drives close."""
    found = []
    for drive in robot.actuators.drives:
        if isinstance(drive, Triangle) and drive.actuator == reading.name:
            a, b = (_value(robot, side) for side in drive.sides)
            factor, rest = (_value(robot, part) for part in drive.length)
            ends = sorted(((abs(a - b) - rest) / factor, (a + b - rest) / factor))
            found.append(_shrunk((ends[0], ends[1]), margin))
        if isinstance(drive, FourBar) and drive.actuator == reading.name and not drive.parallelogram:
            found.append(_shrunk(_limits(reading), margin))
    return found


def _shrunk(ends: Range, margin: float) -> Range:
    inset = margin * (ends[1] - ends[0])
    return ends[0] + inset, ends[1] - inset


def _far(robot: Robot, reading: Reading) -> float:
    """How far a reading without bounds goes to either side."""
    boxes = {variable.name: box for variable, box in zip(robot.variables, joint_box(robot), strict=True)}
    ways = [
        way
        for drive in robot.actuators.drives
        if isinstance(drive, Coupling)
        for way in _ways(robot, drive, reading, boxes)
    ]
    return min(ways, default=math.pi if reading.dimension is Dimension.ANGLE else 1.0)


def _ways(robot: Robot, drive: Coupling, reading: Reading, boxes: Mapping[str, Range]) -> list[float]:
    if reading.name not in drive.actuators:
        return []
    column = drive.actuators.index(reading.name)
    factors = [(joint, abs(_value(robot, row[column]))) for joint, row in zip(drive.joints, drive.matrix, strict=True)]
    return [max(-boxes[joint][0], boxes[joint][1]) / factor for joint, factor in factors if factor]
