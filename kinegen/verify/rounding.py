"""What rounding does to the results of a program: trials in which every operation is off by a unit at random.

How far these are from one another shows what the type can give at these very inputs: near a dead centre or a
singularity as far as there, and for sums of large angles (J. Vignes, Discrete stochastic arithmetic for validating
results of numerical software, Numerical Algorithms 37, 2004). Each operation is moved by the largest error that it can
have, whereas a real one is off by less, so that the spread is above that of real errors.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from fractions import Fraction
from functools import lru_cache
from typing import Any

import numpy as np

from kinegen.backends.accuracy import NUMBER_TYPES
from kinegen.backends.scalar_types import ScalarType
from kinegen.ir.error_analysis import NumberType
from kinegen.ir.finalize import last_reads
from kinegen.ir.lower import runtime_defaults
from kinegen.ir.program import Constant, Operand, Operator, Program, RuntimeParameter, Temporary, Variable
from kinegen.model.outputs import Array
from kinegen.model.robot import Robot
from kinegen.verify.expected_results import subjects
from kinegen.verify.samples import SEED, FloatArray

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

    `inputs`: its inputs in their order, shape (N, inputs); numbers of the type; `seed`: of the directions in which
    operations are rounded. Yields results of shape (N, outputs), NaN where an angle is beyond what sines are computed
    of: first as float64 gives them, then `TRIALS` times with other roundings.
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
    """Returns the directions of all trials, shape (1 + TRIALS, _SIGNS); none of the first, which is plain."""
    generator = np.random.default_rng(seed)
    signs = np.stack([np.zeros(_SIGNS), *(generator.choice((-1.0, 1.0), _SIGNS) for _ in range(TRIALS))])
    signs.flags.writeable = False
    return signs


@lru_cache(maxsize=3)
def _factors(seed: int, unit: float) -> FloatArray:
    """Returns what most operations are multiplied by; a long program takes it ten thousand times."""
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
        """Returns the sine and cosine of an angle; NaN beyond the largest one."""
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


SPREADS = 8
"""So many times the root mean square that the trials find is accepted. Real errors have at most 1/sqrt(3)
of it each, so that this is nearly fourteen standard deviations; fewer would do, were the root mean square known better
than from sixteen trials."""

COARSE = replace(
    NUMBER_TYPES[ScalarType.FLOAT],
    sine_error=max(each.sine_error / float(each.unit) for each in NUMBER_TYPES.values())
    * float(NUMBER_TYPES[ScalarType.FLOAT].unit),
    angle_limit=NUMBER_TYPES[ScalarType.DOUBLE].angle_limit,
)
"""What test vectors are rounded with: units of floats, which what float64 itself loses does not show in, so that every
machine finds the same spread. It is proportional to the unit."""


def parameters_of(robot: Robot, program: Program) -> dict[str, Fraction]:
    """Returns the values of those runtime parameters that a program reads, in its order."""
    names = (parameter.name for parameter in robot.runtime_parameters)
    values = dict(zip(names, runtime_defaults(robot), strict=True))
    return {name: values[name] for name in program.parameters}


def trials_at(
    robot: Robot, program: Program, inputs: Mapping[str, Any], count: int, real: NumberType
) -> Iterator[FloatArray]:
    """Yields the results of a program at some inputs, shape (count, outputs): plain first, then rounded in many ways.

    `inputs`: arrays of `count` inputs by name; matrices with their last rows.
    """
    columns = [
        _upper(inputs[array.name], array).astype(np.float64).reshape(count, -1) for array in program.signature.inputs
    ]
    flat = np.concatenate([*columns, np.zeros((count, 0))], axis=1)
    return rounded_trials(program, flat, parameters_of(robot, program), real, SEED)


def apart(one: Any, two: Any) -> FloatArray:
    """Returns how far two results are apart; infinitely, where one alone is a number."""
    with np.errstate(invalid="ignore"):
        distance = np.abs((one - two).astype(np.float64))
    same = (one == two) | (np.isnan(one.astype(np.float64)) & np.isnan(two.astype(np.float64)))
    return np.where(same, 0.0, np.where(np.isnan(distance), np.inf, distance))


def coarse_spread(robot: Robot, program: Program, inputs: Mapping[str, FloatArray]) -> tuple[FloatArray, FloatArray]:
    """Returns what the results of a program are, and how far units of floats may move them.

    `inputs`: arrays of N inputs by name. Results and `SPREADS` times the root mean square of their differences, shape
    (N, outputs) each. Angles are compared without whole turns. Infinite where a result is not a number, or may become
    one that is not.
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
