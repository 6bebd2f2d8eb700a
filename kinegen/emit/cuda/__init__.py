"""CUDA: a header of device functions, kernels over batches, and a Python module that launches them through CuPy."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from types import MappingProxyType
from typing import TYPE_CHECKING

from kinegen.emit.cuda.reserved import BUILT_IN, RESERVED
from kinegen.emit.language import Language
from kinegen.emit.reals import Real
from kinegen.outputs import Kind, Quantity

if TYPE_CHECKING:
    from kinegen.emit.kernels import Kernels
    from kinegen.emit.printing import Syntax
    from kinegen.ir.program import Operator


def _refuses(quantity: Quantity) -> str:
    if quantity.kind in (Kind.COMPLETE_INVERSE, Kind.REDUNDANCY_RANGE, Kind.INVERSE_TRACKER):
        return "it is in C and Python alone"
    return "it is a search, and functions here have no loop" if quantity.kind is Kind.NUMERIC_INVERSE else ""


def _syntax(_real: str) -> Syntax[Operator]:
    from kinegen.emit.cuda.syntax import SYNTAX

    return SYNTAX


def _files(kernels: Kernels, _real: str) -> Mapping[str, str]:
    """The header takes both number types, and the kernels are of both."""
    return _both(kernels)


@lru_cache(maxsize=1)
def _both(kernels: Kernels) -> Mapping[str, str]:
    """The files, which are asked for once for each number type."""
    # Here, so that the list of languages is quick to read.
    from kinegen.emit.cuda.package import emit_cuda

    return MappingProxyType(emit_cuda(kernels))


CUDA = Language(
    name="cuda",
    title="CUDA",
    reals=tuple(Real),
    syntax=_syntax,
    files=_files,
    refuses=_refuses,
    tools=("g++", "clang++"),
    install="a C++ compiler (g++ 11, clang 9 or later)",
    reserved=BUILT_IN,
    reserved_robots=RESERVED,
)
