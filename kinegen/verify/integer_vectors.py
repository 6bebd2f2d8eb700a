"""Test vectors of the integer kernels, from the 50-digit reference."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import mpmath
import numpy as np

from kinegen import reference
from kinegen.emit.fixed.kernels import FixedKernels
from kinegen.emit.fixed.vectors import FixedVectors, IntegerRow
from kinegen.ir.fixed.program import FixedProgram
from kinegen.verify.integers import ENDS, exact_parameters, exact_point, quantised
from kinegen.verify.known import quantity_frames
from kinegen.verify.samples import vector_samples


def fixed_vectors(fixed: FixedKernels) -> FixedVectors:
    """The test vectors of the integer kernels.

    Args:
        fixed: The robot and its integer programs.

    Returns:
        Joint vectors, those of the other kernels and the ends of the range of int32_t, and the rounded exact results.
    """
    robot = fixed.robot
    ends = np.repeat(np.array(ENDS[:2], dtype=np.int32)[:, None], robot.dof, axis=1)
    inputs = np.concatenate([quantised(fixed, vector_samples(robot)), ends])[: None if robot.dof else 1]
    with mpmath.workdps(reference.DIGITS):
        known = [reference.frames_mp(robot, exact_point(fixed, row), exact_parameters(fixed)) for row in inputs]
        return FixedVectors(
            inputs=tuple(tuple(int(entry) for entry in row) for row in inputs),
            expected={
                program.program.quantity: tuple(_rounded(fixed, program, frames) for frames in known)
                for program in fixed.programs
            },
        )


def _rounded(fixed: FixedKernels, program: FixedProgram, frames: Mapping[str, Any]) -> IntegerRow:
    quantity = program.program.quantity
    columns = range(4) if quantity.is_pose else (3,)
    entries = [
        frames[frame][row, column]
        for frame in quantity_frames(fixed.robot, quantity)
        for row in range(3)
        for column in columns
    ]
    return tuple(int(mpmath.nint(mpmath.ldexp(entry, bits))) for entry, bits in zip(entries, program.bits, strict=True))
