"""Outputs on arrays of any library: the operations of the NumPy form with the functions of that library."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable, Sequence
from functools import cache
from types import FunctionType, ModuleType
from typing import Any

from ._derivatives import kernels_of, members, named
from ._engines import PACKAGE, Array
from ._kernel import Kernel
from ._parameters import checked_params


@cache
def _output(name: str) -> Callable[..., Any]:
    """One output as a function."""
    kernel = kernels_of(PACKAGE)[name]
    formula = _formulas()[name]  # here, since compilers that trace a call import nothing

    def call(*inputs: Any, params: Any = None) -> Any:
        return _evaluated(name, kernel, formula, inputs, params)

    return named(call, kernel)


__getattr__, __dir__ = members(PACKAGE, f"{PACKAGE}.xp", _output)


def evaluate(name: str, *inputs: Any, params: Any = None) -> Any:
    """Compute one output.

    Args:
        name: Its name.
        inputs: Arrays (..., n) of one library and one real floating-point type; leading axes broadcast.
        params: Values of the runtime parameters, a `Params`; each a number, or an array (...) of that library and type
            that broadcasts with the batch. By default those of the robot file.

    Returns:
        An array of the same library, or a tuple of them.

    Raises:
        TypeError: If the inputs are not arrays of a floating-point type, or their number is wrong.
        ValueError: If an input has another shape.
    """
    return _evaluated(name, kernels_of(PACKAGE)[name], _formulas()[name], inputs, params)


def _evaluated(
    name: str, kernel: Kernel[Any], formula: Callable[..., Sequence[Any]], inputs: Sequence[Any], params: Any
) -> Any:
    """One output by its formula."""
    if len(inputs) != len(kernel.inputs):
        names = ", ".join(each.name for each in kernel.inputs)
        raise TypeError(f"{name} takes {len(kernel.inputs)} arrays ({names}), {len(inputs)} given")
    xp = namespace_of(name, inputs[0])
    for each, array in zip(kernel.inputs, inputs, strict=True):
        if tuple(array.shape[-1:]) != each.shape:
            shape = tuple(array.shape)
            raise ValueError(f"{name}: {each.name} has shape {shape}, expected (..., {each.shape[0]})")
        if "float" not in getattr(array.dtype, "name", str(array.dtype)):
            raise TypeError(f"{name}: {each.name} is of {array.dtype}, expected a floating-point type")
    chosen = checked_params(name, params, kernel._params)  # noqa: SLF001 - of its own package
    lead = _lead(xp, [array[..., 0] for array in inputs] + [each for each in chosen or () if _is_array(each)])
    numbers = [Numbers(xp, xp.broadcast_to(array, (*lead, array.shape[-1]))) for array in inputs]
    found = iter(formula(*numbers, *(() if chosen is None else (chosen,))))
    results = tuple(_assembled(xp, each, found, numbers[0]) for each in kernel.results)
    return results[0] if len(results) == 1 else results


def namespace_of(name: str, array: Any) -> Any:
    """The functions for an array: what it names itself, else the module that it comes from.

    Args:
        name: Who asks, for the message.
        array: Any object.

    Raises:
        TypeError: If it is not an array.
    """
    if hasattr(array, "__array_namespace__"):
        return array.__array_namespace__()
    root = type(array).__module__.partition(".")[0]
    module = {"dask": "dask.array", "jaxlib": "jax.numpy", "jax": "jax.numpy"}.get(root, root)
    if hasattr(array, "shape") and hasattr(sys.modules.get(module), "where"):
        return sys.modules[module]
    raise TypeError(f"{name}: q is of type {type(array).__qualname__}, expected an array")


def _is_array(value: Any) -> bool:
    return not isinstance(value, (float, int))


def _lead(xp: Any, arrays: Sequence[Any]) -> tuple[int, ...]:
    """The axes to which those of all arrays broadcast."""
    if len(arrays) == 1:
        return tuple(arrays[0].shape)
    spread = xp.broadcast_arrays if hasattr(xp, "broadcast_arrays") else xp.broadcast_tensors
    return tuple(spread(*arrays)[0].shape)


class Entry:
    """One number of every configuration, with the operations that the formulas use."""

    def __init__(self, xp: Any, value: Any) -> None:
        self.xp, self.value = xp, value

    def like(self, other: Any) -> Any:
        """Another entry or a plain number as an array of this type."""
        if isinstance(other, Entry):
            return other.value
        return self.xp.full_like(self.value, float(other))

    @property
    def dtype(self) -> Kinds:
        """Its number type, as the formulas ask for it."""
        return Kinds(self.value.dtype, lambda number: Entry(self.xp, self.like(number)))

    def _made(self, value: Any) -> Entry:
        return Entry(self.xp, value)

    def __add__(self, other: Any) -> Entry:
        return self._made(self.value + _plain(other))

    def __radd__(self, other: Any) -> Entry:
        return self._made(_plain(other) + self.value)

    def __sub__(self, other: Any) -> Entry:
        return self._made(self.value - _plain(other))

    def __rsub__(self, other: Any) -> Entry:
        return self._made(_plain(other) - self.value)

    def __mul__(self, other: Any) -> Entry:
        return self._made(self.value * _plain(other))

    def __rmul__(self, other: Any) -> Entry:
        return self._made(_plain(other) * self.value)

    def __truediv__(self, other: Any) -> Entry:
        return self._made(self.value / _plain(other))

    def __rtruediv__(self, other: Any) -> Entry:
        return self._made(_plain(other) / self.value)

    def __neg__(self) -> Entry:
        return self._made(-self.value)

    def __lt__(self, other: Any) -> Entry:
        return self._made(self.value < _plain(other))

    def __gt__(self, other: Any) -> Entry:
        return self._made(self.value > _plain(other))


class Kinds:
    """A number type as the formulas use it: compared with `float32`, and called for a number of that type."""

    def __init__(self, dtype: Any, make: Callable[[float], Any] = float) -> None:
        # NumPy prints the byte order of a type, but leaves it out of its name.
        self._name, self.type = getattr(dtype, "name", str(dtype)), make

    def __eq__(self, other: object) -> bool:
        return self._name.rpartition(".")[2] == other

    __hash__ = None  # type: ignore[assignment]


class Numbers:
    """The numbers of an input, each for all configurations."""

    def __init__(self, xp: Any, array: Any) -> None:
        self._entries = [Entry(xp, array[..., index]) for index in range(array.shape[-1])]
        self.dtype = Kinds(array.dtype, self._parameter)

    def _parameter(self, value: Any) -> Entry:
        """A runtime parameter, a number or an array that broadcasts with the batch, as one of each configuration."""
        first = self._entries[0]
        if _is_array(value):
            return Entry(first.xp, first.xp.broadcast_to(value, first.value.shape))
        return Entry(first.xp, first.like(value))

    def __getitem__(self, index: int) -> Entry:
        return self._entries[index]


class Functions:
    """What the formulas call as `np`."""

    float32 = "float32"

    @staticmethod
    def where(condition: Entry, first: Any, second: Any) -> Entry:
        """One of two numbers, of which one is an entry."""
        model = first if isinstance(first, Entry) else second
        return Entry(condition.xp, condition.xp.where(condition.value, model.like(first), model.like(second)))


def _plain(other: Any) -> Any:
    return other.value if isinstance(other, Entry) else float(other)


def _sincos(angle: Entry) -> tuple[Entry, Entry]:
    """Sine and cosine; NaN beyond the range that the C kernels state for their number type."""
    xp, value = angle.xp, angle.value
    limit = 12000.0 if angle.dtype in ("float32", "float16") else 100000.0
    guarded = xp.where(xp.abs(value) <= limit, value, xp.full_like(value, float("nan")))
    return Entry(xp, xp.sin(guarded)), Entry(xp, xp.cos(guarded))


def _atan2(y: Any, x: Any) -> Entry:
    """The angle of a point; zeros have no sign, and an infinity makes it NaN, as in the C files."""
    model = y if isinstance(y, Entry) else x
    xp, up, along = model.xp, model.like(y), model.like(x)
    arctan = getattr(xp, "atan2", None) or xp.arctan2
    return Entry(xp, arctan(up + (up - up), along + (along - along)))


def _sqrt(x: Entry) -> Entry:
    """The square root; zeros have no sign, as in the C files."""
    return Entry(x.xp, x.xp.sqrt(x.value + 0.0))


@cache
def _formulas() -> dict[str, Callable[..., Sequence[Any]]]:
    """The functions of the NumPy form, with what they call replaced by the functions above."""
    own = {"np": Functions, "_sincos": _sincos, "_atan2": _atan2, "_sqrt": _sqrt}
    formulas = vars(importlib.import_module(f"{PACKAGE}._numpy"))
    # Compilers that trace a function look up what it calls in the module of that name.
    module = ModuleType(f"{PACKAGE}._formulas")
    vars(module).update({**formulas, **own, "__name__": module.__name__})
    sys.modules[module.__name__] = module
    functions = ((name, formulas[name]) for name in kernels_of(PACKAGE))
    return {name: FunctionType(each.__code__, vars(module), name) for name, each in functions}


def _assembled(xp: Any, result: Array, entries: Any, model: Numbers) -> Any:
    """The entries of one result as an array, with the last rows of poses."""
    count = result.size
    flat = [model[0].like(each) for each in (next(entries) for _ in range(count))]
    if not result.is_pose:
        return xp.reshape(xp.stack(flat, axis=-1), (*flat[0].shape, *result.shape))
    whole = []
    for start in range(0, count, 12):
        whole += [*flat[start : start + 12], *(model[0].like(each) for each in (0.0, 0.0, 0.0, 1.0))]
    return xp.reshape(xp.stack(whole, axis=-1), (*flat[0].shape, *result.shape))
