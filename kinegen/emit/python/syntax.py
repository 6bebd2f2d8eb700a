"""How the body of a function is written in NumPy, for arrays of either number type."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from dataclasses import replace
from types import MappingProxyType

from kinegen.emit.printing import Printer, Syntax
from kinegen.emit.reals import Real
from kinegen.ir.program import Constant, Operator, Statement
from kinegen.naming import python_identifier

_WIDTH = 112
"""Characters of a line of a comment, after its mark."""

_STATEMENT = 116
"""Characters of a statement, after its indentation."""


def _literal(constant: Constant) -> str:
    """A number that both types take, or one for each."""
    double, single = (Real.DOUBLE.literal(constant.of(kind)) for kind in (False, True))
    text = double if constant.single is None else f"({single} if single else {double})"
    return text.replace("e+", "e")  # as formatters write it


def _pair(sine: str, cosine: str, angle: str) -> tuple[str, ...]:
    return (f"{sine}, {cosine} = _sincos({angle})",)


def _heading(title: str) -> tuple[str, ...]:
    return "", *(f"# {line}" for line in textwrap.wrap(title, _WIDTH, break_long_words=False))


def hash_comment(text: str) -> tuple[str, ...]:
    """A comment of several lines."""
    return tuple(f"# {line}" for line in text.split("\n"))


SYNTAX = Syntax(
    language="Python",
    literal=_literal,
    define="{name} = {value}",
    store="{place} = {value}",
    sincos=_pair,
    parameter="params.{name}",
    forms=MappingProxyType(
        {
            Operator.ADD: "{0} + {1}",
            Operator.SUB: "{0} - {1}",
            Operator.MUL: "{0} * {1}",
            Operator.DIV: "{0} / {1}",
            Operator.NEG: "-{0}",
            Operator.SQRT: "_sqrt({0})",
            Operator.ATAN2: "_atan2({0}, {1})",
            Operator.SELECT_LT: "np.where({0} < {1}, {2}, {3})",
        }
    ),
    negative="{0}",
    unused="_",
    identifier=python_identifier,
    heading=_heading,
    release="del {names}",
)


_TURNED = replace(SYNTAX, forms={Operator.SELECT_LT: "np.where({1} > {0}, {2}, {3})"})


def numpy_printer(variables: Sequence[str]) -> Printer[Operator]:
    """Prints statements in NumPy.

    Args:
        variables: How each number of the inputs is written.
    """
    return Printer(SYNTAX, variables, typed, others=turned)


def turned(statement: Statement) -> Syntax[Operator]:
    """The syntax of a statement: a comparison has its constant last, as linters want it."""
    compares = statement.operator is Operator.SELECT_LT and isinstance(statement.operands[0], Constant)
    return _TURNED if compares else SYNTAX


def broken(lines: tuple[str, ...]) -> tuple[str, ...]:
    """Statements as formatters break them where they are too long: the arguments of a selection on their own line."""
    found: list[str] = []
    for line in lines:
        call, where, arguments = line.partition("np.where(")
        long = where and len(line) > _STATEMENT
        found += (f"{call}{where}", f"    {arguments.removesuffix(')')}", ")") if long else (line,)
    return tuple(found)


def typed(statement: Statement, operands: tuple[str, ...]) -> tuple[str, ...]:
    """Of two numbers that are selected NumPy would make an array of doubles, whatever it compares."""
    chosen = statement.operands[2:]
    if not chosen or not all(isinstance(each, Constant) for each in chosen):
        return operands
    typed = operands[isinstance(statement.operands[0], Constant)]
    return *operands[:2], *(f"{typed}.dtype.type({each})" for each in operands[2:])
