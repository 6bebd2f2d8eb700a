"""Reads routines from text, in which numerical code is easier to check than as records.

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
from kinegen.ir.routines.routine import Passage, Routine

_OPERATORS = {"+": Operator.ADD, "-": Operator.SUB, "*": Operator.MUL, "/": Operator.DIV}
_OPERAND = r"(-?[\w.]+(?:e[-+]\d+)?)"
_OPERATION = re.compile(rf"(\w+) = {_OPERAND} ([-+*/]) {_OPERAND}")
_NEGATION = re.compile(r"(\w+) = -([a-z]\w*)")
_SELECTION = re.compile(rf"(\w+) = {_OPERAND} < {_OPERAND} \? {_OPERAND} : {_OPERAND}")


def read_routine(name: str, inputs: tuple[str, ...], text: str) -> Routine:
    """Read a routine.

    Args:
        name: Its name.
        inputs: The names of its arguments.
        text: Its code.

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
