"""JavaScript: an ECMAScript module with its type declarations, for browsers, Node.js and other engines."""

from __future__ import annotations

from typing import TYPE_CHECKING

from kinegen.backends.language import Language
from kinegen.backends.scalar_types import ScalarType
from kinegen.model.outputs import Kind, Quantity

if TYPE_CHECKING:
    from kinegen.backends.bundle import RobotPrograms
    from kinegen.backends.c.test_vectors import Vectors
    from kinegen.backends.printing import Syntax
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
    from kinegen.backends.javascript.syntax import SYNTAX

    return SYNTAX


def _files(kernels: RobotPrograms, _real: str) -> dict[str, str]:
    # Here, so that the list of languages is quick to read.
    from kinegen.backends.javascript.files import emit_javascript

    return emit_javascript(kernels)


def _tests(kernels: RobotPrograms, _real: str, vectors: Vectors) -> dict[str, str]:
    from kinegen.backends.javascript.files import emit_javascript_tests

    return emit_javascript_tests(kernels, vectors)


JAVASCRIPT = Language(
    name="javascript",
    title="JavaScript",
    reals=(ScalarType.DOUBLE,),
    syntax=_syntax,
    files=_files,
    refuses=_refuses,
    tools=("node",),
    install="Node.js",
    tests=_tests,
)
