"""Rotations as elementary steps with exact angles: roll, pitch and yaw, axes in any direction, quaternions, matrices.

Angles that are not shares of pi become arc tangents of what the file says, so nothing is rounded.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from fractions import Fraction

from kinegen.robot.expressions import (
    ONE,
    ZERO,
    Expression,
    Number,
    add,
    arc_tangent,
    call,
    multiply,
    negate,
)
from kinegen.robot.model import Step, StepKind

Vector = tuple[Fraction, Fraction, Fraction]
Rows = tuple[Vector, Vector, Vector]

ROTATIONS = (StepKind.RX, StepKind.RY, StepKind.RZ)
SHIFTS = (StepKind.TX, StepKind.TY, StepKind.TZ)


def simplified(steps: Iterable[Step]) -> tuple[Step, ...]:
    """The same transform with neighbours added up and zeros left out; shifts in a row are in the order x, y, z."""
    found: list[Step] = []
    for step in steps:
        if step.value == ZERO:
            continue
        found.append(step)
        start = len(found) - 1
        if step.kind.is_rotation:
            if start and found[start - 1].kind is step.kind:
                found[start - 1 :] = _joined(found[start - 1 :])
            continue
        while start and not found[start - 1].kind.is_rotation:
            start -= 1
        found[start:] = _joined(found[start:])
    return tuple(found)


def _joined(steps: list[Step]) -> list[Step]:
    """Turns about one axis, or shifts, added up."""
    kinds = dict.fromkeys(sorted((step.kind for step in steps), key=lambda kind: kind.axis))
    sums = [Step(kind, add(*(step.value for step in steps if step.kind is kind))) for kind in kinds]
    return [step for step in sums if step.value != ZERO]


def inverse(steps: tuple[Step, ...]) -> tuple[Step, ...]:
    """The opposite transform."""
    return tuple(Step(step.kind, negate(step.value)) for step in reversed(steps))


def shift(vector: Vector) -> tuple[Step, ...]:
    """A translation."""
    return simplified(Step(kind, Number(value)) for kind, value in zip(SHIFTS, vector, strict=True))


def motion(axis: Vector, value: Expression, *, turns: bool) -> tuple[Step, ...]:
    """A turn about an axis, or a shift along it.

    Args:
        axis: Its direction; the length does not matter, but is not zero.
        value: How far, in radians or lengths.
        turns: Whether it turns.

    Returns:
        One step for a coordinate axis; otherwise steps that turn an axis into place and back.
    """
    kinds = ROTATIONS if turns else SHIFTS
    x, y, z = axis
    moving = [place for place in range(3) if axis[place]]
    if len(moving) == 1:
        return (Step(kinds[moving[0]], value if axis[moving[0]] > 0 else negate(value)),)
    if not z:
        turned: tuple[Step, ...] = (Step(StepKind.RZ, arc_tangent(Number(y), Number(x))),)
        return (*turned, Step(kinds[0], value), *inverse(turned))
    if not x:
        turned = (Step(StepKind.RX, arc_tangent(Number(-y), Number(z))),)
    elif not y:
        turned = (Step(StepKind.RY, arc_tangent(Number(x), Number(z))),)
    else:
        about = Step(StepKind.RZ, arc_tangent(Number(y), Number(x)))
        turned = (about, Step(StepKind.RY, arc_tangent(root(x * x + y * y), Number(z))))
    return (*turned, Step(kinds[2], value), *inverse(turned))


def root(value: Fraction) -> Expression:
    """An exact square root, of a positive number."""
    top, bottom = math.isqrt(value.numerator), math.isqrt(value.denominator)
    if top * top == value.numerator and bottom * bottom == value.denominator:
        return Number(Fraction(top, bottom))
    return call("sqrt", Number(value))


def of_quaternion(quaternion: tuple[Fraction, Fraction, Fraction, Fraction]) -> tuple[Step, ...]:
    """A rotation by a quaternion w, x, y, z of any length but zero; about a coordinate axis it is one step."""
    w, *vector = quaternion
    moving = [place for place in range(3) if vector[place]]
    if len(moving) <= 1:
        place = moving[0] if moving else 0
        if not vector[place]:
            return ()
        half = arc_tangent(Number(vector[place]), Number(w)) if w else arc_tangent(ONE, ZERO)
        return (Step(ROTATIONS[place], multiply(Number(Fraction(2)), half)),)
    return of_rows(quaternion_rows(quaternion))


def quaternion_rows(quaternion: tuple[Fraction, Fraction, Fraction, Fraction]) -> Rows:
    """The rotation matrix of a quaternion of any length but zero; it is rational."""
    w, x, y, z = quaternion
    s = 2 / (w * w + x * x + y * y + z * z)
    return (
        (1 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y)),
        (s * (x * y + w * z), 1 - s * (x * x + z * z), s * (y * z - w * x)),
        (s * (x * z - w * y), s * (y * z + w * x), 1 - s * (x * x + y * y)),
    )


def of_rows(rows: Rows) -> tuple[Step, ...]:
    """A rotation matrix with rational entries as `Rz Ry Rx`."""
    (r11, r12, _), (r21, r22, _), (r31, r32, r33) = rows
    if not r11 and not r21:
        # The middle angle is a quarter turn, and the two others turn about one axis.
        pitch = arc_tangent(Number(-r31), ZERO)
        return simplified((Step(StepKind.RZ, arc_tangent(Number(-r12), Number(r22))), Step(StepKind.RY, pitch)))
    yaw = arc_tangent(Number(r21), Number(r11))
    pitch = arc_tangent(Number(-r31), root(r11 * r11 + r21 * r21)) if r31 else ZERO
    roll = arc_tangent(Number(r32), Number(r33)) if r32 or r33 else ZERO
    return simplified((Step(StepKind.RZ, yaw), Step(StepKind.RY, pitch), Step(StepKind.RX, roll)))
