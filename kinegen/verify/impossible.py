"""Targets that an inverse must not solve: not finite, not a pose, out of reach; in every way of calling it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinegen import reference
from kinegen.errors import ProofError
from kinegen.outputs import Quantity
from kinegen.robot.extent import joint_box
from kinegen.robot.model import JointType, Robot
from kinegen.symbolic.inverse.derive import family_of, size_of
from kinegen.symbolic.inverse.family import Family
from kinegen.symbolic.inverse.solve import reads_attitude
from kinegen.tables.seen import chain_of
from kinegen.verify.branches import Lines
from kinegen.verify.samples import SEED
from kinegen.verify.solved import random_joints
from kinegen.verify.ways import DTYPES, Way

FloatArray = NDArray[np.float64]

TARGETS = 120
"""Targets of each kind."""

_OUTSIDE = 0.01
"""How far outside its range a joint is given, in part of that."""

SHEAR = 1e-3
"""How far a rotation is from one that is sheared or scaled a little; what is accepted is a part of that."""


def refuse_the_impossible(robot: Robot, quantity: Quantity, ways: Sequence[Way], real: str) -> None:
    """See that no target is solved that cannot be.

    Args:
        robot: The robot.
        quantity: The inverse.
        ways: The ways to call it, none of which checks its targets before it calls the kernel; see `unchecked`.
        real: The number type.

    Raises:
        ProofError: Naming the way and the kind of target.
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

    Args:
        robot: The robot.
        given: Values that are right, shape (N,), or (N, numbers) where several are given.

    Yields:
        What is wrong, and the values with one of them spoilt.
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
    """Let a kernel itself see what Python would refuse.

    Args:
        module: That of the package which checks its targets.
    """
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
