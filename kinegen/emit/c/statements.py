"""Prints the statements of a program as C, one operation each."""

from __future__ import annotations

import textwrap
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction

from kinegen.emit.c.constants import is_length
from kinegen.emit.c.parts import Part
from kinegen.emit.functions import LINE, ROUTINES
from kinegen.emit.reals import Real
from kinegen.emit.sections import FIXED, Section, angle_names
from kinegen.ir.program import (
    Constant,
    Operand,
    Operator,
    Program,
    RuntimeParameter,
    Statement,
    Temporary,
    Variable,
)

_SYMBOLS = {Operator.ADD: "+", Operator.SUB: "-", Operator.MUL: "*", Operator.DIV: "/"}


@dataclass(frozen=True, slots=True)
class CPrinter:
    """Prints operands and statements for one number type.

    Attributes:
        real: The number type.
        sincos: Name of the sine-cosine function or macro.
        variables: How each number of the inputs is written.
        prefix: What the names of other functions begin with.
        selects_bits: Whether selections are calls of a function, so that loops over them become vector code.
        constants: Names of lengths.
    """

    real: Real
    sincos: str
    variables: tuple[str, ...]
    prefix: str
    selects_bits: bool = False
    constants: Mapping[Fraction, str] = field(default_factory=dict)

    def operand(self, operand: Operand) -> str:
        """One operand of an operation; a negative number is in brackets."""
        text = self.value(operand)
        return f"({text})" if isinstance(operand, Constant) and operand.of(self.real is Real.FLOAT) < 0 else text

    def value(self, operand: Operand) -> str:
        """One operand by itself."""
        match operand:
            case Variable(index):
                return self.variables[index]
            case RuntimeParameter(name):
                return f"params->{name}"
            case Constant():
                return self.real.literal(operand.of(self.real is Real.FLOAT))
            case Temporary(name):
                return name
            case _:
                raise TypeError(f"C has no form for the operand {operand!r}")

    def assignment(self, place: str, operand: Operand) -> str:
        """The assignment of an operand to a place of the result."""
        return f"{place} = {self.value(operand)};"

    def lines(
        self,
        program: Program | Part,
        places: Sequence[str | None],
        parts: Sequence[Section] = (),
        rows: Sequence[str] = (),
    ) -> tuple[str, ...]:
        """The statements of a program.

        Args:
            program: The program, or a part of it.
            places: Where each of its outputs belongs. A result is stored as soon as it is there, so that it need not
                be kept (outputs do not overlap inputs); what needs no computing comes last. None leaves one out.
            parts: Its sections, each with a blank line and a title before it; none for lines without titles.
            rows: What comes after all that: assignments of numbers.
        """
        stores: defaultdict[str, list[str]] = defaultdict(list)
        last: list[str] = []
        for place, operand in zip(places, program.outputs, strict=True):
            if place is None:
                continue
            group = stores[operand.name] if isinstance(operand, Temporary) else last
            group.append(self.assignment(place, operand))
        lines: list[str] = []
        angles = angle_names(program.statements)
        for part in parts or (Section("", program.statements),):
            lines += _heading(part.title)
            for statement in part.statements:
                lines += self._statement(statement, self.constants if is_length(statement, angles) else {})
                for name in statement.results:
                    lines += stores[name]
        if parts and (last or rows):
            lines += _heading(FIXED)
        return (*lines[bool(parts) :], *last, *rows)  # no blank line at the beginning

    def _statement(self, statement: Statement, constants: Mapping[Fraction, str]) -> list[str]:
        if statement.operator is not Operator.SINCOS:
            return [f"const {self.real} {statement.name} = {self._expression(statement, constants)};"]
        (angle,), (sine, cosine) = statement.operands, statement.results
        return [
            f"{self.real} {sine};",
            f"{self.real} {cosine};",
            f"{self.sincos}({self.operand(angle)}, &{sine}, &{cosine});",
        ]

    def _named(self, operand: Operand, constants: Mapping[Fraction, str]) -> str:
        """One operand, a length of the table by its name."""
        if not isinstance(operand, Constant) or operand.single is not None or abs(operand.value) not in constants:
            return self.operand(operand)
        return f"{'-' if operand.value < 0 else ''}{constants[abs(operand.value)]}"

    def _expression(self, statement: Statement, constants: Mapping[Fraction, str]) -> str:
        operands = [self._named(operand, constants) for operand in statement.operands]
        if statement.operator is Operator.NEG:
            return f"-{operands[0]}"
        if statement.operator is Operator.SELECT_LT and not self.selects_bits:
            left, right, less, other = operands
            return f"({left} < {right}) ? {less} : {other}"
        if statement.operator in (*ROUTINES[self.real], Operator.SELECT_LT):
            return f"{self.prefix}_{statement.operator.value}({', '.join(operands)})"
        if statement.operator not in _SYMBOLS:
            raise TypeError(f"C has no form for the operator {statement.operator!r}")
        return f"{operands[0]} {_SYMBOLS[statement.operator]} {operands[1]}"


def _heading(title: str) -> list[str]:
    """A blank line and a comment; nothing where there is no title."""
    if not title:
        return []
    first, *others = textwrap.wrap(title, LINE - 5, break_long_words=False)
    lines = [f"/* {first}", *(f" * {line}" for line in others)]
    return ["", *lines[:-1], f"{lines[-1]} */"]
