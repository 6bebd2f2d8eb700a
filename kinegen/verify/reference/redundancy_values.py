"""What an inverse is given besides the pose, from the joint vector of that pose.

In: a robot with a redundancy, joint vectors. Out: the values of the joints, or the arm angle, read off the axes of the
joints as they are there (Kreutz-Delgado, Long and Seraji, Kinematic analysis of 7-DOF manipulators, International
Journal of Robotics Research 11(5), 1992): the angle about the line from the shoulder to the wrist, by the right-hand
rule, from the half plane that contains the direction of axis 1 to the half plane that contains the elbow.
"""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np
from numpy.typing import ArrayLike, NDArray

from kinegen.model.expression_parser import evaluate
from kinegen.model.robot import TOOL, JointVariable, Robot
from kinegen.model.variants import ARM_ANGLE
from kinegen.verify.reference.exact_numbers import DIGITS
from kinegen.verify.reference.number_types import FLOATS, digit_arrays
from kinegen.verify.reference.velocity import Kinematics

Numbers = NDArray[Any]

UPRIGHT = 1e-20
"""Squared sine of the angle between the line and axis 1 below which joint 1 says which half plane is meant."""


def redundancy(robot: Robot, q: ArrayLike, *, exact: bool = False) -> Numbers:
    """Returns what the inverse is given besides the poses of some joint vectors.

    Args:
        robot: A robot with a redundancy.
        q: Joint vectors, shape (N, dof); radians and the file's length unit.
        exact: Whether to compute with `DIGITS` digits.

    Returns:
        Values of the joint in its unit, or arm angles in radians from -pi to pi; shape (N,). Where several joints are
        given, their values in the order of `robot.given`, shape (N, number of joints).
    """
    motion = Kinematics(robot, q, exact=exact)
    places = {variable.name: variable.index for variable in robot.variables}
    found = [motion.q[:, places[name]] for name in robot.given if name in places]
    if found:
        return found[0] if len(found) == 1 else np.stack(found, axis=1)
    if robot.redundancy != ARM_ANGLE:
        raise ValueError(f"{robot.name} has no redundancy")
    with mpmath.workdps(DIGITS):
        return _arm_angle(robot, motion)


def _arm_angle(robot: Robot, motion: Kinematics) -> Numbers:
    kind = digit_arrays() if motion.exact else FLOATS
    root, angle = (kind.arithmetic.functions[name] for name in ("sqrt", "atan2"))
    directions, points = _lines(motion, root)
    shoulder, wrist = (_meeting(directions, points, first) for first in (0, 4))
    line, first, fourth = wrist - shoulder, directions[0], directions[3]
    # The side of the line on which the elbow is; where the arm is stretched, either.
    beside = np.cross(fourth, line)
    side = np.where(_dot(points[3] - shoulder, beside) < 0, -1, 1)
    elbow = beside * side[:, None]
    square = np.cross(line, first)
    upright = _dot(square, square) < UPRIGHT * _dot(line, line)
    square = np.where(upright[:, None], np.cross(_leaning(robot, motion, kind, directions), first), square)
    found: Numbers = angle(_dot(elbow, square) * root(_dot(line, line)), _dot(elbow, np.cross(square, line)))
    return found


def _lines(motion: Kinematics, root: Any) -> tuple[list[Numbers], list[Numbers]]:
    """Returns for each joint the direction about which it turns, and a point of its axis; shape (N, 3) each."""
    jacobian, place = motion.jacobian(TOOL), motion.pose(TOOL)[:, :3, 3]
    directions, points = [], []
    for joint in range(motion.robot.dof):
        linear, angular = jacobian[:, :3, joint], jacobian[:, 3:, joint]
        square = _dot(angular, angular)[:, None]
        directions.append(angular / root(square))
        points.append(place + np.cross(angular, linear) / square)
    return directions, points


def _meeting(directions: list[Numbers], points: list[Numbers], first: int) -> Numbers:
    """Returns where an axis and the next one meet."""
    normal = np.cross(directions[first], directions[first + 1])
    apart = points[first + 1] - points[first]
    along = _dot(np.cross(apart, directions[first + 1]), normal) / _dot(normal, normal)
    found: Numbers = points[first] + along[:, None] * directions[first]
    return found


def _leaning(robot: Robot, motion: Kinematics, kind: Any, directions: list[Numbers]) -> Numbers:
    """Returns where joint 2 leans the arm that stands upright, with joint 1 at 0, or at its limit nearest to 0."""
    first = robot.variables[0]
    rest = _rest(first, kind)
    jacobian = motion.jacobian(TOOL)[:, 3:, 0]
    rate = kind.arithmetic.functions["sqrt"](_dot(jacobian, jacobian))
    turn = (rest - motion.q[:, 0]) * rate
    ahead = np.cross(directions[1], directions[0])
    beside = np.cross(directions[0], ahead)
    found: Numbers = ahead * kind.cos(turn)[:, None] + beside * kind.sin(turn)[:, None]
    return found


def _rest(variable: JointVariable, kind: Any) -> Any:
    """0, or the limit nearest to it."""
    if variable.limits is None:
        return 0
    low, high = (evaluate(end, {}, kind.arithmetic) for end in variable.limits)
    return min(max(low, 0), high)


def _dot(a: Numbers, b: Numbers) -> Numbers:
    found: Numbers = (a * b).sum(axis=-1)
    return found
