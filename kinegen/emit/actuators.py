"""What headers and modules say of actuators, where kernels take or give their readings."""

from __future__ import annotations

from kinegen.emit.kernels import Kernels
from kinegen.robot.actuators.extent import reading_ranges
from kinegen.robot.dimension import Dimension
from kinegen.robot.model import Robot

ARRAY = "actuators"
"""What kernels call the actuator vector."""


def has_actuators(kernels: Kernels) -> bool:
    """Whether a kernel takes or gives readings of actuators."""
    signatures = (program.signature for program in kernels.programs)
    return any(array.name == ARRAY for each in signatures for array in (*each.inputs, *each.results))


def actuator_names(kernels: Kernels) -> tuple[str, ...]:
    """The actuators in the order of their vector; none where no kernel has to do with them."""
    return tuple(reading.name for reading in kernels.robot.actuators.readings) if has_actuators(kernels) else ()


def actuator_units(robot: Robot) -> tuple[str, ...]:
    """The unit of each reading; empty for a bare number."""
    units = {Dimension.LENGTH: robot.units.length, Dimension.ANGLE: "rad", Dimension.NUMBER: ""}
    return tuple(units[reading.dimension] for reading in robot.actuators.readings)


def actuator_lines(kernels: Kernels) -> tuple[str, ...]:
    """One line for each entry of the actuator vector: place, name, unit, range."""
    names = actuator_names(kernels)
    width = max(map(len, names), default=0)
    lines = []
    for index, (name, unit, (low, high)) in enumerate(
        zip(names, actuator_units(kernels.robot), reading_ranges(kernels.robot), strict=True) if names else ()
    ):
        bounds = f"{low:.6g} to {high:.6g}" if low > float("-inf") or high < float("inf") else "no limits"
        lines.append(f"{ARRAY}[{index}]  {name:<{width}}  {unit or '1':<3}  {bounds}")
    return tuple(lines)
