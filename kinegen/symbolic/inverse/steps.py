"""The steps that all solutions are made of: selects, angles with known bounds, a crank and a triangle.

Planar vectors are complex numbers, pairs of a real and an imaginary part: turning is multiplying. Everything goes
through a tape, so that what two branches share is computed once; mirrored branches are written so that they share.

Tolerances (dimensionless) say when a target counts as within reach although rounding put it just outside, and when a
direction counts as free: `REACH` of a squared cosine, `ALIGNED` of a squared length against that of the arm.
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

REACH = sp.Rational(1, 10**11)
ALIGNED = sp.Rational(1, 10**20)
FLAT = sp.Rational(1, 10**14)
"""Squared sines below this are rounding: the arm is stretched or folded."""
WITHIN = sp.Rational(1, 10**7)
"""How far outside its limits a joint may be found, in its own unit: where two branches meet, rounding turns joints by
its square root, 2e-8."""
PLANE = sp.Rational(1, 10**6)
"""How far a target may be from what an arm of fewer than six joints can do: radians, or relative to the arm's size."""

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


@dataclass(frozen=True, slots=True)
class Swing:
    """One way to turn a crank so that its tip meets a point.

    Attributes:
        angle: How far it is turned.
        direction: The same as a complex number of length 1.
        along: How far the tip is out along the crank; it is `aside` across.
        valid: 1 where the point is within reach, else 0.
    """

    angle: Angle
    direction: Planar
    along: sp.Expr
    valid: sp.Expr


@dataclass(frozen=True, slots=True)
class Bend:
    """One way to bend two links so that the tip of the second meets a point.

    Attributes:
        first: Angle of the first joint.
        second: Angle of the second joint.
        direction: The sum of both as a complex number of length 1.
        valid: 1 where the point is within reach, else 0.
    """

    first: Angle
    second: Angle
    direction: Planar
    valid: sp.Expr


