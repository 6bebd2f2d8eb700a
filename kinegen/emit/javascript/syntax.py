"""How the body of a function is written in JavaScript.

Its numbers are doubles, and its operators round each result once, as those of C without contraction: the same bits.
"""

from __future__ import annotations

from types import MappingProxyType

from kinegen.emit.printing import Syntax, number
from kinegen.emit.reals import Real
from kinegen.ir.program import Operator

SINES, COSINES = "sines", "cosines"
"""The arrays of the module for sines and cosines; an angle waits in the place of its sine."""


def _pair(sine: str, cosine: str, angle: str) -> tuple[str, ...]:
    """One by itself; kernels take several in a call."""
    return (
        f"{SINES}[0] = {angle};",
        "sincos(1);",
        f"const {sine} = {SINES}[0];",
        f"const {cosine} = {COSINES}[0];",
    )


SYNTAX = Syntax(
    language="JavaScript",
    literal=number(Real.DOUBLE.literal),
    define="const {name} = {value};",
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
            Operator.SELECT_LT: "{0} < {1} ? {2} : {3}",
        }
    ),
)
