"""The constants of a family, as people read them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import sympy as sp

from kinegen.symbolic.fold import Vector
from kinegen.symbolic.inverse.exact import dot, minus, tidy
from kinegen.symbolic.inverse.family import (
    Arm,
    ColumnArm,
    ElbowArm,
    Family,
    FlatArm,
    PointArm,
    StrokeArm,
    TripleArm,
    WristArm,
)
from kinegen.symbolic.inverse.geometry import Planar, Waist, Wrist


@dataclass(frozen=True, slots=True)
class Constant:
    """One constant.

    Attributes:
        text: What it is.
        value: In degrees or the file's length unit, with the file's values of runtime parameters.
        is_angle: Whether it is an angle.
        runtime: The runtime parameters that it depends on.
    """

    text: str
    value: float
    is_angle: bool
    runtime: tuple[str, ...]


def constants(family: Family) -> tuple[Constant, ...]:
    """List the constants of a family.

    Args:
        family: The family of an arm.

    Returns:
        Lengths and angles between the axes, in the order from base to tool.
    """
    return tuple(_constant(family, text, value, text.startswith("angle")) for text, value in _described(family))


def _described(family: Family) -> Iterator[tuple[str, sp.Expr]]:
    match family.build:
        case PointArm(arm):
            yield from _of_arm(arm, "the tool")
        case WristArm(arm, wrist):
            yield from _of_arm(arm, "the wrist's centre")
            yield from _of_wrist(family, wrist)
        case FlatArm(turns, _, _, upper, lower, end):
            first, second = turns[0].number, turns[1].number
            yield f"from axis {first} to axis {second}", _length(upper)
            yield (
                f"from axis {second} to {f'axis {turns[2].number}' if len(turns) == 3 else 'the tool'}",
                _length(lower),
            )
            if len(turns) == 3:
                yield f"from axis {turns[2].number} to the tool, across", _across(family, end, turns[2].direction)
        case TripleArm(waist, _, upper, lower, hand, depth, end):
            yield from _of_waist(waist)
            yield from (("from axis 2 to axis 3", _length(upper)), ("from axis 3 to axis 4", _length(lower)))
            yield "from axis 4 to axis 5", _length(hand)
            yield "shift along axes 2, 3, 4", depth
            yield "from axis 5 to the tool", _distance(family, end)


def _of_waist(waist: Waist) -> Iterator[tuple[str, sp.Expr]]:
    yield "from axis 1 to axis 2", waist.offset
    yield "angle of axes 1 and 2", sp.atan2(waist.sine, waist.cosine)


def _of_arm(arm: Arm, end: str) -> Iterator[tuple[str, sp.Expr]]:
    match arm:
        case ElbowArm():
            yield from _of_waist(arm.waist)
            yield "from axis 2 to axis 3", _length(arm.upper)
            yield f"from axis 3 to {end}", _length(arm.lower)
            yield f"shift along axis 2 to {end}", arm.depth
        case StrokeArm():
            yield from _of_waist(arm.waist)
            yield f"from axis 2 to the line of {end}", _aside(arm.heading, arm.start)
            yield f"shift along axis 2 to {end}", arm.depth
        case ColumnArm():
            yield f"from axis {arm.turn.number} to the line of {end}", _aside(arm.heading, arm.start)


def _of_wrist(family: Family, wrist: Wrist) -> Iterator[tuple[str, sp.Expr]]:
    yield "from the wrist's centre to the tool", _distance(family, wrist.centre)
    yield "angle of axes 4 and 6 in the zero pose", wrist.skew


def _constant(family: Family, text: str, value: sp.Expr, is_angle: bool) -> Constant:
    number = family.axes.value(value * 180 / sp.pi if is_angle else value)
    return Constant(text, number, is_angle, tuple(sorted(str(symbol) for symbol in value.free_symbols)))


def _length(vector: Planar) -> sp.Expr:
    return sp.sqrt(tidy(vector[0] ** 2 + vector[1] ** 2))


def _aside(heading: Planar, start: Planar | Vector) -> sp.Expr:
    return tidy(heading[0] * start[1] - heading[1] * start[0])


def _distance(family: Family, point: Vector) -> sp.Expr:
    offset = minus(family.axes.position, point)
    return sp.sqrt(dot(offset, offset))


def _across(family: Family, point: Vector, axis: Vector) -> sp.Expr:
    offset = minus(family.axes.position, point)
    return sp.sqrt(tidy(dot(offset, offset) - dot(offset, axis) ** 2))
