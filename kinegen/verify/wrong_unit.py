"""Finds angles that look as if they were written in the other unit: 1.5708 in a file in degrees, 90 in one in radians.

In: a robot. Out: one note for each such constant of the table and each such pair of limits. Nothing is changed: a twist
of 1.5708 degrees is a possible twist.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from fractions import Fraction

from kinegen.robot.dimension import Dimension
from kinegen.robot.expressions import linear
from kinegen.robot.model import JointType, JointVariable, Robot
from kinegen.robot.values import checked_value
from kinegen.verify.nearly import Note, places

ROUNDED = 0.002
"""How far pi/2 lies from what people write for it: 1.57, 1.571, 1.5708; also 3.14 for pi."""

SLACK = 0.01
"""A rounded whole turn is no more than a turn."""

TURNS = 4
"""Limits in radians beyond this many turns to a side are more often degrees than a joint without stops."""


def wrong_unit(robot: Robot) -> tuple[Note, ...]:
    """Find the angles that look as if they were written in the other unit.

    Args:
        robot: The robot.

    Returns:
        The notes: constants in the order of the table, then limits.
    """
    return (*_constants(robot), *_limits(robot))


def _constants(robot: Robot) -> Iterator[Note]:
    parameters = {parameter.name: checked_value(parameter.value, {}) for parameter in robot.parameters}
    variables = frozenset(variable.name for variable in robot.variables)
    for place in places(robot):
        if place.dimension is Dimension.ANGLE:
            value = float(checked_value(linear(place.expression, variables)[1], parameters))
            if text := _slip(robot, value):
                yield Note(place.line, f"{place.words} is {text}")


def _limits(robot: Robot) -> Iterator[Note]:
    rows = {row.name: row for row in robot.rows}
    for variable in robot.variables:
        if variable.limits is None or variable.type is JointType.PRISMATIC:
            continue
        far = max(_values(variable), key=abs)
        text = _slip(robot, far)
        if text and (robot.units.angle == "deg" or abs(far) > TURNS * math.tau):
            row = rows[variable.name]
            yield Note(row.line, f"a limit of joint {row.number} ({row.name}) is {text}")


def _values(variable: JointVariable) -> Iterator[float]:
    return (float(checked_value(limit, {})) for limit in variable.limits or ())


def _slip(robot: Robot, angle: float) -> str:
    """What is odd about an angle in radians, in words; empty if nothing is."""
    if robot.units.angle == "deg":
        return _radians_for_degrees(math.degrees(angle))
    return _degrees_for_radians(angle)


def _radians_for_degrees(degrees: float) -> str:
    quarters = round(abs(degrees) / (math.pi / 2))
    if not 1 <= quarters <= 4 or abs(abs(degrees) - quarters * math.pi / 2) > ROUNDED:
        return ""
    sign = "-" if degrees < 0 else ""
    name = f"{sign}{_share(Fraction(quarters, 2))}"
    written = f"{sign}{90 * quarters}"
    return f"{degrees:.6g} deg, close to the number {name}; if radians were meant, write {written}"


def _degrees_for_radians(radians: float) -> str:
    quarters = round(radians / (math.pi / 2))
    if abs(radians) <= math.tau + SLACK or abs(radians - quarters * math.pi / 2) < ROUNDED:
        return ""
    turns = abs(radians) / math.tau
    return f"{radians:.6g} rad, or {turns:.3g} turns; if degrees were meant, write {_in_pi(radians)}"


def _in_pi(degrees: float) -> str:
    share = Fraction(f"{degrees:.6g}") / 180
    return f"{'-' if share < 0 else ''}{_share(abs(share))}" if share.denominator <= 12 else f"{degrees:.6g}*pi/180"


def _share(share: Fraction) -> str:
    """A positive share of pi: `pi`, `pi/2`, `3*pi/2`."""
    top = "pi" if share.numerator == 1 else f"{share.numerator}*pi"
    return top if share.denominator == 1 else f"{top}/{share.denominator}"
