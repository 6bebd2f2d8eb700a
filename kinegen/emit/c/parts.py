"""The two parts of a batch kernel with runtime parameters: what follows from the parameters alone, and all the rest.

In: a program. Out: two lists of statements. A tile has a row of numbers for each parameter, and one for each number
that follows from parameters alone and is used by the rest. With one set of parameters for a whole batch these rows are
filled once; with a set for each configuration they are filled for each tile. The rest is the same code in both cases,
so it gives the same bits, also where the compiler fuses products and sums.
"""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

from kinegen.emit.printing import Printer
from kinegen.ir.program import Constant, Operand, Operator, Program, RuntimeParameter, Statement, Temporary, Variable
from kinegen.naming import companion

_WIDTH = 112
"""Longest line of a comment."""


@dataclass(frozen=True, slots=True)
class Part:
    """Statements that are printed together.

    Attributes:
        statements: The code.
        outputs: The numbers that are stored, in the order of their places.
    """

    statements: tuple[Statement, ...]
    outputs: tuple[Operand, ...]


@dataclass(frozen=True, slots=True)
class Parts:
    """A program in two parts. The variables after those of the inputs are the rows of parameters.

    Attributes:
        rows: What each row holds: the names of the parameters, then those of temporaries.
        first: What follows from the parameters alone; its outputs are the rows after those of the parameters.
        rest: The program without that.
    """

    rows: tuple[str, ...]
    first: Part
    rest: Part


@dataclass(frozen=True, slots=True)
class ParamRows:
    """The rows of a tile for the parameters, printed.

    Attributes:
        count: How many there are.
        words: What each row holds, as the lines of a comment.
        taker: Name of the function that fills them.
        function: Name of the function that computes what follows from parameters alone; empty where nothing does.
        body: Its statements for one configuration.
    """

    count: int
    words: tuple[str, ...]
    taker: str
    function: str
    body: tuple[str, ...]


def param_rows(printer: Printer[Operator], parts: Parts, function: str, suffix: str) -> ParamRows:
    """Print the first part of a program that reads parameters.

    Args:
        printer: Prints statements; its variables go on with the rows `p[0][i]`, `p[1][i]` and so on.
        parts: The program.
        function: Name of the kernel.
        suffix: What the names of functions end in that bring tiles in and out.
    """
    begin = len(parts.rows) - len(parts.first.outputs)
    body = printer.lines(parts.first, [f"p[{row}][i]" for row in range(begin, len(parts.rows))])
    return ParamRows(
        count=len(parts.rows),
        words=_lines(parts.rows),
        taker=companion(function, "params") if body else f"take_params{suffix}",
        function=companion(function, "from_params") if body else "",
        body=body,
    )


def _lines(rows: tuple[str, ...]) -> tuple[str, ...]:
    text = ", ".join(f"p[{row}]~{name}" for row, name in enumerate(rows))
    lines = textwrap.wrap(text, _WIDTH, break_long_words=False, break_on_hyphens=False)
    return tuple(line.replace("~", " ") for line in lines)


def part(program: Program) -> Parts:
    """Part a program.

    Args:
        program: A program, with runtime parameters or without.

    Returns:
        Its parts; without rows where it reads no parameter.
    """
    if not program.reads_parameters:
        return Parts((), Part((), ()), Part(program.statements, program.outputs))
    early: dict[str, Statement] = {}
    late: list[Statement] = []
    for statement in program.statements:
        if all(_is_early(operand, early) for operand in statement.operands):
            early |= dict.fromkeys(statement.results, statement)
        else:
            late.append(statement)
    used = {operand.name for operand in _operands(late, program.outputs) if isinstance(operand, Temporary)}
    handed_on = [name for name in early if name in used]
    inputs = sum(given.size for given in program.signature.inputs)
    rows = (*program.parameters, *handed_on)
    places: dict[Operand, Operand] = {}
    for place, name in enumerate(rows):
        operand = RuntimeParameter(name) if place < len(program.parameters) else Temporary(name)
        places[operand] = Variable(inputs + place)
    parameters: dict[Operand, Operand] = {
        operand: place for operand, place in places.items() if isinstance(operand, RuntimeParameter)
    }
    first = Part(_moved(dict.fromkeys(early.values()), parameters), tuple(Temporary(name) for name in handed_on))
    outputs = tuple(places.get(operand, operand) for operand in program.outputs)
    return Parts(rows, first, Part(_moved(late, places), outputs))


def _is_early(operand: Operand, early: Mapping[str, Statement]) -> bool:
    if isinstance(operand, Temporary):
        return operand.name in early
    return isinstance(operand, (RuntimeParameter, Constant))


def _operands(statements: Iterable[Statement], outputs: tuple[Operand, ...]) -> tuple[Operand, ...]:
    return (*(operand for statement in statements for operand in statement.operands), *outputs)


def _moved(statements: Iterable[Statement], places: Mapping[Operand, Operand]) -> tuple[Statement, ...]:
    """Statements that read other places."""
    return tuple(
        replace(statement, operands=tuple(places.get(operand, operand) for operand in statement.operands))
        for statement in statements
    )
