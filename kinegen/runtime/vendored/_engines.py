"""What evaluates the kernels of a robot: the compiled extension where it loads, and the NumPy form elsewhere."""

from __future__ import annotations

import importlib
import importlib.util
import itertools
import math
import os
import struct
import sys
import warnings
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.floating[Any]]

PACKAGE = (__package__ or "").rpartition(".")[0]
"""Name of the robot's package, in whose folder this one is."""

_SLOWER = "about 50 times slower than C"
_LARGE = 1 << 24  # bytes of a result whose memory is worth being used again


class Array(NamedTuple):
    """One input or result of a kernel, for one configuration.

    Attributes:
        name: Its name.
        shape: Its shape.
        is_pose: Whether it holds 4x4 poses.
        is_truth: Whether it holds Booleans.
    """

    name: str
    shape: tuple[int, ...]
    is_pose: bool = False
    is_truth: bool = False

    def dtype(self, real: np.dtype[Any]) -> np.dtype[Any]:
        """Type of its entries, where numbers have the type `real`."""
        return np.dtype(np.bool_) if self.is_truth else real

    @property
    def size(self) -> int:
        """Numbers that are computed or read: of each 4x4 matrix the upper three rows."""
        return math.prod(self.shape) * 3 // 4 if self.is_pose else math.prod(self.shape)

    def laid_out(self, layout: str) -> tuple[int, ...]:
        """Its shape in a layout, without the axes of the batch."""
        if layout == "joint_major":
            return (self.size,)
        return (*self.shape[:-2], 3, 4) if layout == "3x4" and self.is_pose else self.shape


def real_array(name: str, label: str, values: ArrayLike) -> NDArray[Any]:
    """What a kernel is given, as an array of plain real numbers.

    Args:
        name: Who asks, for the message.
        label: What it is called there.
        values: Numbers in any form that NumPy takes.

    Raises:
        TypeError: If they are other things than real numbers, or masked.
        ValueError: If they are lists of different lengths.
    """
    try:
        array = np.asarray(values)
    except ValueError:
        raise ValueError(f"{name}: {label} holds lists of different lengths, expected an array of numbers") from None
    if isinstance(values, np.ma.MaskedArray):
        raise TypeError(f"{name}: {label} is a masked array, expected plain real numbers")
    if array.dtype.kind not in "fiub":
        kind = "strings" if array.dtype.kind in "US" else f"entries of type {array.dtype}"
        raise TypeError(f"{name}: {label} has {kind}, expected plain real numbers")
    return array


