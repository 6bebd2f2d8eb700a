"""What poses and their gradients cost in PyTorch and JAX: `python -m benchmarks.learning [--poses N]`.

The arm is a PUMA 560 in double. All sides take turns in one process, PyTorch with one thread; time on the processor is
counted, that of all threads together, so that ratios hold on a busy machine too.
Beside them: pytorch_kinematics, the product of link matrices under `torch.compile` and `jax.jit`, and the closed form
that SymPy makes of that product, under `jax.jit`. What is not installed is left out.
"""

from __future__ import annotations

import argparse
import importlib
import importlib.util
import statistics
import tempfile
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import sympy as sp

from benchmarks.speed.arm import ROBOTS, Arm, Array, load_arm
from benchmarks.speed.peers import jax_vmap, torch_kinematics
from kinegen.driver.pipeline import build
from kinegen.driver.results import BuildOptions
from kinegen.model.outputs import parse_quantity
from kinegen.runtime.extension import load_package

ROBOT = "puma560"
POSES = 100_000
TURNS = 7
OUTPUTS = ("pose", "jacobian", "fk_jacobian", "hessian")
OURS, PEER = "kinegen", "pytorch_kinematics"
SAME, NEAR = 1e-12, 1e-6
"""How far results may differ; the peer's lengths and angles come from a URDF, which it reads in float."""

ASKED = {
    "PyTorch, forward": {PEER: 20, "compiled product": 3},
    "PyTorch, forward and backward": {PEER: 10, "compiled product": 3},
    "JAX under jit, forward": {"product": 8, "closed form of SymPy": 4},
    "JAX under jit, gradient": {},
}
Function = Callable[[Any], Any]
Row = tuple[str, str, str]


def main() -> int:
    """Print the table; a figure that is not met fails nothing, since machines differ."""
    parser = argparse.ArgumentParser(description="PyTorch and JAX, with gradients")
    parser.add_argument("--poses", type=int, default=POSES)
    poses = parser.parse_args().poses
    with tempfile.TemporaryDirectory() as folder:
        arm = load_arm(ROBOT, Path(folder) / "pose")
        options = BuildOptions(output=Path(folder), quantities=tuple(map(parse_quantity, OUTPUTS)))
        package = load_package(build(ROBOTS / f"{ROBOT}.yaml", options, lambda _: None).folder).__name__
        q = arm.configurations(poses, "double")
        weights = np.random.default_rng(1).normal(size=(poses, 4, 4))
        for library, rows in (("torch", torch_rows), ("jax", jax_rows)):
            if importlib.util.find_spec(library) is None:
                print(f"{library} is not installed")
                continue
            for row in rows(arm, importlib.import_module(f"{package}.{library}"), q, weights):
                print(f"{row[0]:<64}{row[1]:>24}   asked {row[2]}", flush=True)
    return 0


def torch_rows(arm: Arm, ours: Any, q: Array, weights: Array) -> Iterator[Row]:
    """Poses, and their gradients."""
    torch: Any = importlib.import_module("torch")
    torch.set_num_threads(1)
    functions: dict[str, Function] = {
        OURS: ours.fk,
        "compiled product": torch.compile(partial(_product, torch, _numbers(arm))),
    }
    if importlib.util.find_spec(PEER) is not None:
        kinematics = importlib.import_module(PEER)
        chain = torch_kinematics.chain_of(torch, kinematics, arm, torch.float64)
        functions[PEER] = lambda q: chain.forward_kinematics(q).get_matrix()
    given, weight = torch.from_numpy(q), torch.from_numpy(weights)

    def forward(function: Function) -> Any:
        with torch.no_grad():
            return function(given)

    leaf = given.clone().requires_grad_()

    def both(function: Function) -> Any:
        return torch.autograd.grad(function(leaf), leaf, weight)[0]

    yield from _compared("PyTorch, forward", functions, forward)
    yield from _compared("PyTorch, forward and backward", functions, both)


