"""CUDA: a header of device functions, kernels over batches, and a Python module that launches them through CuPy."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from kinegen.backends.cpp import RESERVED as OF_THE_LIBRARY
from kinegen.backends.language import Language
from kinegen.backends.scalar_types import ScalarType
from kinegen.model.outputs import Kind, Quantity

if TYPE_CHECKING:
    from kinegen.backends.bundle import RobotPrograms
    from kinegen.backends.printing import Syntax
    from kinegen.ir.program import Operator

BUILT_IN = frozenset(
    {"Real", *"threadIdx blockIdx blockDim gridDim warpSize dim3 clusterDim clusterIdx".split()},
)
"""Of parameters too: built-in variables, some of which are macros elsewhere, and the type of the templates."""

_VECTORS = (
    f"{kind}{size}"
    for kind in "char uchar short ushort int uint long ulong longlong ulonglong float double".split()
    for size in (1, 2, 3, 4)
)

_FUNCTIONS = """
    abs all any assert atomicAdd ballot clock clock64 cospi cospif cyl_bessel_i0 erfcinv erfcx erfinv frexp half half2
    llabs max min norm norm3d norm4d normcdf normcdfinv rcbrt rhypot rnorm rnorm3d rnorm4d rsqrt rsqrtf saturate
    sincospi sinpi sinpif surf1Dread tex1D tex2D tex3D texture surface trap umax umin umul24 mul24
""".split()

RESERVED = frozenset(
    {"cuda", "cub", "cupy", "thrust", "nv", "nvcuda", "cooperative_groups", *_VECTORS, *_FUNCTIONS, *OF_THE_LIBRARY}
)
"""Names of the libraries that come with CUDA, of its vector types, and of its functions and those of C."""


def _refuses(quantity: Quantity) -> str:
    if quantity.kind in (Kind.COMPLETE_INVERSE, Kind.REDUNDANCY_RANGE, Kind.INVERSE_TRACKER):
        return "it is in C and Python alone"
    return "it is a search, and functions here have no loop" if quantity.kind is Kind.NUMERIC_INVERSE else ""


def _syntax(_real: str) -> Syntax[Operator]:
    from kinegen.backends.cuda.files import SYNTAX

    return SYNTAX


def _files(kernels: RobotPrograms, _real: str) -> Mapping[str, str]:
    # Here, so that the list of languages is quick to read.
    from kinegen.backends.cuda.files import emit_cuda

    return emit_cuda(kernels)


CUDA = Language(
    name="cuda",
    title="CUDA",
    reals=tuple(ScalarType),
    syntax=_syntax,
    files=_files,
    refuses=_refuses,
    tools=("g++", "clang++"),
    install="a C++ compiler (g++ 11, clang 9 or later)",
    reserved=BUILT_IN,
    reserved_robots=RESERVED,
)
