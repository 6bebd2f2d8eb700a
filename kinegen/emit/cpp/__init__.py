"""C++17: one header of templates over the number type, with a CMake package around it."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from types import MappingProxyType
from typing import TYPE_CHECKING

from kinegen.emit.cpp.reserved import RESERVED
from kinegen.emit.language import Language
from kinegen.emit.reals import Real
from kinegen.outputs import Kind, Quantity

if TYPE_CHECKING:
    from kinegen.emit.c.expected import Vectors
    from kinegen.emit.kernels import Kernels
    from kinegen.emit.printing import Syntax
    from kinegen.ir.program import Operator


def _refuses(quantity: Quantity) -> str:
    if quantity.kind in (Kind.COMPLETE_INVERSE, Kind.REDUNDANCY_RANGE, Kind.INVERSE_TRACKER):
        return f"C++ calls that of C, in NAME_{quantity.kind}.h"
    return "it is a search; C++ calls that of C, see docs/cpp.md" if quantity.kind is Kind.NUMERIC_INVERSE else ""


def _syntax(_real: str) -> Syntax[Operator]:
    from kinegen.emit.cpp.syntax import SYNTAX

    return SYNTAX


def _files(kernels: Kernels, _real: str) -> Mapping[str, str]:
    """One header takes both number types."""
    return _both(kernels)


@lru_cache(maxsize=1)
def _both(kernels: Kernels) -> Mapping[str, str]:
    """The files, which are asked for once for each number type."""
    # Here, so that the list of languages is quick to read.
    from kinegen.emit.cpp.package import emit_cpp

    return MappingProxyType(emit_cpp(kernels))


def _tests(kernels: Kernels, real: str, vectors: Vectors) -> Mapping[str, str]:
    from kinegen.emit.cpp.vectors import emit_cpp_tests

    return emit_cpp_tests(kernels, vectors, Real(real))


CPP = Language(
    name="cpp",
    title="C++",
    reals=tuple(Real),
    syntax=_syntax,
    files=_files,
    refuses=_refuses,
    tools=("g++", "clang++"),
    install="a C++ compiler (g++ 11, clang 9 or later)",
    tests=_tests,
    reserved=frozenset({"Real"}),
    reserved_robots=RESERVED,
)
