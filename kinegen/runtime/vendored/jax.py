"""Outputs in JAX: custom derivatives around the compiled kernels, which XLA calls on the processor."""

# mypy: disable-error-code="no-untyped-call, attr-defined"
from __future__ import annotations

import os
import re
import string
from collections.abc import Callable, Sequence
from functools import cache, partial
from itertools import islice
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.custom_derivatives import SymbolicZero
from jax.experimental.custom_partitioning import custom_partitioning
from jax.sharding import NamedSharding, PartitionSpec

from . import _xla, xp
from ._derivatives import apart, in_order, kernels_of, members, named, partials, pushed, without_column
from ._engines import PACKAGE
from ._kernel import Kernel
from ._parameters import checked_params

_SPACE = "kinegen_" + re.sub(r"\W", "_", PACKAGE)
_KINDS = ("float64", "float32")
_SHARED = 1 << 13
"""Configurations from which on a call uses all processors."""

# A program may end before results that it did not wait for. XLA's threads, which call kernels through Python, would
# then wait for Python, and Python for them. So calls on the processor return when they are done.
jax.config.update("jax_cpu_enable_async_dispatch", False)


@cache
def _output(name: str) -> Callable[..., Any]:
    """One output as a function of arrays."""
    kernel = kernels_of(PACKAGE)[name]
    function = _differentiable(name)

    def call(*inputs: Any, params: Any = None, **by_name: Any) -> Any:
        arrays = _checked(name, kernel, in_order(name, kernel, inputs, by_name))
        if params is not None:
            arrays.append(_table(name, kernel, params, arrays[0].dtype))
        if len(arrays) > 1:
            lead = jnp.broadcast_shapes(*(given.shape[:-1] for given in arrays))
            arrays = [jnp.broadcast_to(given, (*lead, given.shape[-1])) for given in arrays]
        return function(*arrays)

    return named(call, kernel)


__getattr__, __dir__ = members(PACKAGE, f"{PACKAGE}.jax", _output)


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


def _table(name: str, kernel: Kernel[Any], params: Any, kind: Any) -> Any:
    """Runtime parameters, numbers or arrays (...), as one array (..., P) of the type of the joint values."""
    values = []
    for label, value in checked_params(name, params, kernel._params)._asdict().items():  # noqa: SLF001 - its own package
        array = jnp.asarray(value, kind if isinstance(value, (float, int)) else None)
        if array.dtype != kind:
            raise TypeError(f"{name}: params.{label} is of {array.dtype}, and q of {kind}: they have to be the same")
        values.append(array)
    return jnp.stack(jnp.broadcast_arrays(*values), -1)


@cache
def _differentiable(name: str) -> Any:
    """An output with its derivative; inputs have the same leading axes."""
    kernel = kernels_of(PACKAGE)[name]

    def evaluate(*inputs: Any) -> Any:
        if {device.platform for device in jax.devices()} == {"cpu"}:
            return _called(name, *inputs)

        def pure(*arrays: Any) -> Any:
            own, params = apart(kernel, arrays)
            return xp.evaluate(name, *own, params=params)

        return jax.lax.platform_dependent(*inputs, cpu=lambda *arrays: _called(name, *arrays), default=pure)

    def derivative(inputs: Any, rates: Any) -> Any:
        wanted = [not isinstance(rate, SymbolicZero) for rate in rates]
        lacking = without_column(PACKAGE) if len(inputs) > len(kernel.inputs) else ()
        known = tuple(kernels_of(PACKAGE))
        parts = partials(name, known, lambda each, *arrays: _differentiable(each)(*arrays), inputs, wanted, lacking)
        found = []
        for result, row in zip(kernel.results, parts, strict=True):
            terms = [
                pushed(part, rate, len(result.shape), jnp.stack)
                for part, rate in zip(row, rates, strict=True)
                if part is not None and not isinstance(rate, SymbolicZero)
            ]
            found.append(sum(terms[1:], terms[0]))
        return function(*inputs), found[0] if len(found) == 1 else tuple(found)

    evaluate.__name__ = evaluate.__qualname__ = name
    function = jax.custom_jvp(evaluate)
    function.defjvp(derivative, symbolic_zeros=True)
    return function


def _called(name: str, *inputs: Any) -> Any:
    """The kernel on the processor; each of several devices computes its own rows of a sharded array."""
    if len(jax.local_devices(backend="cpu")) == 1 or any(map(_varying, inputs)):
        return _on_one(name, *inputs)
    lead = max((_explicit(each) for each in inputs), key=lambda spec: sum(each is not None for each in spec))
    if not any(each is not None for each in lead):
        return _sharded(name, len(inputs))(*inputs)
    # A mesh with explicit axes: how results are sharded is part of their type.
    given = PartitionSpec(*lead, None)
    ranks = [len(each.shape) for each in kernels_of(PACKAGE)[name].results]
    specs = tuple(PartitionSpec(*lead, *(None,) * rank) for rank in ranks)
    local = jax.shard_map(partial(_on_one, name), in_specs=given, out_specs=specs[0] if len(specs) == 1 else specs)
    return local(*(jax.sharding.reshard(each, given) for each in inputs))


