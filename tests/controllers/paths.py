"""What trials of all controllers measure along a path."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from kinegen.backends.controllers.machine import Machine
from kinegen.model.expression_parser import evaluate, number
from kinegen.model.expression_values import FLOAT64
from kinegen.model.robot import Robot
from kinegen.verify import reference

Numbers = NDArray[np.float64]


def speed(times: Numbers, positions: Numbers, every: int) -> float:
    """The speed in mm a minute along the middle of a path.

    Args:
        times: Seconds, (N,).
        positions: Positions of the tool in mm, (N, 3).
        every: Chords join every so many of them: steps of motors are too coarse for shorter ones.
    """
    times, positions = times[::every], positions[::every]
    way = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(positions, axis=0), axis=1))])
    begin, end = np.searchsorted(way, [0.3 * way[-1], 0.7 * way[-1]])
    return float(60 * (way[end] - way[begin]) / (times[end] - times[begin]))


def joints_of(robot: Robot, machine: Machine, motors: Numbers) -> Numbers:
    """Joint vectors (N, dof) in the units of kernels, by the reference, for motors (N, axes) in degrees and mm."""
    readings = motors[:, : machine.dof] * [motor.scale for motor in machine.motors]
    return np.asarray(reference.Actuation(robot, readings).joints if robot.actuators.readings else readings, float)


def with_parameter(robot: Robot, index: int, value: float) -> Robot:
    """A robot whose runtime parameter has another value, in the unit of kernels."""
    name = robot.runtime_parameters[index].name
    changed = (replace(each, value=number(Fraction(value))) if each.name == name else each for each in robot.parameters)
    return replace(robot, parameters=tuple(changed))


def other_tool(robot: Robot, machine: Machine) -> tuple[Robot, list[float]]:
    """The robot with its runtime parameters, which are lengths, some 20 mm longer, and their values in mm."""
    usual = [
        float(evaluate(parameter.value, {}, FLOAT64)) * machine.millimetres for parameter in robot.runtime_parameters
    ]
    values = [value + 20 + 5 * index for index, value in enumerate(usual)]
    for index, value in enumerate(values):
        robot = with_parameter(robot, index, value / machine.millimetres)
    return robot, values
