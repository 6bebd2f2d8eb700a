"""Integer statements: what each computes, exactly, and what is known of the results."""

from __future__ import annotations

import math
from collections.abc import Iterator
from fractions import Fraction

from kinegen.ir.program import Program, RuntimeParameter, Temporary, Variable
from kinegen.support.compat import StrEnum
from kinegen.support.dataclass import dataclass


def nearest_integer(value: Fraction) -> int:
    """Return the nearest integer; halves away from zero, so that opposite numbers stay opposite."""
    size = math.floor(abs(value) + Fraction(1, 2))
    return -size if value < 0 else size


def above(value: Fraction) -> float:
    """Return a float that is no smaller than a number, and next to it."""
    nearest = float(value)
    return nearest if Fraction(nearest) >= value else math.nextafter(nearest, math.inf)


def half_place(bits: int) -> float:
    """Return what rounding to a number of fraction bits can lose."""
    return math.ldexp(0.5, -bits)


NUMBER_BITS = 30
"""Fraction bits of sines, cosines and entries of a rotation."""

SINE_ERROR = 0.95
"""Largest error of an emitted sine or cosine in units of 2^-30; tests/fixed tries every angle."""

PAIR_ERROR = 1.17
"""The largest length of the errors of both together, likewise."""

LARGEST = 2**31 - 2**18
"""Magnitude that every int32_t value stays within."""

LARGEST_FACTOR = 2**30 + 2**15 - 1
"""Magnitude that one factor of each product stays within: a little more than the number 1.

With both limits nothing overflows where a product is made of 16-bit halves, for want of a long multiplication."""


class Operation(StrEnum):
    """What an integer statement does. Values are int32_t; those of the `TURN` operations are uint32_t and wrap."""

    ADD = "a + b"
    SUBTRACT = "a - b"
    NEGATE = "-a"
    MULTIPLY = "a * b / 2^shift, halves rounded up"
    TIMES = "a * b, exact"
    ROUND = "a / 2^shift, halves rounded up"
    TURN_ADD = "angle a + b"
    TURN_SUBTRACT = "angle a - b"
    TURN_NEGATE = "angle -a"
    TURN_TIMES = "angle a times the integer b"
    TURN_PART = "a * b / 2^shift, halves rounded up; a is a signed angle"
    SINCOS = "sine and cosine of the angle a"


@dataclass(frozen=True, slots=True)
class Pair:
    """How far sines and cosines are from the exact ones, in units of 2^-30.

    `each`: bound on the error of a sine or a cosine. `both`: bound on the length of the errors of both.
    """

    each: float
    both: float


EMITTED = Pair(SINE_ERROR, PAIR_ERROR)
"""The pair that comes with the kernels."""


@dataclass(frozen=True, slots=True)
class Integer:
    """A literal; one that is an angle is unsigned."""

    value: int


FixedOperand = Variable | RuntimeParameter | Temporary | Integer


@dataclass(frozen=True, slots=True)
class FixedStatement:
    """One integer operation.

    Attributes:
        results: The names of the temporaries that it defines; two for `SINCOS`, and else one.
        operands: What it does it to; the second factor of a product is within `LARGEST_FACTOR`.
        shift: Bits dropped by `MULTIPLY`, `ROUND` and `TURN_PART`.
    """

    results: tuple[str, ...]
    operator: Operation
    operands: tuple[FixedOperand, ...]
    shift: int = 0

    @property
    def name(self) -> str:
        """The name of the only result.

        Raises:
            ValueError: If there are two.
        """
        (name,) = self.results
        return name


@dataclass(frozen=True, slots=True)
class Scales:
    """Fraction bits of lengths, the same for all programs of a robot.

    Attributes:
        length: Of computed lengths: the value is the integer divided by 2^length.
        stroke: Of prismatic joint variables.
        parameter: Of runtime parameters that are lengths.
    """

    length: int
    stroke: int
    parameter: int


@dataclass(frozen=True, slots=True)
class FixedProgram:
    """A kernel in integers.

    Attributes:
        bits: Fraction bits of each output.
        errors: For each output a proven bound on its distance from the exact result for the integer inputs, in
            units of its last place.
    """

    program: Program
    statements: tuple[FixedStatement, ...]
    outputs: tuple[FixedOperand, ...]
    bits: tuple[int, ...]
    errors: tuple[float, ...]

    @property
    def reads_joints(self) -> bool:
        """Tell whether any result depends on a joint variable."""
        return any(isinstance(operand, Variable) for operand in self._used)

    @property
    def reads_parameters(self) -> bool:
        """Tell whether any result depends on a runtime parameter."""
        return any(isinstance(operand, RuntimeParameter) for operand in self._used)

    @property
    def _used(self) -> Iterator[FixedOperand]:
        for statement in self.statements:
            yield from statement.operands
        yield from self.outputs
