"""Slots in kernel units, as linear functions of the joint variables."""

from __future__ import annotations

from collections.abc import Mapping

from kinegen.formats.yaml.slots import Slot
from kinegen.robot.dimension import Dimension
from kinegen.robot.expressions import Expression, Name, linear, multiply, substitute, without_arcs
from kinegen.robot.model import JointType
from kinegen.robot.units import HALF_TURN, RADIAN, radians, scale


def split(
    slot: Slot, types: Mapping[str, JointType], angles: frozenset[str], *, degrees: bool
) -> tuple[dict[str, Expression], Expression]:
    """Convert a slot to kernel units, as a linear function of the joint variables.

    Args:
        slot: Any slot.
        types: Type of each joint.
        angles: The parameters that are angles.
        degrees: Whether the angles of the file count in degrees.

    Returns:
        The coefficient of each joint variable, and the offset.

    Raises:
        ExpressionError: If a variable does not stand linearly.
    """
    factors, offset = linear(slot.expression, frozenset(types))
    if not degrees or slot.dimension is not Dimension.ANGLE:
        return factors, offset
    converted = {name: _in_degrees(factor, angles) for name, factor in factors.items()}
    for name, factor in converted.items():
        if types[name] is JointType.PRISMATIC:
            converted[name] = scale(factor)
    return converted, radians(offset, angles)


def _in_degrees(factor: Expression, angles: frozenset[str]) -> Expression:
    """The same number of degrees, with every name and arc in radians."""
    hidden, found = without_arcs(factor)
    in_degrees = {name: multiply(RADIAN, Name(name)) for name in angles.union(found)}
    return substitute(substitute(hidden, in_degrees, HALF_TURN), found)
