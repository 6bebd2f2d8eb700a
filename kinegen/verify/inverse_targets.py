"""The targets of an inverse, those that it must not solve, and where its solutions lead.

Ways that give the same solutions share their errors, so that the reference computes the pose of each solution once.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinegen.derive.inverse.derive import family_of, size_of
from kinegen.derive.inverse.family import Aim, Family
from kinegen.derive.inverse.singular_configurations import alignments, boundaries
from kinegen.derive.inverse.solve import reads_attitude
from kinegen.errors import ProofError
from kinegen.model.dh_conversion.elementary_transforms import chain_of
from kinegen.model.joint_bounds import joint_box, reach
from kinegen.model.outputs import Quantity
from kinegen.model.robot import JointType, Robot
from kinegen.support.dataclass import dataclass
from kinegen.verify import reference
from kinegen.verify.branches import Lines
from kinegen.verify.free_joint_samples import on_an_axis
from kinegen.verify.invocations import DTYPES, Arrays, KernelCall
from kinegen.verify.merging_samples import beside_merging, with_joint
from kinegen.verify.samples import RANDOM, SEED, FloatArray, Truths, proof_samples, random_joints

AT_LIMITS = "at a limit"
ALIGNED = "aligned"
ON_AN_AXIS = "on an axis"
BESIDE = "on the way to a singular set"

_BLOCK = 8192
"""Joint vectors whose poses are computed at a time: their matrices stay in the processor's cache."""


@dataclass(frozen=True, slots=True)
class SolvedTargets:
    """Joint vectors and the poses that are solved for."""

    random: int  # How many of them are random, the first ones
    special: dict[str, FloatArray]  # Those that follow, by what they are; further ones lie beyond the limits
    points: FloatArray  # All of them, shape (N, dof)
    poses: FloatArray  # Their poses (N, 4, 4)
    given: FloatArray | None = None  # What is given besides the poses, shape (N,); None where nothing is

    def inputs(self, dtype: np.dtype[Any]) -> Arrays:
        """Returns what an inverse is called with, in a number type."""
        return tuple(each.astype(dtype) for each in (self.poses, self.given) if each is not None)

    def fewer(self, random: int) -> tuple[SolvedTargets, NDArray[np.intp]]:
        """Returns the same with fewer random ones, and the rows that they had."""
        rows = np.concatenate([np.arange(random), np.arange(self.random, len(self.points))])
        given = None if self.given is None else self.given[rows]
        return SolvedTargets(random, self.special, self.points[rows], self.poses[rows], given), rows


@dataclass(frozen=True, slots=True)
class Led:
    """Solutions, and how far their poses are from the targets."""

    joints: FloatArray  # The solutions, shape (N, branches, dof)
    solved: Truths  # Which of them are valid, shape (N, branches)
    position: FloatArray  # The largest error of a position over the branches of each target, shape (N,)
    rotation: FloatArray  # The same of an entry of the rotation; 0 where the arm is not solved for it

    def at(self, rows: NDArray[np.intp]) -> Led:
        """Of some of the targets."""
        return Led(self.joints[rows], self.solved[rows], self.position[rows], self.rotation[rows])

    def has(self, joints: FloatArray, solved: Truths) -> Truths:
        """At which targets solutions are valid in the same branches, and there have the same bits."""
        same = (joints == self.joints).all(axis=2) | ~solved
        found: Truths = (same & (solved == self.solved)).all(axis=1)
        return found


def targets_of(
    robot: Robot, family: Family, random: int, each: int, beside: FloatArray | None = None, unit: float = 0.0
) -> SolvedTargets:
    """Returns the targets for a robot.

    `each`: how many of each kind of special ones; `beside`: joint vectors beside singular sets, shape (N, dof); `unit`:
    how far the poses of these are off, relative to 1 and to the reach, as those are that are computed in a number type:
    an entry that is nearly 0 is known to no more digits than others.
    """
    special = _special(robot, family, each)
    if beside is not None and len(beside):
        special[BESIDE] = beside
    if family.defect is not None:
        special |= {name: merging for name, merging in beside_merging(robot, family, each) if len(merging)}
    points = np.concatenate([random_joints(robot, random, SEED), *special.values(), _beyond(robot, each)])
    given = reference.redundancy(robot, points) if robot.redundancy else None
    poses = _poses(robot, points)
    if BESIDE in special:
        end = random + sum(map(len, special.values()))
        rounded = poses[end - len(special[BESIDE]) : end, :3]
        room = unit * np.array([1.0, 1.0, 1.0, reach(robot)])
        rounded += np.random.default_rng(SEED).uniform(-room, room, rounded.shape)
    return SolvedTargets(random, special, points, poses, given)


