"""The outputs of this robot in PyTorch, with gradients: `import puma560.torch`, then `puma560.torch.fk(q)`.

Each output of joint vectors is a function of tensors of float64 or float32 (..., n), with results (..., *shape). It
is a custom operator: it works under `torch.compile` and in `torch.func`. Gradients come from the kernels of Jacobians,
second ones from that of the Hessian; where this package was built without them, a line says so when a gradient is asked
for. Tensors of the processor are read by the compiled kernels where they lie; those of other devices take the
operations of the NumPy form, in PyTorch.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

import torch

from . import _gradients, xp
from ._derivatives import kernels_of, members, named, partials, pulled, pushed, sources_of
from ._kernel import Kernel

_PACKAGE = __package__ or ""
_SPACE = "kinegen_" + re.sub(r"\W", "_", _PACKAGE)
_KINDS = (torch.float64, torch.float32)
_SHARED = 1 << 13
"""Configurations from which on a call uses all threads of PyTorch."""


@cache
def _output(name: str) -> Callable[..., Any]:
    """One output as a function of tensors."""
    kernel = kernels_of(_PACKAGE)[name]
    operator = _operator(name)
    several = len(kernel.inputs) > 1

    def call(*inputs: torch.Tensor) -> Any:
        _check(name, kernel, inputs)
        if several:
            lead = torch.broadcast_shapes(*(given.shape[:-1] for given in inputs))
            inputs = tuple(given.expand(*lead, given.shape[-1]) for given in inputs)
        return _functions(name).apply(*inputs) if _are_transforms_active() else operator(*inputs)

    return named(call, kernel)


__getattr__, __dir__ = members(_PACKAGE, __name__, _output)


def _check(name: str, kernel: Kernel[Any], inputs: Sequence[Any]) -> None:
    """Refuse inputs that the kernel does not take, in one line."""
    if len(inputs) != len(kernel.inputs):
        names = ", ".join(each.name for each in kernel.inputs)
        raise TypeError(f"{name} takes {len(kernel.inputs)} tensors ({names}), {len(inputs)} given")
    first = inputs[0]
    for each, given in zip(kernel.inputs, inputs, strict=True):
        if not isinstance(given, torch.Tensor):
            raise TypeError(f"{name}: {each.name} is of type {type(given).__name__}, expected a torch.Tensor")
        if given.dtype not in _kinds(kernel):
            kinds = " or ".join(map(str, _kinds(kernel)))
            raise TypeError(f"{name}: {each.name} is of {given.dtype}, expected {kinds}")
        if given.layout != torch.strided:
            raise TypeError(f"{name}: {each.name} has the layout {given.layout}, expected torch.strided")
        if tuple(given.shape[-1:]) != each.shape:
            shape = tuple(given.shape)
            raise ValueError(f"{name}: {each.name} has shape {shape}, expected (..., {each.shape[0]})")
        if given.dtype != first.dtype or given.device != first.device:
            both = f"{given.dtype} on {given.device}, and {kernel.inputs[0].name} of {first.dtype} on {first.device}"
            raise TypeError(f"{name}: {each.name} is of {both}: they have to be the same")


def _kinds(kernel: Kernel[Any]) -> tuple[torch.dtype, ...]:
    """The types that results have too: a package for float alone gives float32 whatever it is given."""
    return _KINDS if any(real.itemsize == 8 for real in kernel._reals) else _KINDS[1:]  # noqa: SLF001 - its own package


def _evaluate(name: str, *inputs: torch.Tensor) -> Any:
    """An output as an operator, for derivatives."""
    return _output(name)(*inputs)


@cache
def _operator(name: str) -> Any:
    """The operator of an output: evaluation, shapes, batches and gradients."""
    kernel = kernels_of(_PACKAGE)[name]
    given = ", ".join(f"Tensor {each.name}" for each in kernel.inputs)
    gives = ", ".join(["Tensor"] * len(kernel.results))
    schema = f"({given}) -> {gives if len(kernel.results) == 1 else f'({gives})'}"

    def run(*inputs: torch.Tensor) -> Any:
        if inputs[0].device.type != "cpu":
            return xp.evaluate(name, *inputs)
        found = kernel(*(each.numpy() for each in inputs), threads=_threads(inputs[0]))
        return _tensors(found)

    def shapes(*inputs: torch.Tensor) -> Any:
        lead = inputs[0].shape[:-1]
        found = tuple(inputs[0].new_empty((*lead, *each.shape)) for each in kernel.results)
        return found[0] if len(found) == 1 else found

    operator = torch.library.custom_op(f"{_SPACE}::{name}", run, mutates_args=(), schema=schema)
    operator.register_fake(shapes)
    operator.register_vmap(_mapped(operator, len(kernel.results)))
    operator.register_autograd(_backward(name), setup_context=_keep)
    return operator


def _are_transforms_active() -> bool:
    """Whether this is inside `torch.func.grad` and the like, which operators cannot serve."""
    return not torch.compiler.is_compiling() and bool(torch._C._are_functorch_transforms_active())  # noqa: SLF001 - PyTorch has no other name for it


@cache
def _functions(name: str) -> Any:
    """The operator as a function with its own gradient, forward and backward, for `torch.func`."""
    kernel, operator, backward = kernels_of(_PACKAGE)[name], _operator(name), _backward(name)

    def jvp(ctx: Any, *rates: Any) -> Any:
        return _pushed(name, ctx.saved_tensors, rates)

    def setup(ctx: Any, inputs: Any, output: Any) -> None:
        _keep(ctx, inputs, output)
        ctx.save_for_forward(*inputs)

    def mapped(info: Any, axes: Any, *inputs: Any) -> Any:
        return _functions(name).apply(*_moved(info, axes, inputs)), 0 if len(kernel.results) == 1 else (0,) * len(
            kernel.results
        )

    members: dict[str, Callable[..., Any]] = {
        "forward": operator.__call__,
        "setup_context": setup,
        "backward": backward,
        "jvp": jvp,
        "vmap": mapped,
    }
    return type(
        f"{name}_function", (torch.autograd.Function,), {key: staticmethod(each) for key, each in members.items()}
    )


def _pushed(name: str, inputs: Sequence[torch.Tensor], rates: Sequence[torch.Tensor | None]) -> Any:
    """The rates of the results of an output, from those of its inputs."""
    kernel = kernels_of(_PACKAGE)[name]
    parts = partials(name, tuple(kernels_of(_PACKAGE)), _evaluate, inputs)
    found = []
    for result, row in zip(kernel.results, parts, strict=True):
        terms = [
            pushed(part, rate, len(result.shape), torch.stack)
            for part, rate in zip(row, rates, strict=True)
            if rate is not None
        ]
        found.append(sum(terms[1:], terms[0]))
    return found[0] if len(found) == 1 else tuple(found)


def _threads(q: torch.Tensor) -> int:
    return torch.get_num_threads() if q.numel() >= _SHARED * q.shape[-1] else 1


def _tensors(found: Any) -> Any:
    return tuple(map(torch.from_numpy, found)) if isinstance(found, tuple) else torch.from_numpy(found)


def _keep(ctx: Any, inputs: tuple[torch.Tensor, ...], output: Any) -> None:
    """What the gradient needs: the inputs alone, since their Jacobians are computed when they are asked for."""
    del output
    ctx.save_for_backward(*inputs)


def _backward(name: str) -> Callable[..., Any]:
    """The gradient of an output by its inputs."""
    kernel = kernels_of(_PACKAGE)[name]

    def backward(ctx: Any, *gradients: torch.Tensor | None) -> Any:
        inputs = ctx.saved_tensors
        known = tuple(kernels_of(_PACKAGE))
        sources_of(name, known)  # says what is missing
        quick = not torch.is_grad_enabled() and inputs[0].device.type == "cpu" and _gradients.is_quick(name)
        if quick and gradients[0] is not None:
            return _gradient_operator(name)(inputs[0], gradients[0])
        # In operators that have gradients themselves, for second derivatives.
        parts = partials(name, known, _evaluate, inputs)
        totals: list[Any] = [None] * len(inputs)
        for result, row, gradient in zip(kernel.results, parts, gradients, strict=True):
            for place, part in enumerate(row):
                if gradient is not None and ctx.needs_input_grad[place]:
                    found = pulled(part, gradient, len(result.shape), torch.stack)
                    totals[place] = found if totals[place] is None else totals[place] + found
        return totals[0] if len(totals) == 1 else tuple(totals)

    return backward


@cache
def _gradient_operator(name: str) -> Any:
    """The gradient by joint vectors on the processor, where no gradient of it is asked for."""
    kernels = kernels_of(_PACKAGE)

    def run(q: torch.Tensor, gradient: torch.Tensor) -> torch.Tensor:
        return torch.from_numpy(_gradients.gradient(kernels, name, q.numpy(), gradient.numpy(), _threads(q)))

    schema = "(Tensor q, Tensor gradient) -> Tensor"
    operator = torch.library.custom_op(f"{_SPACE}::{name}_gradient", run, mutates_args=(), schema=schema)
    operator.register_fake(lambda q, _gradient: q.new_empty(q.shape))
    operator.register_vmap(_mapped(operator, 1))
    return operator


def _mapped(operator: Any, results: int) -> Callable[..., Any]:
    """The rule of an operator for `vmap`."""

    def mapped(info: Any, axes: Sequence[int | None], *inputs: torch.Tensor) -> Any:
        return operator(*_moved(info, axes, inputs)), 0 if results == 1 else (0,) * results

    return mapped


def _moved(info: Any, axes: Sequence[int | None], inputs: Sequence[torch.Tensor]) -> list[torch.Tensor]:
    """One more axis of a batch is one more leading axis of all inputs."""
    size = info.batch_size
    return [
        given.unsqueeze(0).expand(size, *given.shape) if axis is None else given.movedim(axis, 0)
        for given, axis in zip(inputs, axes, strict=True)
    ]