def jax_rows(arm: Arm, ours: Any, q: Array, weights: Array) -> Iterator[Row]:
    """Poses under `jit`, and the gradient of a number."""
    jax: Any = importlib.import_module("jax")
    jax.config.update("jax_enable_x64", True)
    product = jax.vmap(partial(jax_vmap.product, jax.numpy, arm, np.float64))
    functions = {OURS: ours.fk, "product": product, "closed form of SymPy": _sympy_form(jax.numpy, arm)}
    given, weight = jax.numpy.asarray(q), jax.numpy.asarray(weights)

    def gradient(function: Function) -> Function:
        return jax.jit(jax.grad(lambda q: (function(q) * weight).sum()))

    def run(function: Function) -> Any:
        return function(given).block_until_ready()

    compiled = {name: jax.jit(function) for name, function in functions.items()}
    yield from _compared("JAX under jit, forward", compiled, run)
    slopes = {name: gradient(function) for name, function in functions.items()}
    yield from _compared("JAX under jit, gradient", slopes, run)


def _compared(what: str, functions: dict[str, Function], run: Callable[[Function], Any]) -> Iterator[Row]:
    """One row for each peer, after a look at the numbers."""
    results = {name: np.asarray(run(function)) for name, function in functions.items()}
    scale = np.abs(results[OURS]).max()
    for name, result in results.items():
        difference = np.abs(result - results[OURS]).max() / scale
        if not difference < (NEAR if name == PEER else SAME):
            raise RuntimeError(f"{what}: {name} differs by {difference:.1e}")
    rates = {name: len(results[OURS]) / seconds for name, seconds in _seconds(functions, run).items()}
    yield f"{what}: million a second", f"{rates[OURS] / 1e6:.2f}", "-"
    for name in functions:
        if name != OURS:
            asked = ASKED[what].get(name)
            label = f"{what}: against {name} ({rates[name] / 1e6:.2f} million)"
            yield label, f"{rates[OURS] / rates[name]:.1f} times", f"at least {asked}" if asked else "-"


def _seconds(functions: dict[str, Function], run: Callable[[Function], Any]) -> dict[str, float]:
    """Medians of alternating turns."""
    found: dict[str, list[float]] = {name: [] for name in functions}
    for _ in range(TURNS):
        for name, function in functions.items():
            begin = time.process_time()
            run(function)
            found[name].append(time.process_time() - begin)
    return {name: statistics.median(seconds) for name, seconds in found.items()}


def _product(torch: Any, rows: list[tuple[float, ...]], q: Any) -> Any:
    """The product of the link matrices of a modified table, as one writes it down."""
    pose = torch.eye(4, dtype=q.dtype)
    for joint, (ca, sa, a, d, theta) in enumerate(rows):
        c, s = torch.cos(q[..., joint] + theta), torch.sin(q[..., joint] + theta)
        one = torch.ones_like(c)
        flat = [c, -s, 0 * one, a * one, s * ca, c * ca, -sa * one, -sa * d * one]
        flat += [s * sa, c * sa, ca * one, ca * d * one, 0 * one, 0 * one, 0 * one, one]
        pose = pose @ torch.stack(flat, -1).reshape(*q.shape[:-1], 4, 4)
    return pose


def _numbers(arm: Arm) -> list[tuple[float, ...]]:
    """The rows of its table as plain numbers."""
    exact = ((sp.cos(link.alpha), sp.sin(link.alpha), link.a, link.d, link.theta) for link in arm.links)
    return [tuple(map(float, row)) for row in exact]


def _sympy_form(jnp: Any, arm: Arm) -> Function:
    """The exact product as SymPy prints it for JAX, with common parts computed once."""
    symbols = sp.symbols(f"q1:{arm.dof + 1}")
    product = sp.eye(4)
    for link in arm.links:
        theta = link.theta + (symbols[link.joint] if link.joint is not None else 0)
        product *= sp.Matrix(link.matrix(sp.cos(theta), sp.sin(theta), sp.sympify))
    entries = sp.lambdify(symbols, [entry.evalf(17) for entry in product], modules="jax", cse=True)

    def function(q: Any) -> Any:
        flat = entries(*(q[..., joint] for joint in range(arm.dof)))
        return jnp.stack([jnp.broadcast_to(entry, q.shape[:-1]) for entry in flat], -1).reshape(*q.shape[:-1], 4, 4)

    return function


if __name__ == "__main__":
    raise SystemExit(main())
