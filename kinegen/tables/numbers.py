"""Numbers with 150 digits, and the exact expressions that they are.

A number that agrees with a simple fraction, a square root or a nested root to 90 digits is that one: no chain of
operations on a table's numbers makes such an accident. What is none of them, such as the cosine of 0.3 rad, is rounded
to 50 digits, and the caller reports it.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from typing import Any

import mpmath

from kinegen.robot.expressions import (
    PI,
    ZERO,
    Arithmetic,
    Expression,
    Number,
    add,
    call,
    evaluate,
    multiply,
    negate,
)

MP = mpmath.mp.clone()
MP.dps = 150

ARITHMETIC = Arithmetic(
    number=lambda value: MP.mpf(value.numerator) / value.denominator,
    pi=+MP.pi,
    functions={
        "sqrt": MP.sqrt,
        "sin": MP.sin,
        "cos": MP.cos,
        "asin": MP.asin,
        "acos": MP.acos,
        "atan": MP.atan,
        "atan2": MP.atan2,
    },
)
"""Evaluation with 150 digits."""

_SMALL = MP.mpf(10) ** -100
_SIMPLE = 10**30
_LARGEST = 10**24
"""Of the whole numbers in the equation of a root."""
_KEPT = 50
_NOISE = MP.mpf(10) ** -45
"""What is left where numbers that were rounded to 50 digits cancel."""
_PRIMES = tuple(n for n in range(2, 100) if all(n % m for m in range(2, n)))


@dataclass(frozen=True, slots=True)
class Found:
    """The expression of a number, and whether it is that number exactly."""

    expression: Expression
    exact: bool = True


def is_small(value: Any) -> bool:
    """Whether a number is zero."""
    return bool(abs(value) < _SMALL)


def settled(value: Any) -> Any:
    """A number, or the 0, 1 or -1 that it is."""
    nearest = MP.nint(value)
    return nearest if abs(nearest) <= 1 and is_small(value - nearest) else value


def rational(value: Any) -> Fraction | None:
    """The simple fraction that a number is."""
    sign, mantissa, exponent, _ = MP.mpf(value)._mpf_
    exact = Fraction((-1) ** sign * int(mantissa)) * Fraction(2) ** exponent
    simple = exact.limit_denominator(_SIMPLE)
    return simple if abs(exact - simple) < Fraction(1, 10**100) else None


@lru_cache(maxsize=4096)
def identified(value: Any, *, algebraic: bool = True) -> Found:
    """The expression of a length or a plain number.

    Args:
        value: Any number.
        algebraic: Whether it may be a root; otherwise only fractions are looked for, which is faster.
    """
    simple = rational(value)
    if simple is not None:
        return Found(Number(simple))
    if abs(value) < _NOISE:
        return Found(ZERO, exact=False)
    square = rational(value * value)
    if square is not None:
        return Found(_signed(value, _root(square)))
    if algebraic:
        for power in (1, 2):
            inner = _quadratic(value**power)
            if inner is not None:
                return Found(inner if power == 1 else _signed(value, call("sqrt", inner)))
    return Found(Number(Fraction(mpmath.libmp.to_str(MP.mpf(value)._mpf_, _KEPT))), exact=False)


@lru_cache(maxsize=4096)
def identified_angle(value: Any, *, algebraic: bool = True) -> Found:
    """The expression of an angle in radians: a share of pi, an arc tangent, or a number of radians beside a quarter."""
    share = rational(value / MP.pi)
    if share is not None and share.denominator < 10**9:
        return Found(multiply(Number(share), PI))
    for quarters in (0, 1, -1, 2, -2):
        plain = rational(value - quarters * MP.pi / 2)
        if plain is not None:
            return Found(add(multiply(Number(Fraction(quarters, 2)), PI), Number(plain)))
    if algebraic:
        slope = MP.tan(value)
        tangent = identified(abs(slope))
        if tangent.exact:
            halves = multiply(Number(Fraction(int(MP.nint((value - MP.atan(slope)) / MP.pi)))), PI)
            return Found(add(_signed(slope, call("atan", tangent.expression)), halves))
    return Found(Number(Fraction(mpmath.libmp.to_str(MP.mpf(value)._mpf_, _KEPT))), exact=False)


def _signed(value: Any, size: Expression) -> Expression:
    return size if value > 0 else negate(size)


def _root(square: Fraction) -> Expression:
    """The square root of a positive fraction, small squares taken out."""
    inside, outside = square.numerator * square.denominator, Fraction(1, square.denominator)
    for prime in _PRIMES:
        while inside % prime**2 == 0:
            inside, outside = inside // prime**2, outside * prime
    return multiply(Number(outside), call("sqrt", Number(Fraction(inside))) if inside != 1 else Number(Fraction(1)))


def _quadratic(value: Any) -> Expression | None:
    """The root of a quadratic equation with whole numbers that a number is."""
    found = MP.pslq([value * value, value, MP.mpf(1)], maxcoeff=_LARGEST, maxsteps=2000, tol=MP.mpf(10) ** -120)
    if not found or not found[0]:
        return None
    a, b, c = (Fraction(int(each)) for each in found)
    middle, square = -b / (2 * a), b * b / (4 * a * a) - c / a
    if square < 0:
        return None
    root = _root(square) if square else ZERO
    above = value > ARITHMETIC.number(middle)
    return add(Number(middle), root if above else negate(root))


def value_of(expression: Expression, values: dict[str, Any]) -> Any:
    """An expression with 150 digits.

    Args:
        expression: Any expression.
        values: A value for each name in it.
    """
    return evaluate(expression, values, ARITHMETIC)