def lead_back(
    robot: Robot, family: Family, poses: FloatArray, joints: FloatArray, solved: Truths, known: Led | None
) -> Led:
    """See where solutions lead.

    `poses`: the targets, shape (N, 4, 4); `joints`: their solutions, shape (N, branches, dof); `solved`: which of them
    are valid, shape (N, branches); `known`: what another way of calling gave for the same targets, if there is any.
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


def within_limits(robot: Robot, q: FloatArray, room: Any = 0.0) -> Truths:
    """Returns which entries of joint vectors (..., dof) are within their limits, or beyond by no more than a room."""
    low, high = np.array(joint_box(robot)).T
    limited = np.array([variable.limits is not None for variable in robot.variables])
    within: Truths = ~limited | ((q >= low - room) & (q <= high + room))
    return within


def rounding_at_limits(robot: Robot, real: str, units: int) -> FloatArray:
    """Returns so many units of rounding of the larger limit of each joint, shape (dof,)."""
    found: FloatArray = units * np.finfo(DTYPES[real]).eps * np.abs(np.array(joint_box(robot))).max(axis=1)
    return found


def point_text(q: Any) -> str:
    """Returns a joint vector for a message."""
    return f"({', '.join(f'{float(entry):.6g}' for entry in q)})"


def _poses(robot: Robot, q: FloatArray) -> FloatArray:
    blocks = [q[start : start + _BLOCK] for start in range(0, len(q), _BLOCK)]
    return np.concatenate([reference.pose(robot, block)[:, 0] for block in blocks])


# Special targets ------------------------------------------------------------------------------------------------------


def _special(robot: Robot, family: Family, count: int) -> dict[str, FloatArray]:
    """Joint vectors at corners, at multiples of 45 degrees, and where branches meet."""
    found = {"singular and extreme": proof_samples(robot)[:-RANDOM]}
    for name, places in (("stretched or folded", boundaries(family)), (ALIGNED, alignments(family))):
        points = [with_joint(robot, family, index, value, count) for index, values in places for value in values]
        points = [each for each in points if len(each)]
        if points:
            found[name] = np.concatenate(points)
    free = on_an_axis(robot, family, count)
    found |= {ON_AN_AXIS: free} if len(free) else {}
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


def pose_errors(poses: FloatArray, targets: FloatArray) -> FloatArray:
    """Distances and angles between poses.

    `poses`: shape (N, 4, 4). Returns shape (N, 2), in the length unit of the poses and in radians.
    """
    between = targets[:, :3, :3] @ poses[:, :3, :3].swapaxes(1, 2)
    skew = between - between.swapaxes(1, 2)
    sines = np.sqrt((skew**2).sum(axis=(1, 2)) / 8)
    cosines = (np.trace(between, axis1=1, axis2=2) - 1) / 2
    return np.stack([np.linalg.norm(targets[:, :3, 3] - poses[:, :3, 3], axis=1), np.arctan2(sines, cosines)], axis=1)


TARGETS = 120
"""Targets of each kind."""

_OUTSIDE = 0.01
"""How far outside its range a joint is given, in part of that."""

SHEAR = 1e-3
"""How far a rotation is from one that is sheared or scaled a little; what is accepted is a part of that."""


def refuse_the_impossible(robot: Robot, quantity: Quantity, ways: Sequence[KernelCall], real: str) -> None:
    """See that no target is solved that cannot be.

    `ways`: the ways to call it, none of which checks its targets before it calls the kernel; see `unchecked`. Raises
    `ProofError` naming the way and the kind of target.
    """
    robot = chain_of(robot, quantity)
    q, family = random_joints(robot, TARGETS, SEED), family_of(robot)
    poses, size = reference.pose(robot, q)[:, 0], size_of(robot, family)
    outward = Lines(robot, q, size, family.chain).from_axis(1, poses[:, :3, 3])
    kind = DTYPES[real]
    given = reference.redundancy(robot, q).astype(kind) if robot.redundancy else None
    besides = () if given is None else (given,)
    kinds = [(what, (targets.astype(kind), *besides)) for what, targets in _impossible(robot, family, poses, outward)]
    if given is not None:
        kinds += [(what, (poses.astype(kind), spoilt)) for what, spoilt in _no_redundancy(robot, given)]
    with np.errstate(all="ignore"):
        for way in ways:
            for what, targets in kinds:
                _, valid = way.call(targets)
                if (valid != 0).any():
                    raise ProofError(f"{robot.name}: {way.target} {quantity} solves for targets {what}")


def _no_redundancy(robot: Robot, given: Any) -> Iterator[tuple[str, Any]]:
    """Values of a redundancy for which nothing is solved: no numbers, and those of a joint outside its limits.

    `given`: values that are right, shape (N,), or (N, numbers) where several are given. Yields what is wrong, and the
    values with one of them spoilt.
    """
    box = dict(zip((variable.name for variable in robot.variables), joint_box(robot), strict=True))
    limited = {variable.name for variable in robot.variables if variable.limits}
    for place, name in enumerate(robot.given):
        wrong = [("of NaN", np.nan), ("that is infinite", np.inf), ("that is infinite", -np.inf), ("beyond all", 1e9)]
        if name in limited:
            low, high = box[name]
            wrong.append(("below its limit", low - _OUTSIDE * (high - low)))
            wrong.append(("above its limit", high + _OUTSIDE * (high - low)))
        for what, value in wrong:
            spoilt = given.copy()
            spoilt.reshape(len(given), -1)[:, place] = value
            of = f" of {name}" if len(robot.given) > 1 else ""
            yield f"with a redundancy{of} {what}", spoilt


def _impossible(
    robot: Robot, family: Family, poses: FloatArray, outward: FloatArray
) -> Iterator[tuple[str, FloatArray]]:
    reads = reads_attitude(family)
    places = np.arange(12) if reads else np.array([3, 7, 11])
    for what, number in (("with NaN", np.nan), ("with an infinity", np.inf), ("with an infinity", -np.inf)):
        spoilt = poses.copy()
        spoilt.reshape(-1, 16)[np.arange(len(poses)), np.resize(places, len(poses))] = number
        yield what, spoilt
    if all(each.type is JointType.REVOLUTE or each.limits for each in robot.variables):
        for distance in (1.01, 4.0):
            yield "out of reach", _moved(poses, poses[:, :3, 3], distance * size_of(robot, family))
            # In the plane of an arm whose axes are parallel, and in the plane of approach of one with five joints.
            yield "out of reach", _moved(poses, outward, distance * size_of(robot, family))
    if not reads:
        return
    for what, change in (
        ("with a rotation times two", np.eye(3) * 2),
        ("with a rotation that is scaled", np.eye(3) * (1 + SHEAR)),
        ("with a rotation of zeros", np.zeros((3, 3))),
        ("with a reflection", np.diag([1.0, 1.0, -1.0])),
        ("with a reflection", -np.eye(3)),
        ("with a rotation that is sheared", np.array([[1.0, SHEAR, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])),
        ("with a rotation that is sheared", np.array([[1.0, 0.0, SHEAR], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])),
    ):
        bent = poses.copy()
        bent[:, :3, :3] = bent[:, :3, :3] @ change
        yield what, bent


def _moved(poses: FloatArray, way: FloatArray, distance: float) -> FloatArray:
    """Poses moved along directions by so much."""
    lengths = np.linalg.norm(way, axis=1, keepdims=True)
    unit = np.where(lengths > 1e-9 * distance, way / np.maximum(lengths, 1e-300), np.eye(3)[0])
    far = poses.copy()
    far[:, :3, 3] += 2 * distance * unit
    return far


@contextmanager
def unchecked(module: Any) -> Iterator[None]:
    """Let a kernel itself see what Python would refuse. `module`: that of the package which checks its targets."""
    names = {
        "checked_targets": lambda _, poses: poses,
        "is_pose": lambda _: True,
        "without_free": lambda poses, _: poses,
    }
    usual = {name: getattr(module, name) for name in names if hasattr(module, name)}
    for name in usual:
        setattr(module, name, names[name])
    try:
        yield
    finally:
        for name, function in usual.items():
            setattr(module, name, function)
