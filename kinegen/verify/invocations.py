"""The ways in which kernels can be called: those of a package, and scalar C without contraction."""

from __future__ import annotations

import ctypes
import sys
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.scalar_types import ScalarType
from kinegen.ir.program import Program
from kinegen.model.outputs import Quantity
from kinegen.runtime.compiler import Compiler
from kinegen.runtime.extension import runnable_variants, select_variant
from kinegen.support.dataclass import dataclass
from kinegen.support.naming import c_file, function, prefix
from kinegen.verify.isolation import GuardedRows, calling, watched
from kinegen.verify.records import NUMPY, Invocation

Floats = NDArray[np.floating[Any]]

DTYPES: dict[str, np.dtype[Any]] = {"double": np.dtype(np.float64), "float": np.dtype(np.float32)}
"""NumPy's names of the number types."""


Arrays = tuple[Floats, ...]
Call = Callable[[Arrays], Arrays]
"""From the inputs, N configurations each, to the results (N, ...)."""

BATCH = "batch"
"""The form of a call with all configurations at once; NumPy has no other, and does not say so."""


@dataclass(frozen=True, slots=True)
class KernelCall:
    """One way to call a kernel."""

    invocation: Invocation
    call: Call
    kernel: Any
    is_plain: bool  # Whether it is the usual batch, whose bits every other call must give
    select: Callable[[], object] = lambda: None  # Sees to it that calls of the kernel go the same way

    @property
    def target(self) -> str:
        """What is called, for messages."""
        return str(self.invocation)

    @property
    def is_batch(self) -> bool:
        """Whether all configurations are given in one call of C or another language."""
        return self.invocation.form == BATCH


def ways_to_call(
    package: ModuleType, quantity: Quantity, real: str, parameters: Sequence[float] | None = None
) -> tuple[KernelCall, ...]:
    """List the ways: compiled one by one, compiled as a batch (in each variant), and in NumPy.

    `parameters`: values of the runtime parameters; those of the robot file if left out. Returns all of them, or the
    last alone where the package was built without a compiler.
    """
    kernel = getattr(package, quantity.function)
    params = None if parameters is None else package.Params(*parameters)
    plain, formula = numpy_form(package, kernel, quantity), Invocation(NUMPY, real)
    watch = _watched(formula, quantity, partial(results_of, plain, params))
    in_numpy = KernelCall(formula, watch, plain, is_plain=True)
    if kernel.backend != "c":
        return (in_numpy,)
    batches = [
        KernelCall(
            batch := Invocation("C", real, BATCH, layout, variant),
            _watched(batch, quantity, partial(_in_variant, package, kernel, params, variant, layout)),
            kernel,
            is_plain=layout == "4x4",
            select=partial(select_variant, package, variant),
        )
        for variant in runnable_variants(package) or ("",)
        for layout in layouts_of(kernel)
    ]
    scalar = Invocation("C", real)
    single = _watched(scalar, quantity, partial(_one_by_one, kernel, params))
    return (KernelCall(scalar, single, kernel, is_plain=False), *batches, in_numpy)


def _watched(invocation: Invocation, quantity: Quantity, call: Call) -> Call:
    """Returns a call of which it is noted what it is, and seen that it writes results alone."""

    def noted(inputs: Arrays) -> Arrays:
        calling(f"{invocation} {quantity}")
        found: Arrays = watched(call, inputs)
        return found

    return noted


def layouts_of(kernel: Any) -> tuple[str, ...]:
    """Returns the layouts that a kernel has: without matrices among its results there is no 3x4."""
    return ("4x4", *["3x4"] * any(each.is_pose for each in kernel.results), "joint_major")


def results_of(kernel: Any, params: Any, inputs: Arrays, layout: str = "4x4") -> Arrays:
    """Returns what a kernel gives, as a tuple also where there is one result."""
    results = kernel(*inputs, params=params, layout=layout)
    return results if isinstance(results, tuple) else (results,)


def _one_by_one(kernel: Any, params: Any, inputs: Arrays) -> Arrays:
    found = [results_of(kernel, params, point) for point in zip(*inputs, strict=True)]
    return tuple(np.stack(results) for results in zip(*found, strict=True))


def _in_variant(package: ModuleType, kernel: Any, params: Any, name: str, layout: str, inputs: Arrays) -> Arrays:
    if name:
        select_variant(package, name)
    return in_layout(kernel, params, layout, inputs)


def numpy_form(package: ModuleType, kernel: Any, quantity: Quantity) -> Any:
    """Returns a kernel of a package as it would be without the compiled extension."""
    params = getattr(package, "Params", None)
    turnings = getattr(kernel, "turnings", None)
    return type(kernel)(
        quantity.function,
        module=package.__name__,
        symbol="",
        inputs=kernel.inputs,
        results=kernel.results,
        reals=tuple(str(dtype) for dtype in DTYPES.values()),
        formula=getattr(sys.modules[f"{package.__name__}._numpy"], quantity.function),
        params=params() if params else None,
        **({} if turnings is None else {"turnings": turnings, "sharings": kernel.sharings, "ends": kernel.ends}),
    )


def in_layout(kernel: Any, params: Any, layout: str, inputs: Arrays) -> Arrays:
    """Returns the results of a batch in one layout, as the default one would hold them."""
    if layout == "joint_major":
        # Rows in which the configurations are neighbours have a way of their own in C.
        rows = tuple(map(np.ascontiguousarray, in_rows(kernel, inputs)))
        results = watched(lambda given: results_of(kernel, params, given, layout), rows)
        found = tuple(result.T for result in results)
    else:
        shorter = tuple(_upper(array, each.is_pose and layout == "3x4") for each, array in zip(kernel.inputs, inputs))
        found = results_of(kernel, params, shorter, layout)
    return tuple(_whole(each, result) for each, result in zip(kernel.results, found, strict=True))


