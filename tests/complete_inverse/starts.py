"""Another way to all solutions, which shares nothing with kinegen's: Newton steps from very many starts."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from kinegen.model.joint_bounds import joint_box, reach
from kinegen.model.robot import TOOL, JointType, Robot
from kinegen.verify import reference

Array = NDArray[np.float64]

STEPS = 40
REACHED = 1e-9


def solutions_from_starts(robot: Robot, target: Array, starts: int, seed: int, given: float | None = None) -> Array:
    """All joint vectors (m, dof) that Newton steps from random starts lead to, with angles from -pi to pi.

    Args:
        robot: The robot, six joints; or seven with a redundancy.
        target: The pose, 4x4.
        starts: The number of starts.
        seed: Of the starts.
        given: What the inverse is given besides, in the unit of the redundancy.
    """
    low, high = np.where(turning(robot), np.array([[-np.pi], [np.pi]]), np.array(joint_box(robot)).T)
    q = np.random.default_rng(seed).uniform(low, high, (starts, robot.dof))
    size = reach(robot, robot.tips)
    for _ in range(STEPS):
        error, slopes = _error(robot, q, target, size, given)
        square = slopes.mT @ slopes
        damping = (1e-3 * (error**2).sum(axis=1)[:, None, None] + 1e-15) * np.eye(robot.dof)
        step = np.linalg.solve(square + damping, slopes.mT @ error[..., None])[..., 0]
        q = q - np.clip(step, -0.5, 0.5)
    q = q[np.linalg.norm(_error(robot, q, target, size, given)[0], axis=1) < REACHED]
    return distinct(np.where(turning(robot), (q + np.pi) % (2 * np.pi) - np.pi, q))


def turning(robot: Robot) -> NDArray[np.bool_]:
    """Which joints turn."""
    return np.array([each.type is not JointType.PRISMATIC for each in robot.variables])


def distinct(q: Array) -> Array:
    """Joint vectors that differ by more than 1e-5 rad in some joint."""
    found: list[Array] = []
    for each in q:
        if all(apart(each, other) > 1e-5 for other in found):
            found.append(each)
    return np.array(found).reshape(-1, q.shape[1])


def apart(q: Array, other: Array) -> float:
    """The largest difference of an angle, whole turns aside; strokes are short."""
    return float(np.abs((q - other + np.pi) % (2 * np.pi) - np.pi).max())


def _error(robot: Robot, q: Array, target: Array, size: float, given: float | None) -> tuple[Array, Array]:
    """Differences of all twelve entries of a pose, lengths as parts of the reach, and of what is given; slopes too."""
    motion = reference.Kinematics(robot, q)
    pose, jacobian = motion.pose(TOOL)[:, :3], motion.jacobian(TOOL)
    off = pose - target[:3]
    by_entry = np.empty((len(q), 3, 4, robot.dof))
    for column in range(3):
        by_entry[:, :, column] = np.cross(jacobian[:, 3:], pose[:, :, column, None], axis=1)
    by_entry[:, :, 3] = jacobian[:, :3] / size
    off[:, :, 3] /= size
    error, slopes = off.reshape(len(q), 12), by_entry.reshape(len(q), 12, robot.dof)
    if given is None:
        return error, slopes
    more = (reference.redundancy(robot, q) - given + np.pi) % (2 * np.pi) - np.pi
    return np.column_stack([error, more]), np.concatenate([slopes, _slope(robot, q)[:, None]], axis=1)


def _slope(robot: Robot, q: Array) -> Array:
    """How what is given changes with each joint, shape (n, dof)."""
    found = np.empty(q.shape)
    for joint, aside in enumerate(1e-6 * np.eye(robot.dof)):
        change = reference.redundancy(robot, q + aside) - reference.redundancy(robot, q - aside)
        found[:, joint] = ((change + np.pi) % (2 * np.pi) - np.pi) / 2e-6
    return found
