"""NumPy: a stack of link matrices for each row of the table, multiplied with `@`."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from benchmarks.speed.arm import Arm, Array, Link
from benchmarks.speed.peers import Peer


def peers(arm: Arm) -> Iterator[Peer]:
    """Both number types."""
    for real in ("double", "float"):
        yield Peer(
            name="NumPy matmul chain",
            package="numpy",
            real=real,
            batch=lambda q: _batch(arm, q),
            result=np.asarray,
            single=lambda q: (lambda one: _chain(arm, one[None]), q),
        )


def _batch(arm: Arm, q: Array) -> Callable[[], Array]:
    return lambda: _chain(arm, q)


def _chain(arm: Arm, q: Array) -> Array:
    pose = _stack(arm.links[0], q)
    for link in arm.links[1:]:
        pose = pose @ _stack(link, q)
    return pose


def _stack(link: Link, q: Array) -> Array:
    theta = float(link.theta) + (q[:, link.joint] if link.joint is not None else np.zeros_like(q[:, 0]))
    matrices = np.empty((len(q), 4, 4), q.dtype)
    for i, row in enumerate(link.matrix(np.cos(theta), np.sin(theta))):
        for j, entry in enumerate(row):
            matrices[:, i, j] = entry
    return matrices
