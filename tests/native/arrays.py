"""The same values in memory in many ways."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]

WAYS = ["plain", "fortran", "sliced", "reversed", "transposed", "odd", "broadcast", "read-only"]


def arranged(values: Array, way: str) -> Array:
    """The same values in memory in another way; some ways need a second axis."""
    if way == "fortran":
        return np.asfortranarray(values)
    if way == "sliced":
        wide = np.zeros([2 * extent for extent in values.shape], values.dtype)
        view = wide[tuple(slice(None, None, 2) for _ in values.shape)]
    elif way == "reversed":
        view = np.zeros(values.shape, values.dtype)[tuple(slice(None, None, -1) for _ in values.shape)]
    elif way == "transposed":
        view = np.moveaxis(np.zeros(np.roll(values.shape, 1), values.dtype), 0, -1)
    elif way == "odd":
        # One byte off: no processor's idea of aligned.
        raw = bytearray(values.nbytes + 1)
        view = np.frombuffer(raw, values.dtype, math.prod(values.shape), 1).reshape(values.shape)
    elif way == "broadcast":
        return np.broadcast_to(values[:1], values.shape) if values.ndim > 1 else values
    else:
        view = values.copy()
    view[...] = values
    view.flags.writeable = way != "read-only"
    return view


def bits(numbers: Array) -> Array:
    """The bits of an array; every NaN has the same, since its payload is nobody's promise."""
    plain = np.where(np.isnan(numbers), np.array(np.nan, numbers.dtype), numbers)
    return plain.view(np.uint64 if numbers.dtype == np.float64 else np.uint32)
