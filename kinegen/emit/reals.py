"""The two number types of the kernels, and exact numbers as literals of them."""

from __future__ import annotations

import struct
from enum import StrEnum
from fractions import Fraction


class Real(StrEnum):
    """A number type."""

    DOUBLE = "double"
    FLOAT = "float"

    def round(self, value: Fraction) -> float:
        """The nearest number of this type, ties to even."""
        nearest = float(value)
        return nearest if self is Real.DOUBLE else _nearest_float32(value, nearest)

    def literal(self, value: Fraction) -> str:
        """A C literal that reads back as the nearest number of this type.

        Doubles are written with the fewest digits that read back exactly, and so are floats, with their suffix.
        """
        rounded = self.round(value)
        if self is Real.DOUBLE:
            return repr(rounded)
        for digits in range(1, 10):
            text = f"{rounded:.{digits}g}"
            if _float32(float(text)) == rounded:
                break
        return (text if any(mark in text for mark in ".e") else f"{text}.0") + "F"


def _float32(value: float) -> float:
    return float(struct.unpack("<f", struct.pack("<f", value))[0])


def _nearest_float32(exact: Fraction, nearby: float) -> float:
    """The nearest float, found from the exact number: rounding twice, through double, can be one off."""
    guess = _float32(nearby)
    bits = struct.unpack("<i", struct.pack("<f", guess))[0]
    candidates = [struct.unpack("<f", struct.pack("<i", bits + step))[0] for step in (-1, 0, 1)]
    return float(min((c for c in candidates if c == c), key=lambda c: (abs(Fraction(c) - exact), c != guess)))
