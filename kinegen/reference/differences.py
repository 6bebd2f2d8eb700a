"""Jacobians as differences of poses in 50 digits: a second way to them, which knows nothing of series."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import mpmath
import numpy as np
from numpy.typing import ArrayLike

from kinegen.outputs import Reference
from kinegen.reference.numbers import DIGITS
from kinegen.reference.velocity import TIP, Kinematics, Numbers
from kinegen.robot.model import Robot

STEP = mpmath.mpf(10) ** -15
"""Central differences of smooth functions are then right to thirty digits, and 35 are left of 50."""


class Differences(Kinematics):
    """The same as `Kinematics` with `DIGITS` digits, but for the Jacobian.

    Args:
        robot: The robot.
        q: Joint vectors, shape (N, dof).
        params: Values of parameters that differ from the file.
    """

    def __init__(self, robot: Robot, q: ArrayLike, params: Mapping[str, Any] | None = None) -> None:
        super().__init__(robot, q, params, exact=True)
        with mpmath.workdps(DIGITS):
            self._moved = [
                tuple(Kinematics(robot, self.q + sign * STEP * row, params, exact=True) for sign in (1, -1))
                for row in np.eye(robot.dof, dtype=int)
            ]

    def jacobian(self, frame: str, reference: Reference = TIP) -> Numbers:
        """Geometric Jacobian, shape (N, 6, dof), from poses on both sides of each joint value."""
        place = self.pose(frame)
        rotation, position = place[:, :3, :3], place[:, :3, 3:]
        columns = []
        with mpmath.workdps(DIGITS):
            for ahead, behind in self._moved:
                moving = (ahead.pose(frame) - behind.pose(frame)) / (2 * STEP)
                turning = moving[:, :3, :3] @ rotation.swapaxes(1, 2)
                angular = np.stack([turning[:, 2, 1], turning[:, 0, 2], turning[:, 1, 0]], axis=1)[..., None]
                linear = moving[:, :3, 3:]
                if reference is Reference.LOCAL:
                    linear, angular = (rotation.swapaxes(1, 2) @ part for part in (linear, angular))
                elif reference is Reference.WORLD:
                    linear = linear - turning @ position
                columns.append(np.concatenate([linear, angular], axis=1)[..., 0])
        return self._joined(columns)
