"""Derivatives of outputs from the kernels of Jacobians and the Hessian, for any library of arrays.

Nothing here differentiates a program. A pose T = (R, p) whose joints move with rates qd changes by dR = w x R (each
column) and dp = v, where (v, w) = J qd is the velocity in the axes of the base at the origin of the frame; all other
outputs have kernels of their plain partial derivatives. The arrays may belong to any library that indexes, multiplies
and sums as NumPy does; what they are computed with is given as `evaluate`, which a library can differentiate again.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from ._kernel import Kernel

Evaluate = Callable[..., Any]
"""Called with the name of a kernel and its inputs, which a table of runtime parameters (..., P) may follow."""

Stack = Callable[[list[Any], int], Any]
"""Puts arrays of one shape side by side along a new axis."""

_ORIENTATIONS = ("quaternion_wxyz", "quaternion_xyzw", "rpy_zyx", "rpy_xyz", "euler_zyz", "axis_angle")
_SOURCES: dict[str, tuple[str, ...]] = {
    "fk": ("jacobian",),
    "fk_actuators": ("jacobian_actuators",),
    "position": ("jacobian",),
    "jacobian": ("hessian",),
    "fk_jacobian": ("jacobian", "hessian"),
    "twist": ("jacobian", "hessian"),
    **{name: (f"{name}_jacobian",) for name in _ORIENTATIONS},
}
"""What the derivatives of an output are made of; other outputs have none."""

_OTHERS = tuple(
    [f"{stem}_{axes}" for stem in ("jacobian", "fk_jacobian", "twist") for axes in ("local", "world")]
    + [f"{name}_jacobian" for name in _ORIENTATIONS]
    + ["jacobian_actuators"]
)
"""Names that begin as one above does, and are other outputs."""


class NoDerivativeError(NotImplementedError):
    """An output has no derivative in this package; the message says why, and which build has it."""


class Part(NamedTuple):
    """How one result depends on one input.

    Attributes:
        slopes: Partial derivatives (..., *result, input), or the Jacobian (..., [tips], 6, n) of a pose.
        pose: Of a pose its value, else None.
    """

    slopes: Any
    pose: Any = None


def kernels_of(package: str) -> dict[str, Kernel[Any]]:
    """The kernels of a package that compute something of joint vectors, by name.

    Args:
        package: Name of an imported package of this kind.
    """
    found = {name: each for name, each in vars(sys.modules[package]).items() if isinstance(each, Kernel)}
    return {
        name: each
        for name, each in found.items()
        if each.kind == "kernel"
        and all(len(given.shape) == 1 for given in each.inputs)
        and not any(result.is_truth for result in each.results)
    }


def apart(kernel: Kernel[Any], inputs: Sequence[Any]) -> tuple[tuple[Any, ...], Any]:
    """The inputs of a kernel, and the runtime parameters (..., P) that may follow them, as `Params`, or None."""
    count = len(kernel.inputs)
    own = tuple(inputs[:count])
    if len(inputs) == count:
        return own, None
    table = inputs[count]
    return own, kernel._params._make(table[..., place] for place in range(table.shape[-1]))  # noqa: SLF001 - its own package


def without_column(package: str) -> tuple[str, ...]:
    """The runtime parameters by which `parameter_jacobian` of a package has no column.

    Args:
        package: Name of an imported package of this kind.
    """
    module = sys.modules[package]
    known = getattr(module, "PARAMETERS", ())
    return tuple(name for name in module.Params._fields if name not in known)


def members(
    package: str, module: str, function: Callable[[str], Callable[..., Any]]
) -> tuple[Callable[[str], Callable[..., Any]], Callable[[], list[str]]]:
    """What a module of outputs for another library has as `__getattr__` and `__dir__`.

    Args:
        package: Name of the package.
        module: Name of the module.
        function: Makes the function of an output from its name.
    """

    def attribute(name: str) -> Callable[..., Any]:
        if name.startswith("__") or name not in kernels_of(package):
            raise AttributeError(f"module {module!r} has no attribute {name!r}")
        return function(name)

    def names() -> list[str]:
        return sorted(kernels_of(package))

    return attribute, names


def named(function: Callable[..., Any], kernel: Kernel[Any]) -> Callable[..., Any]:
    """A function with the name and the text of a kernel."""
    function.__name__ = function.__qualname__ = kernel.__name__
    function.__doc__ = kernel.__doc__
    return function


def in_order(name: str, kernel: Kernel[Any], inputs: tuple[Any, ...], by_name: dict[str, Any]) -> tuple[Any, ...]:
    """The inputs of a call in the order of the kernel; like those of the kernel, they may be given by name.

    Raises:
        TypeError: If a name is not that of an input, or an input is given twice.
    """
    if not by_name:
        return inputs
    names = [each.name for each in kernel.inputs]
    for each in by_name:
        if each not in names[len(inputs) :]:
            fault = "is given twice" if each in names else f"is not an input (expected {', '.join(names)})"
            raise TypeError(f"{name}: {each} {fault}")
    return (*inputs, *(by_name[each] for each in names[len(inputs) :] if each in by_name))


def stem_of(name: str) -> tuple[str, str]:
    """The name of a kernel without its frame, and the rest: `fk` and `_elbow`."""
    stems = (stem for stem in (*_SOURCES, *_OTHERS) if name == stem or name.startswith(f"{stem}_"))
    stem = max(stems, key=len, default=name)
    return stem, name[len(stem) :]


def sources_of(name: str, known: Sequence[str]) -> tuple[str, ...]:
    """The names of the kernels that the derivatives of an output are made of.

    Args:
        name: Name of a kernel.
        known: Names of all kernels of the package.

    Raises:
        NoDerivativeError: If there are none; the message names the output that is missing.
    """
    stem, frame = stem_of(name)
    if stem not in _SOURCES:
        raise NoDerivativeError(f"{name}: kinegen has no derivative of this output")
    found = []
    for source in _SOURCES[stem]:
        both = f"fk_{source}{frame}"  # pose and Jacobian at once
        chosen = next((each for each in (f"{source}{frame}", both) if each in known), None)
        if chosen is None:
            output = f"{source}@{frame[1:]}" if frame else source
            raise NoDerivativeError(
                f"{name}: its derivative takes the output {output}, which this package was built without "
                f"(add it to kinegen build --outputs)"
            )
        found.append(chosen)
    return tuple(found)


def partials(
    name: str,
    known: Sequence[str],
    evaluate: Evaluate,
    inputs: Sequence[Any],
    wanted: Sequence[bool] | None = None,
    lacking: Sequence[str] = (),
) -> list[list[Part | None]]:
    """How each result of a kernel depends on each input.

    Args:
        name: Name of the kernel.
        known: Names of all kernels of the package.
        evaluate: What evaluates one of them.
        inputs: Its inputs (..., n), with the same leading axes; a table of runtime parameters (..., P) may follow.
        wanted: Of which of them derivatives are wanted; by default of all.
        lacking: The runtime parameters by which `parameter_jacobian` has no column.

    Returns:
        For each result a list with a part for each input, or None for what is not wanted.

    Raises:
        NoDerivativeError: If there is no kernel for them.
    """
    count = 2 if stem_of(name)[0] == "twist" else 1
    asked = wanted or (True,) * len(inputs)
    parts: list[list[Part | None]] = [[None] * count]
    if any(asked[:count]) or not any(asked):
        parts = [list(row) for row in _by_joints(name, known, evaluate, inputs)]
    if len(inputs) == count:
        return parts
    if not asked[count]:
        return [[*row, None] for row in parts]
    return [[*row, _by_parameters(name, known, evaluate, inputs, lacking)] for row in parts]


def _by_parameters(
    name: str, known: Sequence[str], evaluate: Evaluate, inputs: Sequence[Any], lacking: Sequence[str]
) -> Part:
    """How the one result of a kernel depends on the runtime parameters."""
    stem, frame = stem_of(name)
    if stem not in ("fk", "position"):
        raise NoDerivativeError(f"{name}: kinegen has no derivative of this output by runtime parameters")
    source = f"parameter_jacobian{frame}"
    if source not in known:
        output = f"parameter_jacobian@{frame[1:]}" if frame else "parameter_jacobian"
        raise NoDerivativeError(
            f"{name}: its derivative by runtime parameters takes the output {output}, which this package was built "
            f"without (add it to kinegen build --outputs)"
        )
    if lacking:
        raise NoDerivativeError(
            f"{name}: parameter_jacobian of this package has no column for {', '.join(lacking)} (name all runtime "
            f"parameters in kinegen build --wrt, or none)"
        )
    slopes = evaluate(source, *inputs)
    return Part(slopes, evaluate(name, *inputs)) if stem == "fk" else Part(slopes[..., :3, :])


def _by_joints(name: str, known: Sequence[str], evaluate: Evaluate, inputs: Sequence[Any]) -> list[list[Part]]:
    """How each result of a kernel depends on its own inputs."""
    stem, _ = stem_of(name)
    sources = sources_of(name, known)
    q = (inputs[0], *inputs[2 if stem == "twist" else 1 :])

    def matrix(source: str) -> Any:
        value = evaluate(source, *q)
        return value[1] if isinstance(value, (tuple, list)) else value

    if stem in ("fk", "fk_actuators"):
        if sources[0].startswith("fk_"):
            pose, jacobian = evaluate(sources[0], *q)
            return [[Part(jacobian, pose)]]
        return [[Part(matrix(sources[0]), evaluate(name, *q))]]
    if stem == "fk_jacobian":
        pose, jacobian = evaluate(name, *q)
        return [[Part(jacobian, pose)], [Part(_last(matrix(sources[1])))]]
    if stem == "position":
        return [[Part(matrix(sources[0])[..., :3, :])]]
    if stem == "jacobian":
        return [[Part(_last(matrix(sources[0])))]]
    if stem == "twist":
        # dJ_ij/dq_k qd_j, summed over the joints j, and J.
        return [[Part(_times_rates(matrix(sources[1]), inputs[1])), Part(matrix(sources[0]))]]
    return [[Part(matrix(sources[0]))]]


def _last(hessian: Any) -> Any:
    """dJ/dq with the joint of the derivative last (..., 6, n, n), from what the kernel gives (..., n, 6, n)."""
    return hessian.swapaxes(-3, -2).swapaxes(-2, -1)


def _times_rates(hessian: Any, rates: Any) -> Any:
    """The partial derivatives of J qd by q: (..., 6, n)."""
    return (hessian * _spread(rates, hessian.ndim - rates.ndim)).sum(-1).swapaxes(-2, -1)


def _spread(vector: Any, axes: int) -> Any:
    """A vector (..., n) with axes put in before the last."""
    return vector[(..., *(None,) * axes, slice(None))]


def pulled(part: Part, gradient: Any, rank: int, stack: Stack) -> Any:
    """The gradient of a number by an input, from its gradient by a result.

    Args:
        part: How the result depends on the input.
        gradient: Of the shape of the result.
        rank: Axes of the result for one configuration.
        stack: The library's function of this name.

    Returns:
        Shape (..., n).
    """
    if part.pose is not None:
        gradient, rank = wrench(part.pose, gradient, stack), rank - 1
    total = part.slopes * gradient[..., None]
    for _ in range(rank):
        total = total.sum(-2)
    return total


def pushed(part: Part, rates: Any, rank: int, stack: Stack) -> Any:
    """The rates of a result, from those of an input (..., n); the arguments are those of `pulled`."""
    if part.pose is None:
        return (part.slopes * _spread(rates, rank)).sum(-1)
    twist = (part.slopes * _spread(rates, rank - 1)).sum(-1)
    velocity, (wx, wy, wz) = twist[..., :3], (twist[..., axis, None] for axis in (3, 4, 5))
    x, y, z = (part.pose[..., row, :3] for row in range(3))
    turned = stack([wy * z - wz * y, wz * x - wx * z, wx * y - wy * x], -2)
    columns = [*(turned[..., column] for column in range(3)), velocity]
    upper = stack(columns, -1)
    rows = [upper[..., row, :] for row in range(3)]
    return stack([*rows, rows[0] * 0.0], -2)


def wrench(pose: Any, gradient: Any, stack: Stack) -> Any:
    """Force and moment (..., 6) at the origin of a frame that do the work of a gradient by its pose (..., 4, 4)."""
    x, y, z = (pose[..., row, :3] for row in range(3))
    fx, fy, fz = (gradient[..., row, :3] for row in range(3))
    moments = ((y * fz - z * fy).sum(-1), (z * fx - x * fz).sum(-1), (x * fy - y * fx).sum(-1))
    return stack([*(gradient[..., row, 3] for row in range(3)), *moments], -1)
