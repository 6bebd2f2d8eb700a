"""Test vectors: joint vectors with what the kernels must return for them, from the 50-digit reference."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from fractions import Fraction
from operator import add, mul, neg, sub, truediv
from typing import Any

import mpmath

from kinegen import reference
from kinegen.emit.c.vectors import Vectors
from kinegen.emit.kernels import Kernels
from kinegen.emit.reals import Real
from kinegen.ir.program import Constant, Operand, Operator, Program, RuntimeParameter, Temporary, Variable
from kinegen.outputs import Quantity
from kinegen.robot.extent import reach
from kinegen.robot.model import Robot
from kinegen.verify.known import quantity_frames
from kinegen.verify.samples import vector_samples
from kinegen.verify.tolerances import accepted_error

Row = tuple[Fraction, ...]

PAIRS = 24
"""Sines and cosines in the self-test of the pair."""

_NEGLIGIBLE = 1e-40
_EXACT: Mapping[Operator, Callable[..., Fraction]] = {
    Operator.ADD: add,
    Operator.SUB: sub,
    Operator.MUL: mul,
    Operator.DIV: truediv,
    Operator.NEG: neg,
}


def compute_vectors(kernels: Kernels) -> Vectors:
    """The test vectors of a robot, for all its kernels.

    Args:
        kernels: The robot and its programs.

    Returns:
        Joint vectors, results and tolerances; positions are held to the robot's reach, or to 1 if that is less.
    """
    robot, programs = kernels.robot, kernels.programs
    inputs = vector_inputs(robot)
    parameters = dict(zip((parameter.name for parameter in robot.runtime_parameters), kernels.defaults, strict=True))
    extent = max(Fraction(1), Fraction(reach(robot, robot.frame_names)))
    return Vectors(
        inputs=inputs,
        expected=vector_results(robot, tuple(program.quantity for program in programs)),
        pairs=vector_pairs(programs, inputs, parameters),
        tolerances={real: Fraction(accepted_error(robot, real)) * extent for real in Real},
    )


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


def vector_pairs(
    programs: tuple[Program, ...], inputs: tuple[Row, ...], parameters: Mapping[str, Fraction]
) -> tuple[tuple[Fraction, Fraction, Fraction], ...]:
    """Angles that kernels take the sine and cosine of, and both.

    Args:
        programs: The kernels.
        inputs: Joint vectors.
        parameters: Values of the runtime parameters.

    Returns:
        Angle, sine and cosine, ascending; `PAIRS` at most, evenly picked. Floats hold the angles exactly.
    """
    exact = {angle for program in programs for row in inputs for angle in _angles(program, row, parameters)}
    angles = sorted({Fraction(Real.FLOAT.round(angle)) for angle in exact})
    chosen = angles[:: math.ceil(len(angles) / PAIRS) or 1]
    with mpmath.workdps(50):
        results = [mpmath.cos_sin(mpmath.mpf(angle.numerator) / angle.denominator) for angle in chosen]
        return tuple((angle, _fraction(s), _fraction(c)) for angle, (c, s) in zip(chosen, results, strict=True))


def _angles(program: Program, row: Row, parameters: Mapping[str, Fraction]) -> Iterator[Fraction]:
    """The arguments of the sines and cosines of one call, in exact arithmetic."""
    known: dict[Operand, Fraction] = {Variable(index): entry for index, entry in enumerate(row)}
    known |= {RuntimeParameter(name): value for name, value in parameters.items()}
    for statement in program.statements:
        known |= {operand: operand.value for operand in statement.operands if isinstance(operand, Constant)}
        operands = [known[operand] for operand in statement.operands if operand in known]
        if statement.operator in (Operator.SIN, Operator.COS):
            yield from operands  # none if it comes from a sine, a root or the like
        elif len(operands) == statement.operator.arity and statement.operator in _EXACT:
            known[Temporary(statement.name)] = _EXACT[statement.operator](*operands)


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
