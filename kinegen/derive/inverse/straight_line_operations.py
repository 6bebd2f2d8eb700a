"""The steps that all solutions are made of: selects, planar vectors, vectors, angles with known bounds.

Planar vectors are complex numbers, pairs of a real and an imaginary part: turning is multiplying. Everything goes
through let bindings, so that what two branches share is computed once; mirrored branches are written so that they
share.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import field
from typing import TypeVar, cast

import sympy as sp

from kinegen.derive.expressions import LetBindings
from kinegen.derive.folding import Vector
from kinegen.derive.inverse.exact_geometry import Rotation, tidy
from kinegen.derive.inverse.geometry import Planar
from kinegen.derive.inverse.tolerances import Thresholds
from kinegen.support.dataclass import dataclass

ONE, ZERO = sp.S.One, sp.S.Zero

_LARGEST = sp.Integer(10) ** 15
"""A sum of squares that no target reaches."""

_Some = TypeVar("_Some", Planar, Vector)


@dataclass(frozen=True, slots=True)
class Angle:
    """An angle in radians and the bounds that it keeps by the way it is made."""

    value: sp.Expr
    low: float
    high: float

    def __neg__(self) -> Angle:
        return Angle(-self.value, -self.high, -self.low)

    def __add__(self, other: Angle) -> Angle:
        return Angle(self.value + other.value, self.low + other.low, self.high + other.high)

    def __sub__(self, other: Angle) -> Angle:
        return self + -other


def fixed(angle: sp.Expr) -> Angle:
    """Return a constant angle."""
    if angle.free_symbols:
        return Angle(angle, -math.pi, math.pi)
    value = float(sp.N(angle))
    return Angle(tidy(angle) if value else ZERO, value, value)


HALF_TURN = Angle(sp.pi, math.pi, math.pi)


@dataclass(slots=True)
class OperationBuilder:
    """Formulas among let bindings.

    Attributes:
        bindings: Receives the intermediate values.
        value: Evaluates an expression in runtime parameters at their values in the file.
        near: The thresholds of the arm.
    """

    bindings: LetBindings
    value: Callable[[sp.Expr], float]
    near: Thresholds

    def name(self, expression: sp.Expr) -> sp.Expr:
        """Give an expression a name."""
        return self.bindings.name(expression)

    def select(self, less: sp.Expr, more: sp.Expr, then: sp.Expr, other: sp.Expr) -> sp.Expr:
        """Return `then` where `less < more`, else `other`, also for NaN."""
        less, more, then, other = (self.name(each) for each in (less, more, then, other))
        if then == other:
            return then
        if less.is_number and more.is_number:
            return then if less < more else other
        condition = sp.Lt(less, more, evaluate=False)
        return self.name(sp.Piecewise((then, condition), (other, True), evaluate=False))

    def choose(self, less: sp.Expr, more: sp.Expr, then: Planar, other: Planar) -> Planar:
        """Return the planar vector `then` where `less < more`, else `other`, entry by entry."""
        return self.select(less, more, then[0], other[0]), self.select(less, more, then[1], other[1])

    def finite(self, numbers: Iterable[sp.Expr], then: sp.Expr = ONE) -> sp.Expr:
        """Return `then` where all numbers are finite, and their squares add up to less than `_LARGEST`, else 0."""
        return self.select(self.square(numbers), _LARGEST, then, ZERO)

    def square(self, vector: Iterable[sp.Expr]) -> sp.Expr:
        """Return the sum of squares."""
        return self.name(sp.Add(*(entry**2 for entry in vector)))

    def root(self, square: sp.Expr) -> sp.Expr:
        """Return the square root of what cannot be negative."""
        return self.name(sp.sqrt(self.name(square)))

    def root_of_positive(self, square: sp.Expr) -> sp.Expr:
        """Return the square root of what is positive but for rounding, else 0."""
        return self.root(self.select(ZERO, square, square, ZERO))

    def times(self, left: Planar, right: Planar) -> Planar:
        """Return the product of two complex numbers; its terms are named, because mirrored branches share them."""
        products = [self.name(a * b) for a in left for b in right]
        return self.name(products[0] - products[3]), self.name(products[1] + products[2])

    def back(self, direction: Planar, vector: Planar) -> Planar:
        """Turn a vector back by a direction."""
        return self.times(vector, (direction[0], -direction[1]))

    def sharpened(self, direction: Planar) -> Planar:
        """Bring a direction whose length is nearly 1 to twice as many digits of that length (a step of Newton's)."""
        return self.scaled(direction, self.name((3 - self.square(direction)) / 2))

    def turned(self, rotation: Rotation, vector: Vector) -> Vector:
        """Multiply a constant rotation and a vector."""
        x, y, z = (self.name(sp.Add(*(a * b for a, b in zip(row, vector, strict=True)))) for row in rotation)
        return x, y, z

    def seen(self, rows: Rotation, vector: Vector) -> Vector:
        """Return a vector in the axes of a frame of named numbers."""
        return self.dot(rows[0], vector), self.dot(rows[1], vector), self.dot(rows[2], vector)

    def combined(self, *terms: tuple[sp.Expr, Vector]) -> Vector:
        """Return a sum of multiples of vectors; every product and every sum is a step of its own, as in `dot`."""
        name = self.name
        x, y, z = (name(sp.Add(*(name(factor * vector[place]) for factor, vector in terms))) for place in range(3))
        return x, y, z

    def dot(self, left: Iterable[sp.Expr], right: Iterable[sp.Expr]) -> sp.Expr:
        """Return the inner product."""
        return self.name(sp.Add(*(self.name(a * b) for a, b in zip(left, right, strict=True))))

    def cross(self, left: Vector, right: Vector) -> Vector:
        """Return the cross product."""
        name = self.name
        x, y, z = (name(name(left[i] * right[j]) - name(left[j] * right[i])) for i, j in ((1, 2), (2, 0), (0, 1)))
        return x, y, z

    def plus(self, left: Vector, right: Vector) -> Vector:
        """Return the sum."""
        x, y, z = (self.name(a + b) for a, b in zip(left, right, strict=True))
        return x, y, z

    def minus(self, left: Vector, right: Vector) -> Vector:
        """Return the difference."""
        x, y, z = (self.name(a - b) for a, b in zip(left, right, strict=True))
        return x, y, z

    def scaled(self, vector: _Some, factor: sp.Expr) -> _Some:
        """Return a multiple."""
        return cast("_Some", tuple(self.name(entry * factor) for entry in vector))

    def argument(self, vector: Planar) -> Angle:
        """Return the angle of a complex number; mirror images share one arc tangent."""
        x, y = self.name(vector[0]), self.name(vector[1])
        # Constants have a constant angle, and mirror images the angle of one of them.
        if y == 0 and x.is_number:
            return fixed(ZERO if x > 0 else sp.pi)
        if y.could_extract_minus_sign():
            return -self.argument((x, -y))
        if x.could_extract_minus_sign():
            return HALF_TURN - self.argument((-x, y))
        if x.is_number and y.is_number:
            return fixed(sp.atan2(y, x))
        return Angle(self.name(sp.atan2(y, x, evaluate=False)), -math.pi, math.pi)

    def length(self, vector: Planar) -> sp.Expr:
        """Return the length of a constant vector, never negative."""
        square = tidy(vector[0] ** 2 + vector[1] ** 2)
        return tidy(sp.sqrt(square)) if square.is_number else self.root(square)

    def polar(self, vector: Planar) -> tuple[sp.Expr, sp.Expr]:
        """Return a constant vector as length and angle; a runtime length along a coordinate axis keeps its sign."""
        x, y = vector
        if x.is_number and y.is_number:
            return tidy(sp.sqrt(x**2 + y**2)), sp.atan2(y, x)
        if y == 0:
            return x, ZERO
        if x == 0:
            return y, sp.pi / 2
        return self.root(x**2 + y**2), self.name(sp.atan2(y, x, evaluate=False))

    def unit(self, angle: sp.Expr) -> Planar:
        """Return a constant angle as a complex number of length 1."""
        if angle.free_symbols:
            return self.name(sp.cos(angle)), self.name(sp.sin(angle))
        return tidy(sp.cos(angle)), tidy(sp.sin(angle))


@dataclass(slots=True)
class Units:
    """Angles that are sums of arc tangents as named complex numbers of length 1, without going through the angles."""

    steps: OperationBuilder
    _defined: dict[sp.Expr, sp.Expr] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self._defined = dict(self.steps.bindings.definitions)

    def of(self, angle: sp.Expr) -> Planar:
        """Return the complex number of length 1 whose argument is a sum of constants and named arc tangents."""
        constants = [term for term in sp.Add.make_args(angle) if term.is_number]
        others = [term for term in sp.Add.make_args(angle) if not term.is_number]
        turned: Planar = (ONE, ZERO)
        for term in others:
            turned = self.steps.times(turned, self._of_term(term))
        if not constants:
            return turned
        constant = sp.Add(*constants)
        return self.steps.times(turned, (tidy(sp.cos(constant)), tidy(sp.sin(constant))))

    def _of_term(self, term: sp.Expr) -> Planar:
        factor, core = term.as_coeff_Mul()
        arc = self._defined.get(core)
        if abs(factor) != 1 or not isinstance(arc, sp.atan2):
            return self.steps.name(sp.cos(term)), self.steps.name(sp.sin(term))
        y, x = arc.args
        scale = self.steps.name(1 / self.steps.root(self.steps.square((x, y))))
        return self.steps.name(x * scale), factor * self.steps.name(y * scale)
