"""Renders the sine-cosine templates by themselves and compiles them."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from kinegen.backends.routines import SINCOS
from kinegen.backends.scalar_types import ScalarType
from kinegen.backends.templates import environment

COMPILERS = tuple(name for name in ("gcc", "clang") if shutil.which(name))
DTYPES = {ScalarType.DOUBLE: np.float64, ScalarType.FLOAT: np.float32}

PROBE = """
void kg_pairs(long n, const {real} *x, {real} *s, {real} *c);

void kg_pairs(long n, const {real} *x, {real} *s, {real} *c)
{{
    for (long i = 0; i < n; i++) {{
        kg_sincos(x[i], &s[i], &c[i]);
    }}
}}
"""


def source(real: ScalarType, qualifier: str = "static", prefix: str = "kg") -> str:
    """The pair alone, as C text."""
    return environment().get_template(SINCOS[real].template).render(prefix=prefix, qualifier=qualifier)


def run(command: list[str | Path]) -> str:
    """Runs a command that must succeed and say nothing on standard error."""
    done = subprocess.run(command, capture_output=True, text=True, check=False)

    assert (done.returncode, done.stderr) == (0, ""), done.stderr
    return done.stdout


@dataclass(frozen=True, slots=True)
class Pairs:
    """A compiled pair that takes arrays."""

    real: ScalarType
    library: ctypes.CDLL

    def __call__(self, x: NDArray[np.floating]) -> tuple[NDArray[np.floating], NDArray[np.floating]]:
        """Sines and cosines of x."""
        angles = np.ascontiguousarray(x, dtype=DTYPES[self.real])
        sines, cosines = np.empty_like(angles), np.empty_like(angles)
        pointers = [array.ctypes.data_as(ctypes.c_void_p) for array in (angles, sines, cosines)]
        self.library.kg_pairs(ctypes.c_long(angles.size), *pointers)
        return sines, cosines


def compile_pairs(folder: Path, real: ScalarType, compiler: str, *flags: str) -> Pairs:
    """Compiles the pair into a shared library and opens it."""
    folder.mkdir(exist_ok=True)
    code, library = folder / "pairs.c", folder / "pairs.so"
    code.write_text(source(real) + PROBE.format(real=real), encoding="utf-8")
    run([compiler, "-std=c99", "-shared", "-fPIC", *flags, code, "-o", library])
    return Pairs(real, ctypes.CDLL(str(library)))
