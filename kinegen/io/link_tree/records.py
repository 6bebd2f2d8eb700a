"""Links and joints as URDF and MJCF describe them, and rotations as elementary steps with exact angles.

A joint's frame is at `origin` in the frame of its parent link. The joint moves about or along `axis`, given in that
frame, and `after` leads on to the frame of the child link. Angles that are not shares of pi become arc tangents of what
the file says, so nothing is rounded.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import field
from fractions import Fraction

from kinegen.model.expression_parser import ONE, ZERO, Expression, Number, add, arc_tangent, call, multiply, negate
from kinegen.model.robot import Step, StepKind
from kinegen.support.compat import StrEnum
from kinegen.support.dataclass import dataclass

Vector = tuple[Fraction, Fraction, Fraction]
Rows = tuple[Vector, Vector, Vector]

ROTATIONS = (StepKind.RX, StepKind.RY, StepKind.RZ)
SHIFTS = (StepKind.TX, StepKind.TY, StepKind.TZ)


def simplified(steps: Iterable[Step]) -> tuple[Step, ...]:
    """Add neighbours up and leave zeros out of a transform; shifts in a row are in the order x, y, z."""
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
    """Add up turns about one axis, or shifts."""
    kinds = dict.fromkeys(sorted((step.kind for step in steps), key=lambda kind: kind.axis))
    sums = [Step(kind, add(*(step.value for step in steps if step.kind is kind))) for kind in kinds]
    return [step for step in sums if step.value != ZERO]


def inverse(steps: tuple[Step, ...]) -> tuple[Step, ...]:
    """Return the opposite transform."""
    return tuple(Step(step.kind, negate(step.value)) for step in reversed(steps))


def shift(vector: Vector) -> tuple[Step, ...]:
    """Return a translation."""
    return simplified(Step(kind, Number(value)) for kind, value in zip(SHIFTS, vector, strict=True))


def motion(axis: Vector, value: Expression, *, turns: bool) -> tuple[Step, ...]:
    """Turn about an axis by radians, or shift along it; its length does not matter, but is not zero.

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
    """Return an exact square root, of a positive number."""
    top, bottom = math.isqrt(value.numerator), math.isqrt(value.denominator)
    if top * top == value.numerator and bottom * bottom == value.denominator:
        return Number(Fraction(top, bottom))
    return call("sqrt", Number(value))


def of_quaternion(quaternion: tuple[Fraction, Fraction, Fraction, Fraction]) -> tuple[Step, ...]:
    """Return a rotation by a quaternion w, x, y, z of any length but zero; about a coordinate axis it is one step."""
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
    """Return the rotation matrix of a quaternion of any length but zero; it is rational."""
    w, x, y, z = quaternion
    s = 2 / (w * w + x * x + y * y + z * z)
    return (
        (1 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y)),
        (s * (x * y + w * z), 1 - s * (x * x + z * z), s * (y * z - w * x)),
        (s * (x * z - w * y), s * (y * z + w * x), 1 - s * (x * x + y * y)),
    )


def of_rows(rows: Rows) -> tuple[Step, ...]:
    """Return a rotation matrix with rational entries as `Rz Ry Rx`."""
    (r11, r12, _), (r21, r22, _), (r31, r32, r33) = rows
    if not r11 and not r21:
        # The middle angle is a quarter turn, and the two others turn about one axis.
        pitch = arc_tangent(Number(-r31), ZERO)
        return simplified((Step(StepKind.RZ, arc_tangent(Number(-r12), Number(r22))), Step(StepKind.RY, pitch)))
    yaw = arc_tangent(Number(r21), Number(r11))
    pitch = arc_tangent(Number(-r31), root(r11 * r11 + r21 * r21)) if r31 else ZERO
    roll = arc_tangent(Number(r32), Number(r33)) if r32 or r33 else ZERO
    return simplified((Step(StepKind.RZ, yaw), Step(StepKind.RY, pitch), Step(StepKind.RX, roll)))


class Motion(StrEnum):
    """The motion of the child link of a joint."""

    REVOLUTE = "revolute"
    CONTINUOUS = "continuous"
    PRISMATIC = "prismatic"
    FIXED = "fixed"


@dataclass(frozen=True, slots=True)
class Mimic:
    """A joint that follows another one: `multiplier * master + offset`; without a master it stays at the offset."""

    master: str
    multiplier: Fraction
    offset: Expression


@dataclass(frozen=True, slots=True)
class Link:
    """A body and the line of its element."""

    name: str
    line: int


@dataclass(frozen=True, slots=True)
class Joint:
    """The joint between a link and the one that carries it.

    Attributes:
        origin: From the frame of the parent to that of the joint.
        limits: Of its variable, in radians or lengths.
        zero: What is added to the variable.
        after: From the frame of the joint, moved, to that of the child.
        refused: Why the joint cannot be carried, such as a floating one, with what to do, if it cannot.
    """

    name: str
    line: int
    motion: Motion
    parent: str
    child: str
    origin: tuple[Step, ...] = ()
    axis: Vector = (Fraction(1), Fraction(0), Fraction(0))
    limits: tuple[Expression, Expression] | None = None
    mimic: Mimic | None = None
    zero: Expression = ZERO
    after: tuple[Step, ...] = ()
    refused: str = ""


@dataclass(frozen=True, slots=True)
class Suspect:
    """A number that is nearly something else, before its effect is known.

    Attributes:
        exact: What it became, or what it is near to.
        digits: How far apart, in units of the last printed digit.
        gap: How far apart, in radians or lengths.
        turns: Whether it is an angle.
        joint: Name of the joint whose origin or axis it is part of.
        changed: Whether the exact value was taken.
    """

    line: int
    where: str
    text: str
    exact: str
    digits: float
    gap: float
    turns: bool
    joint: str
    changed: bool


@dataclass(frozen=True, slots=True)
class LinkTree:
    """The content of a file, with every name checked to be used once.

    Attributes:
        notes: What was left out or chosen, one sentence each.
        degrees: Whether people get its angles in degrees.
    """

    name: str
    links: tuple[Link, ...]
    joints: tuple[Joint, ...]
    suspects: tuple[Suspect, ...] = field(default=())
    notes: tuple[str, ...] = ()
    degrees: bool = False
