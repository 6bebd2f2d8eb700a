"""Exact numbers to integers and to upper bounds."""

from __future__ import annotations

import math
from fractions import Fraction


def nearest_integer(value: Fraction) -> int:
    """The nearest integer; halves away from zero, so that opposite numbers stay opposite."""
    size = math.floor(abs(value) + Fraction(1, 2))
    return -size if value < 0 else size


def above(value: Fraction) -> float:
    """A float that is no smaller than a number, and next to it."""
    nearest = float(value)
    return nearest if Fraction(nearest) >= value else math.nextafter(nearest, math.inf)


def half_place(bits: int) -> float:
    """What rounding to a number of fraction bits can lose."""
    return math.ldexp(0.5, -bits)