def _varying(array: Any) -> frozenset[str]:
    """The axes of devices along which an array of one device inside `shard_map` varies."""
    kind = jax.typeof(array)
    return frozenset(kind.manual_axis_type.varying if hasattr(kind, "manual_axis_type") else getattr(kind, "vma", ()))


def _explicit(array: Any) -> tuple[Any, ...]:
    """How the leading axes of an array are sharded over explicit axes of devices."""
    return tuple(jax.typeof(array).sharding.spec)[:-1]


def _on_one(name: str, *inputs: Any) -> Any:
    """The kernel on one device."""
    kernel, target = kernels_of(PACKAGE)[name], _target(name)
    results = tuple(_result(each.shape, inputs) for each in kernel.results)
    if target:
        found = jax.ffi.ffi_call(target, results, vmap_method="broadcast_all")(*inputs)
    else:
        found = jax.pure_callback(partial(_on_host, name), results, *inputs, vmap_method="broadcast_all")
    return found[0] if len(results) == 1 else tuple(found)


def _result(shape: tuple[int, ...], inputs: Sequence[Any]) -> Any:
    """Shape and type of a result: inside `shard_map` it varies along the axes of devices along which inputs do."""
    given = inputs[0]
    axes, named = frozenset[str]().union(*map(_varying, inputs)), dict[str, Any]()
    if axes and hasattr(jax.typeof(given), "manual_axis_type"):
        mesh, kind = jax.typeof(given).sharding.mesh, jax.typeof(given).manual_axis_type
        named = {"manual_axis_type": kind.update(varying=axes), "sharding": NamedSharding(mesh, PartitionSpec())}
    elif axes:
        named = {"vma": axes}
    return jax.ShapeDtypeStruct((*given.shape[:-1], *shape), given.dtype, **named)


@cache
def _sharded(name: str, count: int) -> Any:
    """The kernel as a function of `count` sharded arrays: leading axes stay as they are sharded, others are whole."""
    kernel = kernels_of(PACKAGE)[name]
    ranks = [len(each.shape) for each in kernel.results]

    def kept(mesh: Any, arguments: Any, rank: int) -> Any:
        lead = len(arguments[0].shape) - 1
        spec = tuple(getattr(arguments[0].sharding, "spec", ()))[:lead]  # none where XLA has not sharded it
        return NamedSharding(mesh, PartitionSpec(*spec, *(None,) * (lead - len(spec) + rank)))

    def shardings(mesh: Any, arguments: Any, results: Any) -> Any:
        del results
        found = tuple(kept(mesh, arguments, rank) for rank in ranks)
        return found[0] if len(found) == 1 else found

    def partition(mesh: Any, arguments: Any, results: Any) -> Any:
        given = tuple(kept(mesh, arguments, 1) for _ in arguments)
        return mesh, partial(_on_one, name), shardings(mesh, arguments, results), given

    whole = custom_partitioning(partial(_on_one, name))
    # Each axis of a joint vector and of a result has a letter of its own, as in `... a, ... b -> ... c d`.
    letters = iter(string.ascii_lowercase)
    sides = [[" ".join(["...", *islice(letters, rank)]) for rank in each] for each in ([1] * count, ranks)]
    rule = " -> ".join(", ".join(each) for each in sides)
    factors = tuple(string.ascii_lowercase[: count + sum(ranks)])
    whole.def_partition(
        partition, infer_sharding_from_operands=shardings, sharding_rule=rule, need_replication_factors=factors
    )
    return _batched(whole, len(ranks))


def _batched(function: Any, results: int) -> Any:
    """A function under `vmap`: one more axis of a batch is one more leading axis of all inputs."""
    batched = jax.custom_batching.custom_vmap(function)

    def rule(size: int, moved: Sequence[bool], *inputs: Any) -> Any:
        whole = [
            given if is_moved else jnp.broadcast_to(given, (size, *given.shape))
            for given, is_moved in zip(inputs, moved, strict=True)
        ]
        return batched(*whole), True if results == 1 else (True,) * results

    batched.def_vmap(rule)
    return batched


def _on_host(name: str, *inputs: Any) -> tuple[Any, ...]:
    """The results of a kernel as NumPy arrays."""
    kernel = kernels_of(PACKAGE)[name]
    own, params = apart(kernel, [*map(np.asarray, inputs)])
    found = kernel(*own, params=params)
    return found if isinstance(found, tuple) else (found,)


_kept: list[Any] = []
"""Handlers that XLA knows; they have to live as long as it does."""


@cache
def _target(name: str) -> str:
    """Makes a kernel known to XLA, and returns its name there; empty where XLA does not take it."""
    kernel = kernels_of(PACKAGE)[name]

    def compute(arguments: list[Any], results: list[Any]) -> None:
        count = arguments[0].size // arguments[0].shape[-1]
        out = results[0] if len(results) == 1 else tuple(results)
        own, params = apart(kernel, arguments)
        kernel(*own, params=params, out=out, threads=0 if count >= _SHARED else 1)

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
