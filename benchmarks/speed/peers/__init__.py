"""What people use instead: one module for each, and one form of calling them all.

A module here offers `peers(arm)`, which yields a `Peer` for each number type that it has. Its library is imported when
that is called; where it is not installed, `load_peers` says so and goes on.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from typing import Any

import numpy as np

from benchmarks.speed.arm import Arm, Array, dtype

NAMES = (
    "numpy_matmul",
    "sympy_lambdify",
    "numba_closed_form",
    "jax_vmap",
    "casadi_map",
    "pinocchio",
    "robotics_toolbox",
    "torch_kinematics",
)
"""The modules of this folder."""

TOLERANCES = {"double": 1e-7, "float": 2e-5}
"""How far a peer may be from the reference; pytorch_kinematics keeps parts of its tables in single precision."""

CHECKED = 200
"""Poses that are compared."""


@dataclass(frozen=True, slots=True)
class Peer:
    """Another way to the same poses.

    Attributes:
        name: What a table calls it.
        package: The distribution whose version is stated.
        real: `double` or `float`.
        batch: Takes joint vectors (N, dof) and returns a function without arguments that evaluates all of them, with
            whatever can be prepared once already done.
        result: Makes an array (N, 3 or 4, 4) of what that function returns.
        single: Takes one joint vector and returns a function and its only argument, or None.
        poses: The most poses that are worth waiting for.
        single_name: What a table calls the call with one joint vector, where that is something else.
    """

    name: str
    package: str
    real: str
    batch: Callable[[Array], Callable[[], Any]]
    result: Callable[[Any], Array]
    single: Callable[[Array], tuple[Callable[[Any], Any], Any]] | None = None
    poses: int = 100_000
    single_name: str = ""

    @property
    def version(self) -> str:
        """The package with its version."""
        return f"{self.package} {version(self.package)}"


@dataclass(frozen=True, slots=True)
class Absent:
    """A peer that cannot take part.

    Attributes:
        name: Its module.
        reason: Why, in a few words.
    """

    name: str
    reason: str


def load_peers(arm: Arm, names: tuple[str, ...] = NAMES) -> Iterator[Peer | Absent]:
    """Load and check the peers of a robot.

    Args:
        arm: The robot.
        names: Which ones.

    Yields:
        Each that computes the same poses as the reference, or why it takes no part.
    """
    for name in names:
        try:
            module = importlib.import_module(f"{__name__}.{name}")
            for peer in module.peers(arm):
                wrong = error(arm, peer)
                yield Absent(peer.name, f"its poses are off by {wrong:.1e}") if wrong > TOLERANCES[peer.real] else peer
        except (ImportError, PackageNotFoundError) as problem:
            yield Absent(name, f"not installed: {str(problem).partition(chr(10))[0]}")
        except NotImplementedError as problem:
            yield Absent(name, str(problem))


def error(arm: Arm, peer: Peer) -> float:
    """The largest difference between the poses of a peer and those of the reference."""
    q = arm.configurations(CHECKED, peer.real)
    expected = arm.poses(q)[:, :3]
    found = np.asarray(peer.result(peer.batch(q)()))[:, :3]
    if found.shape != expected.shape or found.dtype != dtype(peer.real):
        return float("inf")
    return float(np.abs(found - expected).max())
