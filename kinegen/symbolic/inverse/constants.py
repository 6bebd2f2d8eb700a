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
    GimbalArm,
    PointArm,
    SphericalArm,
    StrokeArm,
    TripleArm,
    WristArm,
)
from kinegen.symbolic.inverse.geometry import Planar, Waist


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
    numbers = (0, *family.axes.numbers)
    match family.build:
        case PointArm(arm):
            yield from _of_arm(arm, "the tool", numbers)
        case WristArm(arm, wrist):
            centre = f"the {'shoulder' if family.is_reversed else 'wrist'}'s centre"
            yield from _of_arm(arm, centre, numbers)
            yield f"from {centre} to the {'base' if family.is_reversed else 'tool'}", _distance(family, wrist.centre)
            yield f"angle of axes {numbers[4]} and {numbers[6]} in the zero pose", wrist.skew
        case FlatArm(turns, _, _, upper, lower, end):
            first, second = turns[0].number, turns[1].number
            yield f"from axis {first} to axis {second}", _length(upper)
            yield (
                f"from axis {second} to {f'axis {turns[2].number}' if len(turns) == 3 else 'the tool'}",
                _length(lower),
            )
            if len(turns) == 3:
                yield f"from axis {turns[2].number} to the tool, across", _across(family, end, turns[2].direction)
        case SphericalArm(shoulder, _, wrist, _, upper, lower):
            yield "from the shoulder's centre to axis 4", _length(upper)
            yield "from axis 4 to the wrist's centre", _length(lower)
            yield "from the wrist's centre to the tool", _distance(family, wrist.centre)
            yield f"angle of axes {numbers[1]} and {numbers[3]} in the zero pose", shoulder.skew
            yield f"angle of axes {numbers[5]} and {numbers[7]} in the zero pose", wrist.skew
        case TripleArm(waist, _, upper, lower, hand, depth, end):
            _, _, second, third, fourth, fifth, *_ = numbers
            yield from _of_waist(waist, numbers)
            yield f"from axis {second} to axis {third}", _length(upper)
            yield f"from axis {third} to axis {fourth}", _length(lower)
            yield f"from axis {fourth} to axis {fifth}", _length(hand)
            yield f"shift along axes {second}, {third}, {fourth}", depth
            yield f"from axis {fifth} to the {'base' if family.is_reversed else 'tool'}", _distance(family, end)


def _of_waist(waist: Waist, numbers: tuple[int, ...]) -> Iterator[tuple[str, sp.Expr]]:
    _, first, second, *_ = numbers
    yield f"from axis {first} to axis {second}", waist.offset
    yield f"angle of axes {first} and {second}", sp.atan2(waist.sine, waist.cosine)


def _of_arm(arm: Arm, end: str, numbers: tuple[int, ...]) -> Iterator[tuple[str, sp.Expr]]:
    _, first, second, third, *_ = numbers
    match arm:
        case ElbowArm():
            yield from _of_waist(arm.waist, numbers)
            yield f"from axis {second} to axis {third}", _length(arm.upper)
            yield f"from axis {third} to {end}", _length(arm.lower)
            yield f"shift along axis {second} to {end}", arm.depth
        case GimbalArm():
            yield f"angle of axes {first} and {second}", sp.atan2(arm.waist.sine, arm.waist.cosine)
            yield f"from where they meet to axis {third}", _length(arm.upper)
            yield f"from axis {third} to {end}", _length(arm.lower)
            yield f"shift along axis {third} to {end}", arm.depth
        case StrokeArm():
            yield from _of_waist(arm.waist, numbers)
            yield f"from axis {second} to the line of {end}", _aside(arm.heading, arm.start)
            yield f"shift along axis {second} to {end}", arm.depth
        case ColumnArm():
            yield f"from axis {arm.turn.number} to the line of {end}", _aside(arm.heading, arm.start)


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
