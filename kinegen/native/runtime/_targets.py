"""Checks of poses that joint values are asked for. It needs NumPy alone."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.floating[Any]]

_ALLOWED = {np.dtype(np.float64): 1e-6, np.dtype(np.float32): 1e-4}
"""How far the columns of a rotation may be from orthonormal."""


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
    rotation = poses[..., :3, :3]
    with np.errstate(all="ignore"):
        uneven = np.abs(rotation.swapaxes(-1, -2) @ rotation - np.eye(3)).max(axis=(-2, -1))
        mirrored = np.linalg.det(np.where(np.isfinite(rotation), rotation, 0.0)) < 0
    _refuse(name, ~np.isfinite(poses).all(axis=(-2, -1)), "has entries that are not finite")
    _refuse(name, (poses[..., 3, :] != (0.0, 0.0, 0.0, 1.0)).any(axis=-1), "has a last row other than 0 0 0 1")
    _refuse(name, ~(uneven <= _ALLOWED[poses.dtype]), "has a rotation whose columns are not orthonormal")
    _refuse(name, mirrored, "holds a reflection: its first three columns are left-handed")
    return poses


def _refuse(name: str, wrong: Any, reason: str) -> None:
    if np.any(wrong):
        place = tuple(int(index) for index in np.argwhere(wrong)[0])
        where = f"base_T_tool[{', '.join(map(str, place))}]" if place else "base_T_tool"
        raise ValueError(f"{name}: {where} {reason}")
