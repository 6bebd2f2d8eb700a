"""The pose that the tool is to have, and what remains of it for the other joints once one joint is given."""

from __future__ import annotations

from dataclasses import dataclass

import sympy as sp

from kinegen.symbolic.fold import Vector
from kinegen.symbolic.inverse.axes import Axes, JointAxis
from kinegen.symbolic.inverse.exact import Rotation, combined, dot, minus, transposed, turned
from kinegen.symbolic.inverse.geometry import flat_frame
from kinegen.symbolic.inverse.steps import Steps
from kinegen.symbolic.inverse.waists import minus_named
from kinegen.symbolic.inverse.wrists import Columns


@dataclass(frozen=True, slots=True)
class Target:
    """The pose that the tool is to have, as symbols.

    Attributes:
        rotation: By rows.
        position: Of the tool, in the base frame.
    """

    rotation: Rotation
    position: Vector

    def inverse(self, steps: Steps) -> Target:
        """The pose of the base in the frame of the tool."""
        back = transposed(self.rotation)
        x, y, z = (steps.name(-entry) for entry in steps.turned(back, self.position))
        return Target(back, (x, y, z))

    def point(self, steps: Steps, axes: Axes, point: Vector) -> Vector:
        """Where a point fixed to the tool has to be, from where it is at q = 0."""
        offset = turned(transposed(axes.rotation), minus(point, axes.position))
        x, y, z = (
            steps.name(place + sp.Add(*(a * b for a, b in zip(row, offset, strict=True))))
            for place, row in zip(self.position, self.rotation, strict=True)
        )
        return x, y, z

    def columns(self, steps: Steps, axes: Axes, frame: Rotation) -> Columns:
        """Where the columns of a frame fixed to the tool have to point, from where they point at q = 0."""
        first, second, third = (
            steps.turned(self.rotation, turned(transposed(axes.rotation), column)) for column in frame
        )
        return first, second, third

    def without_first(self, steps: Steps, joint: JointAxis, value: sp.Expr) -> Target:
        """Where the tool has to be for the joints after the first one, which is given.

        Args:
            steps: The tape.
            joint: The first joint.
            value: Its variable.

        Returns:
            This pose, moved back by that joint; NaN in every rotation or position where the variable is.
        """
        if not joint.turns:
            shift = combined((joint.rate, joint.direction))
            x, y, z = (steps.name(a - b * value) for a, b in zip(self.position, shift, strict=True))
            return Target(self.rotation, (x, y, z))
        rows = transposed(flat_frame(joint))
        angle = joint.rate * value
        cosine, sine = sp.cos(angle), sp.sin(angle)

        def turned_back(vector: Vector) -> Vector:
            x, y, z = steps.turned(flat_frame(joint), vector)
            ahead = steps.name(steps.name(cosine * x) + steps.name(sine * y))
            beside = steps.name(steps.name(cosine * y) - steps.name(sine * x))
            return steps.turned(rows, (ahead, beside, z))

        first, second, third = (turned_back(column) for column in transposed(self.rotation))
        axis = combined((1, joint.point), (-dot(joint.point, joint.direction), joint.direction))
        apart = turned_back(minus_named(steps, self.position, axis))
        x, y, z = (steps.name(a + b) for a, b in zip(apart, axis, strict=True))
        return Target(transposed((first, second, third)), (x, y, z))
