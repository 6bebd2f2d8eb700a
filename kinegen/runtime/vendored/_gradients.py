"""Gradients of a number by joint vectors, from gradients by outputs, in blocks. It needs NumPy alone.

Poses and Jacobians of a block are computed with one row for each number, so that they and what is made of them stay in
the processor's cache, and every step is a plain sum of products of long rows.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._derivatives import sources_of, stem_of, wrench
from ._kernel import Kernel
from ._threads import blocks_of, spread

_BLOCK = 1 << 12
"""Configurations of a block: their Jacobians fill part of a cache."""


def is_quick(name: str) -> bool:
    """Whether `gradient` has a way for an output: those of the joint vector alone, with one result."""
    return stem_of(name)[0] not in ("fk_jacobian", "twist")


def gradient(
    kernels: Mapping[str, Kernel[Any]], name: str, q: NDArray[Any], given: NDArray[Any], threads: int
) -> NDArray[Any]:
    """The gradient by the joint vector.

    Args:
        kernels: All kernels of the package by name.
        name: The kernel whose result was used.
        q: Joint vectors (..., n).
        given: Gradient by the result (..., *its shape), of the same type.
        threads: Number of threads.

    Returns:
        Shape (..., n).

    Raises:
        NoDerivativeError: If the package has no kernel for it.
    """
    found = np.empty(q.shape, q.dtype)
    count = math.prod(q.shape[:-1])
    shape = kernels[name].results[0].shape
    rows = [array.reshape(count, size) for array, size in ((q, q.shape[-1]), (given, math.prod(shape)))]
    arrays = [*rows, found.reshape(count, q.shape[-1])]
    work = partial(_block, kernels, name, sources_of(name, tuple(kernels)))
    if count:
        workers = min(threads, -(-count // _BLOCK))
        spread(work, blocks_of(arrays, 1, _BLOCK), workers)
    return found


def _block(
    kernels: Mapping[str, Kernel[Any]], name: str, sources: tuple[str, ...], _lead: int, arrays: list[NDArray[Any]]
) -> None:
    """One block: joint vectors (N, n), gradients (N, size), and the result (N, n)."""
    q, given, found = arrays
    rows = np.ascontiguousarray(given.T)
    result = kernels[name].results[0]
    turned = np.ascontiguousarray(q.T)
    slopes, pose = _slopes(kernels, name, sources[0], turned)
    if result.is_pose:
        rows = _wrenches(pose, rows.reshape(-1, 4, 4, len(q)))
    dof, count = turned.shape
    blocks = slopes.reshape(-1, dof, count)
    # Of the six rows of each tip a position takes the first three.
    tips = 1 if len(blocks) == len(rows) else len(blocks) // 6
    blocks, rows = blocks.reshape(tips, -1, dof, count), rows.reshape(tips, -1, count)
    found[...] = np.einsum("tijn,tin->jn", blocks[:, : rows.shape[1]], rows).T


def _slopes(kernels: Mapping[str, Kernel[Any]], name: str, source: str, q: NDArray[Any]) -> tuple[Any, Any]:
    """Partial derivatives or the Jacobian (rows * n, N), and of a pose the pose (12, N) too."""
    is_pose = kernels[name].results[0].is_pose
    both = f"fk_{source}"
    found = kernels[both if is_pose and both in kernels else source](q, layout="joint_major")
    pose, slopes = found if isinstance(found, tuple) else (None, found)
    if is_pose and pose is None:
        pose = kernels[name](q, layout="joint_major")
    if stem_of(name)[0] == "jacobian":
        dof, count = q.shape
        blocks = slopes.reshape(-1, dof, 6, dof, count)
        slopes = np.ascontiguousarray(blocks.transpose(0, 2, 3, 1, 4))
    return slopes, pose


def _wrenches(pose: NDArray[Any], given: NDArray[Any]) -> NDArray[Any]:
    """Forces and moments (6 * tips, N) from rows of poses (12 * tips, N) and gradients (tips, 4, 4, N)."""
    found = wrench(np.moveaxis(pose.reshape(-1, 3, 4, pose.shape[-1]), -1, 1), np.moveaxis(given, -1, 1), _stacked)
    rows: NDArray[Any] = found.reshape(-1, pose.shape[-1])
    return rows


def _stacked(rows: list[Any], _axis: int) -> NDArray[Any]:
    """Components as rows: (tips, 6, N)."""
    return np.stack(rows, 1)
