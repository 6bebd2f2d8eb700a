"""Renders the square root and the arc tangent by themselves and compiles them."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from kinegen.backends.scalar_types import ScalarType
from kinegen.backends.templates import environment
from tests.sincos.library import COMPILERS, DTYPES, run

__all__ = ["CALLS", "COMPILERS", "DTYPES", "Functions", "compile_functions", "run", "source"]

FORMATS = {ScalarType.DOUBLE: "f64", ScalarType.FLOAT: "f32"}
PARTS = ("registers", "bits", "sqrt", "atan2", "select", "sincos")
CALLS = {
    "sqrt": "out[i] = kg_sqrt(x[i])",
    "atan2": "out[i] = kg_atan2(x[i], y[i])",
    "select": "out[i] = kg_select_lt(x[i], y[i], y[i], x[i])",
    "sincos": "kg_sincos(x[i], &out[i], &other[i])",
}
"""What the loops below do; the selection is that of the larger number."""

LOOP = """
void kg_{name}_all(long n, const {real} *x, const {real} *y, {real} *out, {real} *other);

void kg_{name}_all(long n, const {real} *x, const {real} *y, {real} *out, {real} *other)
{{
    (void)y;
    (void)other;
    for (long i = 0; i < n; i++) {{
        {call};
    }}
}}
"""


def source(real: ScalarType, *parts: str, qualifier: str = "static") -> str:
    """Parts of what is emitted, as C text; all of them if none is named."""
    chosen = [part for part in PARTS if part in ("registers", "bits", *parts)] if parts else list(PARTS)
    texts = [
        environment().get_template(f"c/_{part}_{FORMATS[real]}.c.jinja").render(prefix="kg", qualifier=qualifier)
        for part in chosen
    ]
    return "\n".join(["#include <stdint.h>\n", *texts])


@dataclass(frozen=True, slots=True)
class Functions:
    """Compiled functions that take arrays."""

    real: ScalarType
    library: ctypes.CDLL

    def sqrt(self, x: NDArray[np.floating]) -> NDArray[np.floating]:
        """Square roots."""
        return self._call("sqrt", x, x)[0]

    def atan2(self, y: NDArray[np.floating], x: NDArray[np.floating]) -> NDArray[np.floating]:
        """Angles of points."""
        return self._call("atan2", y, x)[0]

    def larger(self, a: NDArray[np.floating], b: NDArray[np.floating]) -> NDArray[np.floating]:
        """The larger numbers, by a selection."""
        return self._call("select", a, b)[0]

    def sincos(self, angle: NDArray[np.floating]) -> tuple[NDArray[np.floating], NDArray[np.floating]]:
        """Sines and cosines."""
        return self._call("sincos", angle, angle)

    def _call(
        self, name: str, x: NDArray[np.floating], y: NDArray[np.floating]
    ) -> tuple[NDArray[np.floating], NDArray[np.floating]]:
        dtype = DTYPES[self.real]
        given = [np.array(array, dtype=dtype) for array in np.broadcast_arrays(x, y)]
        found = np.empty_like(given[0]), np.empty_like(given[0])
        pointers = [array.ctypes.data_as(ctypes.c_void_p) for array in (*given, *found)]
        self.library[f"kg_{name}_all"](ctypes.c_long(given[0].size), *pointers)
        return found


def compile_functions(folder: Path, real: ScalarType, compiler: str, *flags: str) -> Functions:
    """Compile all functions into a shared library and open it."""
    folder.mkdir(exist_ok=True)
    code, library = folder / "functions.c", folder / "functions.so"
    loops = "".join(LOOP.format(name=name, real=real, call=call) for name, call in CALLS.items())
    code.write_text(source(real) + loops, encoding="utf-8")
    run([compiler, "-std=c99", "-shared", "-fPIC", *flags, code, "-o", library])
    return Functions(real, ctypes.CDLL(str(library)))
