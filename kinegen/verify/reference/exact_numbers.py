"""What the chain product asks of numbers, and the numbers with 50 digits; without NumPy."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import Any

import mpmath

from kinegen.model.expression_parser import Arithmetic
from kinegen.support.dataclass import dataclass

Rows = tuple[tuple[Any, Any, Any, Any], ...]

DIGITS = 50
"""Decimal digits of the mpmath reference."""


@dataclass(frozen=True, slots=True)
class Kind:
    """What the chain product needs to know about the numbers it works in."""

    arithmetic: Arithmetic
    sin: Callable[[Any], Any]
    cos: Callable[[Any], Any]
    matrix: Callable[[Rows], Any]
    multiply: Callable[[Any, Any], Any]


def digits() -> Kind:
    """The numbers of mpmath at the precision in force; pi is fixed here, so it must be called inside `workdps`."""
    return Kind(
        arithmetic=Arithmetic(number=exact_number, pi=+mpmath.pi, functions={**unary(), "atan2": mpmath.atan2}),
        sin=mpmath.sin,
        cos=mpmath.cos,
        matrix=lambda rows: mpmath.matrix([list(row) for row in rows]),
        multiply=lambda left, right: left * right,
    )


def unary() -> dict[str, Callable[[Any], Any]]:
    """Returns the functions of one value."""
    return {name: getattr(mpmath, name) for name in ("sqrt", "sin", "cos", "asin", "acos", "atan")}


def exact_number(value: Fraction) -> Any:
    """Returns a fraction with the digits in force."""
    return mpmath.mpf(value.numerator) / value.denominator
