"""Joint vectors that leave a joint free, as the target then does; and targets in a number type that do.

The axes at q = 0 say where the point goes; that such a joint moves nothing but the wrist shows in the Jacobian of the
reference.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from kinegen.derive.expressions import number_of
from kinegen.derive.folding import Vector
from kinegen.derive.inverse.axes import JointAxis
from kinegen.derive.inverse.exact_geometry import combined
from kinegen.derive.inverse.family import (
    Build,
    ColumnArm,
    ElbowArm,
    Family,
    FlatArm,
    GimbalArm,
    StrokeArm,
    TripleArm,
    WristArm,
)
from kinegen.derive.inverse.singular_configurations import free_end
from kinegen.derive.inverse.tolerances import ALIGNED
from kinegen.model.branches import FreeEnd, OnAxis
from kinegen.model.joint_bounds import joint_box, reach
from kinegen.model.robot import Robot
from kinegen.verify import reference
from kinegen.verify.samples import SEED, FloatArray, Truths, singular_values

_STARTS = 8
"""Random joint vectors for each one that is wanted; many end outside the limits."""

_STEPS = 25
_NEAR = 1e-14
"""How near to the axis the point must be, relative to the reach."""

_FREE, _FIXED = 1e-12, 1e-6
"""Singular values of the Jacobian, lengths by the reach, of a motion that is free, and of one that is not."""


def on_an_axis(robot: Robot, family: Family, count: int) -> FloatArray:
    """Random joint vectors within the limits, with the point that the arm carries on the axis of a joint before it.

    `count`: the most for each joint. Returns shape (N, dof); none where the arm does not get there, or leaves no joint
    after it to follow.
    """
    if family.defect is not None:
        return np.zeros((0, robot.dof))
    found = [_turned_to(robot, family, *each, count) for each in _free(family.build)]
    return np.concatenate(
        [np.zeros((0, robot.dof)), *(each[_leaves_one_free(robot, family, each)][:count] for each in found)]
    )


def folded_on_an_axis(robot: Robot, family: Family, build: FlatArm, count: int) -> FloatArray:
    """Random joint vectors within the limits of two parallel axes that fold their point onto the first of them."""
    first, second = build.turns[:2]
    return _turned_to(robot, family, first, (second,), (build.end,), count)[:count]


def _leaves_one_free(robot: Robot, family: Family, q: FloatArray) -> Truths:
    """Whether the reference knows one motion of the joints that are solved for, and no more, that moves no tool."""
    if not len(q):
        return np.zeros(0, bool)
    values = singular_values(robot, q, joints=sorted(number - 1 for number in family.axes.numbers))
    found: Truths = (values[:, -1] < _FREE) & (values[:, -2] > _FIXED)
    return found


def _free(build: Build) -> Iterator[tuple[JointAxis, tuple[JointAxis, ...], tuple[Vector, ...]]]:
    """The joints that a target can leave free, those after them that move the arm, and the points on the axis."""
    match build:
        case WristArm(ElbowArm(waist, shoulder, third) | StrokeArm(waist, shoulder, third), wrist):
            yield waist.joint, (shoulder, third), (wrist.centre,)
            yield shoulder, (third,), (wrist.centre,)
        case WristArm(GimbalArm(waist, shoulder, elbow), wrist):
            yield waist.joint, (shoulder, elbow), (wrist.centre,)
            yield shoulder, (elbow,), (wrist.centre,)
        case WristArm(ColumnArm(turn, lift, stroke), wrist):
            yield turn, (lift, stroke), (wrist.centre,)
        case TripleArm(waist, turns, end=end, roll=JointAxis() as roll):
            yield waist.joint, turns, (end, combined((1, end), (1, roll.direction)))


def _turned_to(
    robot: Robot,
    family: Family,
    joint: JointAxis,
    movers: Sequence[JointAxis],
    points: Sequence[Vector],
    count: int,
) -> FloatArray:
    """Newton steps of some joints that bring points to an axis, from random joint vectors."""
    low, high = np.array(joint_box(robot)).T
    q = np.random.default_rng(SEED + joint.number).uniform(low, high, (_STARTS * count, robot.dof))
    places, rates = [each.number - 1 for each in movers], np.array([float(each.rate) for each in movers])
    line = np.array([family.axes.value(entry) for entry in joint.point])
    direction = np.array([float(entry) for entry in joint.direction])
    across = np.eye(3) - np.outer(direction, direction)
    carried = [np.array([family.axes.value(entry) for entry in point]) for point in points]
    for step in range(_STEPS + 1):
        moved = [_carried(family, movers, q[:, places] * rates, point) for point in carried]
        off = np.concatenate([(where - line) @ across for where, _ in moved], axis=1)
        ways = np.concatenate([across @ each for _, each in moved], axis=1)
        if step < _STEPS:
            q[:, places] -= (np.linalg.pinv(ways, rcond=1e-9) @ off[..., None])[..., 0] / rates
    near = np.abs(off).max(axis=1) < _NEAR * reach(robot)
    found: FloatArray = q[near & ((q >= low) & (q <= high)).all(axis=1)][: 2 * count]
    return found


def _carried(
    family: Family, movers: Sequence[JointAxis], amounts: FloatArray, point: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Returns where joints carry a point, shape (N, 3), and its velocity for each of them, (N, 3, joints)."""
    where = np.broadcast_to(point, (len(amounts), 3))
    ways: list[FloatArray] = []
    for joint, amount in reversed(list(zip(movers, amounts.T, strict=True))):
        direction = np.array([float(entry) for entry in joint.direction])
        line = np.array([family.axes.value(entry) for entry in joint.point])
        if not joint.turns:
            where = where + amount[:, None] * direction
            ways.insert(0, np.broadcast_to(direction, where.shape))
            continue
        where = line + _turned(direction, amount, where - line)
        ways = [_turned(direction, amount, way) for way in ways]
        ways.insert(0, np.cross(direction, where - line))
    return where, np.stack(ways, axis=2)


