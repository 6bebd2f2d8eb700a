"""How far each entry of a result may be from its test vector: what is proven of it, or what rounding does there.

A length of a robot in millimetres is a large number and an entry of a rotation is not, so every entry is measured by
its own error. The smaller of two answers counts. The proven bound holds in the box of all vectors; it has no rules for
roots and arc tangents, and gets wide for derivatives of long chains. The spread of rounding at the vectors themselves,
which the caller computes, follows the condition of each entry.
"""

from __future__ import annotations

import math
from fractions import Fraction

from kinegen.emit.accuracy import NUMBER_TYPES, bound_over
from kinegen.emit.c.expected import Expected, Row, Vectors
from kinegen.emit.kernels import Kernels
from kinegen.emit.reals import Real
from kinegen.emit.sincos import SINCOS
from kinegen.ir.bounds import Ranges, has_rules
from kinegen.ir.program import Program

SLACK = 2
"""Accepted are so many times the proven errors: a board's own sine and cosine may be a little worse than ours."""


def accepted_differences(kernels: Kernels, program: Program, vectors: Vectors, real: Real) -> tuple[Row, ...]:
    """The largest accepted difference of each entry.

    Args:
        kernels: The robot and the values of its parameters.
        program: The program of a kernel.
        vectors: The test vectors, which the bounds are proven for.
        real: The number type.

    Returns:
        For each result with numbers a row, in the units of its entries; none is zero.
    """
    expected = [each for each in vectors.expected[program.quantity] if each.rows[0]]
    proven = _proven(kernels, program, vectors, real)
    rows, start = [], 0
    for each in expected:
        size = len(each.rows[0])
        errors = proven[start : start + size]
        limits = zip(errors, each.spreads[real], _roundings(each, real), strict=True)
        rows.append(tuple(_smaller(error, spread) + rounding for error, spread, rounding in limits))
        start += size
    return tuple(rows)


def _smaller(proven: float, spread: Fraction) -> Fraction:
    return min(SLACK * Fraction(proven), spread) if math.isfinite(proven) else spread


def accepted_pair_error(real: Real) -> Fraction:
    """The largest accepted error of a sine or cosine."""
    return SLACK * Fraction(SINCOS[real].absolute_error)


def _proven(kernels: Kernels, program: Program, vectors: Vectors, real: Real) -> tuple[float, ...]:
    """The proven errors for the box of all test vectors; infinite where there are no rules."""
    if not has_rules(program):
        return (math.inf,) * sum(array.size for array in program.signature.results)
    columns = [
        column
        for array in program.signature.inputs
        for column in zip(*(row[: array.size] for row in vectors.inputs[array.name]), strict=True)
    ]
    names = (parameter.name for parameter in kernels.robot.runtime_parameters)
    defaults = dict(zip(names, kernels.defaults, strict=True))
    ranges = Ranges(
        joints=tuple((min(column), max(column)) for column in columns),
        parameters=tuple(defaults[name] for name in program.parameters),
    )
    return bound_over(program, ranges, NUMBER_TYPES[real]).entries


def _roundings(expected: Expected, real: Real) -> Row:
    """What rounding the expected entries costs; at least what it costs for a small number, so that none is zero."""
    unit = Fraction(1, 2 ** NUMBER_TYPES[real].precision)
    return tuple(unit * max(Fraction(1, 2**10), *map(abs, column)) for column in zip(*expected.rows, strict=True))