class Compiled:
    """Calls the extension. Its `..._arrays` take the addresses of array objects and return 0 for what they decline."""

    name, block = "c", 1 << 15

    def __init__(
        self, native: Any, symbol: str, name: str, reals: Sequence[np.dtype[Any]], results: Sequence[Array]
    ) -> None:
        self._ffi, self.variant = native.ffi, native.ffi.string(native.lib.kinegen_variant()).decode()
        self._arrays = getattr(native.lib, f"{symbol}_{name}_arrays")
        self._results, self._empty_large = results, getattr(native, "empty_large", None)
        prefixes = {real: symbol if real == np.float64 else f"{symbol}_f32" for real in reals}
        self._pointers = {real: getattr(native.lib, f"{prefix}_{name}_pointers") for real, prefix in prefixes.items()}
        self._structs = {real: f"{prefix}_params *" for real, prefix in prefixes.items()}
        self._latest: tuple[Any, dict[np.dtype[Any], Any], Callable[..., int] | None] = (None, {}, self._arrays)
        self._lib, self._scalar = native.lib, f"{prefixes[reals[0]]}_{name}"

    def _prepared(self, params: Any) -> tuple[Any, dict[np.dtype[Any], Any], Callable[..., int] | None]:
        """The parameters, their C structs, and the function with these filled in; remembered for the next call.

        Parameters that are arrays have neither, and neither have those that are not plain numbers.
        """
        latest = self._latest
        if latest[0] is not params:
            if not all(isinstance(value, (float, int)) for value in params):
                return params, {}, None
            structs = {real: self._ffi.new(struct, list(params)) for real, struct in self._structs.items()}
            # No array of parameters, but one set of them for all configurations.
            self._latest = latest = (params, structs, partial(self._arrays, *structs.values(), 0))
        return latest

    def direct(self, params: Any) -> Callable[..., int] | None:
        """The function that small plain arrays may be given to at once; None for parameters that are arrays."""
        return self._prepared(params)[2]

    def structs(self, params: Any) -> dict[np.dtype[Any], Any]:
        """The parameters as C structs, by number type; none where there are no parameters."""
        return self._prepared(params)[1]

    @property
    def address(self) -> int:
        """The address of the C function for one configuration, of the package's first number type."""
        if not hasattr(self._ffi, "addressof"):
            raise AttributeError("address needs cffi, which is not installed (pip install cffi)")
        return int(self._ffi.cast("uintptr_t", self._ffi.addressof(self._lib, self._scalar)))

    def empty(self, shape: tuple[int, ...], dtype: np.dtype[Any]) -> Floats:
        """Memory for a result; that of large ones is used again when they are gone."""
        if self._empty_large is None or math.prod(shape) * dtype.itemsize < _LARGE:
            return np.empty(shape, dtype)
        found: Floats = self._empty_large(np.empty, shape, dtype)
        return found

    def bind(self, arrays: Sequence[Floats], params: Any) -> Callable[[], object]:
        """The scalar kernel with its pointers filled in, inputs first."""
        real = arrays[0].dtype
        items = {np.dtype(np.float64): "double[]", np.dtype(np.float32): "float[]", np.dtype(np.bool_): "uint8_t[]"}
        structs = self._prepared(params)[1]
        buffers = (self._ffi.from_buffer(items[array.dtype], array) for array in arrays)
        return partial(self._pointers[real], *((structs[real],) if structs else ()), *buffers)

    def fill(
        self, params: Any, real: np.dtype[Any], code: int, varied: int, _lead: int, arrays: Sequence[Floats]
    ) -> None:
        """Evaluate one block; the first `lead` axes of each array count configurations.

        Inputs come first, then the values of `varied` parameters if these are arrays, then results.
        """
        first = len(arrays) - len(self._results)
        inputs, results = arrays[: first - varied], arrays[first:]
        call = self.direct(params)
        if varied:
            # The table has to live until the call is over.
            table = table_of(arrays[first - varied : first], real)
            blank = [self._ffi.new(struct, []) for struct in self._structs.values()]
            call = partial(self._arrays, *blank, id(table))
        if call is None:
            raise RuntimeError("the parameters are neither numbers nor arrays")
        if call(*map(id, inputs), *map(id, results), code):
            return
        # Another type or stride: through copies of this block.
        points = [np.array(array, real, order="C") for array in inputs]
        kinds = [each.dtype(real) for each in self._results]
        buffers = [
            np.empty(array.shape[::-1], kind).T if code == 2 else np.empty(array.shape, kind)
            for array, kind in zip(results, kinds, strict=True)
        ]
        if not call(*map(id, points), *map(id, buffers), code):
            shapes = ", ".join(str(array.shape) for array in arrays)
            raise RuntimeError(f"the compiled kernel declined arrays of shape {shapes}")
        for array, buffer in zip(results, buffers, strict=True):
            array[...] = buffer


class Formula:
    """Calls the NumPy form."""

    name, variant, block = "numpy", "", 1 << 12
    address = None

    def __init__(self, formula: Callable[..., Sequence[Any]], results: Sequence[Array]) -> None:
        self._formula, self._results = formula, results

    def direct(self, params: Any) -> None:
        """There is no short cut."""

    def empty(self, shape: tuple[int, ...], dtype: np.dtype[Any]) -> Floats:
        """Memory for a result."""
        return np.empty(shape, dtype)

    def structs(self, _params: Any) -> dict[np.dtype[Any], Any]:
        """There are none."""
        return {}

    def fill(
        self, params: Any, real: np.dtype[Any], code: int, varied: int, lead: int, arrays: Sequence[Floats]
    ) -> None:
        """Evaluate one block; the first `lead` axes of each array count configurations.

        Inputs come first, then the values of `varied` parameters if these are arrays, then results.
        """
        shape = arrays[0].shape[:lead]
        first = len(arrays) - len(self._results)
        points = [self._numbers(array, lead, real) for array in arrays[: first - varied]]
        if varied:
            params = params._make(array.reshape(-1) for array in arrays[first - varied : first])
        rows = iter(self._formula(*points, *(() if params is None else (params,))))
        for result, array in zip(self._results, arrays[first:], strict=True):
            # Without the last rows of matrices, which are the same for all.
            upper = array[..., :3, :] if result.is_pose and code == 0 else array
            axes = range(upper.ndim - lead)
            by_entry = np.moveaxis(upper, range(lead, upper.ndim), axes)
            for place in itertools.product(*(range(by_entry.shape[axis]) for axis in axes)):
                row = next(rows)
                is_alike = lead == 1 or not isinstance(row, np.ndarray) or not row.ndim
                by_entry[place] = row if is_alike else row.reshape(shape)
            if upper is not array:
                array[..., 3, :] = (0.0, 0.0, 0.0, 1.0)

    def _numbers(self, array: Floats, lead: int, real: np.dtype[Any]) -> Floats:
        """The numbers of an input, one row each, of a matrix the upper three rows."""
        count = math.prod(array.shape[:lead])
        is_matrix = array.shape[lead:] == (4, 4)
        upper = array[..., :3, :] if is_matrix else array
        rows: Floats = np.ascontiguousarray(upper.reshape(count, math.prod(upper.shape[lead:])).T, real)
        return rows


