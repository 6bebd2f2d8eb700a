"""Expressions in kernel units back in the units of the file: what the reader makes of degrees, undone.

In a file in degrees `pi` is half a turn, so an angle that is a plain number of radians cannot be written there; then
the expression that comes back does not read as the same one, and the writer takes radians.
"""

from __future__ import annotations

from collections.abc import Mapping

from kinegen.robot.dimension import Dimension
from kinegen.robot.expressions import (
    Call,
    Expression,
    Name,
    Power,
    Product,
    Sum,
    add,
    multiply,
    names,
    power,
    substitute,
    without_arcs,
)
from kinegen.robot.units import DEGREE, RADIAN


def in_degrees(expression: Expression, dimension: Dimension, angles: frozenset[str]) -> Expression:
    """Write an expression in degrees.

    Args:
        expression: In radians and the file's length unit.
        dimension: What its place measures; a length is as it is.
        angles: Names in it whose values are angles.
    """
    if dimension is Dimension.LENGTH:
        return _waves(expression, angles)
    hidden, found = without_arcs(expression)
    terms = hidden.terms if isinstance(hidden, Sum) else (hidden,)
    scale = RADIAN if dimension is Dimension.ANGLE else multiply()
    counted = {name: multiply(DEGREE, Name(name)) for name in angles.union(found)}
    turned = add(*(_waves(_counted(multiply(scale, term), counted), angles) for term in terms))
    return substitute(turned, found)


def _counted(expression: Expression, counted: Mapping[str, Expression]) -> Expression:
    """Replace names outside of sine and cosine, which take angles of their own."""
    match expression:
        case Call("sin" | "cos", _):
            return expression
        case Sum(parts):
            return add(*(_counted(part, counted) for part in parts))
        case Product(parts):
            return multiply(*(_counted(part, counted) for part in parts))
        case Power(base, exponent):
            return power(_counted(base, counted), exponent)
        case Name(name):
            return counted.get(name, expression)
    return substitute(expression, counted) if names(expression) else expression


def _waves(expression: Expression, angles: frozenset[str]) -> Expression:
    """Convert what sine and cosine take."""
    match expression:
        case Call("sin" | "cos" as function, argument):
            return Call(function, in_degrees(argument, Dimension.ANGLE, angles))
        case Call(function, argument):
            return Call(function, _waves(argument, angles))
        case Sum(parts):
            return add(*(_waves(part, angles) for part in parts))
        case Product(parts):
            return multiply(*(_waves(part, angles) for part in parts))
        case Power(base, exponent):
            return power(_waves(base, angles), exponent)
    return expression
