"""Outputs in PyTorch: custom operators around the compiled kernels, with gradients from those of Jacobians."""

# mypy: disable-error-code="no-untyped-call, attr-defined"
from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

import torch
from torch._functorch.autograd_function import enable_single_level_autograd_function
from torch._library.custom_ops import get_library_allowing_overwrite
from torch.autograd import forward_ad

from . import _gradients, xp
from ._derivatives import (
    apart,
    in_order,
    kernels_of,
    members,
    named,
    partials,
    pulled,
    pushed,
    sources_of,
    without_column,
)
from ._engines import PACKAGE
from ._kernel import Kernel
from ._parameters import checked_params

_SPACE = "kinegen_" + re.sub(r"\W", "_", PACKAGE)
_KINDS = (torch.float64, torch.float32)
_HALVES = (torch.float16, torch.bfloat16)
_SHARED = 1 << 13
"""Configurations from which on a call uses all threads of PyTorch."""


@cache
def _output(name: str) -> Callable[..., Any]:
    """One output as a function of tensors."""
    kernel = kernels_of(PACKAGE)[name]
    operator = _operator(name, is_varied=False)
    varied = None if kernel._params is None else _operator(name, is_varied=True)  # noqa: SLF001 - its own package

    def call(*inputs: torch.Tensor, params: Any = None, **by_name: torch.Tensor) -> Any:
        inputs = _widened(in_order(name, kernel, inputs, by_name))
        _check(name, kernel, inputs)
        if params is not None:
            inputs = (*inputs, _table(name, kernel, params, inputs[0]))
        if len(inputs) > 1:
            lead = torch.broadcast_shapes(*(given.shape[:-1] for given in inputs))
            inputs = tuple(given.expand(*lead, given.shape[-1]) for given in inputs)
        return operator(*inputs) if params is None or varied is None else varied(*inputs)

    return named(call, kernel)


__getattr__, __dir__ = members(PACKAGE, f"{PACKAGE}.torch", _output)


def _widened(inputs: tuple[Any, ...]) -> tuple[Any, ...]:
    """The half precision that `torch.autocast` made of float32, as float32 again; everything else as it is."""
    halves = [isinstance(each, torch.Tensor) and each.dtype in _HALVES for each in inputs]
    if not any(halves) or not torch.is_autocast_enabled(inputs[halves.index(True)].device.type):
        return inputs
    return tuple(each.float() if is_half else each for each, is_half in zip(inputs, halves, strict=True))


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


def _table(name: str, kernel: Kernel[Any], params: Any, q: torch.Tensor) -> torch.Tensor:
    """Runtime parameters, numbers or tensors (...), as one tensor (..., P) of the type and device of joint values."""
    values = []
    for label, value in checked_params(name, params, kernel._params)._asdict().items():  # noqa: SLF001 - its own package
        if not isinstance(value, (torch.Tensor, float, int)):
            kind = type(value).__name__
            raise TypeError(f"{name}: params.{label} is of type {kind}, expected a torch.Tensor or a number")
        if isinstance(value, torch.Tensor) and (value.dtype != q.dtype or value.device != q.device):
            both = f"{value.dtype} on {value.device}, and q of {q.dtype} on {q.device}"
            raise TypeError(f"{name}: params.{label} is of {both}: they have to be the same")
        values.append(
            value if isinstance(value, torch.Tensor) else torch.full((), value, dtype=q.dtype, device=q.device)
        )
    return torch.stack(torch.broadcast_tensors(*values), -1)


def _kinds(kernel: Kernel[Any]) -> tuple[torch.dtype, ...]:
    """The types that results have too: a package for float alone gives float32 whatever it is given."""
    return _KINDS if any(real.itemsize == 8 for real in kernel._reals) else _KINDS[1:]  # noqa: SLF001 - its own package


def _evaluate(name: str, *inputs: torch.Tensor) -> Any:
    """An output as an operator, for derivatives."""
    return _operator(name, is_varied=len(inputs) > len(kernels_of(PACKAGE)[name].inputs))(*inputs)


