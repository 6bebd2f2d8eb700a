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
        call: From the inputs, N configurations each, to the results (N, ...), as the package gives them.
    """

    target: str
    call: Callable[[Arrays], Arrays]


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
    formula = Way(f"NumPy {real}", partial(results_of, numpy_form(package, kernel, quantity), params))
    if kernel.backend != "c":
        return (formula,)
    variants = runnable_variants(package)
    batches = [Way(f"C {real}, batch {name}", partial(_in_variant, package, kernel, params, name)) for name in variants]
    return (
        Way(f"C {real}", partial(_one_by_one, kernel, params)),
        *(batches or [Way(f"C {real}, batch", partial(_every_layout, kernel, params))]),
        formula,
    )


def results_of(kernel: Any, params: Any, inputs: Arrays, layout: str = "4x4") -> Arrays:
    """What a kernel gives, as a tuple also where there is one result."""
    results = kernel(*inputs, params=params, layout=layout)
    return results if isinstance(results, tuple) else (results,)


def _one_by_one(kernel: Any, params: Any, inputs: Arrays) -> Arrays:
    found = [results_of(kernel, params, point) for point in zip(*inputs, strict=True)]
    return tuple(np.stack(results) for results in zip(*found, strict=True))


def _in_variant(package: ModuleType, kernel: Any, params: Any, name: str, inputs: Arrays) -> Arrays:
    select_variant(package, name)
    return _every_layout(kernel, params, inputs)


def numpy_form(package: ModuleType, kernel: Any, quantity: Quantity) -> Any:
    """A kernel of a package as it would be without the compiled extension."""
    params = getattr(package, "Params", None)
    return type(kernel)(
        quantity.function,
        module=package.__name__,
        symbol="",
        inputs=kernel.inputs,
        results=kernel.results,
        reals=tuple(str(dtype) for dtype in DTYPES.values()),
        formula=getattr(sys.modules[f"{package.__name__}._numpy"], quantity.function),
        params=params() if params else None,
    )


def _every_layout(kernel: Any, params: Any, inputs: Arrays) -> Arrays:
    """The results of a batch; where another layout holds another number, that one."""
    results = results_of(kernel, params, inputs)
    given, found = kernel.inputs, kernel.results
    rows = tuple(_upper(array, each.is_pose).reshape(len(array), -1).T for each, array in zip(given, inputs))
    others = [tuple(result.T for result in results_of(kernel, params, rows, "joint_major"))]
    if any(each.is_pose for each in found):
        shorter = tuple(_upper(array, each.is_pose) for each, array in zip(given, inputs))
        others.append(results_of(kernel, params, shorter, "3x4"))
    for each, result, *again in zip(found, results, *others, strict=True):
        whole = _upper(result, each.is_pose)
        numbers = [array.reshape(whole.shape) for array in again]
        differing = [array != whole for array in numbers]
        for array, where in zip(numbers, differing, strict=True):
            np.copyto(whole, array, where=where)
    return results


def _upper(array: Floats, is_pose: bool) -> Floats:
    """Matrices without their last rows."""
    return array[..., :3, :] if is_pose else array
