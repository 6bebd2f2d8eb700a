"""The points that the tip reaches, small enough to be part of a page.

One point of each voxel that samples hit (see `kinegen.workspace`), as 16 bits a coordinate in the box around them,
sorted along a curve through space, so that differences between neighbours are small and compress well.
"""

from __future__ import annotations

import base64
import zlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinegen.errors import KinegenError
from kinegen.pipeline import lower_robot
from kinegen.robot.model import Robot
from kinegen.workspace.cloud import make_cloud
from kinegen.workspace.options import SurveyOptions
from kinegen.workspace.ranges import joint_ranges
from kinegen.workspace.survey import survey
from kinegen.workspace.tip import find_tip, position_of

MOST_POINTS = 40_000
"""What still turns smoothly on a laptop, and takes a quarter of a megabyte of the page."""

_LEVELS = 65535


def cloud_data(robot: Robot, samples: int) -> dict[str, Any]:
    """What the tip of a robot reaches, for the page.

    Args:
        robot: The robot; of a tree the first tip is taken.
        samples: Number of joint vectors to try; 0 for no cloud.

    Returns:
        `{"cloud": {points, low, high, count, tip}}`: differences of 16-bit numbers, x of all points, then y and z,
        compressed and in base64; the corners of their box in the file's length unit; an empty object without samples.

    Raises:
        KinegenError: If the robot has no joint, or joint values are too large for its kernel.
    """
    if not samples:
        return {}
    if not robot.dof:
        raise KinegenError(f"{robot.name} has no joint, so there is nothing to reach", robot.source)
    kernels = lower_robot(robot, (position_of(robot, robot.tips[0] if robot.is_tree else None),))
    found = survey(robot, find_tip(kernels), joint_ranges(robot), SurveyOptions(samples))
    points, _ = make_cloud(found)
    # Evenly thinned: the points come in the order in which samples hit voxels, which no region is first in.
    points = points[:: max(1, -(-len(points) // MOST_POINTS))]
    return {"cloud": packed(points) | {"tip": found.tip.name}}


def packed(points: NDArray[np.float64]) -> dict[str, Any]:
    """Points as text.

    Args:
        points: Shape (N, 3).

    Returns:
        As `cloud_data` says, without the tip.
    """
    low, high = points.min(axis=0), points.max(axis=0)
    size = np.where(high > low, high - low, 1.0)
    levels = np.rint((points - low) / size * _LEVELS).astype(np.uint16)
    levels = levels[np.argsort(_places(levels), kind="stable")]
    steps = np.diff(levels, axis=0, prepend=np.zeros((1, 3), np.uint16))
    data = zlib.compress(steps.T.astype("<u2").tobytes(), 9)
    return {
        "points": base64.b64encode(data).decode(),
        "low": low.tolist(),
        "high": high.tolist(),
        "count": len(points),
    }


def _places(levels: NDArray[np.uint16]) -> NDArray[np.uint64]:
    """The place of each point on Morton's curve: the bits of x, y and z by turns."""
    found = np.zeros(len(levels), np.uint64)
    for bit in range(16):
        for axis in range(3):
            part = (levels[:, axis].astype(np.uint64) >> np.uint64(bit)) & np.uint64(1)
            found |= part << np.uint64(3 * bit + axis)
    return found
