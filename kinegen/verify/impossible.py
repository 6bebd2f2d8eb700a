"""Targets that an inverse must not solve: not finite, not a pose, out of reach; in every way of calling it."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinegen import reference
from kinegen.errors import ProofError
from kinegen.outputs import Quantity
from kinegen.robot.extent import reach
from kinegen.robot.model import JointType, Robot
from kinegen.symbolic.inverse.family import Family
from kinegen.symbolic.inverse.solve import reads_attitude
from kinegen.verify.ways import DTYPES, Way

FloatArray = NDArray[np.float64]

TARGETS = 120
"""Targets of each kind."""

SHEAR = 1e-3
"""How far a rotation is from one that is sheared or scaled a little; what is accepted is a part of that."""


def refuse_the_impossible(
    robot: Robot, family: Family, package: ModuleType, quantity: Quantity, ways: Sequence[Way], real: str, q: FloatArray
) -> None:
    """See that no target is solved that cannot be.

    Args:
        robot: The robot.
        family: How it is built.
        package: Its package.
        quantity: The inverse.
        ways: The ways to call it.
        real: The number type.
        q: Joint vectors within the limits, from whose poses the targets are made.

    Raises:
        ProofError: Naming the way and the kind of target.
    """
    poses = reference.pose(robot, np.resize(q, (TARGETS, robot.dof)))[:, 0]
    kinds = [(what, targets.astype(DTYPES[real])) for what, targets in _impossible(robot, family, poses)]
    with unchecked(sys.modules[f"{package.__name__}._inverse"]), np.errstate(all="ignore"):
        for way in ways:
            for what, targets in kinds:
                _, valid = way.call((targets,))
                if (valid != 0).any():
                    raise ProofError(f"{robot.name}: {way.target} {quantity} solves for targets {what}")


def _impossible(robot: Robot, family: Family, poses: FloatArray) -> Iterator[tuple[str, FloatArray]]:
    reads = reads_attitude(family)
    places = np.arange(12) if reads else np.array([3, 7, 11])
    for what, number in (("with NaN", np.nan), ("with an infinity", np.inf), ("with an infinity", -np.inf)):
        spoilt = poses.copy()
        spoilt.reshape(-1, 16)[np.arange(len(poses)), np.resize(places, len(poses))] = number
        yield what, spoilt
    if all(each.type is JointType.REVOLUTE or each.limits for each in robot.variables):
        for distance in (1.01, 4.0):
            far = poses.copy()
            away = far[:, :3, 3] / np.maximum(np.linalg.norm(far[:, :3, 3], axis=1, keepdims=True), 1e-300)
            away[~(np.linalg.norm(away, axis=1) > 0.5)] = 1, 0, 0
            far[:, :3, 3] = away * distance * reach(robot)
            yield "out of reach", far
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


@contextmanager
def unchecked(module: Any) -> Iterator[None]:
    """Let a kernel itself see what Python would refuse.

    Args:
        module: That of the package which checks its targets.
    """
    names = {"checked_targets": lambda _, poses: poses, "is_pose": lambda _: True}
    usual = {name: getattr(module, name) for name in names if hasattr(module, name)}
    for name in usual:
        setattr(module, name, names[name])
    try:
        yield
    finally:
        for name, function in usual.items():
            setattr(module, name, function)
