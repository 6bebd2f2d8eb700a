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


@dataclass(frozen=True, slots=True)
class Way:
    """One way to call a kernel.

    Attributes:
        target: What is called, such as `C double, batch`.
        call: Joint vectors (N, dof) to results (N, ...), as the package gives them.
    """

    target: str
    call: Callable[[Floats], Floats]


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
    numpy_form = Way(f"NumPy {real}", _bound(_numpy_form(package, kernel, quantity), params))
    if kernel.backend != "c":
        return (numpy_form,)
    compiled = _bound(kernel, params)
    variants = runnable_variants(package)
    batches = [Way(f"C {real}, batch {name}", partial(_in_variant, package, compiled, name)) for name in variants]
    return (
        Way(f"C {real}", lambda points: np.stack([compiled(point) for point in points])),
        *(batches or [Way(f"C {real}, batch", partial(_every_layout, compiled))]),
        numpy_form,
    )


def _in_variant(package: ModuleType, kernel: Callable[..., Floats], name: str, points: Floats) -> Floats:
    select_variant(package, name)
    return _every_layout(kernel, points)


def _bound(kernel: Any, params: Any) -> Callable[..., Floats]:
    return kernel if params is None else lambda points, **options: kernel(points, params=params, **options)


def _numpy_form(package: ModuleType, kernel: Any, quantity: Quantity) -> Callable[..., Floats]:
    """The same kernel as it would be without the compiled extension."""
    params = getattr(package, "Params", None)
    numpy_form: Callable[..., Floats] = type(kernel)(
        quantity.function,
        module=package.__name__,
        symbol="",
        inputs=kernel.inputs,
        results=kernel.results,
        reals=tuple(str(dtype) for dtype in DTYPES.values()),
        formula=getattr(sys.modules[f"{package.__name__}._numpy"], quantity.function),
        params=params() if params else None,
    )
    return numpy_form


def _every_layout(kernel: Callable[..., Floats], points: Floats) -> Floats:
    """The result of a batch; where another layout holds another number, that one."""
    result = kernel(points)
    whole = result[..., :3, :] if result.shape[-2:] == (4, 4) else result
    others = [kernel(points.T, layout="joint_major").T.reshape(whole.shape)]
    if whole is not result:
        others.append(kernel(points, layout="3x4"))
    differing = [other != whole for other in others]
    for other, where in zip(others, differing, strict=True):
        np.copyto(whole, other, where=where)
    return result
