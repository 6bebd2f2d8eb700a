"""The arithmetic of bounds: decimal numbers, none negative, every operation rounded upwards; facts of a number type.

All functions expect to run under `UPWARDS`; `bound` sees to that.
"""

from __future__ import annotations

from collections.abc import Callable
from decimal import MAX_EMAX, MIN_EMIN, ROUND_CEILING, Context, Decimal
from fractions import Fraction
from functools import cache
from math import frexp

import mpmath

from kinegen.support.dataclass import dataclass

UPWARDS = Context(prec=40, rounding=ROUND_CEILING, Emin=MIN_EMIN, Emax=MAX_EMAX)
"""Upper bounds stay upper bounds. Forty digits make the excess invisible, for doubles too."""

_ROOTS = Context(prec=19, Emin=MIN_EMIN, Emax=MAX_EMAX)
"""Of square roots, which cost most and the more for each digit. As many digits as one word of the library holds."""

ZERO = Decimal(0)
ONE = Decimal(1)

_SLACK = Fraction(1, 10**30)
"""Far above the rounding of mpmath at `_DIGITS` digits, and far below anything that a bound shows."""

_DIGITS = 50


class UnboundedError(ArithmeticError):
    """A result may overflow, or a divisor may vanish."""


@dataclass(frozen=True, slots=True)
class NumberType:
    """What the analysis knows of a number type and its sine and cosine.

    Attributes:
        precision: Bits of a normal number, the leading one included.
        lowest: The smallest positive number is 2 to this power.
        highest: The smallest power of two that is no finite number any more.
        nearest: Rounds an exact number, as the emitters do with constants.
        sine_error: Largest error of a computed sine or cosine.
        angle_limit: Largest magnitude of an angle; beyond it sine and cosine are NaN.
    """

    precision: int
    lowest: int
    highest: int
    nearest: Callable[[Fraction], float]
    sine_error: float
    angle_limit: float

    @property
    def unit(self) -> Decimal:
        """The largest relative error of rounding a number in the normal range."""
        return power_of_two(-self.precision)

    @property
    def underflow(self) -> Decimal:
        """The largest error of rounding a subnormal number."""
        return power_of_two(self.lowest - 1)

    @property
    def pair_error(self) -> Decimal:
        """The largest 2-norm of the errors of a sine and the cosine of the same angle."""
        return norm(Decimal(self.sine_error), Decimal(self.sine_error))

    def half_ulp(self, largest: Decimal) -> Decimal:
        """Return the largest error of rounding any number up to a magnitude.

        Raises UnboundedError if rounding may overflow.
        """
        return self._half_ulp(_exponent(largest)) if largest else ZERO

    def _half_ulp(self, exponent: int) -> Decimal:
        """Return the same of numbers up to a power of two."""
        if exponent >= self.highest:
            raise UnboundedError
        return max(power_of_two(exponent - 1 - self.precision), self.underflow)

    def rounded(self, largest: Decimal) -> Decimal:
        """Return a bound on what any number up to a magnitude is rounded to; rounding never passes a power of two."""
        if not largest:
            return ZERO
        exponent = _exponent(largest)
        return min(power_of_two(exponent), largest + self._half_ulp(exponent))


@cache
def power_of_two(exponent: int) -> Decimal:
    """Return a power of two, rounded upwards if it has more than forty digits."""
    return UPWARDS.plus(Decimal(2**exponent)) if exponent >= 0 else UPWARDS.divide(ONE, Decimal(2**-exponent))


def _exponent(largest: Decimal) -> int:
    """Return the smallest k for which a positive number is at most 2^k."""
    mantissa, exponent = frexp(float(largest)) if largest > Decimal("1e-300") else (0.0, -1100)
    if not mantissa < 1:
        raise UnboundedError
    # Conversion to double rounds to nearest, and very small numbers are not converted at all.
    while power_of_two(exponent) < largest:
        exponent += 1
    while exponent > -1100 and power_of_two(exponent - 1) >= largest:
        exponent -= 1
    return exponent


def upper(number: Fraction) -> Decimal:
    """Return an exact number that is not negative, rounded upwards."""
    return Decimal(number.numerator) / Decimal(number.denominator)


def lower(number: Fraction) -> Decimal:
    """Return an exact number that is not negative, rounded downwards."""
    return -(Decimal(-number.numerator) / Decimal(number.denominator))


def norm(*entries: Decimal) -> Decimal:
    """Return the 2-norm of a vector of bounds."""
    present = [entry for entry in entries if entry]
    if len(present) < 2:
        return present[0] if present else ZERO
    if len(present) == 2:  # most of them
        first, second = present
        return root(first * first + second * second)
    return root(sum((entry * entry for entry in present), ZERO))


def root(number: Decimal) -> Decimal:
    """Return the square root; decimal arithmetic rounds it to nearest in every context, hence the step upwards."""
    return _ROOTS.next_plus(_ROOTS.sqrt(number)) if number else ZERO


def largest_cosine(low: Fraction, high: Fraction) -> Decimal:
    """Return the largest magnitude of the cosine of an angle in a range, rounded upwards."""
    with mpmath.workdps(_DIGITS):
        half_turns = [mpmath.floor(_number(end) / mpmath.pi) for end in (low - _SLACK, high + _SLACK)]
        if half_turns[0] != half_turns[1]:
            return ONE
        ends = [Fraction(str(abs(mpmath.cos(_number(end))))) for end in (low, high)]
    return min(ONE, upper(max(ends) + _SLACK))


def largest_sine(low: Fraction, high: Fraction) -> Decimal:
    """Return the largest magnitude of the sine of an angle in a range, rounded upwards."""
    with mpmath.workdps(_DIGITS):
        quarter = Fraction(str(mpmath.pi / 2))
    return largest_cosine(low - quarter - _SLACK, high - quarter + _SLACK)


def _number(value: Fraction) -> mpmath.mpf:
    return mpmath.mpf(value.numerator) / value.denominator
