"""The joint speeds that a twist of the tool costs, held against the reference's Jacobian."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinegen import reference
from kinegen.emit.reals import Real
from kinegen.emit.tracking import TRACKING
from kinegen.errors import ProofError
from kinegen.robot.extent import reach
from kinegen.robot.model import TOOL, Robot
from kinegen.verify.paths import moving, shifts, spreads, weighted_jacobians
from kinegen.verify.samples import SEED, singular_samples
from kinegen.verify.solved import random_joints
from kinegen.verify.ways import DTYPES

FloatArray = NDArray[np.float64]

ACCEPTED = {"double": 1e-7, "float": 3e-2}
"""How far speeds may be from the formula, relative to the largest one and to the size of the twist."""

_MOST = 0.3
"""The bound of all speeds in one of the calls."""


def require_speeds(robot: Robot, name: str, make: Callable[..., Any], real: str, count: int) -> None:
    """See that speeds, residuals and the part of a twist that bounds allow are those of the formula.

    Args:
        robot: The robot.
        name: What is called, for the message.
        make: Makes a tracker at a joint vector.
        real: The number type.
        count: Joint vectors, random ones and singular ones.

    Raises:
        ProofError: Saying which of them is wrong.
    """
    special = singular_samples(robot)[:count]
    points = np.concatenate([random_joints(robot, count, SEED), special]).astype(DTYPES[real]).astype(np.float64)
    twists = np.random.default_rng(SEED).uniform(-1, 1, (len(points), 6))
    twists[:, :3] *= reach(robot, robot.tips) / 3
    twists = twists.astype(DTYPES[real]).astype(np.float64)
    jacobians = reference.Kinematics(robot, points).jacobian(TOOL)
    units = np.array([reach(robot, robot.tips) / 3] * 3 + [1.0] * 3)
    for q, twist, jacobian, wanted in zip(
        points, twists, jacobians, _formula(robot, points, twists, real), strict=True
    ):
        try:
            tracker = make(q.astype(DTYPES[real]))
        except ValueError:
            continue  # in float, an end of the joint box may be outside the limits
        free, bounded = tracker.speeds(twist), tracker.speeds(twist, max_speed=_MOST)
        scale = ACCEPTED[real] * (1 + np.abs(wanted).max() + np.abs(wanted / _strides(robot)).max())
        if np.abs((free.qd - wanted) / _strides(robot)).max() > scale:
            raise ProofError(f"{name} gives other joint speeds than damped least squares; nothing was written")
        if np.abs((free.residual - (twist - jacobian @ free.qd)) / units).max() > scale:
            raise ProofError(f"{name} reports another residual of a twist than there is; nothing was written")
        factor = min(1.0, float(_MOST / max(np.abs(free.qd).max(), 1e-300)))
        if free.factor != 1 or abs(bounded.factor - factor) > 1e-5 or not np.array_equal(bounded.qd, free.qd):
            raise ProofError(f"{name} gives another part of a twist than bounds allow; nothing was written")


def _strides(robot: Robot) -> FloatArray:
    return np.array([reach(robot, robot.tips) / 3 if each else 1.0 for each in shifts(robot)])


def _formula(robot: Robot, q: FloatArray, twists: FloatArray, real: str) -> FloatArray:
    """(J^T J + k)^-1 J^T V by singular values, with k of Nakamura and Hanafusa; 0 for a joint that is given."""
    jacobians, moves = weighted_jacobians(robot, q), moving(robot)
    rows = jacobians.shape[1]
    weights = np.array([3 / reach(robot, robot.tips)] * 3 + [1.0] * 3)
    near = np.maximum(1 - spreads(robot, q) / float(TRACKING.near[Real(real)]), 0)
    least = float(TRACKING.least_damping[Real(real)])
    damping = np.where(near > 0, near**2 * float(TRACKING.speed_damping) + least, 0)
    u, s, vt = np.linalg.svd(jacobians, full_matrices=False)
    gains = s / (s**2 + damping[:, None] + 1e-30)
    parts = np.einsum("nij,ni->nj", u, (twists * weights)[:, :rows]) * gains
    found = np.zeros((len(q), robot.dof))
    found[:, moves] = np.einsum("nij,ni->nj", vt, parts)
    return found * _strides(robot)