@cache
def _operator(name: str, *, is_varied: bool) -> Any:
    """The operator of an output: evaluation, shapes, batches and gradients.

    Args:
        name: Name of the output.
        is_varied: Whether a table of runtime parameters (..., P) follows the inputs. By name alone: an operator that
            is defined again takes the place of the first, which may be in use.
    """
    kernel = kernels_of(PACKAGE)[name]
    given = ", ".join(f"Tensor {each}" for each in [*(each.name for each in kernel.inputs), *["params"] * is_varied])
    gives = ", ".join(["Tensor"] * len(kernel.results))
    schema = f"({given}) -> {gives if len(kernel.results) == 1 else f'({gives})'}"

    def run(*inputs: torch.Tensor) -> Any:
        if inputs[0].device.type != "cpu":
            own, params = apart(kernel, inputs)
            return xp.evaluate(name, *own, params=params)
        own, params = apart(kernel, [each.detach().numpy() for each in inputs])
        return _tensors(kernel(*own, params=params, threads=_threads(inputs[0])))

    def shapes(*inputs: torch.Tensor) -> Any:
        lead = inputs[0].shape[:-1]
        found = tuple(inputs[0].new_empty((*lead, *each.shape)) for each in kernel.results)
        return found[0] if len(found) == 1 else found

    own_name = f"{name}__params" if is_varied else name
    return _defined(own_name, schema, run, shapes, len(kernel.results), lambda operator: _tracked(name, operator))


def _defined(
    name: str,
    schema: str,
    run: Callable[..., Any],
    shapes: Callable[..., Any],
    results: int,
    tracked: Callable[[Any], Callable[..., Any]],
) -> Any:
    """An operator.

    Args:
        name: Its name.
        schema: Its arguments and results.
        run: Computes it.
        shapes: Makes tensors of the shapes of its results.
        results: How many it has.
        tracked: Makes of the operator what it does where PyTorch keeps track of derivatives. The dispatcher calls that
            for one level of derivatives at a time: for tensors, for dual tensors, for each level of `torch.func`, and
            when `torch.compile` traces these.
    """
    library = get_library_allowing_overwrite(_SPACE, name)  # a package that is imported again replaces its operators
    library.define(f"{name}{schema}", tags=(torch.Tag.pt2_compliant_tag,))
    library.impl(name, run, "CompositeExplicitAutograd")
    operator = getattr(getattr(torch.ops, _SPACE), name).default
    torch.library.register_fake(operator, shapes, lib=library)
    torch.library.register_vmap(operator, _mapped(operator, results), lib=library)
    library.impl(name, tracked(operator), "Autograd", with_keyset=True)
    return operator


def _tracked(name: str, operator: Any) -> Callable[..., Any]:
    """What an operator does where PyTorch keeps track of derivatives.

    Forward mode is made of operations on primals and tangents, which have derivatives themselves, so that modes can be
    nested. Reverse mode is a function with a gradient.
    """

    def forward(ctx: Any, keyset: Any, kept: tuple[torch.Tensor, ...], *inputs: torch.Tensor) -> Any:
        # The inputs alone, since their Jacobians are computed when they are asked for; with their tangents.
        ctx.save_for_backward(*kept)
        # PyTorch turns derivatives off in here, which is meant for this level and not for those around it.
        with torch.enable_grad(), forward_ad._set_fwd_grad_enabled(True):  # noqa: SLF001
            return _untracked(operator, keyset, inputs)

    # One level already: a function of several levels would go through the dispatcher of `torch.func` again.
    kind = torch.autograd.function._SingleLevelFunction  # noqa: SLF001
    members = {"forward": staticmethod(forward), "backward": staticmethod(_backward(name))}
    reverse: Any = type(f"{name}_function", (kind,), members)

    def tracked(keyset: Any, *inputs: torch.Tensor) -> Any:
        duals = _duals(inputs)
        rates = [each.tangent for each in duals]
        primals = [given if each.tangent is None else each.primal for given, each in zip(inputs, duals, strict=True)]
        if torch.is_grad_enabled() and any(each.requires_grad for each in inputs):
            with enable_single_level_autograd_function():
                found = reverse.apply(keyset, inputs, *primals)
        else:
            found = _untracked(operator, keyset, primals)
        is_dual = any(each is not None for each in rates)
        return _dual(found, _pushed(name, primals, rates)) if is_dual else found

    return tracked


def _untracked(operator: Any, keyset: Any, inputs: Sequence[torch.Tensor]) -> Any:
    """The operator at the next level below this one."""
    with torch._C._AutoDispatchBelowAutograd():  # noqa: SLF001 - as torch.library does it
        return operator.redispatch(keyset & torch._C._after_autograd_keyset, *inputs)  # noqa: SLF001


