"""How the body of a function is written in C."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from fractions import Fraction
from functools import lru_cache, partial
from types import MappingProxyType

from kinegen.emit.c.constants import is_length
from kinegen.emit.functions import LINE
from kinegen.emit.printing import Printer, Revise, Syntax, as_it_is
from kinegen.emit.reals import Real
from kinegen.emit.sections import angle_names
from kinegen.ir.program import Constant, Operand, Operator, Program, Statement


def c_syntax(real: Real, sincos: str, prefix: str, *, selects_bits: bool = False) -> Syntax[Operator]:
    """The syntax of C for one number type.

    Args:
        real: The number type.
        sincos: Name of the sine-cosine function or macro.
        prefix: What the names of other functions begin with.
        selects_bits: Whether selections are calls of a function, so that loops over them become vector code.
    """
    select = f"{prefix}_select_lt({{0}}, {{1}}, {{2}}, {{3}})" if selects_bits else "({0} < {1}) ? {2} : {3}"
    return Syntax(
        language="C",
        literal=partial(_literal, real),
        define=f"const {real} {{name}} = {{value}};",
        store="{place} = {value};",
        sincos=partial(_pair, real, sincos),
        parameter="params->{name}",
        forms=MappingProxyType(
            {
                Operator.ADD: "{0} + {1}",
                Operator.SUB: "{0} - {1}",
                Operator.MUL: "{0} * {1}",
                Operator.DIV: "{0} / {1}",
                Operator.NEG: "-{0}",
                Operator.SQRT: f"{prefix}_sqrt({{0}})",
                Operator.ATAN2: f"{prefix}_atan2({{0}}, {{1}})",
                Operator.SELECT_LT: select,
            }
        ),
        heading=_heading,
    )


def named_lengths(program: Program, constants: Mapping[Fraction, str]) -> Revise:
    """Prints the lengths of the table by their names.

    Args:
        program: The program that is printed.
        constants: The names by value.
    """
    if not constants:
        return as_it_is
    angles = angle_names(program.statements)

    def revise(statement: Statement, operands: tuple[str, ...]) -> tuple[str, ...]:
        if not is_length(statement, angles):
            return operands
        return tuple(_named(*each, constants) for each in zip(statement.operands, operands, strict=True))

    return revise


def c_printer(
    real: Real, sincos: str, variables: Sequence[str], prefix: str, *, selects_bits: bool = False
) -> Printer[Operator]:
    """Prints statements in the syntax of C; see `c_syntax`.

    Args:
        real: The number type.
        sincos: Name of the sine-cosine function or macro.
        variables: How each number of the inputs is written.
        prefix: What the names of other functions begin with.
        selects_bits: Whether selections are calls of a function.
    """
    return Printer(c_syntax(real, sincos, prefix, selects_bits=selects_bits), variables)


def _named(operand: Operand, text: str, constants: Mapping[Fraction, str]) -> str:
    """One operand, a length of the table by its name."""
    if not isinstance(operand, Constant) or operand.single is not None or abs(operand.value) not in constants:
        return text
    return f"{'-' if operand.value < 0 else ''}{constants[abs(operand.value)]}"


@lru_cache(maxsize=4096)
def _literal(real: Real, constant: Constant) -> str:
    return real.literal(constant.of(real is Real.FLOAT))


def _pair(real: Real, function: str, sine: str, cosine: str, angle: str) -> tuple[str, ...]:
    return f"{real} {sine};", f"{real} {cosine};", f"{function}({angle}, &{sine}, &{cosine});"


def _heading(title: str) -> tuple[str, ...]:
    """A blank line and a comment; nothing where there is no title."""
    if not title:
        return ()
    first, *others = textwrap.wrap(title, LINE - 5, break_long_words=False)
    lines = [f"/* {first}", *(f" * {line}" for line in others)]
    return "", *lines[:-1], f"{lines[-1]} */"
