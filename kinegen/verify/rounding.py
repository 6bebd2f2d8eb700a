"""What rounding does to a program at given inputs: every operation is off by a unit, in random directions.

In: a `Program`, inputs, the facts of a number type. Out: its results, several times, each time rounded in another way.
How far these are from one another shows what the type can give at these very inputs: near a dead centre or a
singularity as far as there, and for sums of large angles (J. Vignes, Discrete stochastic arithmetic for validating
results of numerical software, Numerical Algorithms 37, 2004). Each operation is moved by the largest error that it can
have, whereas a real one is off by less, so that the spread is above that of real errors.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from fractions import Fraction
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinegen.ir.bounds import NumberType
from kinegen.ir.last_reads import last_reads
from kinegen.ir.program import Constant, Operand, Operator, Program, RuntimeParameter, Temporary, Variable

FloatArray = NDArray[np.float64]

TRIALS = 16
"""How often a program is rounded anew."""

_BLOCK = 2048
"""Configurations that are computed at a time, so that long programs take little memory."""

_TOGETHER = 1 << 14
"""Trials of few configurations are computed together, up to so many in all, as each operation has its price."""

_SIGNS = 1 << 16
_ARC_TANGENT = 4
"""Units by which the arc tangent is moved; the emitted ones are within three."""

_EXACT = (Operator.NEG, Operator.SELECT_LT)
"""What rounds nothing."""


def rounded_trials(
    program: Program, inputs: FloatArray, parameters: Mapping[str, Fraction], real: NumberType, seed: int
) -> Iterator[FloatArray]:
    """Evaluate a program with many roundings.

    Args:
        program: The program.
        inputs: Its inputs in their order, shape (N, inputs); numbers of the type.
        parameters: Values of the runtime parameters.
        real: The number type.
        seed: Of the directions in which operations are rounded.

    Yields:
        Results of shape (N, outputs), NaN where an angle is beyond what sines are computed of: first as float64 gives
        them, then `TRIALS` times with other roundings.
    """
    signs, factors = _directions(seed), _factors(seed, float(real.unit))
    together = max(1, _TOGETHER // max(1, len(inputs)))
    blocks = [_Block(inputs[start : start + _BLOCK], real) for start in range(0, len(inputs), _BLOCK)]
    for first in range(0, 1 + TRIALS, together):
        chosen = slice(first, first + together)
        run = _Run(program, parameters, real, signs[chosen], factors[chosen])
        yield from np.concatenate([run.results(block) for block in blocks], axis=1)


@lru_cache(maxsize=2)
def _directions(seed: int) -> FloatArray:
    """The directions of all trials, shape (1 + TRIALS, _SIGNS); none of the first, which is plain."""
    generator = np.random.default_rng(seed)
    signs = np.stack([np.zeros(_SIGNS), *(generator.choice((-1.0, 1.0), _SIGNS) for _ in range(TRIALS))])
    signs.flags.writeable = False
    return signs


@lru_cache(maxsize=3)
def _factors(seed: int, unit: float) -> FloatArray:
    """What most operations are multiplied by; a long program takes it ten thousand times."""
    factors: FloatArray = 1 + unit * _directions(seed)
    factors.flags.writeable = False
    return factors


class _Block:
    """Some inputs, and what is the same of them in all trials: their own sines and cosines."""

    def __init__(self, inputs: FloatArray, real: NumberType) -> None:
        self.columns, self.count = np.ascontiguousarray(inputs.T), len(inputs)
        self._limit = real.angle_limit
        self._pairs: dict[Operand, tuple[FloatArray, ...]] = {}

    def pair(self, operand: Operand, angle: Any) -> tuple[FloatArray, ...]:
        """The sine and cosine of an angle; NaN beyond the largest one."""
        if operand in self._pairs:
            return self._pairs[operand]
        near = np.where(np.abs(angle) <= self._limit, angle, np.nan)
        pair = np.sin(near), np.cos(near)
        if isinstance(operand, Variable):
            self._pairs[operand] = pair
        return pair


class _Run:
    """Some evaluations at once; with signs of zero, as float64 rounds."""

    def __init__(
        self,
        program: Program,
        parameters: Mapping[str, Fraction],
        real: NumberType,
        signs: FloatArray,
        factors: FloatArray,
    ) -> None:
        self._program, self._parameters, self._real = program, parameters, real
        self._signs, self._factors = signs, factors
        self._unit = float(real.unit)
        self._place = 0
        self._dead: dict[int, list[str]] = {}
        for name, place in last_reads(program).items():
            self._dead.setdefault(place, []).append(name)
        self._used = program.used
        self._constants: dict[Constant, Any] = {}

    def results(self, block: _Block) -> FloatArray:
        """Results for some inputs, shape (evaluations, N, outputs)."""
        known: dict[str, FloatArray] = {}
        columns, shape = block.columns, (len(self._signs), block.count)
        with np.errstate(all="ignore"):
            for place, statement in enumerate(self._program.statements):
                operands = [self._operand(operand, columns, known) for operand in statement.operands]
                if statement.operator is Operator.SINCOS:
                    values = block.pair(statement.operands[0], *operands)
                else:
                    values = (_OPERATIONS[statement.operator](*operands),)
                for name, value in zip(statement.results, values, strict=True):
                    if Temporary(name) in self._used:
                        known[name] = self._rounded(statement.operator, value, block.count)
                for name in self._dead.get(place, ()):
                    del known[name]
            outputs = [self._operand(operand, columns, known) for operand in self._program.outputs]
        results = np.empty((*shape, len(outputs)))
        for place, output in enumerate(outputs):
            results[..., place] = output
        return results

    def _operand(self, operand: Operand, columns: FloatArray, known: Mapping[str, FloatArray]) -> Any:
        match operand:
            case Temporary(name):
                return known[name]
            case Variable(index):
                return columns[index]
            case RuntimeParameter(name):
                return self._constant(Constant(self._parameters[name]))
            case Constant():
                return self._constant(operand)

    def _constant(self, operand: Constant) -> Any:
        """A constant; one that the type does not hold is a unit off, always to the same side in one evaluation."""
        if operand not in self._constants:
            value: Any = float(operand.value)
            if self._real.nearest(operand.value) != operand.value:
                value = value * (1 + self._unit * self._signs[:, hash(operand.value) % _SIGNS, None])
            self._constants[operand] = value
        return self._constants[operand]

    def _rounded(self, operator: Operator, value: Any, count: int) -> FloatArray:
        if operator in _EXACT:
            return np.asarray(value)
        # The directions are a fixed random sequence, read from a place that moves on with every operation.
        self._place = (self._place + 7919) % (_SIGNS - count)
        part = slice(self._place, self._place + count)
        if operator is Operator.SINCOS:
            return np.asarray(value + max(self._real.sine_error, self._unit) * self._signs[:, part])
        if operator is Operator.ATAN2:
            return np.asarray(value * (1 + _ARC_TANGENT * self._unit * self._signs[:, part]))
        factors = self._factors[:, part]
        # The array was made for this statement alone, and is of use as it is if all trials are in it.
        moved: FloatArray = np.multiply(value, factors, out=value if np.shape(value) == factors.shape else None)
        return moved


_OPERATIONS: Mapping[Operator, Callable[..., Any]] = {
    Operator.ADD: np.add,
    Operator.SUB: np.subtract,
    Operator.MUL: np.multiply,
    Operator.DIV: np.divide,
    Operator.NEG: np.negative,
    Operator.SQRT: np.sqrt,
    Operator.ATAN2: lambda y, x: np.arctan2(y + 0.0, x + 0.0),  # zeros have no sign
    Operator.SELECT_LT: lambda a, b, x, y: np.where(np.less(a, b), x, y),
}
"""What computes the result of an operator that has one."""
