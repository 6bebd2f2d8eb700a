"""All solutions of the arm with a spherical shoulder and a spherical wrist, for a given arm angle.

The elbow follows from the distance of the wrist; the line from the shoulder to the wrist and the arm angle then say how
the upper arm is turned, and what is left is a wrist at either end (Shimizu et al., Analytical inverse kinematic
computation for 7-DOF redundant manipulators with joint limits, IEEE Transactions on Robotics 24(5), 2008). The arm
angle is measured from the half plane that contains axis 1 (Kreutz-Delgado, Long and Seraji, Kinematic analysis of 7-DOF
manipulators, International Journal of Robotics Research 11(5), 1992), so that it is the same for all branches.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import sympy as sp

from kinegen.symbolic.fold import Vector
from kinegen.symbolic.inverse.axes import Axes
from kinegen.symbolic.inverse.cranks import Bend, bend_to, may_fold
from kinegen.symbolic.inverse.exact import chained, transposed
from kinegen.symbolic.inverse.family import SphericalArm
from kinegen.symbolic.inverse.geometry import Planar, in_frame
from kinegen.symbolic.inverse.solutions import Solution, rest_angle
from kinegen.symbolic.inverse.solve_gimbal import bent
from kinegen.symbolic.inverse.steps import ONE, ZERO, Steps
from kinegen.symbolic.inverse.target import Target
from kinegen.symbolic.inverse.thresholds import ALIGNED
from kinegen.symbolic.inverse.waists import arm_size, minus_named
from kinegen.symbolic.inverse.wrists import Columns, flips


@dataclass(frozen=True, slots=True)
class _Line:
    """The line from the shoulder to the wrist, in the frame of the shoulder, and the arm angle about it.

    Attributes:
        lead: Its direction across axis 1.
        tilt: Cosine and sine of its angle from axis 1.
        angle: Cosine and sine of the arm angle.
        distance: Its length.
    """

    lead: Planar
    tilt: Planar
    angle: Planar
    distance: sp.Expr

    def seen(self, steps: Steps, vector: Vector) -> Vector:
        """A vector of the shoulder's frame along the line, towards the elbow, and square to both."""
        along, across = steps.back(self.lead, vector[:2])
        line, down = steps.back(self.tilt, (vector[2], along))
        elbow, square = steps.back(self.angle, (-down, -across))
        return line, elbow, square

    def placed(self, steps: Steps, vector: Vector) -> Vector:
        """The way back: a vector along the line, towards the elbow and square to both, in the shoulder's frame."""
        line, elbow, square = vector
        up, beside = steps.times(self.angle, (elbow, square))
        height, along = steps.times(self.tilt, (line, -up))
        return (*steps.times(self.lead, (along, -beside)), height)


def spherical_solutions(
    steps: Steps, axes: Axes, build: SphericalArm, target: Target, angle: sp.Expr, sane: sp.Expr
) -> Iterator[Solution]:
    """Solve for all branches.

    Args:
        steps: The tape.
        axes: The chain.
        build: The arm.
        target: The pose of the tool.
        angle: The arm angle.
        sane: 1 for a target of finite numbers whose rotation is one, else 0.

    Yields:
        The solutions.
    """
    line = _line(steps, axes, build, target, angle)
    # Sines and cosines of what is no number, or too large, are NaN.
    valid = steps.select(-2 * ONE, line.angle[0], ONE, ZERO)
    hand = target.columns(steps, axes, build.wrist.hand)
    seen = [line.seen(steps, steps.turned(build.shoulder.frame, column)) for column in hand]
    starts = [steps.unit(rest_angle(wrist.joints[0])) for wrist in (build.shoulder, build.wrist)]
    bends = bend_to(steps, (line.distance, ZERO), build.upper, build.lower, ZERO)
    for bend, side in zip(bends, (1, -1), strict=True):
        shoulder = flips(steps, build.shoulder, _upper_arm(steps, build, line, bend, side), starts[0])
        wrist = flips(steps, build.wrist, _left_to_wrist(steps, build, bend, side, seen), starts[1])
        for first in shoulder:
            for last in wrist:
                amounts = (
                    *zip(build.shoulder.joints, first, strict=True),
                    (build.elbow, bend.second),
                    *zip(build.wrist.joints, last, strict=True),
                )
                yield Solution(amounts, (sane, valid, bend.valid))


def _line(steps: Steps, axes: Axes, build: SphericalArm, target: Target, angle: sp.Expr) -> _Line:
    """The line, which is where the target puts the wrist's centre; upright where it is on axis 1 or has no length."""
    shoulder = build.shoulder
    centre = target.point(steps, axes, build.wrist.centre)
    x, y, z = steps.turned(shoulder.frame, minus_named(steps, centre, shoulder.centre))
    near = ALIGNED * arm_size(*build.upper, *build.lower)
    level, start = steps.square((x, y)), steps.unit(rest_angle(shoulder.joints[0]))
    across = steps.root(level)
    distance = steps.root(level + z**2)
    inverse = steps.name(1 / steps.select(level, near, ONE, across))
    lead = (
        steps.select(level, near, start[0], x * inverse),
        steps.select(level, near, start[1], y * inverse),
    )
    scale, tilt = distance, (z, across)
    if may_fold(*(steps.length(link) for link in (build.upper, build.lower))):
        is_short = steps.square((distance, ZERO))
        scale = steps.select(is_short, near, ONE, distance)
        tilt = (steps.select(is_short, near, ONE, z), steps.select(is_short, near, ZERO, across))
    inverse = steps.name(1 / scale)
    turned = (steps.name(tilt[0] * inverse), steps.name(tilt[1] * inverse))
    return _Line(lead, turned, (sp.cos(angle), sp.sin(angle)), distance)


def _upper_arm(steps: Steps, build: SphericalArm, line: _Line, bend: Bend, side: int) -> Columns:
    """The rotation that is left to the shoulder, in its frame."""
    back, _ = bent(steps, build.upper, build.lower, bend, line.distance)
    columns = []
    for column in build.shoulder.hand:
        x, y, z = in_frame(build.frame, column)
        along, aside = steps.back(back, (x, y))
        columns.append(line.placed(steps, (along, side * aside, side * z)))
    return columns[0], columns[1], columns[2]


def _left_to_wrist(steps: Steps, build: SphericalArm, bend: Bend, side: int, seen: list[Vector]) -> Columns:
    """The rotation that is left to the wrist, in its frame."""
    between = chained(build.wrist.frame, transposed(build.frame))
    columns = []
    for line, elbow, square in seen:
        turned = steps.back(bend.direction, (line, side * elbow))
        columns.append(steps.turned(between, (*turned, side * square)))
    return columns[0], columns[1], columns[2]
