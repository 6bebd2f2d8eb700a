"""Where the numbers of an array are in MATLAB: columns first, one configuration in the last dimension.

A matrix keeps its rows and columns; frames, tips and branches come after them, so that `T(:, :, k, i)` is a matrix.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction

import numpy as np

from kinegen.outputs import Array


def axes(array: Array) -> tuple[int, ...]:
    """The axes of an array of one configuration in the order that they have in MATLAB."""
    every = tuple(range(len(array.shape)))
    block, inner = (every[:1], every[1:]) if array.in_blocks else ((), every)
    return (*inner[-2:], *reversed(inner[:-2]), *block)


def extents(array: Array) -> tuple[int, ...]:
    """Its shape there, at least one number long; without configurations."""
    return tuple(array.shape[axis] for axis in axes(array)) or (1,)


def size(array: Array) -> int:
    """Numbers of one configuration, last rows of matrices among them."""
    return math.prod(extents(array))


def places(array: Array) -> tuple[int, ...]:
    """The place of each number that is computed or read, in the order of a program; places count from 0."""
    return tuple(int(place) for place in _laid_out(array, slice(0, 3)))


def in_columns(array: Array, numbers: Sequence[Fraction]) -> tuple[Fraction, ...]:
    """The numbers of one configuration in the order of memory in MATLAB, from the order of C."""
    if not array.shape:
        return tuple(numbers)
    whole = np.array(numbers, dtype=object).reshape(array.shape)
    return tuple(whole.transpose(axes(array)).ravel(order="F"))


def last_rows(array: Array) -> tuple[tuple[int, int], ...]:
    """The places of the last rows of matrices, and what they hold."""
    if not array.is_pose:
        return ()
    return tuple((int(place), value) for place, value in zip(_laid_out(array, slice(3, 4)), _cycle(array), strict=True))


def _cycle(array: Array) -> tuple[int, ...]:
    return (0, 0, 0, 1) * (math.prod(array.shape) // 16)


def _laid_out(array: Array, rows: slice) -> np.ndarray[tuple[int, ...], np.dtype[np.int64]]:
    """Places in the order of C, of matrices some rows alone."""
    own = np.arange(size(array)).reshape(extents(array), order="F")
    ordered = own.transpose(np.argsort(axes(array))) if array.shape else own
    return (ordered[..., rows, :] if array.is_pose else ordered).ravel()
