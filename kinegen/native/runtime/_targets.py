"""Checks of poses that joint values are asked for. It needs NumPy alone."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.floating[Any]]

_ALLOWED = {np.dtype(np.float64): 1e-6, np.dtype(np.float32): 1e-4}
"""How far the columns of a rotation may be from orthonormal."""

_FAULTS = (
    "has entries that are not finite",
    "has a last row other than 0 0 0 1",
    "has a rotation whose columns are not orthonormal",
    "holds a reflection: its first three columns are left-handed",
)

_BLOCK = 1 << 11  # matrices that are looked at together, few enough for the processor's cache


def checked_targets(name: str, base_T_tool: ArrayLike) -> Floats:
    """Check that matrices are poses.

    Args:
        name: Who asks, for the message.
        base_T_tool: Matrices (..., 4, 4).

    Returns:
        The same as an array of float64, or of float32 if they are of that type or a smaller one.

    Raises:
        TypeError: If they are no real numbers.
        ValueError: If the shape is another, or one of them is no pose: not finite, a last row that is not 0 0 0 1,
            columns that are not orthonormal, or a reflection. The message says which.
    """
    array = np.asarray(base_T_tool)
    if array.dtype.kind not in "fiub" or isinstance(base_T_tool, np.ma.MaskedArray):
        raise TypeError(f"{name}: base_T_tool is of type {array.dtype}, expected plain real numbers")
    if array.shape[-2:] != (4, 4):
        raise ValueError(f"{name}: base_T_tool has shape {array.shape}, expected (..., 4, 4)")
    small = array.dtype.kind == "f" and array.dtype.itemsize <= 4
    poses: Floats = array.astype(np.float32 if small else np.float64, copy=False)
    flat, allowed = poses.reshape(-1, 16), _ALLOWED[poses.dtype]
    if len(flat) == 1:  # quicker in Python's own numbers
        for fault, found in zip(_FAULTS, _find_faults(flat[0].tolist(), allowed), strict=True):
            if found:
                raise ValueError(_refusal(name, poses.shape[:-2], 0, fault))
    else:
        _check_many(name, poses.shape[:-2], flat, allowed)
    return poses


def _check_many(name: str, lead: tuple[int, ...], flat: Floats, allowed: float) -> None:
    for first in range(0, len(flat), _BLOCK):
        with np.errstate(all="ignore"):
            entries = np.ascontiguousarray(flat[first : first + _BLOCK].T)
            for fault, found in zip(_FAULTS, _find_faults(entries, allowed), strict=True):
                if found.any():
                    raise ValueError(_refusal(name, lead, first + int(np.argmax(found)), fault))


def _refusal(name: str, lead: tuple[int, ...], place: int, fault: str) -> str:
    index = [int(each) for each in np.unravel_index(place, lead)] if lead else []
    return f"{name}: base_T_tool{index or ''} {fault}"


def _find_faults(m: Any, allowed: float) -> Generator[Any]:
    """Whether each of the faults is there.

    Args:
        m: The entries of a matrix row by row, or each of them for many matrices.
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
