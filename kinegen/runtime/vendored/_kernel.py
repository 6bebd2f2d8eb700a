"""Array handling for the kernels of a robot: shapes, number types, strides, threads. It needs NumPy alone.

A `Kernel` behaves like a generalised ufunc such as `(n)->(4,4)`: joint values of shape (..., n) give poses of shape
(..., 4, 4). It calls C where the extension `_native` loads, and the NumPy form elsewhere; all packages share this file.

Number types: float32 and float16 give float32; other floats, integers, Booleans and lists give float64. A package
built for double alone rounds its results for float32; one built for float alone always gives float32.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, Generic, Literal, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._engines import Array, Compiled, Floats, Formula, real_array
from ._overlap import check_apart, overlaps_itself
from ._parameters import checked_params, settled_params
from ._quick import quick_class, quicken
from ._signature import OwnSignature, by_place, described
from ._threads import blocks_of, spread, workers_for

Layout = Literal["4x4", "3x4", "joint_major"]
Result = TypeVar("Result")

Varied = Mapping[str, NDArray[Any]]
"""The arrays of the runtime parameters by name, where they are not plain numbers; empty otherwise."""

_LAYOUTS = ("4x4", "3x4", "joint_major")
_SHARE, _SMALL = 1 << 12, 1 << 14  # poses that are worth a thread, numbers that go to C at once
_TABLE = 1 << 16  # numbers of parameters that are put together at once, few enough for the processor's cache
_ndarray: Any = np.ndarray
_empty: Any = np.empty
_MISSING: Any = ...


class Kernel(Generic[Result]):
    """One output of a robot for any number of configurations; several results come as a tuple.

    Its `backend` is "c" or "numpy", `variant` says which C; `inputs`, `results`, `dof` and `shape` describe one
    configuration.

    Args:
        name: Name of the output, and of this object in its module.
        module: Name of that module.
        symbol: Prefix of the C functions.
        inputs: What it is given, in order.
        results: What it gives, in order.
        reals: Number types of the package: "float64", "float32" or both.
        formula: NumPy form: the numbers of each input (size, n), then the parameters if there are any, to the rows of
            the results (of each matrix the upper 3x4 by rows), each an array of length n or a number.
        native: What `load_native` gave.
        params: The robot file's values of the runtime parameters, a named tuple; None where there are none.
        doc: Text for `help()`.
    """

    kind = "kernel"
    options: tuple[tuple[str, Any], ...] = (("out", None), ("threads", 1), ("layout", "4x4"))
    __signature__ = OwnSignature()

    def __new__(cls, *_arguments: Any, native: Any = None, **_options: Any) -> Kernel[Any]:
        """An object whose plain calls go to C without a detour, where that can be."""
        return object.__new__(quick_class(cls, native))

    def __init__(
        self,
        name: str,
        *,
        module: str,
        symbol: str,
        inputs: tuple[Array, ...],
        results: tuple[Array, ...],
        reals: tuple[str, ...],
        formula: Callable[..., Sequence[Any]],
        native: Any = None,
        params: Any = None,
        doc: str = "",
    ) -> None:
        self.__name__, self.__module__ = name, module
        self.inputs, self.results, self._params = inputs, results, params
        self.__doc__ = described(self, doc)
        self.dof = inputs[0].size
        self.shape = results[0].shape if len(results) == 1 else tuple(result.shape for result in results)
        self._first, self._rank = results[0].shape, len(inputs[0].shape)
        self._reals = tuple(np.dtype(real) for real in reals)
        self._engine = (
            Formula(formula, results) if native is None else Compiled(native, symbol, name, self._reals, results)
        )
        self.backend, self.variant = self._engine.name, self._engine.variant
        is_simple = len(inputs) == len(results) == self._rank == 1
        self._direct = self._engine.direct(params) if is_simple else None
        self._defaults = self._engine.structs(params)
        quicken(self, native, self._defaults)

    def __call__(
        self,
        q: Any = _MISSING,
        *others: ArrayLike,
        params: Any = None,
        out: Any = None,
        threads: int = 1,
        layout: Layout = "4x4",
        **named: Any,
    ) -> Result:
        """Evaluate one configuration or a batch.

        Args:
            q: The first input, of shape (..., *its shape), such as joint values (..., dof); for the layout
                "joint_major" (numbers, N).
            others: The other inputs, if there are any, in order. Leading axes broadcast.
            params: Values of the runtime parameters; by default those of the robot file. Each is a number, or an array
                (...) whose axes broadcast with those of the batch.
            out: Array for the result, of its exact shape and type, sharing no memory with the inputs; a tuple where
                there are several results.
            threads: Number of threads that share a batch; 0 for all cores.
            layout: "4x4": matrices (..., 4, 4). "3x4": the same without the last row. "joint_major": (12, N), one row
                for each entry of the 3x4 matrix, and likewise for results that are not matrices.
            named: Inputs that are given by their names.

        Returns:
            The result; `out` where it was given.
        """
        if named:
            q, *rest = by_place(self, others if q is _MISSING else (q, *others), named)
            others = tuple(rest)
        # Small plain arrays are one C call, which reads their headers itself and declines whatever is not plain. What
        # takes and gives a single array has this way to itself, since every look-up counts here. Most such calls never
        # come here: C takes them whole, where `_quick` could arrange it.
        direct = self._direct if params is None else self._direct and self._engine.direct(self._named(params))
        result: Result
        if direct is not None and type(q) is _ndarray and threads == 1 and layout == "4x4" and not others:
            if out is None and q.size < _SMALL:
                result = _empty(self._first if q.ndim == 1 else q.shape[:-1] + self._first, q.dtype)
                if direct(id(q), id(result), 0):
                    return result
            elif type(out) is _ndarray and direct(id(q), id(out), 0):
                result = out
                return result
        inputs = others if q is _MISSING else (q, *others)
        chosen = self._named(params)
        if self._direct is None and threads == 1 and layout == "4x4":
            result = self._at_once(inputs, chosen, out)
            if result is not None:
                return result
        result = self._evaluate(inputs, chosen, out, threads, layout)
        return result

    def bind(self, *arrays: NDArray[Any], params: Any = None, layout: Layout = "4x4") -> Callable[[], object]:
        """Look everything up once: each call of the result reads the inputs anew and writes the results.

        Args:
            arrays: The inputs and then the results, arrays of a type that the package was built for; they stay alive
                as long as what is returned.
            params: As for a call.
            layout: As for a call.

        Returns:
            A function without arguments; for one contiguous configuration it is the C function itself, which looks
            at the memory alone: that an array is made read-only later does not stop it.
        """
        if len(arrays) != len(self.inputs) + len(self.results):
            names = ", ".join(array.name for array in (*self.inputs, *self.results))
            count = len(self.inputs) + len(self.results)
            raise TypeError(f"{self.__name__}: bind takes {count} arrays ({names}), {len(arrays)} given")
        inputs: tuple[Any, ...] = arrays[: len(self.inputs)]
        results = arrays[len(self.inputs) :]
        real = self._checked_input(self.inputs[0], inputs[0], layout).dtype
        found: tuple[Any, ...] = inputs
        for given, array in zip(self.inputs, found, strict=True):
            if not isinstance(array, np.ndarray) or array.dtype not in self._reals or array.dtype != real:
                kinds = " or ".join(map(str, self._reals))
                raise TypeError(f"{self.__name__}: bind needs {given.name} as an array of {kinds}")
        named, varied = settled_params(self.__name__, self._named(params))
        checked = [self._checked_input(*pair, layout) for pair in zip(self.inputs, inputs)]
        lead = self._lead(checked, varied, layout)
        self._checked_results(results, lead, real, inputs, varied, layout)
        plain = all(array.flags.c_contiguous and array.flags.aligned for array in arrays)
        if isinstance(self._engine, Compiled) and plain and not lead and layout == "4x4":
            return self._engine.bind(arrays, named)
        return partial(self, *inputs, params=params, out=self._given(results), layout=layout)

    @property
    def address(self) -> int | None:
        """Address of the C function for one configuration, for Numba, ctypes and others; None with the backend "numpy".

        It needs cffi and raises AttributeError without.

        It takes pointers to contiguous doubles (floats in a package for float alone): the inputs, the runtime
        parameters where there are any, then the results, matrices row by row with all four rows. It returns nothing.
        """
        return self._engine.address

    def __reduce__(self) -> str:
        return self.__name__  # pickled by reference, as functions are

    def __repr__(self) -> str:
        backend = f"{self.backend} ({self.variant})" if self.variant else self.backend
        given = ", ".join(f"{array.name} {array.shape}" for array in self.inputs)
        return f"<{self.__module__}.{self.__name__}: {given} to {self.shape}, backend {backend}>"

    def _at_once(self, inputs: tuple[Any, ...], params: Any, out: Any) -> Any:
        """The results of one C call for several inputs or results; None where there is none, or where it declines."""
        direct = self._engine.direct(params)
        if direct is None or len(inputs) != len(self.inputs):
            return None
        if out is None:
            first = inputs[0]
            if type(first) is not _ndarray or first.size >= _SMALL:
                return None
            lead = first.shape[: max(0, first.ndim - self._rank)]
            results = tuple(_empty(lead + each.shape, each.dtype(first.dtype)) for each in self.results)
        else:
            results = (out,) if len(self.results) == 1 else out
            if type(results) is not tuple or len(results) != len(self.results):
                return None
        arrays = (*inputs, *results)
        if {*map(type, arrays)} != {_ndarray}:
            return None
        if not direct(*map(id, arrays), 0):
            return None
        return self._given(results) if out is None else out

    def _given(self, results: tuple[Floats, ...]) -> Any:
        return results[0] if len(results) == 1 else tuple(results)

    def _evaluate(self, inputs: tuple[ArrayLike, ...], params: Any, out: Any, threads: int, layout: str) -> Any:
        if len(inputs) != len(self.inputs):
            names = ", ".join(array.name for array in self.inputs)
            number = f"{len(self.inputs)} array{'s' if len(self.inputs) > 1 else ''}"
            raise TypeError(f"{self.__name__} takes {number} ({names}), {len(inputs)} given")
        if layout not in _LAYOUTS or (layout == "3x4" and not any(each.is_pose for each in self.results)):
            known = _LAYOUTS if any(each.is_pose for each in self.results) else _LAYOUTS[::2]
            raise ValueError(f"{self.__name__}: no layout {layout!r} (there are {known})")
        named, varied = settled_params(self.__name__, params)
        arrays = [self._checked_input(*pair, layout) for pair in zip(self.inputs, inputs, strict=True)]
        workers, lead = workers_for(threads), self._lead(arrays, varied, layout)
        dtype, real = self.types(arrays)
        if out is None:
            shapes = [self._full_shape(each, lead, layout) for each in self.results]
            kinds = [each.dtype(dtype) for each in self.results]
            results = tuple(map(self._engine.empty, shapes, kinds))
        else:
            results = (out,) if len(self.results) == 1 else out
            self._checked_results(results, lead, dtype, arrays, varied, layout)
        major = layout == "joint_major"
        # From here on the poses are the leading axes, in the joint-major layout too.
        whole = [self._stretched(*pair, lead, layout) for pair in zip(self.inputs, arrays, strict=True)]
        whole = [array.T for array in whole] if major else whole
        whole += [np.broadcast_to(array, lead) for array in varied.values()]
        whole += [array.T for array in results] if major else results
        count = math.prod(lead)
        if count:
            # Equal blocks, a multiple of the workers: memory stays flat, and Ctrl-C gets through in between.
            most = min(self._engine.block, _TABLE // len(varied)) if varied else self._engine.block
            workers = min(workers, -(-count // _SHARE))
            blocks = workers * -(-count // (most * workers))
            fill = partial(self._engine.fill, named, real, _LAYOUTS.index(layout), len(varied))
            spread(fill, blocks_of(whole, len(lead), -(-count // blocks)), workers)
        return self._given(results) if out is None else out

    def _named(self, params: Any) -> Any:
        return checked_params(self.__name__, params, self._params)

    def _checked_input(self, given: Array, values: ArrayLike, layout: str) -> NDArray[Any]:
        array = real_array(self.__name__, given.name, values)
        inner = given.laid_out(layout)
        if layout == "joint_major":
            if array.ndim != 2 or array.shape[:1] != inner:
                expected = f"({given.size}, N)"
                raise ValueError(f"{self.__name__}: {given.name} has shape {array.shape}, expected {expected}")
        elif array.shape[max(0, array.ndim - len(inner)) :] != inner:
            expected = f"(..., {', '.join(map(str, inner))})"
            raise ValueError(f"{self.__name__}: {given.name} has shape {array.shape}, expected {expected}")
        return array

    def _lead(self, arrays: Sequence[NDArray[Any]], varied: Varied, layout: str) -> tuple[int, ...]:
        """The axes of the batch, to which those of all inputs and parameters broadcast."""
        if layout == "joint_major":
            leads = [array.shape[1:] for array in arrays]
        else:
            ranks = [len(given.laid_out(layout)) for given in self.inputs]
            leads = [array.shape[: array.ndim - rank] for array, rank in zip(arrays, ranks, strict=True)]
        leads += [array.shape for array in varied.values()]
        if len(set(leads)) == 1:
            return leads[0]
        with contextlib.suppress(ValueError):
            lead = np.broadcast_shapes(*leads)
            if layout != "joint_major" or len(lead) == 1:
                return lead
        given = [*zip((each.name for each in self.inputs), arrays), *varied.items()]
        shapes = ", ".join(f"{name} {array.shape}" for name, array in given if array.ndim)
        raise ValueError(f"{self.__name__}: the shapes of {shapes} do not fit together")

    def _stretched(self, given: Array, array: NDArray[Any], lead: tuple[int, ...], layout: str) -> NDArray[Any]:
        shape = self._full_shape(given, lead, layout)
        return array if array.shape == shape else np.broadcast_to(array, shape)

    def _full_shape(self, array: Array, lead: tuple[int, ...], layout: str) -> tuple[int, ...]:
        inner = array.laid_out(layout)
        return (*inner, *lead) if layout == "joint_major" else (*lead, *inner)

    def types(self, arrays: Sequence[NDArray[Any]]) -> tuple[np.dtype[Any], np.dtype[Any]]:
        """The type of the results for some inputs, and the type that they are computed in."""
        single = np.dtype(np.float32)
        small = all(array.dtype.kind == "f" and array.dtype.itemsize <= 4 for array in arrays)
        result = single if self._reals == (single,) or small else np.dtype(float)
        return result, result if result in self._reals else self._reals[0]

    def _checked_results(
        self,
        results: Any,
        lead: tuple[int, ...],
        dtype: np.dtype[Any],
        inputs: Sequence[NDArray[Any]],
        varied: Varied,
        layout: str,
    ) -> None:
        if not isinstance(results, tuple) or len(results) != len(self.results):
            names = ", ".join(each.name for each in self.results)
            raise TypeError(f"{self.__name__}: out must be a tuple of arrays for {names}")
        for place, (each, out) in enumerate(zip(self.results, results, strict=True)):
            label = "out" if len(results) == 1 else f"out for {each.name}"
            if isinstance(out, np.ma.MaskedArray) or not isinstance(out, np.ndarray):
                raise TypeError(f"{self.__name__}: {label} is a {type(out).__name__}, expected a plain NumPy array")
            shape = self._full_shape(each, lead, layout)
            if out.shape != shape:
                pairs = [*zip((each.name for each in self.inputs), inputs), *varied.items()]
                given = ", ".join(f"{name} of shape {array.shape}" for name, array in pairs)
                raise ValueError(f"{self.__name__}: {label} has shape {out.shape}, expected {shape} for {given}")
            if out.dtype != each.dtype(dtype):
                raise TypeError(f"{self.__name__}: {label} is of type {out.dtype}, expected {each.dtype(dtype)}")
            if not out.flags.writeable:
                raise ValueError(f"{self.__name__}: {label} is read-only")
            if overlaps_itself(out):
                raise ValueError(f"{self.__name__}: {label} overlaps itself: several entries share memory")
            others = [
                *zip((given.name for given in self.inputs), inputs),
                *varied.items(),
                *((e.name, r) for e, r in zip(self.results[:place], results)),
            ]
            check_apart(self.__name__, label, out, others)
