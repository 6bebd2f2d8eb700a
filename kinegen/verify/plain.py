"""The scalar C kernels compiled without contraction: the bits that every other language has to give.

In: emitted C. Out: results, one configuration after the other, through ctypes.
"""

from __future__ import annotations

import ctypes
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from kinegen.emit.kernels import Kernels
from kinegen.emit.reals import Real
from kinegen.ir.program import Program
from kinegen.naming import c_file, function
from kinegen.native.compiler import Compiler
from kinegen.verify.ways import Arrays

_FLAGS = ("-std=c99", "-O1", "-ffp-contract=off", "-fno-tree-slp-vectorize", "-shared", "-fPIC")


@dataclass(frozen=True, slots=True)
class PlainKernels:
    """Scalar kernels in double precision.

    Attributes:
        kernels: The robot and its programs.
        library: The opened library.
    """

    kernels: Kernels
    library: ctypes.CDLL

    def call(self, program: Program, inputs: Arrays, parameters: tuple[float, ...] | None = None) -> Arrays:
        """Evaluate a kernel.

        Args:
            program: Its program.
            inputs: N configurations of each input.
            parameters: Values of the runtime parameters; those of the robot file if None.

        Returns:
            N configurations of each result.
        """
        kernel = self.library[function(self.kernels.robot.name, program.quantity.function, Real.DOUBLE)]
        kernel.restype = None
        count = len(inputs[0])
        rows = [np.ascontiguousarray(array, np.float64).reshape(count, -1) for array in inputs]
        results = [np.full((count, *array.shape), -7.0) for array in program.signature.results]
        extra: list[Any] = []
        if self.kernels.defaults:
            values = tuple(map(float, self.kernels.defaults)) if parameters is None else parameters
            extra = [ctypes.byref((ctypes.c_double * len(values))(*values))]
        for index in range(count):
            given = [_pointer(array, index) for array in rows if array.size]
            kernel(*given, *extra, *(_pointer(array, index) for array in results if array.size))
        return tuple(results)


def _pointer(array: Any, index: int) -> ctypes.c_void_p:
    return ctypes.c_void_p(array.ctypes.data + index * array.strides[0])


def compile_plain(kernels: Kernels, files: Mapping[str, str], folder: Path, compiler: Compiler) -> PlainKernels:
    """Compile the emitted scalar kernels of doubles to a library of this machine.

    Args:
        kernels: The robot and its programs.
        files: The emitted files by name; those of doubles among them.
        folder: Where to compile.
        compiler: The compiler.

    Raises:
        CompileError: If the compiler refuses.
    """
    name = kernels.robot.name
    header, source = (c_file(name, suffix, Real.DOUBLE) for suffix in "hc")
    for file in (header, source):
        (folder / file).write_text(files[file], encoding="utf-8", newline="\n")
    library = folder / f"{name}_plain.so"
    compiler.run(folder, (*_FLAGS, source, "-o", library.name), source)
    return PlainKernels(kernels, ctypes.CDLL(str(library)))
