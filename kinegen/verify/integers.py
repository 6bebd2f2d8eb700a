"""Inputs of the integer kernels: joint vectors on which they are tried, and what the integers stand for."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np
from numpy.typing import NDArray

from kinegen.emit.fixed.kernels import FixedKernels
from kinegen.ir.fixed.turns import TURN
from kinegen.robot.dimension import Dimension
from kinegen.robot.model import JointType
from kinegen.verify.samples import SEED, proof_samples

Integers = NDArray[np.int32]
FloatArray = NDArray[np.float64]

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
    """What the last place of a joint variable is in radians or the file's length unit."""
    is_stroke = fixed.robot.variables[index].type is JointType.PRISMATIC
    return 0.5**fixed.scales.stroke if is_stroke else 2 * np.pi / TURN


def integer_samples(fixed: FixedKernels) -> Integers:
    """Joint vectors for the proof: those of every other kernel, and others from anywhere.

    Returns:
        Shape (N, dof).
    """
    generator = np.random.default_rng(SEED)
    shape = (ANYWHERE, fixed.robot.dof)
    anywhere = generator.integers(-(2**31), 2**31, shape, dtype=np.int64)
    ends = generator.choice(np.array(ENDS, dtype=np.int64), shape)
    return np.concatenate([quantised(fixed, proof_samples(fixed.robot)), anywhere, ends]).astype(np.int32)


def parameters(fixed: FixedKernels) -> dict[str, float]:
    """The values of the runtime parameters that the integers stand for."""
    units = {Dimension.ANGLE: 2 * np.pi / TURN, Dimension.LENGTH: 0.5**fixed.scales.parameter}
    pairs = zip(fixed.robot.runtime_parameters, fixed.defaults, strict=True)
    return {parameter.name: value * units[parameter.dimension] for parameter, value in pairs}


def exact_point(fixed: FixedKernels, row: NDArray[Any]) -> list[Any]:
    """What the integers of a joint vector stand for, in the precision of mpmath."""
    return [
        _exact(int(entry), None if variable.type is not JointType.PRISMATIC else fixed.scales.stroke)
        for entry, variable in zip(row, fixed.robot.variables, strict=True)
    ]


def exact_parameters(fixed: FixedKernels) -> dict[str, Any]:
    """What the integers of the runtime parameters stand for, likewise."""
    pairs = zip(fixed.robot.runtime_parameters, fixed.defaults, strict=True)
    return {
        parameter.name: _exact(value, None if parameter.dimension is Dimension.ANGLE else fixed.scales.parameter)
        for parameter, value in pairs
    }


def _exact(value: int, bits: int | None) -> Any:
    """What an integer stands for: an angle, or a length with so many fraction bits."""
    return mpmath.ldexp(value, -bits) if bits is not None else mpmath.pi * value / 2**31
