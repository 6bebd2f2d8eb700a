"""The exact value of a constant expression, as a fraction of which kernels take what their type holds.

In: sympy expressions without variables. Out: fractions. sympy evaluates each constant from its beginning, though those
of a chain are products of the same sines and cosines; here each part is evaluated once.
"""

from __future__ import annotations

from fractions import Fraction
from functools import lru_cache

import mpmath
import sympy as sp
from mpmath.libmp import dps_to_prec, from_rational, mpf_pos, round_nearest, to_str

DIGITS = 150
_WORKING = 200
"""Digits of what a constant is made of."""

_CANCELLED = mpmath.mpf(10) ** (DIGITS + 10 - _WORKING)
"""A sum that is so much smaller than its largest term is left to sympy, which takes more digits then."""

_NEGLIGIBLE = Fraction(1, 10**120)


class _LostError(ArithmeticError):
    """A value has not enough digits, or is made by a function that is not evaluated here."""


@lru_cache(maxsize=4096)
def exact_number(expression: sp.Expr) -> Fraction:
    """The value of a constant expression: exact if rational, else to 150 digits."""
    if expression.is_Rational:
        return Fraction(int(expression.p), int(expression.q))
    try:
        with mpmath.workdps(_WORKING):
            rounded = mpf_pos(_evaluated(expression)._mpf_, dps_to_prec(DIGITS), round_nearest)
        digits = Fraction(to_str(rounded, DIGITS))
    except _LostError:
        digits = Fraction(str(sp.N(expression, DIGITS, maxn=4 * DIGITS)))
    return Fraction(0) if abs(digits) < _NEGLIGIBLE else digits


@lru_cache(maxsize=4096)
def _evaluated(expression: sp.Expr) -> mpmath.mpf:
    """A part of a constant; 200 digits are the working precision."""
    if expression.is_Rational:
        return mpmath.mpf(from_rational(int(expression.p), int(expression.q), mpmath.mp.prec, round_nearest))
    if expression is sp.pi:
        return +mpmath.pi
    parts = [_evaluated(part) for part in expression.args]
    if isinstance(expression, sp.Add):
        total = mpmath.fsum(parts)
        if abs(total) <= _CANCELLED * max(map(abs, parts)):
            raise _LostError
        return total
    if isinstance(expression, sp.Mul):
        return mpmath.fprod(parts)
    if isinstance(expression, (sp.sin, sp.cos)):
        return (mpmath.sin if isinstance(expression, sp.sin) else mpmath.cos)(parts[0])
    if isinstance(expression, sp.Pow) and expression.exp.is_Rational and parts[0] > 0:
        return mpmath.power(*parts)
    raise _LostError
