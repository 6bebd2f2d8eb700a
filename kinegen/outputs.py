"""The kinematic quantities that kernels are built for, and the shape of each."""

from __future__ import annotations

from enum import StrEnum


class Quantity(StrEnum):
    """One kinematic quantity, as `--outputs` names it; each becomes a function of its own.

    `pose` is the pose of every tip, `frames` the pose of every link and named frame, `position` the position of
    every tip, all relative to the base frame.
    """

    POSE = "pose"
    FRAMES = "frames"
    POSITION = "position"

    @property
    def function(self) -> str:
        """Name of the function in C (after the robot's prefix) and in Python."""
        return "fk" if self is Quantity.POSE else self.value

    @property
    def entries(self) -> int:
        """Computed numbers for each frame: a 3x4 matrix, row by row, or a point."""
        return 3 if self is Quantity.POSITION else 12

    @property
    def is_pose(self) -> bool:
        """Whether each frame gets a homogeneous matrix, whose last row is 0 0 0 1."""
        return self is not Quantity.POSITION
