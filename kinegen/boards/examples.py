"""Inputs for what cannot be measured with random numbers: poses that an arm can take."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from kinegen import reference
from kinegen.errors import KinegenError
from kinegen.robot.extent import joint_box, reach
from kinegen.robot.model import JointType, Robot

COUNT = 16
"""Examples of one kernel; small boards hold them in RAM."""

NEAR = 0.1
"""How far a search starts from a solution: radians, or this part of a stroke."""

_INNER = 0.8


def targets_by_kind(robot: Robot) -> dict[str, tuple[tuple[float, ...], ...]]:
    """Targets of an inverse that cost different things, each followed by a joint vector.

    Args:
        robot: The robot; of several tips the first one is changed.

    Returns:
        `COUNT` rows of a 4x4 matrix for every tip and a joint vector for each kind. Joint vectors are near a solution,
        or, of the targets called far, anywhere in the joint box.

    Raises:
        KinegenError: If the robot has a redundancy, which these rows have no place for.
    """
    if robot.redundancy:
        raise KinegenError(f"{robot.name}: kinds of targets are not measured with a redundancy", robot.source)
    near = np.array(reachable_poses(robot, starts=True))
    box = np.array(joint_box(robot)).clip(-math.pi, math.pi)
    far, unreachable, bent = near.copy(), near.copy(), near.copy()
    far[:, -robot.dof :] = np.random.default_rng(2).uniform(box[:, 0], box[:, 1], (COUNT, robot.dof))
    unreachable[:, 3] += 3 * reach(robot)
    bent[:, [0, 1, 2, 4, 5, 6, 8, 9, 10]] *= 2
    kinds = {"near a solution": near, "far from one": far, "out of reach": unreachable, "not a rotation": bent}
    return {name: tuple(tuple(map(float, row)) for row in rows) for name, rows in kinds.items()}


def reachable_poses(robot: Robot, *, starts: bool, given: bool = False) -> tuple[tuple[float, ...], ...]:
    """Poses of the tips, each the numbers of a 4x4 matrix for every tip.

    Args:
        robot: The robot.
        starts: Whether each is followed by the joint vector from which a search begins.
        given: Whether what the inverse is given besides stands between them, for a robot with a redundancy.

    Returns:
        `COUNT` rows. The joint vectors of the poses are random ones well within the limits.
    """
    box = np.array(joint_box(robot))
    angles = np.array([variable.type is not JointType.PRISMATIC for variable in robot.variables])
    box[angles] = np.clip(box[angles], -math.pi, math.pi)
    middle, half = box.mean(axis=1), np.ptp(box, axis=1) / 2
    generator = np.random.default_rng(1)
    joints = middle + half * generator.uniform(-_INNER, _INNER, (COUNT, robot.dof))
    poses: NDArray[np.float64] = reference.pose(robot, joints).reshape(COUNT, -1)
    if given and robot.redundancy:
        poses = np.column_stack([poses, reference.redundancy(robot, joints)])
    steps = NEAR * np.where(angles, 1, 2 * half) * generator.choice([-1, 1], joints.shape)
    rows = np.concatenate([poses, np.clip(joints + steps, box[:, 0], box[:, 1])], axis=1) if starts else poses
    return tuple(tuple(map(float, row)) for row in rows)
