"""Numbers with 150 digits and the expressions that they are, and fixed transforms made of them.

A number that agrees with a simple fraction, a square root or a nested root to 90 digits is that one: no chain of
operations on a table's numbers makes such an accident. What is none of them, such as the cosine of 0.3 rad, is rounded
to 50 digits, of which at most 50 stand behind the point, and the caller reports it. A rotation is numbers. A shift
keeps the terms of the table, `d4` or `D4/sqrt(3)`, each with a factor that is a number, so that names survive, and
runtime lengths stay what they are.
"""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
from functools import lru_cache
from typing import Any

import mpmath

from kinegen.model.dh_conversion.elementary_transforms import terms, total
from kinegen.model.expression_parser import (
    MAX_DIGITS,
    PI,
    ZERO,
    Arithmetic,
    Expression,
    Number,
    Pi,
    add,
    call,
    evaluate,
    is_arc,
    multiply,
    names,
    negate,
)
from kinegen.model.robot import Step
from kinegen.support.dataclass import dataclass

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
_NOISE = MP.mpf(10) ** -42
"""What is left where numbers that were rounded to 50 digits cancel: no decision is made on it. Axes
that such numbers make parallel would meet 1e45 m away."""
_PRIMES = tuple(n for n in range(2, 100) if all(n % m for m in range(2, n)))


@dataclass(frozen=True, slots=True)
class ExactValue:
    """The expression of a number, and whether it is that number exactly."""

    expression: Expression
    exact: bool = True


def is_small(value: Any) -> bool:
    """Tell whether a number is zero."""
    return bool(abs(value) < _SMALL)


def is_noise(value: Any) -> bool:
    """Tell whether a length, or the sine of an angle, is zero but for numbers that have been rounded."""
    return bool(abs(value) < _NOISE)


def settled(value: Any) -> Any:
    """Return a number, or the 0, 1 or -1 that it is."""
    nearest = MP.nint(value)
    return nearest if abs(nearest) <= 1 and is_small(value - nearest) else value


def rational(value: Any) -> Fraction | None:
    """Return the simple fraction that a number is."""
    sign, mantissa, exponent, _ = MP.mpf(value)._mpf_
    exact = Fraction((-1) ** sign * int(mantissa)) * Fraction(2) ** exponent
    simple = exact.limit_denominator(_SIMPLE)
    return simple if abs(exact - simple) < Fraction(1, 10**100) else None


@lru_cache(maxsize=4096)
def recognised(value: Any, *, algebraic: bool = True) -> ExactValue:
    """Return the expression of a number; without `algebraic` only fractions are looked for, which is faster."""
    simple = rational(value)
    if simple is not None:
        return ExactValue(Number(simple))
    if is_noise(value):
        return ExactValue(ZERO, exact=False)
    square = rational(value * value)
    if square is not None:
        return ExactValue(_signed(value, _root(square)))
    if algebraic:
        for power in (1, 2):
            inner = _quadratic(value**power)
            if inner is not None:
                return ExactValue(inner if power == 1 else _signed(value, call("sqrt", inner)))
    return ExactValue(Number(_rounded(value)), exact=False)


@lru_cache(maxsize=4096)
def identified_angle(value: Any, *, algebraic: bool = True) -> ExactValue:
    """Find the expression of an angle: a share of pi, an arc tangent, or a number of radians beside a quarter."""
    share = rational(value / MP.pi)
    if share is not None and share.denominator < 10**9:
        return ExactValue(multiply(Number(share), PI))
    for quarters in (0, 1, -1, 2, -2):
        plain = rational(value - quarters * MP.pi / 2)
        if plain is not None:
            return ExactValue(add(multiply(Number(Fraction(quarters, 2)), PI), Number(plain)))
    if algebraic:
        slope = MP.tan(value)
        tangent = recognised(abs(slope))
        if tangent.exact:
            halves = multiply(Number(Fraction(int(MP.nint((value - MP.atan(slope)) / MP.pi)))), PI)
            return ExactValue(add(_signed(slope, call("atan", tangent.expression)), halves))
    return ExactValue(Number(_rounded(value)), exact=False)


def _rounded(value: Any) -> Fraction:
    """Round to 50 digits; below 1 the zeros in front count too, or the last ones could not be written."""
    if abs(value) < 1:
        return Fraction(int(MP.nint(value * 10**_KEPT)), 10**_KEPT)
    return Fraction(mpmath.libmp.to_str(MP.mpf(value)._mpf_, _KEPT))


def _signed(value: Any, size: Expression) -> Expression:
    return size if value > 0 else negate(size)


def _root(square: Fraction) -> Expression:
    """Return the square root of a positive fraction, small squares taken out."""
    inside, outside = square.numerator * square.denominator, Fraction(1, square.denominator)
    for prime in _PRIMES:
        while inside % prime**2 == 0:
            inside, outside = inside // prime**2, outside * prime
    if inside >= 10**MAX_DIGITS:
        # No file may have such a number; the fraction has half of its digits.
        return call("sqrt", Number(square))
    return multiply(Number(outside), call("sqrt", Number(Fraction(inside))) if inside != 1 else Number(Fraction(1)))


