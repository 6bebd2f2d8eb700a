"""JAX: one pose as a product of link matrices, or as the closed form of the kernels, through `jit(vmap(...))`."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np

from benchmarks.speed.arm import Arm, Array, dtype
from benchmarks.speed.peers import Peer
from kinegen.ir.program import Constant, Operand, Operator, RuntimeParameter, Temporary, Variable


def peers(arm: Arm) -> Iterator[Peer]:
    """Both forms in both number types."""
    jax: Any = importlib.import_module("jax")
    jax.config.update("jax_enable_x64", True)
    for real in ("double", "float"):
        for name, form in (("link matrices", product), ("closed form", _closed_form)):
            function = jax.jit(jax.vmap(partial(form, jax.numpy, arm, dtype(real))))
            yield Peer(
                name=f"JAX jit(vmap), {name}",
                package="jax",
                real=real,
                batch=partial(_batch, jax, function),
                result=np.asarray,
                single=partial(_single, jax, function),
            )


def _batch(jax: Any, function: Callable[[Any], Any], q: Array) -> Callable[[], Any]:
    on_device = jax.numpy.asarray(q)
    return lambda: function(on_device).block_until_ready()


def _single(jax: Any, function: Callable[[Any], Any], q: Array) -> tuple[Callable[[Any], Any], Any]:
    return lambda one: function(one).block_until_ready(), jax.numpy.asarray(q[None])


def product(jnp: Any, arm: Arm, real: type, q: Any) -> Any:
    """One pose as a product of link matrices."""
    pose = jnp.eye(4, dtype=real)
    for link in arm.links:
        theta = real(link.theta) + (q[link.joint] if link.joint is not None else real(0))
        rows = link.matrix(jnp.cos(theta), jnp.sin(theta), lambda value: real(float(value)))
        pose = pose @ jnp.array(rows, dtype=real)
    return pose


def _closed_form(jnp: Any, arm: Arm, real: type, q: Any) -> Any:
    values: dict[str, Any] = {}

    def operand(value: Operand) -> Any:
        match value:
            case Variable(index):
                return q[index]
            case Constant(number):
                return real(float(number))
            case Temporary(name):
                return values[name]
            case RuntimeParameter():
                raise NotImplementedError("left out: runtime parameters")

    functions: dict[Operator, tuple[Callable[..., Any], ...]] = {
        Operator.ADD: (lambda a, b: a + b,),
        Operator.SUB: (lambda a, b: a - b,),
        Operator.MUL: (lambda a, b: a * b,),
        Operator.DIV: (lambda a, b: a / b,),
        Operator.NEG: (lambda a: -a,),
        Operator.SINCOS: (jnp.sin, jnp.cos),
    }
    for each in arm.program.statements:
        operands = tuple(map(operand, each.operands))
        for name, compute in zip(each.results, functions[each.operator], strict=True):
            values[name] = compute(*operands)
    entries = [operand(each) for each in arm.program.outputs]
    return jnp.stack([jnp.asarray(entry, dtype=real) for entry in (*entries, 0, 0, 0, 1)]).reshape(4, 4)
