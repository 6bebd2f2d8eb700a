"""The two number types of the kernels, and exact numbers as literals of them."""

from __future__ import annotations

import math
import struct
from fractions import Fraction

from kinegen.support.compat import StrEnum

_INFINITY = 0x7F800000
_SMALLEST_NORMAL = 2.0**-126
_BELOW, _HALF = 0x1FFFFFFF, 0x10000000
"""The bits of a double that floats do not have, and those of the middle between two floats."""


class ScalarType(StrEnum):
    """A number type."""

    DOUBLE = "double"
    FLOAT = "float"

    @property
    def precision(self) -> str:
        """The word before "precision" that says which: double or single."""
        return "double" if self is ScalarType.DOUBLE else "single"

    @property
    def size(self) -> int:
        """Bytes of a number."""
        return 8 if self is ScalarType.DOUBLE else 4

    def round(self, value: Fraction) -> float:
        """Return the nearest number of this type, ties to even."""
        nearest = float(value)
        return nearest if self is ScalarType.DOUBLE or not value else _nearest_float32(value, nearest)

    def literal(self, value: Fraction) -> str:
        """Return a C literal that reads back as the nearest number of this type.

        Doubles are written with the fewest digits that read back exactly, and so are floats, with their suffix.
        """
        if not value:  # most entries of a Hessian, so it is worth a short way
            return "0.0" if self is ScalarType.DOUBLE else "0.0F"
        rounded = self.round(value)
        if self is ScalarType.DOUBLE:
            # Whole numbers of seventeen digits are no longer without an exponent, and easier to read.
            is_whole = 1e16 <= abs(rounded) < 1e17
            return f"{rounded:.1f}" if is_whole else repr(rounded)
        # Most numbers need more than six digits, so the shorter texts are tried only where six are enough.
        for digits in range(1 if _reads_back(f"{rounded:.6g}", rounded) else 7, 10):
            text = f"{rounded:.{digits}g}"
            if _reads_back(text, rounded):
                break
        return (text if any(mark in text for mark in ".e") else f"{text}.0") + "F"


def _reads_back(text: str, rounded: float) -> bool:
    return _float32(float(text)) == rounded


def _float32(value: float) -> float:
    try:
        return float(struct.unpack("<f", struct.pack("<f", value))[0])
    except OverflowError:  # a few digits of the largest floats round up beyond them
        return math.copysign(math.inf, value)


def _nearest_float32(exact: Fraction, nearby: float) -> float:
    """Return the nearest float, found from the exact number: rounding twice, through double, can be one off."""
    # It is only where the double lies half-way between two floats, or where floats have fewer digits.
    if abs(nearby) >= _SMALLEST_NORMAL and struct.unpack("<Q", struct.pack("<d", nearby))[0] & _BELOW != _HALF:
        return float(struct.unpack("<f", struct.pack("<f", nearby))[0])
    if exact < 0:
        return -_nearest_float32(-exact, -nearby)
    bits = struct.unpack("<I", struct.pack("<f", nearby))[0]
    candidates = [_from_bits(bits + step) for step in (0, -1, 1) if 0 <= bits + step < _INFINITY]
    # The candidate with an even last bit wins a tie.
    return min(candidates, key=lambda c: (abs(Fraction(c) - exact), struct.unpack("<I", struct.pack("<f", c))[0] & 1))


def _from_bits(bits: int) -> float:
    return float(struct.unpack("<f", struct.pack("<I", bits))[0])
