"""Names that robots and parameters cannot have in CUDA: built-in variables and types, and what its headers declare.

Where a robot becomes a namespace, what is declared outside of std counts too, as in C++.
"""

from __future__ import annotations

from kinegen.emit.cpp.reserved import RESERVED as OF_THE_LIBRARY

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
