"""Runs a program through its printed NumPy form, without files."""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.python.formula import emit_formula
from kinegen.ir.program import Program
from kinegen.model.robot import Robot

Floats = NDArray[np.float64]


def run(
    robot: Robot, program: Program, q: Floats, defaults: tuple[Any, ...] = (), further: tuple[Floats, ...] = ()
) -> Floats:
    """Evaluate a program.

    Args:
        robot: Its robot.
        program: The program.
        q: Joint vectors (N, dof).
        defaults: Values of the runtime parameters.
        further: The inputs after the joint vectors, such as their rates (N, dof).

    Returns:
        The computed entries (N, entries).
    """
    text = emit_formula(RobotPrograms(robot, (program,), defaults))["_numpy.py"]
    namespace: dict[str, Any] = {}
    exec(compile(text, "_numpy.py", "exec"), namespace)  # noqa: S102 - our own output
    formula: Callable[..., Any] = namespace[program.quantity.function]
    names = [parameter.name for parameter in robot.runtime_parameters]
    arguments = [namedtuple("Params", names)(*map(float, defaults))] if names else []  # noqa: PYI024 - made at run time
    rows = formula(q.T, *(rows.T for rows in further), *arguments)
    return np.stack([np.broadcast_to(row, (len(q),)) for row in rows], axis=1)


def as_poses(entries: Floats, frames: int) -> Floats:
    """Entries of 3x4 matrices as (N, frames, 3, 4)."""
    return entries.reshape(len(entries), frames, 3, 4)
