"""Says how the body of a function is written in Rust.

Its operators round each result once and nothing is contracted: the same bits as C compiled without contraction.
"""

from __future__ import annotations

from fractions import Fraction
from functools import partial
from types import MappingProxyType

from kinegen.backends.c.syntax import c_like, line_heading
from kinegen.backends.printing import Syntax
from kinegen.backends.routines import LINE
from kinegen.backends.scalar_types import ScalarType
from kinegen.ir.program import Constant, Operator

NUMBER = MappingProxyType({ScalarType.DOUBLE: "f64", ScalarType.FLOAT: "f32"})
"""The number types as Rust names them."""


BOTH = "{0} & {1}"
"""The product of two truth values."""


def literal(real: ScalarType, value: Fraction | float) -> str:
    """Returns a number without a suffix; its type follows from where it is written."""
    return real.literal(Fraction(value)).removesuffix("F")


def rust_syntax(real: ScalarType) -> Syntax[Operator]:
    """Returns the syntax of Rust for one number type."""
    return c_like(
        "Rust",
        {
            Operator.SQRT: "sqrt({0})",
            Operator.ATAN2: "atan2({0}, {1})",
            Operator.SELECT_LT: "select({0}, {1}, {2}, {3})",
        },
        literal=partial(_literal, real),
        define="let {name} = {value};",
        sincos=_pair,
        parameter="params.{name}",
        negative="{0}",
        unused="_",
        heading=line_heading("//", LINE - 5),
    )


def line_comment(text: str) -> tuple[str, ...]:
    """Returns a comment."""
    return tuple(f"// {line}" for line in text.split("\n"))


def _literal(real: ScalarType, constant: Constant) -> str:
    return literal(real, constant.of(real is ScalarType.FLOAT))


def _pair(sine: str, cosine: str, angle: str) -> tuple[str, ...]:
    return (f"let ({sine}, {cosine}) = sincos({angle});",)