def _turned(direction: FloatArray, angle: FloatArray, vector: FloatArray) -> FloatArray:
    """Vectors turned about a direction."""
    along = (vector @ direction)[:, None] * direction
    cosine, sine = np.cos(angle)[:, None], np.sin(angle)[:, None]
    found: FloatArray = along + cosine * (vector - along) + sine * np.cross(direction, vector)
    return found


_APART = 0.02
"""The least singular value but one of the Jacobian, lengths by the reach."""

_CLEAR = 0.05
"""How far both shoulders are apart at least, by the reach."""

_CLEARLY = 0.5
"""How near, as a share of the threshold, is near enough in spite of rounding."""


def joints_freed(robot: Robot, family: Family, count: int) -> FloatArray:
    """Joint vectors (N, dof) within the limits whose poses leave the first or last joint free.

    `count`: the most for each place where that is so.
    """
    end = free_end(family)
    if end is None:
        return np.zeros((0, robot.dof))
    if isinstance(family.build, FlatArm):
        return _well_conditioned(robot, folded_on_an_axis(robot, family, family.build, count))
    if isinstance(end.where, OnAxis):
        return _well_conditioned(robot, on_an_axis(robot, family, count))
    low, high = np.array(joint_box(robot)).T
    q = np.random.default_rng(SEED).uniform(low, high, (count * len(end.where.places), robot.dof))
    middles, values = zip(*((each.middle, each.at) for each in end.where.places), strict=True)
    turn = 2 * np.pi / abs(float(family.joints[middles[0]].rate))
    for row, value in zip(q, np.resize(values, len(q)), strict=True):
        inside = value + turn * np.arange(-3, 4)
        row[middles[0]] = inside[np.abs(inside - row[middles[0]]).argmin()]
    q = q[((q >= low) & (q <= high)).all(axis=1)]
    if isinstance(family.build, TripleArm):
        q = q[_shoulder(robot, family, family.build, q) > _CLEAR * reach(robot)]
    return _well_conditioned(robot, q)


def _well_conditioned(robot: Robot, q: FloatArray) -> FloatArray:
    """Those beside which no other singular set is: rounding there is as much as what says that a joint is free."""
    kept: FloatArray = q[singular_values(robot, q)[:, -2] > _APART]
    return kept


def _shoulder(robot: Robot, family: Family, build: TripleArm, q: FloatArray) -> FloatArray:
    """Returns how far the point that the waist of a UR type turns is from where both shoulders meet."""
    axis = family.axes.joints[0]
    turned, position = (np.array(each, float) for each in (family.axes.rotation, family.axes.position))
    carried = turned.T @ (np.array(build.end, float) - position)
    apart = reference.pose(robot, q)[:, 0] @ [*carried, 1]
    across = np.cross(apart[:, :3] - np.array(axis.point, float), np.array(axis.direction, float))
    beyond: FloatArray = np.sqrt(np.maximum((across**2).sum(axis=1) - float(build.depth) ** 2, 0))
    return beyond


def is_freed(end: FreeEnd | None, target: FloatArray, solutions: FloatArray, single: bool) -> bool:
    """Returns whether a target clearly leaves the joint free.

    `end`: the joint, or None; `target`: shape (4, 4), as it is in the number type; `solutions`: those that are valid
    (N, dof).
    """
    if end is None:
        return False
    if isinstance(end.where, OnAxis):
        apart = target[:3, :3] @ end.where.point + target[:3, 3] - end.point
        across = np.cross(end.direction, apart)
        tilt = np.cross(end.direction, target[:3, :3] @ (end.where.along or end.direction)) * (
            end.where.along is not None
        )
        apart = max(across @ across / end.where.near.of(single), tilt @ tilt / number_of(ALIGNED, single=single))
        return bool(apart < _CLEARLY**2)
    ways = ((2 * np.sin((solutions[:, each.middle] - each.at) / 2), each.near.of(single)) for each in end.where.places)
    return any(bool((np.abs(away) < _CLEARLY * near).any()) for away, near in ways)
