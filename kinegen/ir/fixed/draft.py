"""A program in integers whose ranges are yet to be judged."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from kinegen.ir.fixed.extents import Extents
from kinegen.ir.fixed.kinds import Kind
from kinegen.ir.fixed.program import (
    LARGEST,
    LARGEST_FACTOR,
    FixedOperand,
    FixedProgram,
    FixedStatement,
    Integer,
    Operation,
)
from kinegen.ir.program import Program


@dataclass(frozen=True, slots=True)
class Local:
    """A value in integers.

    Attributes:
        operand: How statements refer to it.
        kind: What it measures.
        bits: Fraction bits.
        place: Its place among the analysed values.
    """

    operand: FixedOperand
    kind: Kind
    bits: int
    place: int


@dataclass(frozen=True, slots=True)
class Draft:
    """Integer statements, and what is known of their values.

    Attributes:
        program: The exact program behind them.
        statements: The code; which factor of a product stands second is not settled yet.
        operands: For each statement, its operands as locals; none for angles.
        locals: Every value but angles: inputs, literals, temporaries.
        outputs: One local for each output.
        extents: The analysis.
    """

    program: Program
    statements: tuple[FixedStatement, ...]
    operands: tuple[tuple[Local, ...], ...]
    locals: tuple[Local, ...]
    outputs: tuple[Local, ...]
    extents: Extents

    def largest(self, local: Local) -> float:
        """Bound on the magnitude of the integer."""
        if isinstance(local.operand, Integer):
            return abs(local.operand.value)
        return math.ldexp(self.extents.extent(local.place).largest, local.bits)

    def too_large(self) -> list[str]:
        """The values that are not shown to fit an int32_t."""
        return [
            str(getattr(local.operand, "name", local.operand)) for local in self.locals if self.largest(local) > LARGEST
        ]

    def overflows(self) -> tuple[str, ...]:
        """The values that are not shown to fit, and the products none of whose factors is small enough."""
        found = self.too_large()
        for statement, operands in zip(self.statements, self.operands, strict=True):
            if statement.operator is Operation.MULTIPLY and not self._small(operands):
                found.append(statement.name)
        return tuple(found)

    def splits(self, settled: FixedProgram) -> bool:
        """Whether products of 16-bit halves do not overflow, with the factors in the order of the finished program."""
        pairs = zip(self.statements, settled.statements, self.operands, strict=True)
        return all(
            self.largest(operands[int(own.operands == final.operands)]) <= LARGEST_FACTOR
            for own, final, operands in pairs
            if own.operator is Operation.MULTIPLY
        )

    @property
    def errors(self) -> tuple[float, ...]:
        """For each output the bound on its error, in units of its last place."""
        return tuple(math.ldexp(self.extents.extent(local.place).error, local.bits) for local in self.outputs)

    def settled(self) -> FixedProgram:
        """The finished program: the second factor of each product is a small one."""
        statements = []
        for statement, operands in zip(self.statements, self.operands, strict=True):
            if statement.operator is Operation.MULTIPLY and operands[1] not in self._small(operands):
                statements.append(replace(statement, operands=statement.operands[::-1]))
            else:
                statements.append(statement)
        return FixedProgram(
            program=self.program,
            statements=tuple(statements),
            outputs=tuple(local.operand for local in self.outputs),
            bits=tuple(local.bits for local in self.outputs),
            errors=self.errors,
        )

    def _small(self, operands: Sequence[Local]) -> list[Local]:
        return [local for local in operands if self.largest(local) <= LARGEST_FACTOR]
