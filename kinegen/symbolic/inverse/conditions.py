"""The conditions that families ask of axes: which of them fail, in words with numbers."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import sympy as sp

from kinegen.symbolic.fold import Vector
from kinegen.symbolic.inverse.axes import Axes, JointAxis
from kinegen.symbolic.inverse.exact import dot, is_null, minus
from kinegen.symbolic.inverse.geometry import are_parallel, are_square, feet, foot

_SHOWN = 1e-4
"""Radians from which on six digits of an angle show that it is not the one wanted."""


class Refusal(Exception):  # noqa: N818 - an answer, not an error
    """An arm is not of the family that was tried.

    Args:
        reasons: The conditions that fail, one line each.
    """

    def __init__(self, *reasons: str) -> None:
        super().__init__(*reasons)
        self.reasons = reasons


@dataclass(slots=True)
class Conditions:
    """Collects what fails.

    Attributes:
        axes: The chain, for the values of runtime parameters.
        failed: What fails, one line each.
    """

    axes: Axes
    failed: list[str] = field(default_factory=list)

    def parallel(self, left: JointAxis, right: JointAxis) -> None:
        """Two axes have to be parallel."""
        if not are_parallel(left, right):
            self.failed.append(
                f"axes {left.number} and {right.number} are not parallel: {_off(left, right, sp.Integer(0))}"
            )

    def square(self, left: JointAxis, right: JointAxis) -> None:
        """Two axes have to be at right angles."""
        if not are_square(left, right):
            self.failed.append(
                f"axes {left.number} and {right.number} are not at right angles: {_off(left, right, sp.pi / 2)}"
            )

    def turned(self, left: JointAxis, right: JointAxis) -> None:
        """Two axes must not be parallel."""
        if are_parallel(left, right):
            self.failed.append(f"axes {left.number} and {right.number} are parallel")

    def apart(self, left: JointAxis, right: JointAxis) -> None:
        """Two axes must not be the same line."""
        if are_parallel(left, right) and is_null(minus(foot(left, right.point), right.point)):
            self.failed.append(f"axes {left.number} and {right.number} are the same line")

    def meet(self, joints: tuple[JointAxis, ...]) -> Vector:
        """Where lines meet, of which the first two are not parallel."""
        numbers = ", ".join(str(joint.number) for joint in joints)
        near, far = feet(joints[0], joints[1])
        gaps = [(joints[0], joints[1], minus(far, near))]
        gaps += [(joints[0], joint, minus(foot(joint, near), near)) for joint in joints[2:]]
        for left, right, gap in gaps:
            if not is_null(gap):
                distance = math.hypot(*map(self.axes.value, gap))
                where = f"axes {left.number} and {right.number} pass at {distance:.4g}"
                if right is not joints[1]:
                    where = f"axis {right.number} misses the other two by {distance:.4g}"
                pair = f"axes {left.number} and {right.number} do not meet: they pass at {distance:.4g}"
                several = f"joints {numbers} do not meet in one point: {where}"
                self.failed.append(pair if len(joints) == 2 else several)
                break
        return near

    def check(self) -> None:
        """Raise `Refusal` if anything failed."""
        if self.failed:
            raise Refusal(*self.failed)


def _off(left: JointAxis, right: JointAxis, wanted: sp.Expr) -> str:
    """The angle between two axes, or what it lacks where rounding would hide that."""
    angle = sp.acos(abs(dot(left.direction, right.direction)))
    deviation = abs(float(sp.N(angle - wanted, 30)))
    if deviation < _SHOWN:
        return f"off by {deviation:.2g} rad"
    return f"they are at {float(sp.N(angle * 180 / sp.pi)):.6g} deg"
