"""Inputs and test vectors of the integer kernels, from the 50-digit reference."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import mpmath
import numpy as np
from numpy.typing import NDArray

from kinegen.backends.fixed_point.kernels import FixedKernels
from kinegen.backends.fixed_point.vectors import FixedVectors, IntegerRow
from kinegen.ir.fixed_point.binary_angles import TURN
from kinegen.ir.fixed_point.program import FixedProgram
from kinegen.model.expression_values import Dimension
from kinegen.model.robot import JointType
from kinegen.verify import reference
from kinegen.verify.reference_cache import quantity_frames
from kinegen.verify.samples import SEED, FloatArray, proof_samples, vector_samples

Integers = NDArray[np.int32]

ANYWHERE = 2_000
"""Joint vectors from the whole range of int32_t, and as many from its special places, besides those within limits."""

ENDS = (-(2**31), 2**31 - 1, -1, 0, 1, -(2**30), 2**30, 2**29, 2**29 - 1)


def quantised(fixed: FixedKernels, points: FloatArray) -> Integers:
    """Joint vectors (N, dof) as the kernels take them: the nearest integers, whole turns left out."""
    units = np.array([unit(fixed, index) for index in range(fixed.robot.dof)])
    integers = np.rint(points / units).astype(np.int64) if len(units) else points.astype(np.int64)
    wrapped = (integers + TURN // 2) % TURN - TURN // 2
    return wrapped.astype(np.int32)


def unit(fixed: FixedKernels, index: int) -> float:
    """Returns what the last place of a joint variable is in radians or the file's length unit."""
    is_stroke = fixed.robot.variables[index].type is JointType.PRISMATIC
    return 0.5**fixed.scales.stroke if is_stroke else 2 * np.pi / TURN


def integer_samples(fixed: FixedKernels) -> Integers:
    """Joint vectors for the proof: those of every other kernel, and others from anywhere. Returns shape (N, dof)."""
    generator = np.random.default_rng(SEED)
    shape = (ANYWHERE, fixed.robot.dof)
    anywhere = generator.integers(-(2**31), 2**31, shape, dtype=np.int64)
    ends = generator.choice(np.array(ENDS, dtype=np.int64), shape)
    return np.concatenate([quantised(fixed, proof_samples(fixed.robot)), anywhere, ends]).astype(np.int32)


def parameters(fixed: FixedKernels) -> dict[str, float]:
    """Returns the values of the runtime parameters that the integers stand for."""
    units = {Dimension.ANGLE: 2 * np.pi / TURN, Dimension.LENGTH: 0.5**fixed.scales.parameter}
    pairs = zip(fixed.robot.runtime_parameters, fixed.defaults, strict=True)
    return {parameter.name: value * units[parameter.dimension] for parameter, value in pairs}


def exact_point(fixed: FixedKernels, row: NDArray[Any]) -> list[Any]:
    """Returns what the integers of a joint vector stand for, in the precision of mpmath."""
    return [
        _exact(int(entry), None if variable.type is not JointType.PRISMATIC else fixed.scales.stroke)
        for entry, variable in zip(row, fixed.robot.variables, strict=True)
    ]


def exact_parameters(fixed: FixedKernels) -> dict[str, Any]:
    """Returns what the integers of the runtime parameters stand for, likewise."""
    pairs = zip(fixed.robot.runtime_parameters, fixed.defaults, strict=True)
    return {
        parameter.name: _exact(value, None if parameter.dimension is Dimension.ANGLE else fixed.scales.parameter)
        for parameter, value in pairs
    }


def _exact(value: int, bits: int | None) -> Any:
    """Returns what an integer stands for: an angle, or a length with so many fraction bits."""
    return mpmath.ldexp(value, -bits) if bits is not None else mpmath.pi * value / 2**31


def fixed_vectors(fixed: FixedKernels) -> FixedVectors:
    """Returns the test vectors of the integer kernels.

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
