"""Numbers and vectors of the geometry: exact where they are rational, else rounded once, far beyond any kernel.

A constant such as sin(60 deg) becomes a fraction that is right to 160 digits, so that two ways to the same number give
the same fraction and a structural zero is seen without a tolerance that a person could notice.
"""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction

import sympy as sp

from kinegen.derive.folding import Vector

Rotation = tuple[Vector, Vector, Vector]
"""A rotation by rows."""

IDENTITY: Rotation = (
    (sp.S.One, sp.S.Zero, sp.S.Zero),
    (sp.S.Zero, sp.S.One, sp.S.Zero),
    (sp.S.Zero, sp.S.Zero, sp.S.One),
)

_DIGITS = 160
_SCALE = 10**_DIGITS
_NEGLIGIBLE = Fraction(1, 10**120)
_SIMPLE = 10**9


def tidy(expression: sp.Expr) -> sp.Expr:
    """Bring an expression in runtime parameters to one form: a sum of their products with rational factors.

    It holds sums and products of constants and real symbols; other functions of symbols stay as they are. Zero is `0`.
    """
    if expression.is_Rational and expression.q < _SCALE:
        return expression
    if not expression.free_symbols:
        return _rounded(expression)
    # Like terms are collected, so that equal expressions become the same one.
    collected: dict[sp.Expr, sp.Expr] = {}
    for term in sp.Add.make_args(sp.expand(expression)):
        factor, moving = term.as_independent(*expression.free_symbols, as_Add=False)
        collected[moving] = collected.get(moving, sp.S.Zero) + factor
    return sp.Add(*(_rounded(factor) * moving for moving, factor in collected.items()))


def _rounded(constant: sp.Expr) -> sp.Rational:
    """Return a constant as a fraction: the simple one that it equals, or 160 digits of it."""
    if constant.is_Rational:
        value = Fraction(int(constant.p), int(constant.q))
    else:
        value = Fraction(str(sp.N(constant, _DIGITS + 20, maxn=4 * _DIGITS)))
    simple = value.limit_denominator(_SIMPLE)
    if abs(simple - value) < _NEGLIGIBLE:
        value = simple
    elif value.denominator > _SCALE:
        value = Fraction(round(value * _SCALE), _SCALE)
    return sp.Rational(value.numerator, value.denominator)


def dot(left: Vector, right: Vector) -> sp.Expr:
    """Return the inner product."""
    return tidy(left[0] * right[0] + left[1] * right[1] + left[2] * right[2])


def cross(left: Vector, right: Vector) -> Vector:
    """Return the cross product."""
    return (
        tidy(left[1] * right[2] - left[2] * right[1]),
        tidy(left[2] * right[0] - left[0] * right[2]),
        tidy(left[0] * right[1] - left[1] * right[0]),
    )


def combined(*terms: tuple[sp.Expr | int, Vector]) -> Vector:
    """Return a sum of multiples of vectors."""
    x, y, z = (tidy(sp.Add(*(factor * vector[place] for factor, vector in terms))) for place in range(3))
    return x, y, z


def minus(left: Vector, right: Vector) -> Vector:
    """Return the difference of two vectors."""
    return combined((1, left), (-1, right))


def unit(vector: Vector) -> Vector:
    """Return a vector of numbers, not null, scaled to length 1."""
    return combined((1 / sp.sqrt(dot(vector, vector)), vector))


def is_null(vector: Iterable[sp.Expr]) -> bool:
    """Tell whether all entries are zero, whatever the runtime parameters."""
    return all(entry == 0 for entry in vector)


def turned(rotation: Rotation, vector: Vector) -> Vector:
    """Return a rotation times a vector."""
    return dot(rotation[0], vector), dot(rotation[1], vector), dot(rotation[2], vector)


def transposed(rotation: Rotation) -> Rotation:
    """Return the inverse of a rotation: the columns of a matrix that is given by rows, or the other way round."""
    first, second, third = zip(*rotation, strict=True)
    return first, second, third


def chained(left: Rotation, right: Rotation) -> Rotation:
    """Return the product of two rotations."""
    turned_columns = [turned(left, column) for column in transposed(right)]
    return transposed((turned_columns[0], turned_columns[1], turned_columns[2]))


def about(axis: int, angle: sp.Expr) -> Rotation:
    """Return the rotation about coordinate axis 0, 1 or 2."""
    cosine, sine = tidy(sp.cos(angle)), tidy(sp.sin(angle))
    rows = [[sp.S.Zero] * 3 for _ in range(3)]
    i, j = (axis + 1) % 3, (axis + 2) % 3
    rows[axis][axis] = sp.S.One
    rows[i][i], rows[i][j] = cosine, -sine
    rows[j][i], rows[j][j] = sine, cosine
    first, second, third = (tuple(row) for row in rows)
    return first, second, third


def perpendicular(axis: Vector) -> Vector:
    """Return a unit vector at right angles to an axis of numbers, along a coordinate axis where one will do."""
    for place in (0, 1, 2):
        if axis[place] == 0:
            return IDENTITY[place]
    return unit(cross(axis, IDENTITY[2]))
