"""Checks of poses that joint values are asked for. It needs NumPy alone."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._engines import real_array

Floats = NDArray[np.floating[Any]]

_ALLOWED = {np.dtype(np.float64): 1e-6, np.dtype(np.float32): 1e-4}
"""How far the columns of a rotation may be from orthonormal."""

_UNEVEN = "has a rotation whose columns are not orthonormal"

_FAULTS = (
    "has entries that are not finite",
    "has a last row other than 0 0 0 1",
    _UNEVEN,
    "holds a reflection: its first three columns are left-handed",
)

_LAST = [0.0, 0.0, 0.0, 1.0]

_BLOCK = 1 << 11  # matrices that are looked at together, few enough for the processor's cache


def joint_vector_asked(name: str, label: str, given: ArrayLike | None, q0: ArrayLike | None) -> ArrayLike | None:
    """The value of an argument that may be called q0 too, as other libraries call it.

    Args:
        name: Who asks, for the message.
        label: What the argument is called.
        given: Its value under this name.
        q0: Its value under the other one.

    Raises:
        TypeError: If it is given twice.
    """
    if given is not None and q0 is not None:
        raise TypeError(f"{name}: {label} and q0 are the same argument, expected one of them")
    return given if q0 is None else q0


def checked_targets(name: str, base_T_tool: ArrayLike) -> Floats:
    """Check that matrices are poses.

    Args:
        name: Who asks, for the message.
        base_T_tool: Matrices (..., 4, 4).

    Returns:
        The same as an array of float64, or of float32 if they are of that type or a smaller one.

    Raises:
        TypeError: If they are not real numbers.
        ValueError: If the shape is another, or one of them is not a pose: not finite, a last row that is not 0 0 0 1,
            columns that are not orthonormal, or a reflection. The message says which.
    """
    array = real_array(name, "base_T_tool", base_T_tool)
    if array.shape[-2:] != (4, 4):
        raise ValueError(f"{name}: base_T_tool has shape {array.shape}, expected (..., 4, 4)")
    small = array.dtype.kind == "f" and array.dtype.itemsize <= 4
    poses: Floats = array.astype(np.float32 if small else np.float64, copy=False)
    flat, lead = poses.reshape(-1, 16), poses.shape[:-2]
    if not lead and is_pose(poses):
        return poses
    for first in range(0, len(flat), _BLOCK):
        with np.errstate(all="ignore"):
            entries = np.ascontiguousarray(flat[first : first + _BLOCK].T)
            for fault, found in zip(_FAULTS, _find_faults(entries, _ALLOWED[poses.dtype]), strict=True):
                if found.any():
                    row = first + int(np.argmax(found))
                    index = np.unravel_index(row, lead) if lead else ()
                    place = [int(each) for each in index]
                    more = _remedy(flat[row]) if fault == _UNEVEN else ""
                    raise ValueError(f"{name}: base_T_tool{place or ''} {fault}{more}")
    return poses


def _remedy(matrix: Floats) -> str:
    """How far the columns of a matrix (16,) are from orthonormal, how far they may be, and what to do about it."""
    rotation = matrix.reshape(4, 4)[:3, :3].astype(float)
    off = np.abs(rotation.T @ rotation - np.eye(3)).max()
    return (
        f": an entry of R^T R is off by {off:.1e}, and {_ALLOWED[matrix.dtype]:.0e} is allowed in {matrix.dtype}; "
        "u, _, vt = np.linalg.svd(R); R = u @ vt gives the nearest rotation"
    )


def is_pose(matrix: Floats) -> bool:
    """Whether one 4x4 matrix is beyond doubt a pose; quicker than `checked_targets`, which also says what is wrong."""
    rows: Any = matrix.tolist()
    (a, b, c, x), (d, e, f, y), (g, h, i, z), last = rows
    allowed = _ALLOWED.get(matrix.dtype, 0.0) / 4
    return (
        abs(a * a + b * b + c * c - 1) <= allowed
        and abs(d * d + e * e + f * f - 1) <= allowed
        and abs(a * d + b * e + c * f) <= allowed
        and abs(b * f - c * e - g) <= allowed
        and abs(c * d - a * f - h) <= allowed
        and abs(a * e - b * d - i) <= allowed
        and x - x == y - y == z - z == 0
        and bool(last == _LAST)
    )


def _find_faults(m: Any, allowed: float) -> Generator[Any]:
    """Which matrices have each of the faults.

    Args:
        m: Each of their entries, row by row, for all of them.
        allowed: How far columns may be from orthonormal.
    """
    yield sum(m) * 0 != 0
    yield (m[12] != 0) | (m[13] != 0) | (m[14] != 0) | (m[15] != 1)
    x, y, z = ((m[i], m[4 + i], m[8 + i]) for i in range(3))
    uneven = False
    for a, b, product in ((x, x, 1), (y, y, 1), (z, z, 1), (x, y, 0), (y, z, 0), (z, x, 0)):
        uneven |= abs(a[0] * b[0] + a[1] * b[1] + a[2] * b[2] - product) > allowed
    yield uneven
    across = x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]
    yield across[0] * z[0] + across[1] * z[1] + across[2] * z[2] < 0
