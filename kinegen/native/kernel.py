"""Array handling for the kernels of a robot: shapes, number types, strides, threads. It needs NumPy alone.

A `Kernel` behaves like a generalised ufunc `(n)->(4,4)`: joint values of shape (..., n) give poses of shape
(..., 4, 4). It calls C where the extension `_native` loads, and the NumPy form elsewhere; all packages share this file.

Number types: float32 and float16 give float32; other floats, integers, truth values and lists give float64. A package
built for double alone rounds its results for float32; one built for float alone always gives float32.
"""

from __future__ import annotations

import importlib
import math
import operator
import os
import struct
import sys
import threading
import warnings
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.floating[Any]]
Layout = Literal["4x4", "3x4", "joint_major"]

_LAYOUTS = ("4x4", "3x4", "joint_major")
_SHARE, _SMALL = 1 << 12, 1 << 14  # poses that are worth a thread, joint values that go to C at once
_ndarray, _empty = np.ndarray, np.empty
_pools: dict[str, ThreadPoolExecutor] = {}  # the one pool, made when first needed
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_pools.clear)  # a child has none of its parent's threads


class Kernel:
    """One output of a robot for any number of configurations.

    Its `backend` is "c" or "numpy", `variant` says which C; `dof` and `shape` describe one configuration.

    Args:
        name: Name of the output, and of this object in its module.
        module: Name of that module.
        symbol: Prefix of the C functions.
        dof: Number of joint values.
        shape: (4, 4), (tips, 4, 4), (3,) or (tips, 3).
        reals: Number types of the package: "float64", "float32" or both.
        formula: NumPy form: joint values (dof, n), then the parameters if there are any, to the rows of the result (of
            each matrix the upper 3x4 by rows), each an array of length n or a number.
        native: What `load_native` gave.
        params: The robot file's values of the runtime parameters, a named tuple; None where there are none.
        doc: Text for `help()`.
    """

    def __init__(
        self,
        name: str,
        *,
        module: str,
        symbol: str,
        dof: int,
        shape: tuple[int, ...],
        reals: tuple[str, ...],
        formula: Callable[..., Sequence[Any]],
        native: Any = None,
        params: Any = None,
        doc: str = "",
    ) -> None:
        self.__name__, self.__module__, self.__doc__ = name, module, doc
        self.dof, self.shape, self._params = dof, shape, params
        self._reals = tuple(np.dtype(real) for real in reals)
        self._engine = _Formula(formula) if native is None else _Compiled(native, symbol, name, self._reals)
        self.backend, self.variant = self._engine.name, self._engine.variant
        self._direct = self._engine.direct(params)

    def __call__(
        self, q: ArrayLike, *, params: Any = None, out: Floats | None = None, threads: int = 1, layout: Layout = "4x4"
    ) -> Floats:
        """Evaluate one configuration or a batch.

        Args:
            q: Joint values, shape (..., dof); for the layout "joint_major" (dof, N).
            params: Values of the runtime parameters; by default those of the robot file.
            out: Array for the result, of its exact shape and type, sharing no memory with `q`.
            threads: Number of threads that share a batch; 0 for all cores.
            layout: "4x4": (..., 4, 4). "3x4": the same without the last row. "joint_major": (12, N), one row for each
                entry of the 3x4 matrix.

        Returns:
            The result; `out` where it was given.
        """
        # Small plain arrays are one C call, which reads their headers itself and declines whatever is not plain.
        direct = self._direct if params is None else self._engine.direct(self._named(params))
        if direct is not None and type(q) is _ndarray and threads == 1 and layout == "4x4":
            if out is None and q.size < _SMALL:
                result: Floats = _empty(self.shape if q.ndim == 1 else q.shape[:-1] + self.shape, q.dtype)
                if direct(id(q), id(result), 0):
                    return result
            elif type(out) is _ndarray and direct(id(q), id(out), 0):
                return out
        return self._evaluate(q, self._named(params), out, threads, layout)

    def bind(self, q: Floats, out: Floats, *, params: Any = None, layout: Layout = "4x4") -> Callable[[], object]:
        """Look everything up once: each call of the result reads `q` anew and writes `out`, and keeps both alive.

        Args:
            q: Joint values as for a call, an array of a type that the package was built for.
            out: Array for the result.
            params: As for a call.
            layout: As for a call.

        Returns:
            A function without arguments; for one contiguous configuration it is the C function itself.
        """
        if self._input(q, layout).dtype not in self._reals or not isinstance(q, np.ndarray):
            raise TypeError(f"{self.__name__}: bind needs q as an array of {' or '.join(map(str, self._reals))}")
        self._checked(out, self._result_shape(q, layout), q.dtype, q)
        plain = all(array.flags.c_contiguous and array.flags.aligned for array in (q, out))
        if isinstance(self._engine, _Compiled) and plain and q.ndim == 1 and layout == "4x4":
            return self._engine.bind(q, out, self._named(params))
        return partial(self, q, params=params, out=out, layout=layout)

    def __reduce__(self) -> str:
        return self.__name__  # pickled by reference, as functions are

    def __repr__(self) -> str:
        backend = f"{self.backend} ({self.variant})" if self.variant else self.backend
        return f"<{self.__module__}.{self.__name__}: {self.dof} joint values to {self.shape}, backend {backend}>"

    def _evaluate(self, q: ArrayLike, params: Any, out: Floats | None, threads: int, layout: str) -> Floats:
        array, workers = self._input(q, layout), _workers(threads)
        shape, dtype = self._result_shape(array, layout), self._result_type(array.dtype)
        out = np.empty(shape, dtype) if out is None else self._checked(out, shape, dtype, array)
        # From here on the poses are the leading axes, in the joint-major layout too.
        points, target = (array.T, out.T) if layout == "joint_major" else (array, out)
        count = math.prod(points.shape[:-1])
        if count:
            # Equal blocks, a multiple of the workers: memory stays flat, and Ctrl-C gets through in between.
            workers = min(workers, -(-count // _SHARE))
            blocks = workers * -(-count // (self._engine.block * workers))
            real = dtype if dtype in self._reals else self._reals[0]
            fill = partial(self._engine.fill, params, real, _LAYOUTS.index(layout))
            _spread(fill, _blocks(points, target, -(-count // blocks)), workers)
        return out

    def _named(self, params: Any) -> Any:
        if params is not None and type(params) is not type(self._params):
            expected = "none" if self._params is None else type(self._params).__qualname__
            raise TypeError(f"{self.__name__}: params is of type {type(params).__qualname__}, expected {expected}")
        return self._params if params is None else params

    def _input(self, q: ArrayLike, layout: str) -> NDArray[Any]:
        array = np.asarray(q)
        if array.dtype.kind not in "fiub" or isinstance(q, np.ma.MaskedArray):
            raise TypeError(f"{self.__name__}: q is a {type(q).__name__} of {array.dtype}, expected plain real numbers")
        joint_major = layout == "joint_major"
        if array.shape[-1:] != (self.dof,) if not joint_major else array.ndim != 2 or array.shape[0] != self.dof:
            expected = f"({self.dof}, N)" if joint_major else f"(..., {self.dof})"
            raise ValueError(f"{self.__name__}: q has shape {array.shape}, expected {expected}")
        return array

    def _result_type(self, dtype: np.dtype[Any]) -> np.dtype[Any]:
        single = np.dtype(np.float32)
        return single if self._reals == (single,) or (dtype.kind == "f" and dtype.itemsize <= 4) else np.dtype(float)

    def _result_shape(self, q: NDArray[Any], layout: str) -> tuple[int, ...]:
        poses = self.shape[-2:] == (4, 4)
        if layout == "joint_major":
            return (math.prod(self.shape) * 3 // 4 if poses else math.prod(self.shape), q.shape[1])
        if layout == "4x4":
            return q.shape[:-1] + self.shape
        if layout == "3x4" and poses:
            return (*q.shape[:-1], *self.shape[:-2], 3, 4)
        raise ValueError(f"{self.__name__}: no layout {layout!r} (there are {_LAYOUTS if poses else _LAYOUTS[::2]})")

    def _checked(self, out: Floats, shape: tuple[int, ...], dtype: np.dtype[Any], q: NDArray[Any]) -> Floats:
        if isinstance(out, np.ma.MaskedArray) or not isinstance(out, np.ndarray):
            raise TypeError(f"{self.__name__}: out is a {type(out).__name__}, expected a plain NumPy array")
        if out.shape != shape:
            raise ValueError(f"{self.__name__}: out has shape {out.shape}, expected {shape} for q of shape {q.shape}")
        if out.dtype != dtype:
            raise TypeError(f"{self.__name__}: out is of type {out.dtype}, expected {dtype}")
        if not out.flags.writeable:
            raise ValueError(f"{self.__name__}: out is read-only")
        if _overlap(q, out):
            raise ValueError(f"{self.__name__}: out shares memory with q")
        return out


class _Compiled:
    """Calls the extension. Its `..._arrays` take the addresses of array objects and return 0 for what they decline."""

    name, block = "c", 1 << 15

    def __init__(self, native: Any, symbol: str, name: str, reals: Sequence[np.dtype[Any]]) -> None:
        self._ffi, self.variant = native.ffi, native.ffi.string(native.lib.kinegen_variant()).decode()
        self._arrays = getattr(native.lib, f"{symbol}_{name}_arrays")
        prefixes = {real: symbol if real == np.float64 else f"{symbol}_f32" for real in reals}
        self._pointers = {real: getattr(native.lib, f"{prefix}_{name}_pointers") for real, prefix in prefixes.items()}
        self._structs = {real: f"{prefix}_params *" for real, prefix in prefixes.items()}
        self._latest: tuple[Any, dict[np.dtype[Any], Any], Callable[..., int]] = (None, {}, self._arrays)

    def _prepared(self, params: Any) -> tuple[Any, dict[np.dtype[Any], Any], Callable[..., int]]:
        """The parameters, their C structs, and the function with these filled in; remembered for the next call."""
        latest = self._latest
        if latest[0] is not params:
            structs = {real: self._ffi.new(struct, list(params)) for real, struct in self._structs.items()}
            self._latest = latest = (params, structs, partial(self._arrays, *structs.values()))
        return latest

    def direct(self, params: Any) -> Callable[..., int]:
        return self._prepared(params)[2]

    def bind(self, q: Floats, out: Floats, params: Any) -> Callable[[], object]:
        items = "double[]" if q.dtype == np.float64 else "float[]"
        structs = self._prepared(params)[1]
        arrays = self._ffi.from_buffer(items, q), self._ffi.from_buffer(items, out)
        return partial(self._pointers[q.dtype], *((structs[q.dtype],) if structs else ()), *arrays)

    def fill(self, params: Any, real: np.dtype[Any], code: int, q: NDArray[Any], out: Floats) -> None:
        call = self.direct(params)
        if not call(id(q), id(out), code):
            # Another type or stride: through copies of this block.
            points = np.array(q, real, order="C")
            buffer = np.empty(out.shape[::-1], real).T if code == 2 else np.empty(out.shape, real)
            if not call(id(points), id(buffer), code):
                raise RuntimeError(f"the compiled kernel declined shapes {q.shape} and {out.shape}")
            out[...] = buffer


class _Formula:
    """Calls the NumPy form."""

    name, variant, block = "numpy", "", 1 << 12

    def __init__(self, formula: Callable[..., Sequence[Any]]) -> None:
        self._formula = formula

    def direct(self, params: Any) -> None:
        """There is no short cut."""

    def fill(self, params: Any, real: np.dtype[Any], code: int, q: NDArray[Any], out: Floats) -> None:
        lead, tail = q.shape[:-1], out.shape[q.ndim - 1 :]
        poses = code == 0 and tail[-2:] == (4, 4)
        points = np.ascontiguousarray(q.reshape(math.prod(lead), q.shape[-1]).T, real)
        rows = self._formula(points, *(() if params is None else (params,)))
        for place, row in zip(np.ndindex(*tail[:-2], *((3, 4) if poses else tail[-2:])), rows, strict=True):
            out[(..., *place)] = np.reshape(row, lead if np.ndim(row) else ())
        if poses:
            out[..., 3, :] = (0.0, 0.0, 0.0, 1.0)


def load_native(stamp: str) -> Any:
    """Load the extension that lies beside this file.

    A portable one serves the processor as well as it can; the environment may name a variant as KINEGEN_VARIANT.

    Args:
        stamp: Digest of the C sources that belong to the package.

    Returns:
        The cffi module, or None where there is none; one that exists but does not serve is named in a warning.
    """
    path = Path(__file__).with_name("_native.abi3.so")
    if not path.exists():
        return None
    try:
        return _load(path, stamp)
    except (ImportError, OSError, AttributeError) as error:
        reason = str(error).partition("\n")[0]
        warnings.warn(f"{path.parent.name}: {path.name} is not used, NumPy is: {reason}", RuntimeWarning, stacklevel=2)
        return None


def _load(path: Path, stamp: str) -> Any:
    # A 64-bit ELF file ends where its header says; the loader would crash on a shorter one.
    with path.open("rb") as file:
        sections, size, count = struct.unpack("<40xQ10xHH2x", (header := file.read(64)).ljust(64))
    if header[:6] == b"\x7fELF\x02\x01" and sections + size * count > path.stat().st_size:
        raise ImportError("the file is cut short")
    # The extension reads the headers of arrays, whose form NumPy has kept from 1 to 2.
    if sys.implementation.name != "cpython" or int(np.__version__.partition(".")[0]) > 2:
        raise ImportError("it serves CPython with NumPy 1 or 2")
    native = importlib.import_module(f"{__package__}._native")
    if native.ffi.string(native.lib.kinegen_stamp()).decode() != stamp:
        raise ImportError("it was built from other sources")
    if not native.lib.kinegen_select(os.fsencode(wanted := os.environ.get("KINEGEN_VARIANT", ""))):
        which = f"it has no variant {wanted!r} that this processor can run"
        raise ImportError(which if wanted else "it was built for a processor with more instructions")
    return native


def _workers(threads: int) -> int:
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    if operator.index(threads) < 0:
        raise ValueError(f"threads is {threads}, expected 0 (all cores) or more")
    return min(threads or cores, 4 * cores)


def _overlap(first: NDArray[Any], second: NDArray[Any]) -> bool:
    effort: Any = 10_000  # the exact answer can take for ever
    try:
        return bool(np.shares_memory(first, second, max_work=effort))
    except RuntimeError:
        return True


def _blocks(q: NDArray[Any], out: Floats, limit: int) -> Generator[tuple[NDArray[Any], Floats]]:
    """Cut a batch along its leading axes into blocks of at most `limit` poses."""
    inner = math.prod(q.shape[1:-1])
    if q.ndim == 1:
        yield q, out
    elif inner > limit:
        for part, target in zip(q, out):
            yield from _blocks(part, target, limit)
    else:
        step = limit // inner
        for start in range(0, len(q), step):
            yield q[start : start + step], out[start : start + step]


def _spread(work: Callable[..., None], blocks: Generator[tuple[Any, ...]], workers: int) -> None:
    """Work through the blocks, without NumPy's warnings, the caller together with helpers from the pool."""
    lock = threading.Lock()
    pool = _pools.get("") or _pools.setdefault("", ThreadPoolExecutor(os.cpu_count(), "kinegen"))

    def drain() -> None:
        while True:
            with lock:
                block = next(blocks, None)
            if block is None:
                return
            with np.errstate(all="ignore"):
                work(*block)

    helpers: list[Future[None]] = []
    try:
        helpers.extend(pool.submit(drain) for _ in range(workers - 1))
        drain()
    finally:
        with lock:
            blocks.close()
        for helper in helpers:
            if not helper.cancel():
                helper.result()