def table_of(params: Sequence[NDArray[Any]], real: np.dtype[Any]) -> NDArray[Any]:
    """The parameters of each configuration in a row of its own, as an array of C structs has them.

    Args:
        params: For each parameter its values, all of one shape (...).
        real: Number type.

    Returns:
        Shape (N, parameters).
    """
    shape = params[0].shape
    table = np.empty((*shape, len(params)), real)
    if table.size:
        table[...] = [array[(0,) * array.ndim] for array in params]
    for place, array in enumerate(params):
        if any(array.strides):
            table[..., place] = array
    return table.reshape(-1, len(params))


def forget(package: dict[str, Any]) -> None:
    """Take out of Python's list what an earlier import of the package read, since it may have been built anew.

    Args:
        package: The names of the package, as it is imported again.
    """
    name = package["__name__"]
    # The new package may lack outputs of the old one.
    for each in ("__getattr__", *package.pop("__all__", ())):
        package.pop(each, None)
    for module in [each for each in sys.modules if each.startswith(f"{name}.")]:
        del sys.modules[module]
        package.pop(module[len(name) + 1 :], None)
    importlib.invalidate_caches()


def load_native(stamp: str) -> Any:
    """Load the extension that lies in the robot's package.

    A portable one serves the processor as well as it can; the environment may name a variant as KINEGEN_VARIANT.

    Args:
        stamp: Digest of the C sources that belong to the package.

    Returns:
        The cffi module, or the same by ctypes where cffi is not installed; None where NumPy has to serve. A warning
        then says why.
    """
    path = Path(__file__).parent.with_name("_native.abi3.so")
    try:
        if path.exists():
            return _load(path, stamp)
        reason = f"there is no {path.name} here; `kinegen build` with a C compiler makes it"
    except (ImportError, OSError, AttributeError) as error:
        reason = f"{path.name} is not used: {str(error).partition(chr(10))[0]}"
    warnings.warn(f"NumPy evaluates {path.parent.name}, {_SLOWER}: {reason}", RuntimeWarning, stacklevel=3)
    return None


def _load(path: Path, stamp: str) -> Any:
    # A 64-bit ELF file ends where its header says; the loader would crash on a shorter one.
    with path.open("rb") as file:
        sections, size, count = struct.unpack("<40xQ10xHH2x", (header := file.read(64)).ljust(64))
    if header[:6] == b"\x7fELF\x02\x01" and sections + size * count > path.stat().st_size:
        raise ImportError("the file is cut short")
    # The extension reads the headers of arrays, whose form NumPy has kept from 1 to 2.
    if sys.implementation.name != "cpython" or int(np.__version__.partition(".")[0]) > 2:
        raise ImportError("it needs CPython and NumPy 1 or 2")
    try:
        native = importlib.import_module(f"{PACKAGE}._native")
        if _stamp(native) != stamp:
            native = _load_again(_fresh_name(path), f"{PACKAGE}._native")
    except ImportError as error:
        if "cffi" not in str(error):
            raise
        native = _without_cffi(str(path), error)
        if _stamp(native) != stamp:
            native = _without_cffi(_fresh_name(path), error)
    if _stamp(native) != stamp:
        raise ImportError("it was built from other sources")
    if not native.lib.kinegen_select(os.fsencode(wanted := os.environ.get("KINEGEN_VARIANT", ""))):
        which = f"it has no variant {wanted!r} that this processor can run"
        raise ImportError(which if wanted else "it was built for a processor with more instructions")
    return native


def _stamp(native: Any) -> str:
    """The digest of the sources that an extension was built from."""
    return str(native.ffi.string(native.lib.kinegen_stamp()).decode())


def _fresh_name(path: Path) -> str:
    """A path to the file that is there now, where Python and the system remember an earlier one by its path.

    Each version of the file gets a path of its own to the same place, with the bits of its number and time in it.
    """
    status = path.stat()
    bits = "".join("/." if bit == "1" else "//" for bit in f"{status.st_ino ^ status.st_mtime_ns:b}")
    return f"{path.parent}{bits}/{path.name}"


def _load_again(path: str, name: str) -> Any:
    """The extension at a path, instead of the one that was imported before."""
    spec: Any = importlib.util.spec_from_file_location(name, path)
    native = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(native)
    sys.modules[name] = native
    return native


def _without_cffi(path: str, missing: ImportError) -> Any:
    """The same functions through ctypes, which Python brings along but for a few builds of it."""
    try:
        plain = importlib.import_module(f"{__package__}._plain")
    except ImportError:
        raise ImportError(f"{missing} (pip install cffi)") from None
    return plain.open_library(path)
