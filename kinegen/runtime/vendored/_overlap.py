"""Arrays for results that share memory with others, or with themselves. It needs NumPy alone."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray


def check_apart(name: str, label: str, out: NDArray[Any], others: Sequence[tuple[str, NDArray[Any]]]) -> None:
    """Refuse an array for results that shares memory with another array."""
    for other, array in others:
        if _overlap(array, out):
            raise ValueError(f"{name}: {label} shares memory with {other}")


def overlaps_itself(array: NDArray[Any]) -> bool:
    """Whether entries of an array may lie over each other; never so for a part or another order of a whole array."""
    end = array.itemsize
    for stride, size in sorted((abs(stride), size) for stride, size in zip(array.strides, array.shape) if size > 1):
        if stride < end:
            return array.size > 0
        end = stride * (size - 1) + end
    return False


def _overlap(first: NDArray[Any], second: NDArray[Any]) -> bool:
    effort: Any = 10_000  # the exact answer can take for ever
    try:
        return bool(np.shares_memory(first, second, max_work=effort))
    except RuntimeError:
        return True
