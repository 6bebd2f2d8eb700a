"""How the body of a function is written in MATLAB, for rows of numbers: element by element, a column a configuration.

Its element-wise operators round each result once and nothing is contracted: the same bits as C without contraction.
"""

from __future__ import annotations

import re
import textwrap
from functools import partial
from types import MappingProxyType

from kinegen.emit.printing import Syntax
from kinegen.emit.reals import Real
from kinegen.ir.program import Constant, Operator

CLASS = MappingProxyType({Real.DOUBLE: "double", Real.FLOAT: "single"})
"""The number types as MATLAB names them."""

WIDTH = 112
"""Characters of a line of a comment, without its mark."""


def number(real: Real, text: str) -> str:
    """A number of a type, from its literal in C; a plain literal is a double."""
    return text if real is Real.DOUBLE else f"single({text.removesuffix('F')})"


def matlab_syntax(real: Real) -> Syntax[Operator]:
    """The syntax of MATLAB for one number type."""
    return Syntax(
        language="MATLAB",
        literal=partial(_literal, real),
        define="{name} = {value};",
        store="{place} = {value};",
        sincos=partial(_pair, real),
        parameter=f"{CLASS[real]}(params.{{name}})",
        forms=MappingProxyType(
            {
                Operator.ADD: "{0} + {1}",
                Operator.SUB: "{0} - {1}",
                Operator.MUL: "{0} .* {1}",
                Operator.DIV: "{0} ./ {1}",
                Operator.NEG: "-{0}",
                Operator.SQRT: "square_root({0})",
                Operator.ATAN2: f"arc_tangent_{CLASS[real]}({{0}}, {{1}})",
                Operator.SELECT_LT: "choose({0}, {1}, {2}, {3})",
            }
        ),
        unused="~",
        heading=_heading,
    )


def percent_comment(text: str) -> tuple[str, ...]:
    """A comment of several lines."""
    return tuple(f"% {line}" for line in matlab_text(text).split("\n"))


def matlab_text(text: str) -> str:
    """Words about arrays as MATLAB writes these: indices in parentheses, from 1; columns of branches."""
    found = re.sub(r"\b(q|q0|actuators|joints)\[(\d+)\]", lambda place: f"{place[1]}({int(place[2]) + 1})", text)
    found = re.sub(r"\bq\[k\]", "q(k)", found).replace(", row by row", "")
    return found.replace("then its row is arbitrary. Valid rows", "then its column is arbitrary. Valid columns")


def _literal(real: Real, constant: Constant) -> str:
    text = number(real, real.literal(constant.of(real is Real.FLOAT)))
    return f"-{text.replace('(-', '(')}" if text.startswith("single(-") else text  # signs are in front


def _pair(real: Real, sine: str, cosine: str, angle: str) -> tuple[str, ...]:
    return (f"[{sine}, {cosine}] = sincos_{CLASS[real]}({angle});",)


def _heading(title: str) -> tuple[str, ...]:
    """A blank line and a comment; nothing where there is no title."""
    if not title:
        return ()
    return "", *(f"% {line}" for line in textwrap.wrap(matlab_text(title), WIDTH, break_long_words=False))
