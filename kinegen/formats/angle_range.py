"""Refuses angles that no kernel takes the sine of, however short the file that asks for them.

In: a `Robot`. Out: nothing, or one message. Each angle of the table counts by itself, over the limits of the joints;
what angles of several joints add up to is left to the notes of a build.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

from kinegen.formats.messages import fail, within
from kinegen.robot.expressions import Expression, evaluate, linear
from kinegen.robot.extent import joint_box
from kinegen.robot.floats import FLOATS
from kinegen.robot.model import JointType, Robot, Row, Step

MAX_ANGLE = 1e5
"""The largest angle in radians of which the kernels in double take the sine and cosine."""


def check_angles(robot: Robot) -> None:
    """Refuse a robot with angles beyond `MAX_ANGLE`.

    Raises:
        RobotFileError: At the first of them.
    """
    degrees = robot.units.angle == "deg"
    turning = {variable.name for variable in robot.variables if variable.type is not JointType.PRISMATIC}
    box = {variable.name: max(map(abs, ends)) for variable, ends in zip(robot.variables, joint_box(robot), strict=True)}
    values = {entry.name: float(evaluate(entry.value, {}, FLOATS)) for entry in robot.parameters}
    for row in robot.rows:
        with within(f"joint {row.number} ({row.name})", row.line):
            limited = next((each for each in robot.variables if each.name == row.variable and each.limits), None)
            if limited is not None and row.variable in turning:
                _require("limits", box[limited.name], degrees=degrees)
            for key, angle in _angles(row):
                _require(key, _largest(angle, box, values), degrees=degrees)
    for where, steps, line in _steps(robot):
        with within(where, line):
            for step in steps:
                if step.kind.is_rotation:
                    _require(step.kind.value, _largest(step.value, box, values), degrees=degrees)


def _angles(row: Row) -> Iterator[tuple[str, Expression]]:
    for key, entry in (("alpha", row.alpha), ("theta", row.theta), ("beta", row.beta)):
        if entry is not None:
            yield key, entry
    yield from ((step.kind.value, step.value) for step in row.steps if step.kind.is_rotation)


def _steps(robot: Robot) -> Iterator[tuple[str, tuple[Step, ...], int]]:
    yield "base", robot.base, 0
    yield "tool", robot.tool, 0
    yield from ((f"frame '{frame.name}'", frame.steps, frame.line) for frame in robot.frames)


def _largest(angle: Expression, box: Mapping[str, float], values: Mapping[str, float]) -> float:
    """The largest magnitude of an angle that is linear in joint variables."""
    factors, rest = linear(angle, frozenset(box))
    moving = (abs(float(evaluate(factor, values, FLOATS))) * box[name] for name, factor in factors.items())
    return abs(float(evaluate(rest, values, FLOATS))) + sum(moving)


def _require(key: str, size: float, *, degrees: bool) -> None:
    if not size <= MAX_ANGLE:
        shown, most = (math.degrees(size), math.degrees(MAX_ANGLE)) if degrees else (size, MAX_ANGLE)
        unit = "deg" if degrees else "rad"
        fail(f"{key}: the angle reaches {shown:.3g} {unit}; kernels take angles up to {most:.7g} {unit}")
