"""The targets of an inverse, the same for all ways to call it, and where its solutions lead.

In: a robot, and how it is built. Out: joint vectors with their poses; errors of the poses of solutions. Ways that give
the same solutions share their errors, so that the reference computes the pose of each solution once.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinegen import reference
from kinegen.robot.extent import joint_box
from kinegen.robot.model import Robot
from kinegen.symbolic.inverse.family import Aim, Family
from kinegen.symbolic.inverse.places import alignments, boundaries
from kinegen.verify.samples import RANDOM, SEED, proof_samples
from kinegen.verify.ways import Arrays

FloatArray = NDArray[np.float64]
Truths = NDArray[np.bool_]

AT_LIMITS = "at a limit"

_BLOCK = 8192
"""Joint vectors whose poses are computed at a time: their matrices stay in the processor's cache."""


@dataclass(frozen=True, slots=True)
class SolvedTargets:
    """Joint vectors and the poses that are solved for.

    Attributes:
        random: How many of them are random, the first ones.
        special: Those that follow, by what they are; further ones lie beyond the limits.
        points: All of them, shape (N, dof).
        poses: Their poses (N, 4, 4).
        given: What is given besides the poses, shape (N,); None where nothing is.
    """

    random: int
    special: dict[str, FloatArray]
    points: FloatArray
    poses: FloatArray
    given: FloatArray | None = None

    def inputs(self, dtype: np.dtype[Any]) -> Arrays:
        """What an inverse is called with, in a number type."""
        return tuple(each.astype(dtype) for each in (self.poses, self.given) if each is not None)

    def fewer(self, random: int) -> tuple[SolvedTargets, NDArray[np.intp]]:
        """The same with fewer random ones, and the rows that they had."""
        rows = np.concatenate([np.arange(random), np.arange(self.random, len(self.points))])
        given = None if self.given is None else self.given[rows]
        return SolvedTargets(random, self.special, self.points[rows], self.poses[rows], given), rows


@dataclass(frozen=True, slots=True)
class Led:
    """Solutions, and how far their poses are from the targets.

    Attributes:
        joints: The solutions, shape (N, branches, dof).
        solved: Which of them are valid, shape (N, branches).
        position: The largest error of a position over the branches of each target, shape (N,).
        rotation: The same of an entry of the rotation; 0 where the arm is not solved for it.
    """

    joints: FloatArray
    solved: Truths
    position: FloatArray
    rotation: FloatArray

    def at(self, rows: NDArray[np.intp]) -> Led:
        """Of some of the targets."""
        return Led(self.joints[rows], self.solved[rows], self.position[rows], self.rotation[rows])

    def has(self, joints: FloatArray, solved: Truths) -> Truths:
        """At which targets solutions are valid in the same branches, and there have the same bits."""
        same = (joints == self.joints).all(axis=2) | ~solved
        found: Truths = (same & (solved == self.solved)).all(axis=1)
        return found


def targets_of(robot: Robot, family: Family, random: int, each: int) -> SolvedTargets:
    """The targets for a robot.

    Args:
        robot: The robot.
        family: How it is built.
        random: How many random ones.
        each: How many of each kind of special ones.
    """
    special = _special(robot, family, each)
    points = np.concatenate([random_joints(robot, random, SEED), *special.values(), _beyond(robot, each)])
    given = reference.redundancy(robot, points) if robot.redundancy else None
    return SolvedTargets(random, special, points, _poses(robot, points), given)


