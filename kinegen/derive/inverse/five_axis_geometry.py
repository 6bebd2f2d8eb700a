"""Machine tools with five axes: three joints that shift and two that turn between a workpiece and a tool.

Where the joints that turn are (both below the workpiece, both above the tool, one on either side) is read off the order
of the joints on the way; right angles and 45 degrees are one case, since any two directions that differ will do.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import sympy as sp

from kinegen.derive.folding import Vector
from kinegen.derive.inverse.axes import Axes, JointAxis, axes_between
from kinegen.derive.inverse.exact_geometry import Rotation, combined, cross, dot, is_null, tidy, transposed
from kinegen.derive.inverse.geometry import are_parallel, flat_frame
from kinegen.model.robot import Robot
from kinegen.support.compat import StrEnum
from kinegen.support.dataclass import dataclass

_JOINTS = 5
_SHIFTS = 3


class Arrangement(StrEnum):
    """Where the two joints that turn are."""

    TABLE = "both rotary axes in the table"
    HEAD = "both rotary axes in the head"
    MIXED = "one rotary axis in the table, one in the head"


@dataclass(frozen=True, slots=True)
class FiveAxisMachine:
    """A machine tool with five axes at q = 0, in the frame of the workpiece.

    With a unit vector a along the tool and first and second axis u1 and u2, a turn of the second joint by t has `u1 . a
    = middle + cosine * cos(t) + sine * sin(t)`.

    Attributes:
        first: The joint that turns next to the workpiece.
        second: The other one; its variable grows as its axis turns.
        frame: Rows of a frame whose z axis is the first axis.
        pointing: Tool axis at q = 0.
        end: Tool tip at q = 0.
        inverse: Rows of the inverse of the matrix of the directions of the shifts.
    """

    arrangement: Arrangement
    first: JointAxis
    second: JointAxis
    shifts: tuple[JointAxis, JointAxis, JointAxis]
    frame: Rotation
    pointing: Vector
    end: Vector
    inverse: Rotation
    middle: sp.Expr
    cosine: sp.Expr
    sine: sp.Expr
    defaults: tuple[tuple[sp.Symbol, sp.Expr], ...]

    @property
    def radius(self) -> sp.Expr:
        """How far `u1 . a` gets from its middle."""
        return tidy(sp.sqrt(tidy(self.cosine**2 + self.sine**2)))

    @property
    def is_square(self) -> bool:
        """Whether the tool axis reaches every direction: all standard machines without an inclined axis."""
        return bool(self.middle == 0 and self.radius == 1)

    @property
    def words(self) -> str:
        """How it is built and solved, in a sentence."""
        first, second = self.first.name, self.second.name
        low, high = (float(self.middle + sign * self.radius) for sign in (-1, 1))
        least, most, tilt = (
            math.degrees(math.acos(max(-1.0, min(1.0, cosine))))
            for cosine in (high, low, abs(float(dot(self.first.direction, self.second.direction))))
        )
        is_free = self.radius + abs(self.middle) == 1
        free = f"; where the tool is along axis {first}, joint {first} stays where it is" if is_free else ""
        return (
            f"{self.arrangement}, {first} next to the workpiece; axes {first} and {second} are at {tilt:.6g} deg; "
            f"directions from {least:.6g} to {most:.6g} deg off axis {first} are reached in two ways{free}"
        )

    @property
    def joints(self) -> tuple[JointAxis, ...]:
        """The joints in the order of the joint vector."""
        return tuple(sorted((self.first, self.second, *self.shifts), key=lambda joint: joint.number))


def machine_of(robot: Robot, start: str, end: str) -> FiveAxisMachine | tuple[str, ...]:
    """Recognise a machine tool with five axes between two frames, or tell why it is none, one line each.

    The tool is along the z axis of the frame `end`.
    """
    axes = axes_between(robot, start, end)
    if not isinstance(axes, Axes):
        return axes
    failures = tuple(_counts(axes)) or tuple(_directions(axes))
    return failures or _machine(axes)


def _counts(axes: Axes) -> Iterator[str]:
    """Yield the conditions on what the joints are and in which order they come."""
    turning = [place for place, joint in enumerate(axes.joints) if joint.turns]
    if len(axes.joints) != _JOINTS or len(turning) != _JOINTS - _SHIFTS:
        found = f"{len(axes.joints) - len(turning)} and {len(turning)}"
        yield f"a five-axis machine has 3 prismatic and 2 revolute joints, this has {found}"
        return
    if turning not in ([0, 1], [3, 4], [0, 4]):
        names = ", ".join(joint.name for joint in axes.joints)
        yield f"the 3 prismatic joints must follow each other in the chain from workpiece to tool, which is {names}"


def _directions(axes: Axes) -> Iterator[str]:
    """Yield the conditions on their directions."""
    first, second = (joint for joint in axes.joints if joint.turns)
    shifts = [joint for joint in axes.joints if not joint.turns]
    pointing = transposed(axes.rotation)[2]
    if are_parallel(first, second):
        yield f"axes {first.name} and {second.name} are parallel"
    if any(entry.free_symbols for entry in pointing):
        yield "the direction of the tool depends on a runtime parameter"
    elif is_null(cross(second.direction, pointing)):
        yield f"the tool is along axis {second.name}, which does not turn its direction"
    if _volume(shifts) == 0:
        yield f"the directions of {', '.join(joint.name for joint in shifts)} are in one plane"


def _volume(shifts: list[JointAxis]) -> sp.Expr:
    one, other, third = (joint.direction for joint in shifts)
    return dot(one, cross(other, third))


def _machine(axes: Axes) -> FiveAxisMachine:
    first, second = (joint for joint in axes.joints if joint.turns)
    second = second.forward
    shifts = [joint for joint in axes.joints if not joint.turns]
    one, other, third = (joint.direction for joint in shifts)
    # The inverse of the matrix of three shifts, which need not be orthogonal.
    volume = _volume(shifts)
    rows = tuple(combined((1 / volume, each)) for each in (cross(other, third), cross(third, one), cross(one, other)))
    pointing = transposed(axes.rotation)[2]
    # The tool axis along the first rotary axis: a constant, a cosine and a sine of the second joint.
    middle = tidy(dot(second.direction, pointing) * dot(first.direction, second.direction))
    turning = [joint.turns for joint in axes.joints]
    mixed = turning[0] and turning[-1]
    return FiveAxisMachine(
        arrangement=Arrangement.MIXED if mixed else Arrangement.TABLE if turning[0] else Arrangement.HEAD,
        first=first,
        second=second,
        shifts=(shifts[0], shifts[1], shifts[2]),
        frame=flat_frame(first),
        pointing=pointing,
        end=axes.position,
        inverse=(rows[0], rows[1], rows[2]),
        middle=middle,
        cosine=tidy(dot(first.direction, pointing) - middle),
        sine=dot(first.direction, cross(second.direction, pointing)),
        defaults=axes.defaults,
    )


def turned_parts(joint: JointAxis, vector: Vector) -> tuple[Vector, Vector, Vector]:
    """Return a constant vector turned by a joint: what is constant, what goes with the cosine and with the sine."""
    along = combined((dot(joint.direction, vector), joint.direction))
    return along, combined((1, vector), (-1, along)), cross(joint.direction, vector)
