"""The scalar C kernels compiled without contraction: the bits that every other language has to give.

In: emitted C. Out: results, one configuration after the other, through ctypes.
"""

from __future__ import annotations

import ctypes
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinegen.emit.kernels import Kernels
from kinegen.emit.reals import Real
from kinegen.ir.program import Program
from kinegen.naming import c_file, function, prefix
from kinegen.native.compiler import Compiler
from kinegen.verify.ways import DTYPES, Arrays

NEAREST, WITHIN, CLAMP = "inverse_nearest", "within_limits", "clamp"
"""The functions beside the kernels."""

_FLAGS = ("-std=c99", "-O1", "-ffp-contract=off", "-fno-tree-slp-vectorize", "-shared", "-fPIC")


@dataclass(frozen=True, slots=True)
class PlainKernels:
    """Scalar kernels of one number type.

    Attributes:
        kernels: The robot and its programs.
        library: The opened library.
        real: The number type.
    """

    kernels: Kernels
    library: ctypes.CDLL
    real: Real = Real.DOUBLE

    def call(self, program: Program, inputs: Arrays, parameters: tuple[float, ...] | None = None) -> Arrays:
        """Evaluate a kernel.

        Args:
            program: Its program.
            inputs: N configurations of each input.
            parameters: Values of the runtime parameters; those of the robot file if None.

        Returns:
            N configurations of each result.
        """
        count, results = len(inputs[0]), program.signature.results
        arrays = [_unset(count, each.shape, np.uint8 if each.is_truth else DTYPES[self.real]) for each in results]
        self._run(program.quantity.function, inputs, self._parameters(parameters), arrays)
        return tuple(np.asarray(array, DTYPES[self.real]) for array in arrays)

    def others(self, name: str, inputs: Arrays) -> Arrays:
        """Evaluate a function beside the kernels, with the runtime parameters of the robot file.

        Args:
            name: `NEAREST` (of poses of the tool and joint vectors), `WITHIN` or `CLAMP` (of joint vectors).
            inputs: N configurations of each input.

        Returns:
            N configurations of each result: joint vectors but for `WITHIN`, then flags but for `CLAMP`.
        """
        joints = [] if name == WITHIN else [_unset(len(inputs[0]), inputs[-1].shape[1:], DTYPES[self.real])]
        flags = self._run(name, inputs, self._parameters(None) if name == NEAREST else [], joints)
        return (*joints, *([] if name == CLAMP else [flags]))

    def _parameters(self, parameters: tuple[float, ...] | None) -> list[Any]:
        """The argument with the runtime parameters, if there are any."""
        if not self.kernels.defaults:
            return []
        values = tuple(map(float, self.kernels.defaults)) if parameters is None else parameters
        kind = ctypes.c_double if self.real is Real.DOUBLE else ctypes.c_float
        return [ctypes.byref((kind * len(values))(*values))]

    def _run(self, name: str, inputs: Arrays, parameters: list[Any], results: Sequence[NDArray[Any]]) -> NDArray[Any]:
        """Call a function for each configuration; returns what it returns."""
        kernel, count = self.library[function(self.kernels.robot.name, name, self.real)], len(inputs[0])
        rows = [np.ascontiguousarray(array, DTYPES[self.real]).reshape(count, -1) for array in inputs]
        returned = np.zeros(count, DTYPES[self.real])
        for index in range(count):
            given = [_pointer(array, index) for array in rows if array.size]
            returned[index] = kernel(*given, *parameters, *(_pointer(array, index) for array in results if array.size))
        return returned


def _unset(count: int, shape: tuple[int, ...], dtype: Any) -> NDArray[Any]:
    """Memory for a result, with what no kernel gives."""
    return np.full((count, *shape), 7 if dtype == np.uint8 else -7, dtype)


def _pointer(array: Any, index: int) -> ctypes.c_void_p:
    return ctypes.c_void_p(array.ctypes.data + index * array.strides[0])


def compile_plain(
    kernels: Kernels, files: Mapping[str, str], folder: Path, compiler: Compiler, real: Real = Real.DOUBLE
) -> PlainKernels:
    """Compile the emitted scalar kernels of one number type to a library of this machine.

    Args:
        kernels: The robot and its programs.
        files: The emitted files by name; those of the number type among them.
        folder: Where to compile.
        compiler: The compiler.
        real: The number type.

    Raises:
        CompileError: If the compiler refuses.
    """
    name = kernels.robot.name
    header, source = (c_file(name, suffix, real) for suffix in "hc")
    for file in (header, source):
        (folder / file).write_text(files[file], encoding="utf-8", newline="\n")
    library = folder / f"{prefix(name, real)}_plain.so"
    compiler.run(folder, (*_FLAGS, source, "-o", library.name), source)
    return PlainKernels(kernels, ctypes.CDLL(str(library)), real)
