"""The chain for which an inverse is solved, against the robot that it is a part of.

The proof of an inverse samples poses of the chain between two frames of a tree. That this chain is the way between
these frames is seen here: its poses are those that the reference gives for one frame as seen from the other one.
"""

from __future__ import annotations

import numpy as np

from kinegen import reference
from kinegen.errors import ProofError
from kinegen.outputs import Quantity
from kinegen.robot.extent import joint_box, reach
from kinegen.robot.model import Robot
from kinegen.tables.seen import chain_of
from kinegen.verify.samples import SEED

POSES = 64
"""Random joint vectors at which both are compared."""

SAME = 1e-12
"""Accepted difference of an entry of a rotation, and of a position relative to the reach."""


def require_same_way(robot: Robot, quantity: Quantity) -> None:
    """See that the chain of an inverse is the way between its frames.

    Args:
        robot: The robot.
        quantity: The inverse.

    Raises:
        ProofError: If a pose of the chain is another one.
    """
    if not quantity.frame:
        return
    chain = chain_of(robot, quantity)
    low, high = np.array(joint_box(robot)).T
    q = np.random.default_rng(SEED).uniform(low, high, (POSES, robot.dof))
    wanted = reference.Kinematics(robot, q).pose(quantity.way)
    apart = np.abs(reference.pose(chain, q)[:, 0] - wanted)
    apart[:, :3, 3] /= reach(robot, [quantity.way])
    if not apart.max() < SAME:
        raise ProofError(f"{robot.name}: the chain of {quantity} has other poses than the robot; nothing was written")