@dataclass(slots=True)
class Steps:
    """Formulas on a tape.

    Attributes:
        tape: Receives the intermediate values.
        value: An expression in runtime parameters at their values in the file.
    """

    tape: Tape
    value: Callable[[sp.Expr], float]

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

    def swing(self, point: Planar, aside: sp.Expr, near: sp.Expr, start: Planar) -> tuple[Swing, Swing]:
        """Turn a crank whose tip is `aside` across it so that the tip meets a point, forward and backward.

        Solves `direction * (along + i*aside) = point`. Where the point lies on the axis of the crank, which then may
        stand anywhere, it stands at `start`.

        Args:
            point: The point.
            aside: How far the tip is off the crank.
            near: The squared distance within which the point counts as on the axis.
            start: Direction of the crank for a point on the axis.

        Returns:
            With the tip forward (`along` is positive) and backward.
        """
        square = self.square(point)
        if not (aside.is_number and aside != 0):
            # Only the direction is replaced: how far the point is, is known all the same.
            point = (self.select(square, near, start[0], point[0]), self.select(square, near, start[1], point[1]))
        if aside == 0:
            return self._swing_in_line(point, square, near)
        rest = self.name(square - aside**2)
        valid = self.select(-REACH * square, rest, ONE, ZERO)
        along = self.root(self.select(ZERO, rest, rest, ZERO))
        shown, length = along, square
        if not aside.is_number:
            shown, length = (self.select(square, near, ONE, each) for each in (along, square))
        inverse = self.name(1 / length)
        swings = []
        for sign in (1, -1):
            real, imaginary = self.times(point, (sign * shown, -aside))
            direction = (self.name(real * inverse), self.name(imaginary * inverse))
            angle = self.argument(point) - self.argument((sign * shown, aside))
            swings.append(Swing(angle, direction, sign * along, valid))
        return swings[0], swings[1]

    def _swing_in_line(self, point: Planar, square: sp.Expr, near: sp.Expr) -> tuple[Swing, Swing]:
        """The same for a tip on the line of the crank, which every point has; `point` gives the direction."""
        along = self.root(square)
        # A direction that was chosen is near to length 1, one that was given has the length of the point.
        inverse = self.name(1 / self.select(square, near, ONE, along))
        direction = (self.name(point[0] * inverse), self.name(point[1] * inverse))
        angle = self.argument(point)
        back = (-direction[0], -direction[1])
        return Swing(angle, direction, along, ONE), Swing(angle + HALF_TURN, back, -along, ONE)

    def bend(self, point: Planar, upper: Planar, lower: Planar, start: sp.Expr) -> tuple[Bend, Bend]:
        """Bend two links so that the tip of the second meets a point: `turn * (upper + turn' * lower) = point`.

        The cosine rule, with 1 - cos and 1 + cos formed as products of lengths so that nothing cancels near the
        stretched and the folded arm. Where links of equal length are folded to the axis of the first joint, that stands
        at `start`.

        Args:
            point: The point, as seen from the axis of the first joint.
            upper: The first link, where its joint stands at zero.
            lower: The second link, where both joints stand at zero.
            start: Angle of the first joint for a point on its axis.

        Returns:
            With the elbow to the left of the line to the point, and to the right of it.
        """
        (first, first_angle), (second, second_angle) = self.polar(upper), self.polar(lower)
        square = self.square(point)
        scale = self._inverse(2 * first * second)
        less = self.name(((first + second) ** 2 - square) * scale)
        more = self.name((square - (first - second) ** 2) * scale)
        sine_square = self.name(less * more)
        valid = self.select(-REACH, sine_square, ONE, ZERO)
        sine = self.root(self.select(FLAT, sine_square, sine_square, ZERO))
        elbow = self.argument((self.name(more - 1), sine))
        shoulder = self.argument((self.name(first - second + second * more), self.name(second * sine)))
        lead, aside = self.name(second - first + first * more), self.name(first * sine)
        inverse = self.name(1 / square)
        lead, aside = self.name(lead * inverse), self.name(aside * inverse)
        back = self.unit(-second_angle)
        terms = [self.name(a * b) for a in (lead, aside) for b in back]
        bends = []
        for sign in (-1, 1):
            turned = (self.name(terms[0] - sign * terms[3]), self.name(terms[1] + sign * terms[2]))
            sided = Angle(sign * shoulder.value, *sorted((sign * shoulder.low, sign * shoulder.high)))
            bent = Angle(sign * elbow.value, *sorted((sign * elbow.low, sign * elbow.high)))
            angle = self.argument(point) - sided - fixed(first_angle)
            bends.append(Bend(angle, bent - fixed(second_angle) + fixed(first_angle), self.times(point, turned), valid))
        if _may_fold(first, second):
            lengths, angles = (first, second), (first_angle, second_angle)
            bends = [self._folded(each, square, lengths, angles, start) for each in bends]
        if not (first.is_number and second.is_number) and self._is_negative(first) != self._is_negative(second):
            bends.reverse()
        return bends[0], bends[1]

    def _is_negative(self, length: sp.Expr) -> bool:
        """Whether a length has a minus sign in the file; a root never has."""
        return not any(isinstance(symbol, sp.Dummy) for symbol in length.free_symbols) and self.value(length) < 0

    def _inverse(self, length: sp.Expr) -> sp.Expr:
        return tidy(1 / length) if length.is_number else self.name(1 / length)

    def _folded(self, bend: Bend, square: sp.Expr, lengths: Planar, angles: Planar, start: sp.Expr) -> Bend:
        """The same, with the first joint at `start` where the point lies on its axis and the links on each other."""
        free = ALIGNED * (lengths[0] ** 2 + lengths[1] ** 2)
        first = Angle(
            self.select(square, free, start, bend.first.value),
            min(bend.first.low, -math.pi),
            max(bend.first.high, math.pi),
        )
        folded = self.name(-lengths[0] / lengths[1])
        real, imaginary = (folded * entry for entry in self.unit(start + angles[0] - angles[1]))
        direction = (
            self.select(square, free, real, bend.direction[0]),
            self.select(square, free, imaginary, bend.direction[1]),
        )
        return Bend(first, bend.second, direction, bend.valid)


def _may_fold(first: sp.Expr, second: sp.Expr) -> bool:
    """Whether two lengths may be equal."""
    if first.is_number and second.is_number:
        return bool(abs(abs(first) - abs(second)) < abs(first) / 10**6)
    return True
