"""A crank and a triangle, of which all arms are made: how they are turned so that their tips meet a point.

The crank is a waist, or a stroke that turns; the triangle is an elbow, with the cosine rule.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import sympy as sp

from kinegen.symbolic.inverse.exact import tidy
from kinegen.symbolic.inverse.geometry import Planar
from kinegen.symbolic.inverse.steps import HALF_TURN, ONE, ZERO, Angle, Steps, fixed
from kinegen.symbolic.inverse.thresholds import ALIGNED, TARGET

_SLENDER = 32
"""Links are nearly equal where their sum is more than so many times their difference."""


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


def swing_to(
    steps: Steps, point: Planar, aside: sp.Expr, near: sp.Expr, start: Planar, rest: sp.Expr | None = None
) -> tuple[Swing, Swing]:
    """Turn a crank whose tip is `aside` across it so that the tip meets a point, forward and backward.

    Solves `direction * (along + i*aside) = point`. Where the point lies on the axis of the crank, which then may
    stand anywhere, it stands at `start`.

    Args:
        steps: The tape.
        point: The point.
        aside: How far the tip is off the crank.
        near: The squared distance within which the point counts as on the axis.
        start: Direction of the crank for a point on the axis.
        rest: The square of `along`, where it is known better than from the point.

    Returns:
        With the tip forward (`along` is positive) and backward.
    """
    square = steps.square(point)
    if not (aside.is_number and aside != 0):
        # Only the direction is replaced: how far the point is, is known all the same.
        point = (steps.select(square, near, start[0], point[0]), steps.select(square, near, start[1], point[1]))
    if aside == 0:
        return _swing_in_line(steps, point, square, near)
    rest = steps.name(square - aside**2) if rest is None else rest
    # Beside the axis the square is off by twice `aside` times what the point is off by.
    reach = steps.near.reach
    beyond = 2 * reach * abs(aside) if aside.is_number else square + reach**2
    valid = steps.select(-TARGET * beyond, rest, ONE, ZERO)
    along = steps.root(steps.select(ZERO, rest, rest, ZERO))
    shown, length = along, square
    if not aside.is_number:
        shown, length = (steps.select(square, near, ONE, each) for each in (along, square))
    inverse = steps.name(1 / length)
    swings = []
    for sign in (1, -1):
        real, imaginary = steps.times(point, (sign * shown, -aside))
        direction = (steps.name(real * inverse), steps.name(imaginary * inverse))
        angle = steps.argument(point) - steps.argument((sign * shown, aside))
        swings.append(Swing(angle, direction, sign * along, valid))
    return swings[0], swings[1]


def _swing_in_line(steps: Steps, point: Planar, square: sp.Expr, near: sp.Expr) -> tuple[Swing, Swing]:
    """The same for a tip on the line of the crank, which every point has; `point` gives the direction."""
    along = steps.root(square)
    # A direction that was chosen is near to length 1, one that was given has the length of the point.
    inverse = steps.name(1 / steps.select(square, near, ONE, along))
    direction = (steps.name(point[0] * inverse), steps.name(point[1] * inverse))
    angle = steps.argument(point)
    back = (-direction[0], -direction[1])
    return Swing(angle, direction, along, ONE), Swing(angle + HALF_TURN, back, -along, ONE)


def bend_to(steps: Steps, point: Planar, upper: Planar, lower: Planar, start: sp.Expr) -> tuple[Bend, Bend]:
    """Bend two links so that the tip of the second meets a point: `turn * (upper + turn' * lower) = point`.

    The cosine rule, with 1 - cos and 1 + cos formed as products of lengths so that nothing cancels near the
    stretched and the folded arm. Where links of equal length are folded to the axis of the first joint, that stands
    at `start`.

    Args:
        steps: The tape.
        point: The point, as seen from the axis of the first joint.
        upper: The first link, where its joint stands at zero.
        lower: The second link, where both joints stand at zero.
        start: Angle of the first joint for a point on its axis.

    Returns:
        With the elbow to the left of the line to the point, and to the right of it.
    """
    (first, first_angle), (second, second_angle) = steps.polar(upper), steps.polar(lower)
    square = steps.square(point)
    scale = _inverse(steps, 2 * first * second)
    less = steps.name(((first + second) ** 2 - square) * scale)
    more = steps.name((square - (first - second) ** 2) * scale)
    sine_square = steps.name(less * more)
    weight = steps.name(square + _apart(first, second))
    valid = steps.select(-steps.near.beyond * weight, sine_square, ONE, ZERO)
    sine = steps.root(steps.select(steps.near.flat * weight, sine_square, sine_square, ZERO))
    elbow = steps.argument((steps.name(more - 1), sine))
    shoulder = steps.argument((steps.name(first - second + second * more), steps.name(second * sine)))
    lead, aside = steps.name(second - first + first * more), steps.name(first * sine)
    inverse = _of_length_one(steps, (lead, aside), square, (first, second))
    lead, aside = steps.name(lead * inverse), steps.name(aside * inverse)
    back = steps.unit(-second_angle)
    terms = [steps.name(a * b) for a in (lead, aside) for b in back]
    bends = []
    for sign in (-1, 1):
        turned = (steps.name(terms[0] - sign * terms[3]), steps.name(terms[1] + sign * terms[2]))
        sided = Angle(sign * shoulder.value, *sorted((sign * shoulder.low, sign * shoulder.high)))
        bent = Angle(sign * elbow.value, *sorted((sign * elbow.low, sign * elbow.high)))
        angle = steps.argument(point) - sided - fixed(first_angle)
        bends.append(Bend(angle, bent - fixed(second_angle) + fixed(first_angle), steps.times(point, turned), valid))
    if may_fold(first, second):
        lengths, angles = (first, second), (first_angle, second_angle)
        bends = [_folded(steps, each, square, lengths, angles, start) for each in bends]
    if not (first.is_number and second.is_number) and _is_negative(steps, first) != _is_negative(steps, second):
        bends.reverse()
    return bends[0], bends[1]


def _apart(first: sp.Expr, second: sp.Expr) -> sp.Expr:
    """The sum of two lengths times their difference, not negative."""
    product = tidy(first**2 - second**2)
    return abs(product) if product.is_number else sp.Abs(product)


def _of_length_one(steps: Steps, vector: Planar, square: sp.Expr, lengths: Planar) -> sp.Expr:
    """What makes a vector, which should have the square of its length, one over its length when multiplied by it.

    Where the arm is folded and its links are nearly equal, little is left of the length: a target that is off by its
    rounding changes it a lot, and so does a squared sine that is taken for zero. There the length itself is asked.
    """
    if all(length.is_number for length in lengths):
        total, apart = (abs(abs(lengths[0]) + sign * abs(lengths[1])) for sign in (1, -1))
        if apart == 0 or apart * _SLENDER > total:
            return steps.name(1 / square)
    return steps.name(1 / steps.root(square * steps.square(vector)))


def _is_negative(steps: Steps, length: sp.Expr) -> bool:
    """Whether a length has a minus sign in the file; a root never has."""
    return not any(isinstance(symbol, sp.Dummy) for symbol in length.free_symbols) and steps.value(length) < 0


def _inverse(steps: Steps, length: sp.Expr) -> sp.Expr:
    return tidy(1 / length) if length.is_number else steps.name(1 / length)


def _folded(steps: Steps, bend: Bend, square: sp.Expr, lengths: Planar, angles: Planar, start: sp.Expr) -> Bend:
    """The same, with the first joint at `start` where the point lies on its axis and the links on each other."""
    free = ALIGNED * (lengths[0] ** 2 + lengths[1] ** 2)
    first = Angle(
        steps.select(square, free, start, bend.first.value),
        min(bend.first.low, -math.pi),
        max(bend.first.high, math.pi),
    )
    folded = steps.name(-lengths[0] / lengths[1])
    real, imaginary = (folded * entry for entry in steps.unit(start + angles[0] - angles[1]))
    direction = (
        steps.select(square, free, real, bend.direction[0]),
        steps.select(square, free, imaginary, bend.direction[1]),
    )
    return Bend(first, bend.second, direction, bend.valid)


def may_fold(first: sp.Expr, second: sp.Expr) -> bool:
    """Whether two lengths may be equal."""
    if first.is_number and second.is_number:
        return bool(abs(abs(first) - abs(second)) < abs(first) / 10**6)
    return True
