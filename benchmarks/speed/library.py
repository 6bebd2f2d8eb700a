"""C text to a function: compiled with given flags into a shared library, called through ctypes."""

from __future__ import annotations

import ctypes
import platform
import re
import sys
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from benchmarks.speed.arm import Array
from benchmarks.speed.clock import Repeated
from kinegen.backends.scalar_types import ScalarType
from kinegen.runtime.compiler import Compiler, find_compiler
from kinegen.runtime.flags import Flags
from kinegen.support.naming import c_file, function

LIBM_FLAGS = ("-O3", "-march=native")
"""How the loops that people write by hand are compiled."""

TILED_FLAGS = ("-Ofast", "-march=native")
"""How the loops that people vectorise by hand are compiled: gcc then calls libmvec for sines and cosines."""

LAYOUTS = {"4x4": 0, "3x4": 1, "joint-major": 2}
"""The layouts of a result, as the batch kernels number them."""

Run = Callable[[], object]

# Calls are repeated from C, in a file of its own so that none is left out: a call from Python takes longer than some
# hundred poses.
_REPEATED_LOOP = """
#include <stddef.h>

void loop(size_t n, const {real} *q, {real} *out);

void repeat(size_t times, size_t n, const {real} *q, {real} *out);

void repeat(size_t times, size_t n, const {real} *q, {real} *out)
{{
    for (size_t i = 0; i < times; i++) {{
        loop(n, q, out);
    }}
}}
"""

_REPEATED_KERNEL = """
#include "{header}"

void repeat(size_t times, size_t n, const {real} *q, ptrdiff_t pose, ptrdiff_t joint, {real} *t, ptrdiff_t stride,
    int layout)
{{
    for (size_t i = 0; i < times; i++) {{
        {function}(n, q, pose, joint, t, stride, layout);
    }}
}}
"""


@dataclass(frozen=True, slots=True)
class Build:
    """A way of compiling.

    Attributes:
        label: What the rows of a table call it.
        compiler: The compiler.
        flags: Its flags.
    """

    label: str
    compiler: Compiler
    flags: tuple[str, ...]

    @property
    def version(self) -> str:
        """Name and number of the compiler, which may be installed as cc."""
        told = self.compiler.version
        number = re.search(r"\d+\.\d+\.\d+", told.partition("\n")[0])
        name = "clang" if "clang" in told else "gcc" if "Free Software" in told else self.compiler.command[0]
        return f"{name} {number[0]}" if number else name

    def library(self, sources: Mapping[str, str]) -> ctypes.CDLL:
        """Compile C files and load the result.

        Args:
            sources: C text by file name.

        Returns:
            The library, already gone from the disk.
        """
        return _library(self.compiler, self.flags, tuple(sources.items()))


def default_build() -> Build:
    """How the package is compiled, and with it the floor."""
    return kernel_build("kernel", find_compiler(), Flags())


def kernel_build(name: str, compiler: Compiler, flags: Flags) -> Build:
    """A build with the flags that a package's batch kernels are compiled with."""
    return Build(name, compiler, (*flags.arguments(batch=True), *compiler.scheduling))


def libm_build() -> Build:
    """How the loops with libm are compiled."""
    return Build("libm", find_compiler(), LIBM_FLAGS)


def tiled_build() -> Build:
    """How the loops that are vectorised by hand are compiled."""
    return Build("libmvec", find_compiler(), TILED_FLAGS)


def loop(build: Build, text: str, q: Array, out: Array, count: int) -> Run:
    """A call of the `loop` of one C file.

    Args:
        build: How it is compiled.
        text: The file.
        q: Joint values.
        out: Room for the results.
        count: Its n.

    Returns:
        A function without arguments; it keeps the arrays alive, and repeats the call from C.
    """
    real = "double" if q.itemsize == 8 else "float"
    call = build.library({"loop.c": text, "repeat.c": _REPEATED_LOOP.format(real=real)}).repeat
    call.argtypes, call.restype = (ctypes.c_size_t, ctypes.c_size_t, ctypes.c_void_p, ctypes.c_void_p), None

    return Repeated(call, (count, *_addresses(q, out)))


def kernel(library: ctypes.CDLL, layout: str, q: Array, out: Array) -> Run:
    """A call of a batch kernel.

    Args:
        library: Holds the kernel.
        layout: One of `LAYOUTS`.
        q: Joint values (N, dof), or (dof, N) for the joint-major layout; contiguous.
        out: Room for the result.

    Returns:
        A function without arguments; it keeps the arrays alive, and repeats the call from C.
    """
    call = library.repeat
    size, pointer, stride = ctypes.c_size_t, ctypes.c_void_p, ctypes.c_ssize_t
    call.argtypes, call.restype = (size, size, pointer, stride, stride, pointer, stride, ctypes.c_int), None
    number = LAYOUTS[layout]
    count = q.shape[1] if number == 2 else q.shape[0]
    steps = (1, count) if number == 2 else (q.shape[1], 1)
    stride_out = (16, 12, count)[number]

    address_q, address_out = _addresses(q, out)
    return Repeated(call, (count, address_q, *steps, address_out, stride_out, number))


def kernel_library(build: Build, sources: Mapping[str, str], robot: str, real: ScalarType) -> ctypes.CDLL:
    """Compile the batch kernels alone, as the package has them."""
    names = (c_file(robot, "h", real), *(c_file(robot, kind, real, batch=True) for kind in "hc"))
    repeat = _REPEATED_KERNEL.format(header=names[1], real=real, function=function(robot, "fk", real, batch=True))
    return build.library({name: sources[name] for name in names} | {"repeat.c": repeat})


@cache
def _library(compiler: Compiler, flags: tuple[str, ...], sources: tuple[tuple[str, str], ...]) -> ctypes.CDLL:
    with tempfile.TemporaryDirectory(prefix="kinegen-bench-") as place:
        folder = Path(place)
        for name, text in sources:
            (folder / name).write_text(text, encoding="utf-8")
        names = tuple(name for name, _ in sources if name.endswith(".c"))
        compiler.run(folder, (*flags, "-fPIC", "-c", *names), ", ".join(names))
        # Linked with -Ofast, the library would turn subnormal numbers to zero in the whole process.
        objects = tuple(f"{name.removesuffix('.c')}.o" for name in names)
        vectors = ("-lmvec",) if sys.platform == "linux" and platform.machine() == "x86_64" else ()
        compiler.run(folder, ("-shared", "-o", "library.so", *objects, *vectors, "-lm"), "library.so")
        return ctypes.CDLL(str(folder / "library.so"))


def _addresses(*arrays: Array) -> list[ctypes.c_void_p]:
    """Where arrays begin; each pointer keeps its array alive."""
    return [array.ctypes.data_as(ctypes.c_void_p) for array in arrays]
