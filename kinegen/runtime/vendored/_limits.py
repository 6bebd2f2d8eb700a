"""The limits of the joints: whether joint vectors are within, and the nearest that are. It needs NumPy alone."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Pairs = tuple[tuple[float, float] | None, ...]


class _Limits:
    """Lower and upper limits for joint vectors, in each number type."""

    def __init__(self, name: str, double: Pairs, single: Pairs, *, module: str, doc: str) -> None:
        self.__name__, self.__module__, self.__doc__ = name, module, doc
        self.dof = len(double)
        self._sides = {np.dtype(kind): _sides(pairs, kind) for kind, pairs in ((float, double), (np.float32, single))}

    def __reduce__(self) -> str:
        return self.__name__  # pickled by reference, as functions are

    def __repr__(self) -> str:
        return f"<{self.__module__}.{self.__name__}: q ({self.dof},)>"

    def _checked(self, q: ArrayLike) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
        """Joint vectors as an array of float64 or float32, and both sides."""
        array = np.asarray(q)
        if array.dtype.kind not in "fiub" or isinstance(q, np.ma.MaskedArray):
            raise TypeError(f"{self.__name__}: q is of type {array.dtype}, expected plain real numbers")
        if array.shape[-1:] != (self.dof,):
            raise ValueError(f"{self.__name__}: q has shape {array.shape}, expected (..., {self.dof})")
        small = array.dtype.kind == "f" and array.dtype.itemsize <= 4
        kind = np.dtype(np.float32) if small else np.dtype(float)
        return array.astype(kind, copy=False), *self._sides[kind]


class WithinLimits(_Limits):
    """Says whether joint vectors are within the limits."""

    def __call__(self, q: ArrayLike) -> Any:
        """Look at one joint vector or a batch.

        Args:
            q: Joint values (..., dof), in rad or the length unit of the robot file.

        Returns:
            True where every joint is at its limits or between them (...). NaN and infinity never are.
        """
        array, low, high = self._checked(q)
        return ((array >= low) & (array <= high) & np.isfinite(array)).all(axis=-1)


class Clamp(_Limits):
    """Brings joint values to the nearest limit where they are outside."""

    def __call__(self, q: ArrayLike) -> NDArray[Any]:
        """Clamp one joint vector or a batch.

        Args:
            q: Joint values (..., dof), in rad or the length unit of the robot file.

        Returns:
            A new array of the same shape, float64 or float32. NaN stays NaN.
        """
        array, low, high = self._checked(q)
        clamped: NDArray[Any] = np.minimum(np.maximum(array, low), high)
        return clamped


def _sides(pairs: Pairs, kind: Any) -> tuple[NDArray[Any], NDArray[Any]]:
    """Lower and upper limits, infinite where there are none."""
    low, high = np.array([(-math.inf, math.inf) if each is None else each for each in pairs], kind).reshape(-1, 2).T
    return low, high
