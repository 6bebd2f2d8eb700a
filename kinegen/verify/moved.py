"""Other values of the runtime parameters, with which kernels are tried."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from kinegen.robot.expressions import evaluate, number
from kinegen.robot.floats import FLOATS
from kinegen.robot.model import Robot

FloatArray = NDArray[np.float64]


def move_parameters(robot: Robot) -> tuple[Robot, tuple[float, ...]]:
    """Give every runtime parameter another value, so that a kernel that ignores or mixes them up is seen.

    Args:
        robot: A robot with runtime parameters.

    Returns:
        The robot with its parameters moved, each in its own way, and their values, which floats hold exactly.
    """
    moved: dict[str, Fraction] = {}
    for place, parameter in enumerate(robot.runtime_parameters, start=1):
        value = float(evaluate(parameter.value, {}, FLOATS))
        moved[parameter.name] = Fraction(float(np.float32(value * (1 + place / 16) + 1 / 32)))
    parameters = tuple(
        replace(parameter, value=number(moved[parameter.name])) if parameter.runtime else parameter
        for parameter in robot.parameters
    )
    return replace(robot, parameters=parameters), tuple(float(value) for value in moved.values())


def parameter_sets(robot: Robot) -> FloatArray:
    """The values of the robot file and the moved ones, for batches in which they alternate.

    Args:
        robot: A robot with runtime parameters.

    Returns:
        Shape (2, parameters), in numbers that floats hold exactly.
    """
    usual = [float(evaluate(parameter.value, {}, FLOATS)) for parameter in robot.runtime_parameters]
    return np.array([np.array(usual, np.float32).astype(float), move_parameters(robot)[1]])
