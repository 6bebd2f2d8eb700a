"""Routines, which are functions in straight-line code, and their notation, easier to check than records.

    # A comment, of any number of lines, begins a passage.
    k = x * 2.0
    sign = k < 0.0 ? -1.0 : 1.0
    result = k - sign
    return result

A line is one operation: `a + b`, `a - b`, `a * b`, `a / b`, `-a` or `a < b ? c : d`. Numbers are exact decimals; every
language rounds them once, to the type of the routine.
"""

from __future__ import annotations

import re
from fractions import Fraction

from kinegen.ir.program import Constant, Operand, Operator, Statement, Temporary, Variable
from kinegen.support.dataclass import dataclass


@dataclass(frozen=True, slots=True)
class Passage:
    """Some statements and what they do.

    `title`: the comment; its lines are kept in every language.
    """

    title: str
    statements: tuple[Statement, ...]


@dataclass(frozen=True, slots=True)
class Routine:
    """A function of numbers.

    Raises:
        ValueError: If a name is defined twice, used before its definition or never.

    Attributes:
        inputs: The names of its arguments, in the order of the variables.
    """

    name: str
    inputs: tuple[str, ...]
    passages: tuple[Passage, ...]
    outputs: tuple[Operand, ...]

    def __post_init__(self) -> None:
        defined: set[str] = set(self.inputs)
        used = {operand.name for operand in self.outputs if isinstance(operand, Temporary)}
        for statement in self.statements:
            names = {operand.name for operand in statement.operands if isinstance(operand, Temporary)}
            if not names <= defined:
                raise ValueError(f"{self.name}: {sorted(names - defined)} are used before they are defined")
            if statement.name in defined:
                raise ValueError(f"{self.name}: {statement.name} is defined twice")
            defined.add(statement.name)
            used |= names
        unused = {statement.name for statement in self.statements} - used
        if unused:
            raise ValueError(f"{self.name}: {sorted(unused)} are never used")

    @property
    def statements(self) -> tuple[Statement, ...]:
        """All statements in their order."""
        return tuple(statement for passage in self.passages for statement in passage.statements)

    def uses(self, *operators: Operator) -> bool:
        """Tell whether it has one of these operations."""
        return any(statement.operator in operators for statement in self.statements)


_OPERATORS = {"+": Operator.ADD, "-": Operator.SUB, "*": Operator.MUL, "/": Operator.DIV}
_OPERAND = r"(-?[\w.]+(?:e[-+]\d+)?)"
_OPERATION = re.compile(rf"(\w+) = {_OPERAND} ([-+*/]) {_OPERAND}")
_NEGATION = re.compile(r"(\w+) = -([a-z]\w*)")
_SELECTION = re.compile(rf"(\w+) = {_OPERAND} < {_OPERAND} \? {_OPERAND} : {_OPERAND}")


def read_routine(name: str, inputs: tuple[str, ...], text: str) -> Routine:
    """Read a routine.

    Raises:
        ValueError: If a line is not an operation, or the code is not sound.
    """
    passages: list[Passage] = []
    comment: list[str] = []
    for line in filter(None, (line.strip() for line in text.splitlines())):
        if line.startswith("# "):
            comment.append(line[2:])
            continue
        if comment or not passages:
            passages.append(Passage("\n".join(comment), ()))
            comment = []
        if line.startswith("return "):
            outputs = tuple(_operand(word, inputs) for word in line.removeprefix("return ").split(", "))
            return Routine(name, inputs, tuple(passages), outputs)
        last = passages.pop()
        passages.append(Passage(last.title, (*last.statements, _statement(line, inputs))))
    raise ValueError(f"{name} returns nothing")


def _statement(line: str, inputs: tuple[str, ...]) -> Statement:
    if found := _OPERATION.fullmatch(line):
        result, left, sign, right = found.groups()
        return Statement((result,), _OPERATORS[sign], (_operand(left, inputs), _operand(right, inputs)))
    if found := _SELECTION.fullmatch(line):
        result, *operands = found.groups()
        return Statement((result,), Operator.SELECT_LT, tuple(_operand(each, inputs) for each in operands))
    if found := _NEGATION.fullmatch(line):
        return Statement((found[1],), Operator.NEG, (_operand(found[2], inputs),))
    raise ValueError(f"'{line}' is not an operation")


def _operand(word: str, inputs: tuple[str, ...]) -> Operand:
    if word in inputs:
        return Variable(inputs.index(word))
    return Temporary(word) if word.isidentifier() else Constant(Fraction(word))