def _quadratic(value: Any) -> Expression | None:
    """Return the root of a quadratic equation with whole numbers that a number is."""
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
    """Evaluate an expression with 150 digits."""
    return evaluate(expression, values, ARITHMETIC)


Form = dict[Expression, Any]
"""Terms of lengths with factors of 150 digits."""

Matrix = tuple[tuple[Any, Any, Any], tuple[Any, Any, Any], tuple[Any, Any, Any]]


class NotNumeric(Exception):  # noqa: N818 - not an error: another way is taken
    """An angle or a decision depends on a runtime parameter."""


@dataclass(frozen=True, slots=True)
class Values:
    """The values of the parameters, and which of them are set at run time."""

    values: tuple[tuple[str, Any], ...]
    runtime: frozenset[str]

    def angle(self, expression: Expression) -> Any:
        """Return an angle as a number."""
        if self.runtime.intersection(names(expression)):
            raise NotNumeric
        return value_of(expression, dict(self.values))

    def length(self, form: Form) -> Any:
        """Return the value of a linear form."""
        return sum((factor * value_of(term, dict(self.values)) for term, factor in form.items()), MP.mpf(0))

    def is_zero(self, form: Form) -> bool:
        """Tell whether a linear form is zero, whatever the runtime parameters."""
        if all(is_noise(factor) for factor in form.values()):
            return True
        return not self.varies(form) and is_noise(self.length(form))

    def varies(self, form: Form) -> bool:
        """Tell whether a linear form depends on a runtime parameter."""
        used = (term for term, factor in form.items() if not is_small(factor))
        return any(self.runtime.intersection(names(term)) for term in used)


@dataclass(frozen=True, slots=True)
class Pose:
    """A fixed transform; `algebraic` says whether its numbers can be roots of fractions."""

    rotation: Matrix
    shift: tuple[Form, Form, Form]
    algebraic: bool


IDENTITY = Pose(
    tuple(tuple(MP.mpf(int(i == j)) for j in range(3)) for i in range(3)),  # type: ignore[arg-type]
    ({}, {}, {}),
    algebraic=True,
)


def pose_of(steps: Iterable[Step], values: Values, start: Pose = IDENTITY) -> Pose:
    """Multiply elementary transforms without joint variables, from left to right, behind a pose.

    Raises:
        NotNumeric: If an angle depends on a runtime parameter.
    """
    columns = [[start.rotation[i][j] for i in range(3)] for j in range(3)]
    shift: list[Form] = [dict(form) for form in start.shift]
    algebraic = start.algebraic
    for step in steps:
        # A shift along a column of the rotation, term by term so that names survive.
        axis = step.kind.axis
        if not step.kind.is_rotation:
            for place in range(3):
                for term, factor in terms(step.value).items():
                    moved = columns[axis][place] * ARITHMETIC.number(factor)
                    shift[place][term] = settled_sum(shift[place].get(term, MP.mpf(0)), moved)
            continue
        angle = values.angle(step.value)
        # A turn mixes two columns; sines of shares of pi and of arcs may be roots, others are not.
        algebraic = algebraic and all(_is_special(term) for term in terms(step.value))
        cosine, sine = settled(MP.cos(angle)), settled(MP.sin(angle))
        i, j = (axis + 1) % 3, (axis + 2) % 3
        first, second = columns[i], columns[j]
        columns[i] = [settled(cosine * a + sine * b) for a, b in zip(first, second, strict=True)]
        columns[j] = [settled(cosine * b - sine * a) for a, b in zip(first, second, strict=True)]
    rows = tuple(tuple(columns[j][i] for j in range(3)) for i in range(3))
    return Pose(rows, (shift[0], shift[1], shift[2]), algebraic)  # type: ignore[arg-type]


def _is_special(term: Expression) -> bool:
    """Tell whether the sine of an angle can be a root: shares of pi and arcs, not plain radians."""
    return isinstance(term, Pi) or is_arc(term)


def settled_sum(left: Any, right: Any) -> Any:
    """Return a sum that is zero where it cancels."""
    value = left + right
    return MP.mpf(0) if is_small(value) else value


def scaled(factor: Any, form: Form) -> Form:
    """Return a multiple of a linear form."""
    return {term: factor * value for term, value in form.items()}


def combined(*forms: Form) -> Form:
    """Return the sum of linear forms."""
    found: Form = {}
    for form in forms:
        for term, factor in form.items():
            found[term] = settled_sum(found.get(term, MP.mpf(0)), factor)
    return found


def expression_of(form: Form, *, algebraic: bool) -> ExactValue:
    """Return a linear form as an expression, and whether all its factors are exact."""
    parts = []
    exact = True
    for term, factor in form.items():
        if is_small(factor):
            continue
        found = recognised(factor, algebraic=algebraic)
        exact = exact and found.exact
        parts.append(multiply(found.expression, term))
    return ExactValue(total(*parts), exact)
