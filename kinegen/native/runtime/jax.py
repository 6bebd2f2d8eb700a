"""The outputs of this robot in JAX, with derivatives: `import puma560.jax`, then `puma560.jax.fk(q)`.

Each output of joint vectors is a function of arrays of float64 or float32 (..., n), with results (..., *shape). It
works under `jit`, `vmap`, `grad`, `jvp` and what is made of them. Derivatives come from the kernels of Jacobians,
second ones from that of the Hessian; where this package was built without them, a line says so when one is asked for.
On the processor XLA calls the compiled kernels, which read and write its arrays where they lie; other devices take the
operations of the NumPy form. Calls on the processor return when they are done; for that, import this module before JAX
first computes something.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Sequence
from functools import cache, partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from . import _xla, xp
from ._derivatives import kernels_of, members, named, partials, pushed
from ._kernel import Kernel

_PACKAGE = __package__ or ""
_SPACE = "kinegen_" + re.sub(r"\W", "_", _PACKAGE)
_KINDS = ("float64", "float32")
_SHARED = 1 << 13
"""Configurations from which on a call uses all processors."""

# A program may end before results that it did not wait for. XLA's threads, which call kernels through Python, would
# then wait for Python, and Python for them. So calls on the processor return when they are done.
jax.config.update("jax_cpu_enable_async_dispatch", False)


@cache
def _output(name: str) -> Callable[..., Any]:
    """One output as a function of arrays."""
    kernel = kernels_of(_PACKAGE)[name]
    function = _differentiable(name)

    def call(*inputs: Any) -> Any:
        arrays = _checked(name, kernel, inputs)
        if len(arrays) > 1:
            lead = jnp.broadcast_shapes(*(given.shape[:-1] for given in arrays))
            arrays = [jnp.broadcast_to(given, (*lead, given.shape[-1])) for given in arrays]
        return function(*arrays)

    return named(call, kernel)


__getattr__, __dir__ = members(_PACKAGE, __name__, _output)


def _checked(name: str, kernel: Kernel[Any], inputs: Sequence[Any]) -> list[Any]:
    """The inputs as arrays; what is none of a kernel's is refused in one line."""
    if len(inputs) != len(kernel.inputs):
        names = ", ".join(each.name for each in kernel.inputs)
        raise TypeError(f"{name} takes {len(kernel.inputs)} arrays ({names}), {len(inputs)} given")
    arrays = [jnp.asarray(given) for given in inputs]
    known = [kind for kind in _KINDS if kind == "float32" or any(real.itemsize == 8 for real in kernel._reals)]  # noqa: SLF001 - its own package
    for each, array in zip(kernel.inputs, arrays, strict=True):
        if str(array.dtype) not in known:
            raise TypeError(f"{name}: {each.name} is of {array.dtype}, expected {' or '.join(known)}")
        if array.dtype != arrays[0].dtype:
            first = f"{kernel.inputs[0].name} of {arrays[0].dtype}"
            raise TypeError(f"{name}: {each.name} is of {array.dtype}, and {first}: they have to be the same")
        if array.shape[-1:] != each.shape:
            raise ValueError(f"{name}: {each.name} has shape {array.shape}, expected (..., {each.shape[0]})")
    return arrays


@cache
def _differentiable(name: str) -> Any:
    """An output with its derivative; inputs have the same leading axes."""
    kernel = kernels_of(_PACKAGE)[name]

    def evaluate(*inputs: Any) -> Any:
        if {device.platform for device in jax.devices()} == {"cpu"}:
            return _called(name, *inputs)
        pure = lambda *arrays: xp.evaluate(name, *arrays)  # noqa: E731 - a name for a branch
        return jax.lax.platform_dependent(*inputs, cpu=lambda *arrays: _called(name, *arrays), default=pure)

    def derivative(inputs: Any, rates: Any) -> Any:
        known = tuple(kernels_of(_PACKAGE))
        parts = partials(name, known, lambda each, *arrays: _differentiable(each)(*arrays), inputs)
        found = []
        for result, row in zip(kernel.results, parts, strict=True):
            terms = [pushed(part, rate, len(result.shape), jnp.stack) for part, rate in zip(row, rates, strict=True)]
            found.append(sum(terms[1:], terms[0]))
        return function(*inputs), found[0] if len(found) == 1 else tuple(found)

    evaluate.__name__ = evaluate.__qualname__ = name
    function = jax.custom_jvp(evaluate)
    function.defjvp(derivative)
    return function


def _called(name: str, *inputs: Any) -> Any:
    """The kernel on the processor."""
    kernel = kernels_of(_PACKAGE)[name]
    lead, dtype = inputs[0].shape[:-1], inputs[0].dtype
    results = tuple(jax.ShapeDtypeStruct((*lead, *each.shape), dtype) for each in kernel.results)
    target = _target(name)
    if target:
        found = jax.ffi.ffi_call(target, results, vmap_method="broadcast_all")(*inputs)
    else:
        found = jax.pure_callback(partial(_on_host, name), results, *inputs, vmap_method="broadcast_all")
    return found[0] if len(results) == 1 else tuple(found)


def _on_host(name: str, *inputs: Any) -> tuple[Any, ...]:
    """The results of a kernel as NumPy arrays."""
    found = kernels_of(_PACKAGE)[name](*map(np.asarray, inputs))
    return found if isinstance(found, tuple) else (found,)


_kept: list[Any] = []
"""Handlers that XLA knows; they have to live as long as it does."""


@cache
def _target(name: str) -> str:
    """Makes a kernel known to XLA, and returns its name there; empty where XLA does not take it."""
    kernel = kernels_of(_PACKAGE)[name]

    def compute(arguments: list[Any], results: list[Any]) -> None:
        count = arguments[0].size // arguments[0].shape[-1]
        out = results[0] if len(results) == 1 else tuple(results)
        kernel(*arguments, out=out, threads=0 if count >= _SHARED else 1)

    handler = _xla.handler(compute)
    _kept.append(handler)
    target = f"{_SPACE}_{name}_{len(_kept)}_{os.getpid()}"
    try:
        jax.ffi.register_ffi_target(target, jax.ffi.pycapsule(handler), platform="cpu")
    except (
        jax.errors.JaxRuntimeError
    ):  # another version of the interface: XLA's own way into Python serves, with copies
        return ""
    return target
