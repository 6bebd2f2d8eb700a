"""Test vectors: joint vectors with what the kernels must return for them, from the 50-digit reference."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import mpmath

from kinegen import reference
from kinegen.outputs import Quantity
from kinegen.robot.model import Robot
from kinegen.verify.samples import vector_samples

Row = tuple[Fraction, ...]

_NEGLIGIBLE = 1e-40


def vector_inputs(robot: Robot) -> tuple[Row, ...]:
    """The joint vectors, exact; floats hold them too."""
    return tuple(tuple(Fraction(float(entry)) for entry in row) for row in vector_samples(robot))


def vector_results(robot: Robot, quantities: tuple[Quantity, ...]) -> dict[Quantity, tuple[Row, ...]]:
    """What each kernel must return for each joint vector.

    Args:
        robot: The robot.
        quantities: The kernels.

    Returns:
        For each quantity, one row for each of `vector_inputs`: the entries of its frames, 3x4 matrices by rows or
        points.
    """
    known = [reference.frames_mp(robot, row) for row in vector_samples(robot)]
    return {
        quantity: tuple(
            tuple(entry for frame in quantity_frames(robot, quantity) for entry in _entries(frames[frame], quantity))
            for frames in known
        )
        for quantity in quantities
    }


def quantity_frames(robot: Robot, quantity: Quantity) -> tuple[str, ...]:
    """The frames for which a quantity is computed."""
    return robot.frame_names if quantity is Quantity.FRAMES else robot.tips


def _entries(matrix: Any, quantity: Quantity) -> Row:
    columns = range(4) if quantity.is_pose else (3,)
    return tuple(_fraction(matrix[row, column]) for row in range(3) for column in columns)


def _fraction(value: Any) -> Fraction:
    """The exact value of an mpmath number; what 50 digits leave of a zero is zero."""
    if abs(value) < _NEGLIGIBLE:
        return Fraction(0)
    sign, mantissa, exponent, _ = mpmath.mpf(value)._mpf_  # mpmath offers no public way
    magnitude = Fraction(int(mantissa)) * Fraction(2) ** int(exponent)
    return -magnitude if sign else magnitude
