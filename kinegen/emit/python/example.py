"""The call that a module's docstring shows: arguments for which the kernel has a value."""

from __future__ import annotations

from collections.abc import Iterable

from kinegen.emit.actuators import ARRAY
from kinegen.emit.kernels import Kernels
from kinegen.outputs import Array, Kind
from kinegen.reference.actuators import Actuation
from kinegen.robot.actuators.extent import reading_box
from kinegen.robot.model import Robot


def example(kernels: Kernels) -> str:
    """A call of the first kernel of a module.

    Args:
        kernels: The robot and its programs.

    Returns:
        One line of Python.
    """
    robot, program = kernels.robot, kernels.programs[0]
    if program.quantity.kind is Kind.JOINTS_TO_ACTUATORS:
        given = [_array(Actuation(robot, _readings(robot)).joints[0])]
    else:
        given = [_argument(robot, array) for array in program.signature.inputs]
    results = ", ".join(array.name for array in program.signature.results)
    return f"{results} = {robot.name}.{program.quantity.function}({', '.join(given)})"


def _argument(robot: Robot, array: Array) -> str:
    if array.name == ARRAY:
        return _array(_readings(robot))
    if array.shape == (robot.dof,):
        return f"np.zeros({robot.name}.DOF)"
    return "np.eye(4)" if array.is_pose else f"np.zeros({array.shape})"


def _readings(robot: Robot) -> list[float]:
    """Readings in the middle of what they can be: a linkage need not close at zero."""
    return [(low + high) / 2 for low, high in reading_box(robot)]


def _array(numbers: Iterable[float]) -> str:
    return f"[{', '.join(f'{float(number) + 0.0:.4g}' for number in numbers)}]"
