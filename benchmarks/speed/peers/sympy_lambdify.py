"""SymPy: the product of the exact link matrices, made into NumPy code by `lambdify(cse=True)`."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import sympy as sp

from benchmarks.speed.arm import Arm, Array
from benchmarks.speed.peers import Peer

LONGEST = 8
"""Rows; the expressions of a product grow so fast that a chain of 21 does not end."""


def peers(arm: Arm) -> Iterator[Peer]:
    """Both number types; the generated function takes whichever it is given.

    Raises:
        NotImplementedError: If the chain is too long.
    """
    if len(arm.links) > LONGEST:
        raise NotImplementedError(f"left out: the product of {len(arm.links)} link matrices is too large for it")
    function = _function(arm)
    for real in ("double", "float"):
        yield Peer(
            name="SymPy lambdify(cse=True)",
            package="sympy",
            real=real,
            batch=lambda q: _batch(function, q),
            result=np.asarray,
            single=lambda q: (lambda one: function(*one), q),
            single_name="SymPy lambdify(cse=True), NumPy",
        )


def _function(arm: Arm) -> Callable[..., list[Any]]:
    symbols = sp.symbols(f"q1:{arm.dof + 1}")
    product = sp.eye(4)
    for link in arm.links:
        theta = link.theta + (symbols[link.joint] if link.joint is not None else 0)
        product *= sp.Matrix(link.matrix(sp.cos(theta), sp.sin(theta), sp.sympify))
    entries = [entry.evalf(17) for entry in product[:3, :]]
    function: Callable[..., list[Any]] = sp.lambdify(symbols, entries, modules="numpy", cse=True)
    return function


def _batch(function: Callable[..., list[Any]], q: Array) -> Callable[[], Array]:
    columns = [np.ascontiguousarray(column) for column in q.T]

    out = np.zeros((len(q), 4, 4), q.dtype)
    out[:, 3, 3] = 1
    entries = out.reshape(-1, 16)

    def run() -> Array:
        for place, entry in enumerate(function(*columns)):
            entries[:, place] = entry
        return out

    return run
