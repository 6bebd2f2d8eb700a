"""How the body of a function is written in Rust.

Its operators round each result once and nothing is contracted: the same bits as C compiled without contraction.
"""

from __future__ import annotations

import textwrap
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from functools import partial
from types import MappingProxyType

from kinegen.emit.c.truths import is_truth
from kinegen.emit.functions import LINE
from kinegen.emit.printing import Syntax
from kinegen.emit.reals import Real
from kinegen.ir.program import Constant, Operator, Statement

NUMBER = MappingProxyType({Real.DOUBLE: "f64", Real.FLOAT: "f32"})
"""The number types as Rust names them."""


BOTH = "{0} & {1}"
"""The product of two truth values."""


def literal(real: Real, value: Fraction | float) -> str:
    """A number without a suffix; its type follows from where it is written."""
    return real.literal(Fraction(value)).removesuffix("F")


def rust_syntax(real: Real) -> Syntax[Operator]:
    """The syntax of Rust for one number type."""
    return Syntax(
        language="Rust",
        literal=partial(_literal, real),
        define="let {name} = {value};",
        store="{place} = {value};",
        sincos=_pair,
        parameter="params.{name}",
        forms=MappingProxyType(
            {
                Operator.ADD: "{0} + {1}",
                Operator.SUB: "{0} - {1}",
                Operator.MUL: "{0} * {1}",
                Operator.DIV: "{0} / {1}",
                Operator.NEG: "-{0}",
                Operator.SQRT: "sqrt({0})",
                Operator.ATAN2: "atan2({0}, {1})",
                Operator.SELECT_LT: "select({0}, {1}, {2}, {3})",
            }
        ),
        negative="{0}",
        unused="_",
        heading=_heading,
    )


def truth_syntax(truths: frozenset[str], syntax: Syntax[Operator]) -> Callable[[Statement], Syntax[Operator]]:
    """How statements are written: a product of two truth values is true where both are.

    Args:
        truths: The temporaries that are truth values.
        syntax: The syntax of numbers.
    """
    of_truths = replace(syntax, forms=MappingProxyType({**syntax.forms, Operator.MUL: BOTH}))
    return lambda statement: of_truths if statement.results[0] in truths else syntax


def truth_operands(truths: frozenset[str], statement: Statement, operands: tuple[str, ...]) -> tuple[str, ...]:
    """Operands as text, the numbers 1 and 0 in truth values as `true` and `false`."""
    if statement.results[0] not in truths:
        return operands
    compared = 2 if statement.operator is Operator.SELECT_LT else 0
    made_of = zip(statement.operands[compared:], operands[compared:], strict=True)
    named = (truth(each) if isinstance(each, Constant) and is_truth(each, truths) else text for each, text in made_of)
    return *operands[:compared], *named


def truth(constant: Constant) -> str:
    """The number 1 or 0 as a truth value."""
    return "true" if constant.value else "false"


def line_comment(text: str) -> tuple[str, ...]:
    """A comment."""
    return tuple(f"// {line}" for line in text.split("\n"))


def _literal(real: Real, constant: Constant) -> str:
    return literal(real, constant.of(real is Real.FLOAT))


def _pair(sine: str, cosine: str, angle: str) -> tuple[str, ...]:
    return (f"let ({sine}, {cosine}) = sincos({angle});",)


def _heading(title: str) -> tuple[str, ...]:
    """A blank line and a comment; nothing where there is no title."""
    if not title:
        return ()
    return "", *(f"// {line}" for line in textwrap.wrap(title, LINE - 5, break_long_words=False))
