"""The steps that all solutions are made of: selects, planar vectors, angles with known bounds.

Planar vectors are complex numbers, pairs of a real and an imaginary part: turning is multiplying. Everything goes
through a tape, so that what two branches share is computed once; mirrored branches are written so that they share.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import sympy as sp

from kinegen.symbolic.expressions import Tape
from kinegen.symbolic.fold import Vector
from kinegen.symbolic.inverse.exact import Rotation, tidy
from kinegen.symbolic.inverse.geometry import Planar
from kinegen.symbolic.inverse.thresholds import Thresholds

ONE, ZERO = sp.S.One, sp.S.Zero


@dataclass(frozen=True, slots=True)
class Angle:
    """An angle and the bounds that it keeps by the way it is made.

    Attributes:
        value: Radians.
        low: Lower bound.
        high: Upper bound.
    """

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
    """A constant angle."""
    if angle.free_symbols:
        return Angle(angle, -math.pi, math.pi)
    value = float(sp.N(angle))
    return Angle(tidy(angle) if value else ZERO, value, value)


HALF_TURN = Angle(sp.pi, math.pi, math.pi)


@dataclass(slots=True)
class Steps:
    """Formulas on a tape.

    Attributes:
        tape: Receives the intermediate values.
        value: An expression in runtime parameters at their values in the file.
        near: The thresholds of the arm.
    """

    tape: Tape
    value: Callable[[sp.Expr], float]
    near: Thresholds

    def name(self, expression: sp.Expr) -> sp.Expr:
        """Give an expression a name."""
        return self.tape.name(expression)

    def select(self, less: sp.Expr, more: sp.Expr, then: sp.Expr, other: sp.Expr) -> sp.Expr:
        """`then` where `less < more`, else `other`, also for NaN."""
        less, more, then, other = (self.name(each) for each in (less, more, then, other))
        if then == other:
            return then
        if less.is_number and more.is_number:
            return then if less < more else other
        condition = sp.Lt(less, more, evaluate=False)
        return self.name(sp.Piecewise((then, condition), (other, True), evaluate=False))

    def square(self, vector: Planar | Vector) -> sp.Expr:
        """The squared length."""
        return self.name(sp.Add(*(entry**2 for entry in vector)))

    def root(self, square: sp.Expr) -> sp.Expr:
        """The square root of what cannot be negative."""
        return self.name(sp.sqrt(self.name(square)))

    def times(self, left: Planar, right: Planar) -> Planar:
        """The product of two complex numbers; its terms are named, because mirrored branches share them."""
        products = [self.name(a * b) for a in left for b in right]
        return self.name(products[0] - products[3]), self.name(products[1] + products[2])

    def back(self, direction: Planar, vector: Planar) -> Planar:
        """A vector turned back by a direction."""
        return self.times(vector, (direction[0], -direction[1]))

    def turned(self, rotation: Rotation, vector: Vector) -> Vector:
        """A constant rotation times a vector."""
        x, y, z = (self.name(sp.Add(*(a * b for a, b in zip(row, vector, strict=True)))) for row in rotation)
        return x, y, z

    def argument(self, vector: Planar) -> Angle:
        """The angle of a complex number; mirror images share one arc tangent."""
        x, y = self.name(vector[0]), self.name(vector[1])
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
        """The length of a constant vector, never negative."""
        square = tidy(vector[0] ** 2 + vector[1] ** 2)
        return tidy(sp.sqrt(square)) if square.is_number else self.root(square)

    def polar(self, vector: Planar) -> tuple[sp.Expr, sp.Expr]:
        """A constant vector as length and angle; a runtime length along a coordinate axis keeps its sign."""
        x, y = vector
        if x.is_number and y.is_number:
            return tidy(sp.sqrt(x**2 + y**2)), sp.atan2(y, x)
        if y == 0:
            return x, ZERO
        if x == 0:
            return y, sp.pi / 2
        return self.root(x**2 + y**2), self.name(sp.atan2(y, x, evaluate=False))

    def unit(self, angle: sp.Expr) -> Planar:
        """A constant angle as a complex number of length 1."""
        if angle.free_symbols:
            return self.name(sp.cos(angle)), self.name(sp.sin(angle))
        return tidy(sp.cos(angle)), tidy(sp.sin(angle))
