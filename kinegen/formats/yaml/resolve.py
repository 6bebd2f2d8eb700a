"""`RawRobot` -> `Robot`: names looked up, joint types and dimensions found, everything in exact radians."""

from __future__ import annotations

from kinegen.errors import RobotFileError
from kinegen.formats.messages import fail, within
from kinegen.formats.yaml.actuators.names import formula_slots, with_names
from kinegen.formats.yaml.actuators.resolve import resolve_actuators
from kinegen.formats.yaml.convert import Converter
from kinegen.formats.yaml.dimensions import find_dimensions
from kinegen.formats.yaml.motion import check_names, joint_types, with_dimensions
from kinegen.formats.yaml.parameters import close_parameters
from kinegen.formats.yaml.read import RawRobot
from kinegen.formats.yaml.slots import all_slots
from kinegen.robot.model import Robot
from kinegen.robot.redundancy import check_redundancy
from kinegen.robot.values import checked_value


def resolve(raw: RawRobot, source: str) -> Robot:
    """Make the model of what a file says.

    Args:
        raw: The file as written.
        source: Its base name.

    Returns:
        The robot, whose digest is still to be filled in.

    Raises:
        RobotFileError: At the first defect.
    """
    degrees = raw.units.angle == "deg"
    types = joint_types(raw.rows)
    rows = with_dimensions(raw.rows, types)
    slots = tuple(all_slots(rows, (raw.base, raw.tool, *raw.frames)))
    known = [parameter.name for parameter in raw.parameters]
    for where, slot in slots:
        with within(where, slot.line):
            check_names(slot, known, types)
    actuators = with_names(raw.actuators, raw.parameters, types)
    dimensions = find_dimensions(raw.parameters, slots, frozenset(types), formula_slots(actuators))
    parameters = close_parameters(raw.parameters, dimensions, degrees=degrees)
    values = {parameter.name: checked_value(parameter.value, {}) for parameter in parameters}
    converter = Converter(types, {parameter.name: parameter for parameter in parameters}, values, degrees)
    robot = Robot(
        name=raw.name,
        description=raw.description,
        convention=raw.convention,
        units=raw.units,
        parameters=parameters,
        variables=converter.variables(rows),
        rows=tuple(converter.row(row) for row in rows),
        base=converter.steps(raw.base),
        tool=converter.steps(raw.tool),
        frames=tuple(converter.frame(frame) for frame in raw.frames),
        source=source,
        digest="",
        actuators=resolve_actuators(actuators, converter),
        version=raw.version,
        redundancy=raw.redundancy.text if raw.redundancy else "",
    )
    if raw.redundancy:
        try:
            check_redundancy(robot, raw.redundancy.text)
        except RobotFileError as error:
            fail(error.message, raw.redundancy.line)
    return robot
