"""The kinds of numbers that the reference works in: float64, wider floats, and mpmath with 50 digits."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

import mpmath
import numpy as np
from numpy.typing import NDArray

from kinegen.robot.expressions import Arithmetic

FloatArray = NDArray[np.float64]
Rows = tuple[tuple[Any, Any, Any, Any], ...]

DIGITS = 50
"""Decimal digits of the mpmath reference."""

WIDE: Any = np.longdouble
"""The widest floats of NumPy: 64 or 113 bits of precision on most machines, and 53 where C has nothing wider."""

WIDE_UNIT = float(np.finfo(WIDE).eps) / 2
"""The relative error of one rounding in them."""


@dataclass(frozen=True, slots=True)
class Kind:
    """What the chain product needs to know about the numbers it works in."""

    arithmetic: Arithmetic
    sin: Callable[[Any], Any]
    cos: Callable[[Any], Any]
    matrix: Callable[[Rows], Any]
    multiply: Callable[[Any, Any], Any]


def _stack(rows: Rows, dtype: Any = np.float64) -> NDArray[Any]:
    """Stack entries of shape (N,) or () to matrices (N, 4, 4) or (4, 4)."""
    found = np.empty((*np.broadcast_shapes(*(np.shape(entry) for row in rows for entry in row)), 4, 4), dtype=dtype)
    for row, entries in enumerate(rows):
        for column, entry in enumerate(entries):
            found[..., row, column] = entry
    return found


FLOATS = Kind(
    arithmetic=Arithmetic(
        number=float,
        pi=np.pi,
        functions={
            "sqrt": np.sqrt,
            "sin": np.sin,
            "cos": np.cos,
            "asin": np.arcsin,
            "acos": np.arccos,
            "atan": np.arctan,
            "atan2": np.arctan2,
        },
    ),
    sin=np.sin,
    cos=np.cos,
    matrix=_stack,
    multiply=np.matmul,
)
"""Arrays of float64, one number for each joint vector."""


def _widest(value: Fraction) -> Any:
    return WIDE(value.numerator) / WIDE(value.denominator)


WIDE_FLOATS = replace(
    FLOATS,
    arithmetic=replace(FLOATS.arithmetic, number=_widest, pi=WIDE("3.14159265358979323846264338327950288419717")),
    matrix=lambda rows: _stack(rows, WIDE),
)
"""Arrays of `WIDE`, which kernels in double are compared with: what the judge loses is far less than what they do."""


def digits() -> Kind:
    """The numbers of mpmath at the precision in force; pi is fixed here, so it must be called inside `workdps`."""
    return Kind(
        arithmetic=Arithmetic(number=_exact, pi=+mpmath.pi, functions={**_unary(), "atan2": mpmath.atan2}),
        sin=mpmath.sin,
        cos=mpmath.cos,
        matrix=lambda rows: mpmath.matrix([list(row) for row in rows]),
        multiply=lambda left, right: left * right,
    )


def digit_arrays() -> Kind:
    """The same numbers in arrays of NumPy, one for each joint vector."""
    functions = {name: np.frompyfunc(_real(function), 1, 1) for name, function in _unary().items()}
    functions["atan2"] = np.frompyfunc(mpmath.atan2, 2, 1)
    return Kind(
        arithmetic=Arithmetic(number=_exact, pi=+mpmath.pi, functions=functions),
        sin=functions["sin"],
        cos=functions["cos"],
        matrix=lambda rows: _stack(rows, object),
        multiply=_by_blocks,
    )


def _by_blocks(left: NDArray[Any], right: NDArray[Any]) -> NDArray[Any]:
    """The product of two transforms, or of their derivatives, by blocks: zeros take as long as other numbers here."""
    found = np.empty(np.broadcast_shapes(left.shape, right.shape), dtype=object)
    found[..., :3, :] = left[..., :3, :3] @ right[..., :3, :]
    found[..., :3, 3] += left[..., :3, 3] * right[..., 3, 3:]
    found[..., 3, :] = left[..., 3, 3:] * right[..., 3, :]
    return found


def _unary() -> dict[str, Callable[[Any], Any]]:
    """The functions of one value."""
    return {name: getattr(mpmath, name) for name in ("sqrt", "sin", "cos", "asin", "acos", "atan")}


def _real(function: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """NaN where mpmath would give a complex number."""

    def real(value: Any) -> Any:
        found = function(value)
        return found if isinstance(found, mpmath.mpf) else mpmath.nan

    return real


def _exact(value: Fraction) -> Any:
    return mpmath.mpf(value.numerator) / value.denominator
