"""Launches kernels through CuPy, for arrays of any library that has DLPack, on the device where these are.

Kernels are compiled by NVRTC at their first use, without contraction, and CuPy keeps them in its cache. Arrays are read
where they are; what is neither in rows nor joint-major is copied first. With tensors of PyTorch, work is queued on
PyTorch's current stream, otherwise on CuPy's; other libraries are waited for as DLPack says.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

_LAYOUTS = ("4x4", "3x4", "joint_major")
_ON_DEVICE = (2, 13)  # kDLCUDA, kDLCUDAManaged
_MOST_BLOCKS = 2**31 - 1


class Array(NamedTuple):
    """An input or a result of one configuration: its name, its shape, and its numbers without last rows of matrices."""

    name: str
    shape: tuple[int, ...]
    upper: int
    is_truth: bool = False

    @property
    def has_rows(self) -> bool:
        """Whether it holds matrices with last rows."""
        return self.upper < math.prod(self.shape)


class Kernel:
    """One output of a robot, on a GPU; several results come as a tuple.

    Args:
        name: Name of the output.
        package: Name of the module, for messages.
        source: The file with the kernels, whose first line with `#include` names the header.
        macro: What macros of these files begin with.
        symbols: What the names of its kernels begin with, by number type.
        inputs: What it is given.
        results: What it gives.
        block: Threads of a block.
        params: Names of the runtime parameters.
        doc: What it computes.
    """

    def __init__(
        self,
        name: str,
        *,
        package: str,
        source: str,
        macro: str,
        symbols: Mapping[str, str],
        inputs: tuple[Array, ...],
        results: tuple[Array, ...],
        block: int,
        params: tuple[str, ...],
        doc: str,
    ) -> None:
        self.__name__, self.__module__, self.__doc__ = name, package, doc
        self.inputs, self.results, self.block, self.symbols = inputs, results, block, symbols
        self._source, self._macro, self._params = source, macro, params
        self._compiled: dict[tuple[int, str], Any] = {}

    def __call__(self, *inputs: Any, params: Any = None, layout: str = "4x4") -> Any:
        """Evaluate one configuration or a batch.

        Args:
            inputs: Arrays on one device, all float64 or all float32, of shape (..., *their shape) with the same leading
                axes, such as joint values (..., dof); for the layout "joint_major" (numbers, N), of a matrix 12.
            params: Values of the runtime parameters, in their order or by name, or an array of them on the device, read
                where it is; those of the robot file if None.
            layout: "4x4": matrices (..., 4, 4). "3x4": the same without the last row. "joint_major": (12, N), one row
                for each number of the 3x4 matrix, and likewise for results that are not matrices.

        Returns:
            The results in the library and on the device of the first input, which need not be ready yet.

        Raises:
            ImportError: If there is no CuPy.
            RuntimeError: If there is no GPU.
            TypeError: If an input is not on a GPU, or of another number type, or if the library of the first input has
                no `from_dlpack` that would take the results.
            ValueError: If a shape, a layout or a parameter is wrong.
        """
        if layout not in _LAYOUTS:
            raise ValueError(f"{self.__name__}: layout is {layout!r}, expected one of {', '.join(_LAYOUTS)}")
        if len(inputs) != len(self.inputs):
            names = ", ".join(array.name for array in self.inputs)
            raise TypeError(f"{self.__name__} takes {len(self.inputs)} arrays ({names}), {len(inputs)} given")
        cupy = _cupy(self.__module__)
        first = inputs[0]
        device = self._device(first, self.inputs[0])
        returned = self._returning(cupy, first)
        with ExitStack() as stack:
            stack.enter_context(cupy.cuda.Device(device))
            _enter_stream(cupy, stack, first, device)
            arrays = [self._taken(cupy, *pair, device) for pair in zip(inputs, self.inputs, strict=True)]
            results = tuple(returned(array) for array in self._evaluate(cupy, arrays, params, layout, device))
        return results if len(results) > 1 else results[0]

    def _device(self, given: Any, array: Array) -> int:
        """The device where an input is."""
        place = given.__dlpack_device__() if hasattr(given, "__dlpack_device__") else (0, 0)
        if int(place[0]) not in _ON_DEVICE:
            reason = "a CuPy array, a CUDA tensor of PyTorch, or what else has DLPack on a GPU"
            raise TypeError(f"{self.__name__}: {array.name} is {_kind(given)}, not on a GPU; it takes {reason}")
        return int(place[1])

    def _returning(self, cupy: Any, first: Any) -> Callable[[Any], Any]:
        """What hands a result to the library of an input, found before anything is launched."""
        if isinstance(first, cupy.ndarray):
            return lambda array: array
        # A class of one's own is in no library; the class of a library that it is made from is.
        for base in reversed(type(first).__mro__):
            name = base.__module__.partition(".")[0]
            library = sys.modules.get("jax.dlpack" if name in ("jax", "jaxlib") else name)
            if library is not None and hasattr(library, "from_dlpack"):
                return library.from_dlpack  # type: ignore[no-any-return]
        reason = "a library without from_dlpack, so results cannot be returned to it; pass cupy.from_dlpack of it"
        raise TypeError(f"{self.__name__}: {self.inputs[0].name} is {_kind(first)}, of {reason}")

    def _taken(self, cupy: Any, given: Any, array: Array, device: int) -> Any:
        """An input as an array of CuPy, which is a view of the memory of the caller."""
        if self._device(given, array) != device:
            raise ValueError(f"{self.__name__}: {array.name} is on another device than {self.inputs[0].name}")
        return given if isinstance(given, cupy.ndarray) else cupy.from_dlpack(given)

    def _evaluate(self, cupy: Any, arrays: Sequence[Any], params: Any, layout: str, device: int) -> list[Any]:
        real = str(arrays[0].dtype)
        for given, array in zip(arrays, self.inputs, strict=True):
            if str(given.dtype) not in self.symbols or str(given.dtype) != real:
                kinds = " or ".join(f"all {name}" for name in self.symbols)
                raise TypeError(f"{self.__name__}: {array.name} is {given.dtype}; inputs are {kinds}")
        leading = self._leading(arrays, layout)
        count = math.prod(leading)
        laid = [_laid(cupy, *pair, count, layout) for pair in zip(arrays, self.inputs, strict=True)]
        shapes = [self._shape(array, leading, layout) for array in self.results]
        types = ["bool" if array.is_truth else real for array in self.results]
        found = [cupy.empty(*each) for each in zip(shapes, types, strict=True)]
        values = self._values(cupy, params, real, device)
        if count:
            pairs = [*laid, *(_stride(each, array, layout) for each, array in zip(found, self.results, strict=True))]
            parts = [part for each, stride in pairs for part in (each, np.int64(stride))]
            blocks = min(-(-count // self.block), _MOST_BLOCKS)
            self._kernel(cupy, real, layout, device)((blocks,), (self.block,), (np.int64(count), *parts, *values))
        return found

    def _leading(self, arrays: Sequence[Any], layout: str) -> tuple[int, ...]:
        """The leading axes of all inputs; the number of configurations where arrays are joint-major."""
        axes: list[tuple[int, ...]] = []
        for given, array in zip(arrays, self.inputs, strict=True):
            rank = 1 if layout == "joint_major" else len(array.shape)
            own = (array.upper,) if layout == "joint_major" else array.shape
            split = given.ndim - rank
            core, rest = (given.shape[:1], given.shape[1:]) if layout == "joint_major" else _cut(given.shape, split)
            if core != own or (layout == "joint_major" and len(rest) != 1):
                wanted = f"({array.upper}, N)" if layout == "joint_major" else f"(..., {', '.join(map(str, own))})"
                raise ValueError(f"{self.__name__}: {array.name} has shape {tuple(given.shape)}, expected {wanted}")
            axes.append(tuple(rest))
        if any(each != axes[0] for each in axes):
            shapes = ", ".join(map(str, axes))
            raise ValueError(f"{self.__name__}: leading axes of the inputs differ: {shapes}")
        return axes[0]

    def _shape(self, array: Array, leading: tuple[int, ...], layout: str) -> tuple[int, ...]:
        """The shape of a result."""
        if layout == "joint_major":
            return (array.upper, *leading)
        own = (*array.shape[:-2], 3, 4) if array.has_rows and layout == "3x4" else array.shape
        return (*leading, *own)

    def _values(self, cupy: Any, params: Any, real: str, device: int) -> tuple[Any, ...]:
        """The runtime parameters as the last argument of a kernel, null for those of the robot file."""
        if params is None:
            return (np.uint64(0),) * bool(self._params)
        if not self._params:
            raise ValueError(f"{self.__name__}: the robot has no runtime parameters")
        known = f"{self.__name__}: params are {', '.join(self._params)}"
        if isinstance(params, Mapping):
            if set(params) != set(self._params):
                raise ValueError(f"{known}, given {', '.join(map(str, params)) or 'none'}")
            params = [params[name] for name in self._params]
        place = params.__dlpack_device__() if hasattr(params, "__dlpack_device__") else (0, 0)
        if int(place[0]) in _ON_DEVICE:
            given = self._taken(cupy, params, Array("params", (len(self._params),), len(self._params)), device)
            if given.shape != (len(self._params),):
                raise ValueError(f"{known}; params has shape {tuple(given.shape)}")
            return (cupy.ascontiguousarray(given, dtype=real),)
        if len(params) != len(self._params):
            raise ValueError(f"{known}; {len(params)} numbers given")
        return (cupy.asarray([float(value) for value in params], dtype=real),)

    def _kernel(self, cupy: Any, real: str, layout: str, device: int) -> Any:
        """The compiled kernel of a number type and layout."""
        ends = {"4x4": "rows", "3x4": "rows", "joint_major": "joint_major"}
        end = "rows_3x4" if layout == "3x4" and any(each.has_rows for each in self.results) else ends[layout]
        name = f"{self.symbols[real]}_{end}"
        if (device, name) not in self._compiled:
            chosen = (f"-D{self._macro}_ONLY", f"-D{self._macro}_WITH_{self.__name__}")
            module = cupy.RawModule(code=_text(self._source), options=("--std=c++17", "-fmad=false", *chosen))
            self._compiled[device, name] = module.get_function(name)
        return self._compiled[device, name]


def _kind(given: Any) -> str:
    """The class of an input, for messages."""
    return f"{type(given).__module__.partition('.')[0]}.{type(given).__name__}"


def _cut(shape: tuple[int, ...], split: int) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """The last axes and the leading ones; no last axes if there are too few."""
    return (tuple(shape[split:]), tuple(shape[:split])) if split >= 0 else ((), tuple(shape))


def _cupy(package: str) -> Any:
    """CuPy, where it and a GPU are."""
    try:
        import cupy
    except ImportError as error:
        install = "pip install cupy-cuda13x, or cupy-cuda12x where the driver is of CUDA 12"
        raise ImportError(f"{package} needs CuPy ({install}): {error}") from None
    try:
        count = cupy.cuda.runtime.getDeviceCount()
    except Exception as error:  # noqa: BLE001 - whatever CuPy says of a driver that is missing
        raise RuntimeError(f"{package} needs an NVIDIA GPU, and CuPy finds none: {error}") from None
    if not count:
        raise RuntimeError(f"{package} needs an NVIDIA GPU, and CuPy finds none")
    return cupy


def _enter_stream(cupy: Any, stack: ExitStack, first: Any, device: int) -> None:
    """Queue what follows where the caller queues: PyTorch's current stream for its tensors, else that of CuPy."""
    torch = sys.modules.get("torch")
    if torch is not None and isinstance(first, torch.Tensor):
        stream = torch.cuda.current_stream(device)
        if not stream.cuda_stream:
            entered = cupy.cuda.Stream.null
        elif hasattr(cupy.cuda.Stream, "from_external"):
            entered = cupy.cuda.Stream.from_external(_Stream(stream))
        else:  # before CuPy 14
            entered = cupy.cuda.ExternalStream(stream.cuda_stream)
        stack.enter_context(entered)