def _duals(tensors: Sequence[torch.Tensor]) -> list[forward_ad.UnpackedDualTensor]:
    """Primals with their tangents, which are None for plain tensors."""
    # PyTorch has one level of dual tensors; its Python variable for it is not set while compiled code runs.
    return [forward_ad.unpack_dual(each, level=0) for each in tensors]


def _dual(primals: Any, tangents: Any) -> Any:
    """Results with their tangents."""
    if isinstance(primals, tuple):
        return tuple(forward_ad.make_dual(*each, level=0) for each in zip(primals, tangents, strict=True))
    return forward_ad.make_dual(primals, tangents, level=0)


def _pushed(name: str, inputs: Sequence[torch.Tensor], rates: Sequence[torch.Tensor | None]) -> Any:
    """The rates of the results of an output, from those of its inputs."""
    kernel = kernels_of(PACKAGE)[name]
    parts = _partials(name, inputs, [rate is not None for rate in rates])
    found = []
    for result, row in zip(kernel.results, parts, strict=True):
        terms = [
            pushed(part, rate, len(result.shape), torch.stack)
            for part, rate in zip(row, rates, strict=True)
            if rate is not None
        ]
        found.append(sum(terms[1:], terms[0]))
    return found[0] if len(found) == 1 else tuple(found)


def _partials(name: str, inputs: Sequence[torch.Tensor], wanted: Sequence[bool]) -> list[list[Any]]:
    """How each result of an output depends on those of its inputs that are wanted."""
    lacking = without_column(PACKAGE) if len(inputs) > len(kernels_of(PACKAGE)[name].inputs) else ()
    return partials(name, tuple(kernels_of(PACKAGE)), _evaluate, inputs, wanted, lacking)


def _threads(q: torch.Tensor) -> int:
    return torch.get_num_threads() if q.numel() >= _SHARED * q.shape[-1] else 1


def _tensors(found: Any) -> Any:
    return tuple(map(torch.from_numpy, found)) if isinstance(found, tuple) else torch.from_numpy(found)


def _backward(name: str) -> Callable[..., Any]:
    """The gradient of an output by its inputs."""

    def backward(ctx: Any, *gradients: torch.Tensor | None) -> Any:
        inputs = ctx.saved_tensors
        is_plain = len(inputs) == 1 and inputs[0].device.type == "cpu" and not torch.is_grad_enabled()
        if is_plain and _gradients.is_quick(name) and gradients[0] is not None:
            sources_of(name, tuple(kernels_of(PACKAGE)))  # says what is missing
            return None, None, _gradient_operator(name)(inputs[0], gradients[0])
        return None, None, *_pulled(name, inputs, gradients, ctx.needs_input_grad[2:])

    return backward


def _pulled(
    name: str, inputs: Sequence[torch.Tensor], gradients: Sequence[torch.Tensor | None], wanted: Sequence[bool]
) -> list[torch.Tensor | None]:
    """The gradients by the inputs of an output, in operators that have derivatives themselves."""
    kernel = kernels_of(PACKAGE)[name]
    parts = _partials(name, inputs, wanted)
    totals: list[Any] = [None] * len(inputs)
    for result, row, gradient in zip(kernel.results, parts, gradients, strict=True):
        for place, part in enumerate(row):
            if gradient is not None and wanted[place]:
                found = pulled(part, gradient, len(result.shape), torch.stack)
                totals[place] = found if totals[place] is None else totals[place] + found
    return totals


@cache
def _gradient_operator(name: str) -> Any:
    """The gradient by joint vectors on the processor, where no gradient of it is asked for."""
    kernels = kernels_of(PACKAGE)

    def run(q: torch.Tensor, gradient: torch.Tensor) -> torch.Tensor:
        arrays = (q.detach().numpy(), gradient.detach().numpy())
        return torch.from_numpy(_gradients.gradient(kernels, name, *arrays, _threads(q)))

    def tracked(operator: Any) -> Callable[..., Any]:
        def called(keyset: Any, *inputs: torch.Tensor) -> Any:
            if any(each.tangent is not None for each in _duals(inputs)):
                return _pulled(name, inputs[:1], inputs[1:], (True,))[0]
            return _untracked(operator, keyset, inputs)

        return called

    schema = "(Tensor q, Tensor gradient) -> Tensor"
    return _defined(f"{name}_gradient", schema, run, lambda q, _gradient: q.new_empty(q.shape), 1, tracked)


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
