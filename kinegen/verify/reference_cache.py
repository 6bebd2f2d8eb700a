"""The reference at the inputs of a kernel, computed once for all kernels, and which of its entries are lengths."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import Any

import mpmath
import numpy as np
from numpy.typing import NDArray

from kinegen.model.outputs import Kind, Quantity
from kinegen.model.robot import Robot
from kinegen.verify.reference import WIDE, Actuation, Kinematics

Numbers = NDArray[Any]

PLACES = (Kind.POSE, Kind.FRAMES, Kind.POSITION)
"""Kinds that say where frames are."""

_OF_POSES = (Kind.INVERSE_POSE, Kind.TRANSFORM_POINT, Kind.ADJOINT)
"""Kinds that are given a pose, of any frame b in any frame a."""

_OF_JOINTS = (Kind.ACTUATORS_TO_JOINTS, Kind.JOINTS_TO_ACTUATORS)
"""Kinds that have nothing to do with a frame, and one result for all tips."""


class ReferenceResults:
    """What the reference knows at some inputs.

    Args:
        inputs: Arrays of N configurations by name, such as `q` (N, dof) and `qd`.
        unit: The relative error of one rounding in the kernels that are compared.
    """

    def __init__(
        self, robot: Robot, inputs: Mapping[str, Numbers], *, exact: bool = False, unit: float = 2.0**-53
    ) -> None:
        exactly = np.frompyfunc(mpmath.mpf, 1, 1)
        self.robot = robot
        self.inputs = {name: exactly(array) if exact else array.astype(WIDE) for name, array in inputs.items()}
        self.exact = exact
        self.unit = unit

    @cached_property
    def motion(self) -> Kinematics:
        """Poses and velocities at the joint vectors."""
        return Kinematics(self.robot, self.inputs["q"], exact=self.exact, wide=True)

    @cached_property
    def driven(self) -> Actuation:
        """The same, at the readings of actuators."""
        return Actuation(self.robot, self.inputs["actuators"], exact=self.exact, wide=True)

    @property
    def count(self) -> int:
        """Number of configurations."""
        return len(next(iter(self.inputs.values())))

    @property
    def joints(self) -> Numbers:
        """The joint vectors, or what stands for them; without entries for kernels that take none."""
        given = (self.inputs[name] for name in ("q", "joints", "actuators") if name in self.inputs)
        return next(given, np.zeros((self.count, 0)))


def quantity_frames(robot: Robot, quantity: Quantity) -> tuple[str, ...]:
    """Returns the frames for which a quantity is computed; the first tip where there is none.

    A frame that is not seen from the base is written `frame/other`.
    """
    if quantity.kind in _OF_POSES:
        return ("b",)
    if quantity.kind in _OF_JOINTS:
        return robot.tips[:1]
    if quantity.frame:
        return (quantity.way,)
    return robot.frame_names if quantity.kind is Kind.FRAMES else robot.tips


def quantity_reach(robot: Robot, quantity: Quantity) -> tuple[str, ...]:
    """Returns the frames whose reach lengths of a quantity are measured by."""
    return robot.tips if quantity.kind in (*_OF_POSES, *_OF_JOINTS) else quantity_frames(robot, quantity)


Split = tuple[Numbers, Numbers]


def split_matrix(matrices: Numbers) -> Split:
    """Positions; rotations with the last rows."""
    others = np.concatenate([matrices[:, :3, :3].reshape(-1, 9), matrices[:, 3]], axis=1)
    return matrices[:, :3, 3], others


def split_point(points: Numbers) -> Split:
    """Lengths alone."""
    return points, points[:, :0]


def split_rows(arrays: Numbers) -> Split:
    """Linear rows, angular rows: of (N, 6, columns) and (N, n, 6, columns)."""
    return arrays[..., :3, :].reshape(len(arrays), -1), arrays[..., 3:, :].reshape(len(arrays), -1)


def split_numbers(arrays: Numbers) -> Split:
    """No lengths."""
    flat = arrays.reshape(len(arrays), -1)
    return flat[:, :0], flat


def split_adjoint(matrices: Numbers) -> Split:
    """Returns the block that holds lengths, the three others."""
    others = (matrices[:, :3, :3], matrices[:, 3:, :3], matrices[:, 3:, 3:])
    return matrices[:, :3, 3:].reshape(-1, 9), np.concatenate([block.reshape(-1, 9) for block in others], axis=1)


def adjoint(a_T_b: Numbers) -> Numbers:
    """The matrices [[R, [p]x R], [0, R]], shape (N, 6, 6), which take twists from b to a (linear, then angular)."""
    rotation, position = a_T_b[:, :3, :3], a_T_b[:, :3, 3]
    found = np.zeros((len(a_T_b), 6, 6), dtype=a_T_b.dtype)
    found[:, :3, :3] = found[:, 3:, 3:] = rotation
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        found[:, i, 3:] = position[:, j, None] * rotation[:, k] - position[:, k, None] * rotation[:, j]
    return found