class _Stream:
    """A stream of PyTorch under CUDA's protocol for streams, which those of older PyTorch lack."""

    def __init__(self, stream: Any) -> None:
        self._stream = stream

    def __cuda_stream__(self) -> tuple[int, int]:
        return 0, self._stream.cuda_stream


def _laid(cupy: Any, given: Any, array: Array, count: int, layout: str) -> tuple[Any, int]:
    """An input in rows or joint-major, a copy only where it is neither, and how far its rows are apart."""
    size = array.upper if layout == "joint_major" else math.prod(array.shape)
    rows = given if layout == "joint_major" else given.reshape(count, size)
    if rows.shape[-1] > 1 and rows.strides[-1] != rows.itemsize:
        rows = cupy.ascontiguousarray(rows)
    return rows, rows.strides[0] // rows.itemsize


def _stride(found: Any, array: Array, layout: str) -> tuple[Any, int]:
    """A result, and how far its rows are apart."""
    if layout == "joint_major":
        return found, found.shape[1]
    return found, array.upper if layout == "3x4" else math.prod(array.shape)


def _text(source: str) -> str:
    """The kernels with their header, as one text."""
    kernels = Path(__file__).with_name(source)
    header = kernels.with_suffix(".cuh")
    text = kernels.read_text(encoding="utf-8")
    return text.replace(f'#include "{header.name}"\n', header.read_text(encoding="utf-8"), 1)
