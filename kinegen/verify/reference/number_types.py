"""The kinds of numbers that the reference works in: float64, wider floats, sums of two of them, and 50 digits.

A joint of 1e4 turns that stands in the table as `q + 90` would lose in one float as much as a kernel in double may be
off, since kernels leave quarter turns out of the sum. The operations are those of T. J. Dekker, A floating-point
technique for extending the available precision, Numerische Mathematik 18, 1971.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from typing import Any

import mpmath
import numpy as np
from numpy.typing import NDArray

from kinegen.model.expression_parser import Arithmetic
from kinegen.support.dataclass import dataclass
from kinegen.verify.reference.exact_numbers import Kind, Rows, exact_number, unary

WIDE: Any = np.longdouble
"""The widest floats of NumPy: 64 or 113 bits of precision on most machines, and 53 where C has nothing wider."""

_HALVES = WIDE(2) ** ((np.finfo(WIDE).nmant + 2) // 2) + 1
"""Products with this cut a float into two halves, whose products are exact."""


@dataclass(frozen=True, slots=True)
class Pair:
    """A number, or an array of them, as a sum that is not carried out.

    Attributes:
        high: The nearest float.
        low: What is left, below its last digit.
    """

    high: Any
    low: Any

    __array_ufunc__ = None  # an array does not take a pair for one of its entries

    def __neg__(self) -> Pair:
        return Pair(-self.high, -self.low)

    def __add__(self, other: Any) -> Any:
        if not is_plain(other):
            return NotImplemented
        one = paired(other)
        high, low = _sum(self.high, one.high)
        return Pair(*_sum(high, low + (self.low + one.low)))

    __radd__ = __add__

    def __sub__(self, other: Any) -> Any:
        return self + -other if is_plain(other) else NotImplemented

    def __rsub__(self, other: Any) -> Any:
        return -self + other if is_plain(other) else NotImplemented

    def __mul__(self, other: Any) -> Any:
        if not is_plain(other):
            return NotImplemented
        one = paired(other)
        high, low = _product(self.high, one.high)
        return Pair(*_sum(high, low + (self.high * one.low + self.low * one.high)))

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Any:
        if not is_plain(other):
            return NotImplemented
        one = paired(other)
        quotient = self.high / one.high
        rest = self - one * quotient
        return Pair(*_sum(quotient, rest.high / one.high))

    def __rtruediv__(self, other: Any) -> Any:
        return paired(other) / self if is_plain(other) else NotImplemented

    def __pow__(self, exponent: int) -> Pair:
        found = self
        for _ in range(exponent - 1):
            found = found * self
        return found


def is_plain(value: Any) -> bool:
    """Returns whether a pair can be computed with something: not with series, which know how to compute with pairs."""
    return isinstance(value, (Pair, np.ndarray, np.number, int, float))


def paired(value: Any) -> Pair:
    """Returns a number as a pair."""
    return value if isinstance(value, Pair) else Pair(value if isinstance(value, np.ndarray) else WIDE(value), WIDE(0))


def pair_of(value: Fraction) -> Pair:
    """Returns the pair that is nearest to a fraction."""
    high = widest(value)
    return Pair(high, widest(value - Fraction(*high.as_integer_ratio())))


def single(value: Any) -> Any:
    """Returns a pair as one float; anything else as it is."""
    return value.high + value.low if isinstance(value, Pair) else value


def of_singles(function: Callable[..., Any]) -> Callable[..., Any]:
    """Returns a function of floats that takes pairs as well."""
    return lambda *values: function(*map(single, values))


def sine(angle: Any) -> Any:
    """Returns the sine of a float or a pair."""
    if not isinstance(angle, Pair):
        return np.sin(angle)
    return np.sin(angle.high) + angle.low * np.cos(angle.high)


def cosine(angle: Any) -> Any:
    """Returns the cosine of a float or a pair."""
    if not isinstance(angle, Pair):
        return np.cos(angle)
    return np.cos(angle.high) - angle.low * np.sin(angle.high)


def widest(value: Fraction) -> Any:
    """Returns a fraction as one float."""
    return WIDE(value.numerator) / WIDE(value.denominator)


def _sum(one: Any, other: Any) -> tuple[Any, Any]:
    """Returns a sum and what rounding has taken from it."""
    total = one + other
    part = total - one
    return total, (one - (total - part)) + (other - part)


def _product(one: Any, other: Any) -> tuple[Any, Any]:
    """Returns a product and what rounding has taken from it."""
    total = one * other
    (a, b), (c, d) = _halves(one), _halves(other)
    return total, ((a * c - total) + a * d + b * c) + b * d


def _halves(value: Any) -> tuple[Any, Any]:
    wide = _HALVES * value
    upper = wide - (wide - value)
    return upper, value - upper


FloatArray = NDArray[np.float64]
WIDE_UNIT = float(np.finfo(WIDE).eps) / 2
"""The relative error of one rounding in them."""


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


WIDE_FLOATS = replace(
    FLOATS,
    arithmetic=replace(FLOATS.arithmetic, number=widest, pi=WIDE("3.14159265358979323846264338327950288419717")),
    matrix=lambda rows: _stack(rows, WIDE),
)
"""Arrays of `WIDE`, which kernels in double are compared with: what the judge loses is far less than what they do."""

WIDE_TABLES = replace(
    WIDE_FLOATS,
    arithmetic=Arithmetic(
        number=pair_of,
        pi=pair_of(Fraction("3.1415926535897932384626433832795028841971693993751058209749445923078164062862")),
        functions={name: of_singles(function) for name, function in FLOATS.arithmetic.functions.items()},
    ),
    sin=sine,
    cos=cosine,
    matrix=lambda rows: _stack(tuple(tuple(map(single, row)) for row in rows), WIDE),
)
"""The same, with entries of a table that have twice the digits."""


def digit_arrays() -> Kind:
    """Returns the same numbers in arrays of NumPy, one for each joint vector."""
    functions = {name: np.frompyfunc(_real(function), 1, 1) for name, function in unary().items()}
    functions["atan2"] = np.frompyfunc(mpmath.atan2, 2, 1)
    return Kind(
        arithmetic=Arithmetic(number=exact_number, pi=+mpmath.pi, functions=functions),
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


def _real(function: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """NaN where mpmath would give a complex number."""

    def real(value: Any) -> Any:
        found = function(value)
        return found if isinstance(found, mpmath.mpf) else mpmath.nan

    return real