def in_rows(kernel: Any, inputs: Arrays) -> Arrays:
    """Inputs as the layout "joint_major" takes them, in their own memory."""
    return tuple(
        _upper(array, each.is_pose).reshape(len(array), each.size).T for each, array in zip(kernel.inputs, inputs)
    )


def _whole(array: Any, result: Floats) -> Floats:
    """Returns a result with the last rows of its matrices, which other layouts leave out."""
    if result.shape[1:] == array.shape:
        return result
    if not array.is_pose:
        return result.reshape(len(result), *array.shape)
    found = np.empty((len(result), *array.shape), result.dtype)
    found[..., :3, :] = result.reshape(len(result), *array.shape[:-2], 3, 4)
    found[..., 3, :] = 0, 0, 0, 1
    return found


def _upper(array: Floats, is_pose: bool) -> Floats:
    """Matrices without their last rows."""
    return array[..., :3, :] if is_pose else array


NEAREST, WITHIN, CLAMP = "inverse_nearest", "within_limits", "clamp"
"""The functions beside the kernels."""

READINGS_WITHIN, CLAMP_READINGS = "actuators_within_limits", "clamp_actuators"
"""Those of readings of actuators."""

ASK = WITHIN, READINGS_WITHIN
"""Functions that return a flag alone."""

CLAMPS = CLAMP, CLAMP_READINGS
"""Functions that return a vector alone."""

_FLAGS = ("-std=c99", "-O1", "-ffp-contract=off", "-fno-tree-slp-vectorize", "-shared", "-fPIC")


@dataclass(frozen=True, slots=True)
class PlainKernels:
    """Scalar kernels of one number type."""

    kernels: RobotPrograms
    library: ctypes.CDLL
    real: ScalarType = ScalarType.DOUBLE

    def call(self, program: Program, inputs: Arrays, parameters: tuple[float, ...] | None = None) -> Arrays:
        """Evaluate a kernel.

        `inputs`: n configurations of each input; `parameters`: values of the runtime parameters; those of the robot
        file if None. Returns n configurations of each result.
        """
        count, results = len(inputs[0]), program.signature.results
        rows = [_unset(count, each.shape, np.uint8 if each.is_truth else DTYPES[self.real]) for each in results]
        self._run(program.quantity.function, inputs, self._parameters(parameters), rows)
        return tuple(np.asarray(each.cells, DTYPES[self.real]) for each in rows)

    def others(self, name: str, inputs: Arrays) -> Arrays:
        """Evaluate a function beside the kernels, with the runtime parameters of the robot file.

        `name`: `NEAREST` (of poses of the tool and joint vectors), one of `ASK` or of `CLAMPS` (of joint vectors or
        readings of actuators); `inputs`: n configurations of each input. Returns n configurations of each result:
        vectors but for `ASK`, then flags but for `CLAMPS`.
        """
        joints: list[GuardedRows] = (
            [] if name in ASK else [_unset(len(inputs[0]), inputs[-1].shape[1:], DTYPES[self.real])]
        )
        flags = self._run(name, inputs, self._parameters(None) if name == NEAREST else [], joints)
        return (*(each.cells for each in joints), *([] if name in CLAMPS else [flags]))

    def _parameters(self, parameters: tuple[float, ...] | None) -> list[Any]:
        """Returns the argument with the runtime parameters, if there are any."""
        if not self.kernels.defaults:
            return []
        values = tuple(map(float, self.kernels.defaults)) if parameters is None else parameters
        kind = ctypes.c_double if self.real is ScalarType.DOUBLE else ctypes.c_float
        return [ctypes.byref((kind * len(values))(*values))]

    def _run(self, name: str, inputs: Arrays, parameters: list[Any], results: Sequence[GuardedRows]) -> NDArray[Any]:
        """Call a function for each configuration; returns what it returns."""
        kernel, count = self.library[function(self.kernels.robot.name, name, self.real)], len(inputs[0])
        rows = [np.ascontiguousarray(array, DTYPES[self.real]).reshape(count, -1) for array in inputs]
        returned = np.zeros(count, DTYPES[self.real])
        calling(f"C {self.real} {name}")
        for index in range(count):
            given = [_pointer(array, index) for array in rows if array.size]
            places = (_pointer(each.cells, index) for each in results if each.cells.size)
            returned[index] = kernel(*given, *parameters, *places)
        for each in results:
            each.require(self.kernels.robot.name)
        return returned


def _unset(count: int, shape: tuple[int, ...], dtype: Any) -> GuardedRows:
    """Memory for a result, with what no kernel gives."""
    rows = GuardedRows.of(count, shape, dtype, used=count)
    rows.cells[...] = 7 if dtype == np.uint8 else -7
    return rows


def _pointer(array: Any, index: int) -> ctypes.c_void_p:
    return ctypes.c_void_p(array.ctypes.data + index * array.strides[0])


def compile_plain(
    kernels: RobotPrograms,
    files: Mapping[str, str],
    folder: Path,
    compiler: Compiler,
    real: ScalarType = ScalarType.DOUBLE,
) -> PlainKernels:
    """Compile the emitted scalar kernels of one number type to a library of this machine.

    `files`: the emitted files by name; those of the number type among them. Raises `CompileError` if the compiler
    refuses.
    """
    name = kernels.robot.name
    header, source = (c_file(name, suffix, real) for suffix in "hc")
    for file in (header, source):
        (folder / file).write_text(files[file], encoding="utf-8", newline="\n")
    library = folder / f"{prefix(name, real)}_plain.so"
    compiler.run(folder, (*_FLAGS, source, "-o", library.name), source)
    return PlainKernels(kernels, ctypes.CDLL(str(library)), real)
