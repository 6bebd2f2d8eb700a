"""The ways in which a kernel of a package can be called; a proof tries each of them."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinegen.native.package import runnable_variants, select_variant
from kinegen.outputs import Quantity

Floats = NDArray[np.floating[Any]]

DTYPES: dict[str, np.dtype[Any]] = {"double": np.dtype(np.float64), "float": np.dtype(np.float32)}
"""NumPy's names of the number types."""


Arrays = tuple[Floats, ...]


@dataclass(frozen=True, slots=True)
class Way:
    """One way to call a kernel.

    Attributes:
        target: What is called, such as `C double, batch`.
        call: From the inputs, N configurations each, to the results (N, ...).
        kernel: The kernel that is called.
        row: What it counts as in a report: the same for all layouts and variants.
        is_plain: Whether it is the usual batch, whose bits every other call must give.
        select: Sees to it that calls of the kernel go the same way.
    """

    target: str
    call: Callable[[Arrays], Arrays]
    kernel: Any
    row: str
    is_plain: bool
    select: Callable[[], object] = lambda: None


def ways_to_call(
    package: ModuleType, quantity: Quantity, real: str, parameters: Sequence[float] | None = None
) -> tuple[Way, ...]:
    """List the ways: compiled one by one, compiled as a batch (in each variant), and in NumPy.

    Args:
        package: A generated package, imported.
        quantity: One that it was built for.
        real: A number type that it was built for.
        parameters: Values of the runtime parameters; those of the robot file if left out.

    Returns:
        All of them, or the last alone where the package was built without a compiler.
    """
    kernel = getattr(package, quantity.function)
    params = None if parameters is None else package.Params(*parameters)
    plain, name = numpy_form(package, kernel, quantity), f"NumPy {real}"
    formula = Way(name, partial(results_of, plain, params), plain, name, is_plain=True)
    if kernel.backend != "c":
        return (formula,)
    name = f"C {real}"
    batches = [
        Way(
            " ".join([f"{name}, batch", *[variant] * bool(variant), *[layout] * (layout != "4x4")]),
            partial(_in_variant, package, kernel, params, variant, layout),
            kernel,
            f"{name}, batch",
            is_plain=layout == "4x4",
            select=partial(select_variant, package, variant),
        )
        for variant in runnable_variants(package) or ("",)
        for layout in layouts_of(kernel)
    ]
    return (Way(name, partial(_one_by_one, kernel, params), kernel, name, is_plain=False), *batches, formula)


def layouts_of(kernel: Any) -> tuple[str, ...]:
    """The layouts that a kernel has: without matrices among its results there is no 3x4."""
    return ("4x4", *["3x4"] * any(each.is_pose for each in kernel.results), "joint_major")


def results_of(kernel: Any, params: Any, inputs: Arrays, layout: str = "4x4") -> Arrays:
    """What a kernel gives, as a tuple also where there is one result."""
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
    """A kernel of a package as it would be without the compiled extension."""
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
        **({} if turnings is None else {"turnings": turnings}),
    )


def in_layout(kernel: Any, params: Any, layout: str, inputs: Arrays) -> Arrays:
    """The results of a batch in one layout, as the default one would hold them."""
    if layout == "joint_major":
        # Rows in which the configurations are neighbours have a way of their own in C.
        rows = tuple(map(np.ascontiguousarray, in_rows(kernel, inputs)))
        found = tuple(result.T for result in results_of(kernel, params, rows, layout))
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
    """A result with the last rows of its matrices, which other layouts leave out."""
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
