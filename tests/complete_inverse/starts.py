"""Another way to all solutions, which shares nothing with the elimination: Newton steps from very many starts."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from kinegen import reference
from kinegen.robot.extent import reach
from kinegen.robot.model import Robot

Array = NDArray[np.float64]


def solutions_from_starts(robot: Robot, target: Array, starts: int, seed: int) -> Array:
    """All joint vectors (m, 6) that Newton steps from random starts lead to, with angles from -pi to pi.

    Args:
        robot: The robot, six joints that turn.
        target: The pose, 4x4.
        starts: The number of starts.
        seed: Of the starts.
    """
    q = np.random.default_rng(seed).uniform(-np.pi, np.pi, (starts, 6))
    size = reach(robot, robot.tips)
    for _ in range(60):
        error, slopes = _error(robot, q, target, size), np.empty((len(q), 12, 6))
        for joint in range(6):
            aside = np.zeros(6)
            aside[joint] = 1e-6
            change = _error(robot, q + aside, target, size) - _error(robot, q - aside, target, size)
            slopes[:, :, joint] = change / 2e-6
        damping = 1e-3 * (error**2).sum(axis=1)[:, None, None] * np.eye(6)
        step = np.linalg.solve(slopes.mT @ slopes + damping + 1e-15 * np.eye(6), slopes.mT @ error[..., None])
        q = q - np.clip(step[..., 0], -0.5, 0.5)
    q = q[np.linalg.norm(_error(robot, q, target, size), axis=1) < 1e-9]
    return distinct((q + np.pi) % (2 * np.pi) - np.pi)


def distinct(q: Array) -> Array:
    """Joint vectors that differ by more than 1e-5 rad in some joint."""
    found: list[Array] = []
    for each in q:
        if all(apart(each, other) > 1e-5 for other in found):
            found.append(each)
    return np.array(found).reshape(-1, 6)


def apart(q: Array, other: Array) -> float:
    """The largest difference of an angle, whole turns aside."""
    return float(np.abs((q - other + np.pi) % (2 * np.pi) - np.pi).max())


def _error(robot: Robot, q: Array, target: Array, size: float) -> Array:
    """Differences of all twelve entries of a pose, lengths as parts of the reach, shape (n, 12)."""
    off = (reference.pose(robot, q)[:, 0] - target)[:, :3].copy()
    off[:, :, 3] /= size
    return off.reshape(len(q), 12)
