"""The one walk over a program that prints the body of a function, in the syntax of any language.

In: a `Program`, a `Syntax`, and where inputs are read and results are stored. Out: lines, one operation each, in the
order of the program. What a language adds is its syntax alone; an operator that it has no form for is an error.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction

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


@dataclass(frozen=True, slots=True)
class Syntax:
    """All that differs between languages in the body of a function.

    Attributes:
        language: What it is called in messages.
        literal: An exact number as text; negative ones in brackets where an operator may come before them.
        define: A definition, with `{name}` and `{value}`.
        store: An assignment to a place of a result, with `{place}` and `{value}`.
        sincos: The lines that define sine and cosine, from the names of both and the angle.
        parameter: A runtime parameter, with `{name}`.
        forms: The expression of each other operator, with `{0}` and so on for its operands.
    """

    language: str
    literal: Callable[[Fraction], str]
    define: str
    store: str
    sincos: Callable[[str, str, str], tuple[str, ...]]
    parameter: str
    forms: Mapping[Operator, str]


@dataclass(frozen=True, slots=True)
class Printer:
    """Prints one program.

    Attributes:
        syntax: Of which language.
        variables: How each number of the inputs is written.
    """

    syntax: Syntax
    variables: Sequence[str]

    def operand(self, operand: Operand) -> str:
        """One operand."""
        match operand:
            case Variable(index):
                return self.variables[index]
            case RuntimeParameter(name):
                return self.syntax.parameter.format(name=name)
            case Constant(value):
                text = self.syntax.literal(value)
                return f"({text})" if value < 0 else text
            case Temporary(name):
                return name
            case _:
                raise TypeError(f"{self.syntax.language} has no form for the operand {operand!r}")

    def assignment(self, place: str, operand: Operand) -> str:
        """The assignment of an operand to a place of a result."""
        value = self.syntax.literal(operand.value) if isinstance(operand, Constant) else self.operand(operand)
        return self.syntax.store.format(place=place, value=value)

    def lines(self, program: Program, places: Sequence[str]) -> tuple[str, ...]:
        """The statements of a program; one operation each.

        Args:
            program: The program.
            places: Where each of its outputs belongs. A result is stored as soon as it is computed, so that it need
                not be kept; what needs no computing comes last.
        """
        stores: defaultdict[str, list[str]] = defaultdict(list)
        last: list[str] = []
        for place, operand in zip(places, program.outputs, strict=True):
            group = stores[operand.name] if isinstance(operand, Temporary) else last
            group.append(self.assignment(place, operand))
        lines: list[str] = []
        for statement in program.statements:
            lines += self._statement(statement)
            for name in statement.results:
                lines += stores[name]
        return (*lines, *last)

    def _statement(self, statement: Statement) -> tuple[str, ...]:
        if statement.operator is Operator.SINCOS:
            sine, cosine = statement.results
            return self.syntax.sincos(sine, cosine, self.operand(statement.operands[0]))
        return (self.syntax.define.format(name=statement.name, value=self._expression(statement)),)

    def _expression(self, statement: Statement) -> str:
        if statement.operator not in self.syntax.forms:
            raise TypeError(f"{self.syntax.language} has no form for the operator {statement.operator!r}")
        return self.syntax.forms[statement.operator].format(*map(self.operand, statement.operands))
