"""JavaScript: an ECMAScript module with its type declarations, for browsers, Node.js and other engines."""

from __future__ import annotations

from typing import TYPE_CHECKING

from kinegen.emit.language import Language
from kinegen.emit.reals import Real
from kinegen.outputs import Kind, Quantity

if TYPE_CHECKING:
    from kinegen.emit.c.expected import Vectors
    from kinegen.emit.kernels import Kernels
    from kinegen.emit.printing import Syntax
    from kinegen.ir.program import Operator


def _refuses(quantity: Quantity) -> str:
    if quantity.kind is Kind.REDUNDANCY_RANGE:
        return "it is in C and Python alone"
    if quantity.kind is Kind.COMPLETE_INVERSE:
        return "it computes eigenvalues in loops, and functions here have none"
    if quantity.kind is Kind.INVERSE_TRACKER:
        return "it is in C and Python alone"
    return "it is a search, and functions here have no loop" if quantity.kind is Kind.NUMERIC_INVERSE else ""


def _syntax(_real: str) -> Syntax[Operator]:
    from kinegen.emit.javascript.syntax import SYNTAX

    return SYNTAX


def _files(kernels: Kernels, _real: str) -> dict[str, str]:
    # Here, so that the list of languages is quick to read.
    from kinegen.emit.javascript.module import emit_javascript

    return emit_javascript(kernels)


def _tests(kernels: Kernels, _real: str, vectors: Vectors) -> dict[str, str]:
    from kinegen.emit.javascript.vectors import emit_javascript_tests

    return emit_javascript_tests(kernels, vectors)


JAVASCRIPT = Language(
    name="javascript",
    title="JavaScript",
    reals=(Real.DOUBLE,),
    syntax=_syntax,
    files=_files,
    refuses=_refuses,
    tools=("node",),
    install="Node.js",
    tests=_tests,
)
