"""Runs programs step by step in NumPy: as a kernel would, exactly, and with the worst errors that arithmetic allows.

NumPy adds, subtracts, multiplies and divides with one rounding, like C without contraction; sines and cosines come from
the emitted pair.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from kinegen.backends.accuracy import NUMBER_TYPES
from kinegen.backends.scalar_types import ScalarType
from kinegen.ir.program import Constant, Operand, Operator, Program, RuntimeParameter, Statement, Temporary, Variable
from tests.sincos.library import COMPILERS, DTYPES, Pairs, compile_pairs

Floats = NDArray[np.floating]
Pair = Callable[[Floats], tuple[Floats, Floats]]


@cache
def emitted_pair(real: ScalarType) -> Pairs:
    """The emitted sine and cosine of a number type, compiled."""
    with tempfile.TemporaryDirectory() as folder:
        return compile_pairs(Path(folder), real, COMPILERS[0], "-O2", "-ffp-contract=off")


def run(program: Program, q: Floats, parameters: tuple[Fraction, ...], real: ScalarType) -> Floats:
    """What a kernel computes.

    Args:
        program: The program.
        q: Joint vectors (n, dof), numbers of the type.
        parameters: Values of the runtime parameters, rounded to the type.
        real: The number type.

    Returns:
        Results (outputs, n).
    """
    kind = DTYPES[real]
    given = [kind(real.round(value)) for value in parameters]
    values = _leaves(program, q.astype(kind), dict(zip(program.parameters, given, strict=True)))

    def operand(one: Operand) -> Floats:
        if isinstance(one, Constant):
            return np.full(len(q), real.round(one.value), kind)
        return values[one]

    for statement in program.statements:
        operands = [operand(one) for one in statement.operands]
        results = _apply(statement.operator, operands, emitted_pair(real))
        values.update(zip(map(Temporary, statement.results), results, strict=True))
    return np.stack([operand(one) for one in program.outputs])


def _leaves(program: Program, q: Floats, parameters: Mapping[str, float]) -> dict[Operand, Floats]:
    known: dict[Operand, Floats] = {Variable(index): q[:, index] for index in range(program.signature.dof)}
    return known | {RuntimeParameter(name): np.full(len(q), value) for name, value in parameters.items()}


def _apply(operator: Operator, operands: list[Floats], pair: Pair) -> tuple[Floats, ...]:
    match operator:
        case Operator.ADD:
            return (operands[0] + operands[1],)
        case Operator.SUB:
            return (operands[0] - operands[1],)
        case Operator.MUL:
            return (operands[0] * operands[1],)
        case Operator.DIV:
            return (operands[0] / operands[1],)
        case Operator.NEG:
            return (-operands[0],)
        case Operator.SINCOS:
            sine, cosine = pair(operands[0])
            return sine, cosine


def _is_exact(statement: Statement) -> bool:
    """Whether an operation needs no rounding: a change of sign, or a product with a power of two."""
    powers = (one.value for one in statement.operands if isinstance(one, Constant) and one.value)
    doubling = any(abs(math.frexp(float(value))[0]) == 0.5 for value in powers)
    return statement.operator is Operator.NEG or (statement.operator is Operator.MUL and doubling)


# The adversary --------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Adversary:
    """Makes every operation of a program as wrong as the analysis allows, each in the direction that hurts most.

    It works in double precision on what the number type would do, so it cannot be told from arithmetic in the type but
    for the direction of its roundings: half a unit in the last place at most, never past a power of two; sines and
    cosines off by their bound, never beyond one.

    Attributes:
        program: The program.
        parameters: Exact values of the runtime parameters.
        real: The number type.
    """

    program: Program
    parameters: tuple[Fraction, ...]
    real: ScalarType = ScalarType.FLOAT

    def errors(self, q: Floats, output: int) -> Floats:
        """What one output is off, for joint vectors (n, dof) in the number type."""
        exact = self._forward(q.astype(np.float64), None)
        place = self.program.outputs[output]
        wrong = self._forward(q.astype(np.float64), self._gradient(exact, place))
        found = np.abs(self._operand(wrong, place, rounded=True) - self._operand(exact, place))
        return np.broadcast_to(found, (len(q),))

    def _operand(self, values: dict[Operand, Floats], one: Operand, rounded: bool = False) -> Floats:
        if isinstance(one, Constant):
            return np.float64(self.real.round(one.value) if rounded else one.value)
        return values[one]

    def _forward(self, q: Floats, gradient: dict[Operand, Floats] | None) -> dict[Operand, Floats]:
        rounded = gradient is not None
        given = {
            n: self.real.round(v) if rounded else float(v) for n, v in zip(self.program.parameters, self.parameters)
        }
        values = _leaves(self.program, q, given)
        for statement in self.program.statements:
            operands = [self._operand(values, one, rounded) for one in statement.operands]
            results = _apply(statement.operator, operands, lambda angle: (np.sin(angle), np.cos(angle)))
            for name, result in zip(map(Temporary, statement.results), results, strict=True):
                values[name] = result
                if gradient is not None and not _is_exact(statement):
                    values[name] = self._disturbed(statement.operator, result, np.sign(gradient.get(name, 0.0)))
        return values

    def _disturbed(self, operator: Operator, result: Floats, direction: Floats) -> Floats:
        number = NUMBER_TYPES[self.real]
        if operator is Operator.SINCOS:
            return np.clip(result + direction * number.sine_error, -1, 1)
        mantissa, exponent = np.frexp(result)
        limit = np.ldexp(1.0, exponent - (np.abs(mantissa) == 0.5))
        half_ulp = limit * 2.0 ** (-1 - number.precision)
        return np.where(result == 0, 0, np.clip(result + direction * half_ulp, -limit, limit))

    def _gradient(self, values: dict[Operand, Floats], output: Operand) -> dict[Operand, Floats]:
        """The derivative of one output by every value."""
        found: dict[Operand, Floats] = {output: np.float64(1)}
        for statement in reversed(self.program.statements):
            slopes = [found.get(Temporary(name), 0.0) for name in statement.results]
            for one, part in self._parts(values, statement, slopes):
                found[one] = found.get(one, 0.0) + part
        return found

    def _parts(
        self, values: dict[Operand, Floats], statement: Statement, slopes: list[Floats]
    ) -> Iterator[tuple[Operand, Floats]]:
        """What each operand adds to the derivative, from the derivatives by the results."""
        operands, slope = statement.operands, slopes[0]
        first, last = (self._operand(values, one) for one in (operands[0], operands[-1]))
        match statement.operator:
            case Operator.ADD:
                parts = [slope, slope]
            case Operator.SUB:
                parts = [slope, -slope]
            case Operator.MUL:
                parts = [slope * last, slope * first]
            case Operator.DIV:
                parts = [slope / last, -slope * first / last**2]
            case Operator.NEG:
                parts = [-slope]
            case Operator.SINCOS:
                parts = [slope * np.cos(first) - slopes[1] * np.sin(first)]
        yield from zip(operands, parts, strict=True)
