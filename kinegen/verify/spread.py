"""How far rounding moves the results of a program at given inputs, as numbers: the trials of `rounding`, compared.

In: a `Program` of a robot, arrays of inputs. Out: results, and the root mean square of how far trials are from them.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinegen.emit.accuracy import NUMBER_TYPES
from kinegen.emit.reals import Real
from kinegen.ir.bounds import NumberType
from kinegen.ir.lower import runtime_defaults
from kinegen.ir.program import Program
from kinegen.outputs import Array
from kinegen.robot.model import Robot
from kinegen.verify.rounding import TRIALS, rounded_trials
from kinegen.verify.samples import SEED
from kinegen.verify.subjects import subjects

FloatArray = NDArray[np.float64]

SPREADS = 8
"""So many times the root mean square of what `rounding` finds is accepted. Real errors have at most 1/sqrt(3) of it
each, so that this is nearly fourteen standard deviations; fewer would do, were the root mean square known better than
from sixteen trials."""

COARSE = replace(
    NUMBER_TYPES[Real.FLOAT],
    sine_error=max(each.sine_error / float(each.unit) for each in NUMBER_TYPES.values())
    * float(NUMBER_TYPES[Real.FLOAT].unit),
    angle_limit=NUMBER_TYPES[Real.DOUBLE].angle_limit,
)
"""What test vectors are rounded with: units of floats, which what float64 itself loses does not show in, so that every
machine finds the same spread. It is proportional to the unit."""


def parameters_of(robot: Robot, program: Program) -> dict[str, Fraction]:
    """The values of those runtime parameters that a program reads, in its order."""
    names = (parameter.name for parameter in robot.runtime_parameters)
    values = dict(zip(names, runtime_defaults(robot), strict=True))
    return {name: values[name] for name in program.parameters}


def trials_at(
    robot: Robot, program: Program, inputs: Mapping[str, Any], count: int, real: NumberType
) -> Iterator[FloatArray]:
    """The results of a program at some inputs, shape (count, outputs): plain first, then rounded in many ways.

    Args:
        robot: The robot.
        program: A program of it.
        inputs: Arrays of `count` inputs by name; matrices with their last rows.
        count: Number of inputs.
        real: The number type.
    """
    columns = [
        _upper(inputs[array.name], array).astype(np.float64).reshape(count, -1) for array in program.signature.inputs
    ]
    flat = np.concatenate([*columns, np.zeros((count, 0))], axis=1)
    return rounded_trials(program, flat, parameters_of(robot, program), real, SEED)


def apart(one: Any, two: Any) -> FloatArray:
    """How far two results are apart; infinitely, where one alone is a number."""
    with np.errstate(invalid="ignore"):
        distance = np.abs((one - two).astype(np.float64))
    same = (one == two) | (np.isnan(one.astype(np.float64)) & np.isnan(two.astype(np.float64)))
    return np.where(same, 0.0, np.where(np.isnan(distance), np.inf, distance))


def coarse_spread(robot: Robot, program: Program, inputs: Mapping[str, FloatArray]) -> tuple[FloatArray, FloatArray]:
    """What the results of a program are, and how far units of floats may move them.

    Args:
        robot: The robot.
        program: A program of it.
        inputs: Arrays of N inputs by name.

    Returns:
        Results and `SPREADS` times the root mean square of their differences, shape (N, outputs) each. Angles are
        compared without whole turns. Infinite where a result is not a number, or may become one that is not.
    """
    count = len(inputs["q"])
    trials = trials_at(robot, program, inputs, count, COARSE)
    plain = next(trials)
    turned = [
        subject.turns
        for subject, array in zip(subjects(program.quantity), program.signature.results, strict=True)
        for _ in range(array.size)
    ]
    squares = np.zeros(plain.shape)
    for other in trials:
        distance = apart(plain, other)
        with np.errstate(invalid="ignore"):
            rest = np.fmod(distance, 2 * np.pi)
        squares += np.where(turned, np.minimum(rest, 2 * np.pi - rest), distance) ** 2
    spread = SPREADS * np.sqrt(squares / TRIALS)
    return plain, np.where(np.isnan(plain) | np.isnan(spread), np.inf, spread)


def _upper(values: Any, array: Array) -> Any:
    """Matrices without their last rows."""
    return values[..., :3, :] if array.is_pose else values
