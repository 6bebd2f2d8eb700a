"""The reference at the inputs of a kernel, computed once for all kernels that are given the same."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import Any

import mpmath
import numpy as np
from numpy.typing import NDArray

from kinegen.outputs import Kind, Quantity
from kinegen.reference import WIDE, Actuation, Kinematics
from kinegen.robot.model import Robot

Numbers = NDArray[Any]

PLACES = (Kind.POSE, Kind.FRAMES, Kind.POSITION)
"""Kinds that say where frames are."""

_OF_POSES = (Kind.INVERSE_POSE, Kind.TRANSFORM_POINT, Kind.ADJOINT)
"""Kinds that are given a pose, of any frame b in any frame a."""


class Known:
    """What the reference knows at some inputs.

    Args:
        robot: The robot.
        inputs: Arrays of N configurations by name, such as `q` (N, dof) and `qd`.
        exact: Whether to compute with 50 digits.
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
    """The frames for which a quantity is computed; one that is not seen from the base is written `frame/other`."""
    if quantity.kind in _OF_POSES:
        return ("b",)
    if quantity.frame:
        return (quantity.way,)
    return robot.frame_names if quantity.kind is Kind.FRAMES else robot.tips


def quantity_reach(robot: Robot, quantity: Quantity) -> tuple[str, ...]:
    """The frames whose reach lengths of a quantity are measured by."""
    return robot.tips if quantity.kind in _OF_POSES else quantity_frames(robot, quantity)
