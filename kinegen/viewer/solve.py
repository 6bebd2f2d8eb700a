"""What the page has to know of an arm to solve for its joints: sizes, turns and the words of its closed form."""

from __future__ import annotations

import math
from typing import Any

from kinegen.emit.inverse import branches_of
from kinegen.emit.kernels import Kernels
from kinegen.robot.extent import joint_box, reach
from kinegen.robot.model import JointType


def inverse_model(kernels: Kernels) -> dict[str, Any]:
    """What the panels of the inverse and of the Jacobian take from Python.

    Args:
        kernels: The robot and its programs.

    Returns:
        `reach` of the tips in the file's length unit; `units`, 1 for each joint that turns and the reach for each that
        shifts; `box`, the ends of each joint variable; `periods`, what a whole turn of a joint is in its variable,
        null where it must not be turned; `family`, `meanings`, `conditions` and `readsAttitude` of the closed form.
    """
    robot, size = kernels.robot, reach(kernels.robot)
    branches = branches_of(kernels)
    turns = [2 * math.pi if each.type is JointType.REVOLUTE else math.inf for each in robot.variables]
    return {
        "reach": size,
        "units": [size if each.type is JointType.PRISMATIC else 1.0 for each in robot.variables],
        "box": [list(ends) for ends in joint_box(robot)],
        "periods": [each if math.isfinite(each) else None for each in (branches.turns if branches else turns)],
        "family": branches.family if branches else None,
        "branches": list(branches.names) if branches else [],
        "meanings": list(branches.meanings) if branches else [],
        "conditions": list(branches.conditions) if branches else [],
        "readsAttitude": branches.reads_attitude if branches else True,
    }
