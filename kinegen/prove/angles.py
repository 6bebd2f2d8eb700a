"""The angles whose sines and cosines a kernel takes, over a box of inputs, rounded as the kernel rounds them."""

from __future__ import annotations

import itertools
import operator
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from kinegen.emit.kernels import Kernels
from kinegen.emit.reals import Real
from kinegen.ir.program import Constant, Operand, Operator, RuntimeParameter, Statement, Temporary, Variable
from kinegen.prove.ranges import Box

_KINDS: Mapping[Real, Any] = {Real.DOUBLE: np.float64, Real.FLOAT: np.float32}
_COMBINED: Mapping[Operator, Callable[..., Any]] = {
    Operator.ADD: operator.add,
    Operator.SUB: operator.sub,
    Operator.MUL: operator.mul,
    Operator.NEG: operator.neg,
}


def angle_range(kernels: Kernels, real: Real, box: Box, most: float = np.inf) -> tuple[float, float]:
    """The smallest and the largest angle whose sine and cosine the kernels take.

    Args:
        kernels: The robot and its programs.
        real: The number type.
        box: The inputs, those of each program in order; its ends are rounded outwards.
        most: What stands for an angle that is not a sum of inputs, to either side.

    Returns:
        Numbers of the type; zero lies between them.
    """
    found = [(0.0, 0.0)]
    for program in kernels.programs:
        statements = {name: each for each in program.statements for name in each.results}
        sums = _Sums(kernels, real, box, statements, most)
        angles = {each.operands[0] for each in program.statements if each.operator is Operator.SINCOS}
        found += [sums.bounds(angle) for angle in angles]
    return min(float(low) for low, _ in found), max(float(high) for _, high in found)


def rounded(real: Real, value: float, towards: float | None = None) -> float:
    """A number of the type: the nearest, or, where one is named, the nearest on the way to an infinity."""
    kind = _KINDS[real]
    nearest = kind(value)
    if towards is not None and (float(nearest) > value if towards < 0 else float(nearest) < value):
        nearest = np.nextafter(nearest, kind(towards))
    return float(nearest)


@dataclass(frozen=True, slots=True)
class _Sums:
    """Bounds of sums of joint values, which rise or fall with each of them, so that ends go to ends."""

    kernels: Kernels
    real: Real
    box: Box
    statements: Mapping[str, Statement]
    most: float

    def bounds(self, operand: Operand) -> tuple[Any, Any]:
        """The smallest and the largest value of an operand."""
        kind = _KINDS[self.real]
        match operand:
            case Variable(index):
                low, high = self.box[index]
                return kind(rounded(self.real, low, -np.inf)), kind(rounded(self.real, high, np.inf))
            case Constant(value):
                return (kind(self.real.round(value)),) * 2
            case RuntimeParameter(name):
                names = [parameter.name for parameter in self.kernels.robot.runtime_parameters]
                return (kind(self.real.round(self.kernels.defaults[names.index(name)])),) * 2
            case Temporary(name):
                return self._combined(self.statements[name])

    def _combined(self, statement: Statement) -> tuple[Any, Any]:
        if statement.operator not in _COMBINED:
            kind = _KINDS[self.real]
            return kind(-self.most), kind(self.most)
        parts = [self.bounds(operand) for operand in statement.operands]
        ends = [_COMBINED[statement.operator](*choice) for choice in itertools.product(*parts)]
        return min(ends), max(ends)