def lead_back(
    robot: Robot, family: Family, poses: FloatArray, joints: FloatArray, solved: Truths, known: Led | None
) -> Led:
    """See where solutions lead.

    Args:
        robot: The robot.
        family: How it is built.
        poses: The targets, shape (N, 4, 4).
        joints: Their solutions, shape (N, branches, dof).
        solved: Which of them are valid, shape (N, branches).
        known: What another way of calling gave for the same targets, if there is any.
    """
    position, rotation = np.zeros((2, len(poses)))
    new = np.ones(len(poses), bool)
    if known is not None:
        new = ~known.has(joints, solved)
        position[~new], rotation[~new] = known.position[~new], known.rotation[~new]
    for branch in range(joints.shape[1]):
        rows = np.flatnonzero(solved[:, branch] & new)
        if not len(rows):
            continue
        apart = np.abs(_poses(robot, joints[rows, branch]) - poses[rows])[:, :3]
        position[rows] = np.maximum(position[rows], apart[..., 3].max(axis=1))
        if family.aim is Aim.POSE:
            rotation[rows] = np.maximum(rotation[rows], apart[..., :3].max(axis=(1, 2)))
    return Led(joints, solved, position, rotation)


def random_joints(robot: Robot, count: int, seed: int) -> FloatArray:
    """Joint vectors from the joint box, shape (count, dof)."""
    low, high = np.array(joint_box(robot)).T
    return np.random.default_rng(seed).uniform(low, high, (count, robot.dof))


def _poses(robot: Robot, q: FloatArray) -> FloatArray:
    blocks = [q[start : start + _BLOCK] for start in range(0, len(q), _BLOCK)]
    return np.concatenate([reference.pose(robot, block)[:, 0] for block in blocks])


# Special targets ------------------------------------------------------------------------------------------------------


def _special(robot: Robot, family: Family, count: int) -> dict[str, FloatArray]:
    """Joint vectors at corners, at multiples of 45 degrees, and where branches meet."""
    found = {"singular and extreme": proof_samples(robot)[:-RANDOM]}
    for name, places in (("stretched or folded", boundaries(family)), ("aligned", alignments(family))):
        points = [_with(robot, family, index, value, count) for index, values in places for value in values]
        points = [each for each in points if len(each)]
        if points:
            found[name] = np.concatenate(points)
    limits = _at_limits(robot, count)
    return found | ({AT_LIMITS: limits} if len(limits) else {})


def _at_limits(robot: Robot, count: int) -> FloatArray:
    """Random joint vectors with one joint exactly at one of its limits."""
    box = np.array(joint_box(robot))
    limited = [variable.index for variable in robot.variables if variable.limits is not None]
    points = random_joints(robot, count if limited else 0, SEED)
    for row, point in enumerate(points):
        index = limited[row // 2 % len(limited)]
        point[index] = box[index, row % 2]
    return points


def _beyond(robot: Robot, count: int) -> FloatArray:
    """Random joint vectors of which most are outside the limits: what is valid for their poses is not."""
    low, high = np.array(joint_box(robot)).T
    room = np.maximum(np.pi - (high - low) / 2, (high - low) / 4)
    return np.random.default_rng(SEED).uniform(low - room, high + room, (count, robot.dof))


def _with(robot: Robot, family: Family, index: int, value: float, count: int) -> FloatArray:
    """Random joint vectors with one joint at a value, or whole turns from it; none if its limits exclude it."""
    low, high = joint_box(robot)[index]
    turn = 2 * math.pi / abs(float(family.joints[index].rate))
    turned = value + turn * math.ceil((low - value) / turn - 1e-9)
    points = random_joints(robot, count, SEED + index)
    points[:, index] = turned
    return points if turned <= high else points[:0]


def pose_errors(poses: FloatArray, targets: FloatArray) -> FloatArray:
    """Distances and angles between poses.

    Args:
        poses: Shape (N, 4, 4).
        targets: Likewise.

    Returns:
        Shape (N, 2), in the length unit of the poses and in radians.
    """
    between = targets[:, :3, :3] @ poses[:, :3, :3].swapaxes(1, 2)
    skew = between - between.swapaxes(1, 2)
    sines = np.sqrt((skew**2).sum(axis=(1, 2)) / 8)
    cosines = (np.trace(between, axis1=1, axis2=2) - 1) / 2
    return np.stack([np.linalg.norm(targets[:, :3, 3] - poses[:, :3, 3], axis=1), np.arctan2(sines, cosines)], axis=1)
