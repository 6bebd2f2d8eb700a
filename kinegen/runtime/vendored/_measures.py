"""Measures of how well an arm can move, for batches of Jacobians. They need NumPy alone."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.floating[Any]]


def manipulability(jacobian: ArrayLike) -> Floats:
    """How far an arm is from singular poses: the product of the singular values of its Jacobian.

    That is the square root of det(J J^T), or of det(J^T J) for fewer joints than rows (Yoshikawa, Manipulability of
    robotic mechanisms, IJRR 1985, eq. 8). Linear and angular rows have different units; `jacobian[..., :3, :]` is the
    linear part alone.

    Args:
        jacobian: Jacobians, shape (..., rows, joints).

    Returns:
        Shape (...); 0 at singular poses.
    """
    values = _singular_values(jacobian)
    result: Floats = np.asarray(values.prod(axis=-1))
    return result


def condition_number(jacobian: ArrayLike) -> Floats:
    """How unequally an arm moves in different directions: its largest singular value over the smallest.

    1 is best (Salisbury and Craig, Articulated hands, IJRR 1982: isotropic).

    Args:
        jacobian: Jacobians, shape (..., rows, joints).

    Returns:
        Shape (...); infinite where the smallest singular value is 0.
    """
    values = _singular_values(jacobian)
    with np.errstate(divide="ignore", invalid="ignore"):
        result: Floats = np.asarray(values[..., 0] / values[..., -1])
    return result


def _singular_values(jacobian: ArrayLike) -> Floats:
    array = np.asarray(jacobian)
    if array.dtype.kind not in "fiub" or array.ndim < 2 or 0 in array.shape[-2:]:
        raise ValueError(f"a Jacobian has the shape (..., rows, joints) and real numbers, not {array.shape}")
    # One that is not finite would stop the whole batch.
    finite = np.isfinite(array).all(axis=(-2, -1), keepdims=True)
    values: Floats = np.linalg.svd(np.where(finite, array, 0.0), compute_uv=False)
    return np.where(finite[..., 0], values, np.nan)
