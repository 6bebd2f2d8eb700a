"""A crank and a triangle, of which all arms are made: how they are turned so that their tips meet a point.

The crank is a waist, or a stroke that turns; the triangle is an elbow, with the cosine rule.
"""

from __future__ import annotations

import math

import sympy as sp

from kinegen.derive.inverse.exact_geometry import tidy
from kinegen.derive.inverse.geometry import Planar
from kinegen.derive.inverse.straight_line_operations import HALF_TURN, ONE, ZERO, Angle, OperationBuilder, fixed
from kinegen.derive.inverse.tolerances import ALIGNED, TARGET
from kinegen.support.dataclass import dataclass

_SLENDER = 32
"""Links are nearly equal where their sum is more than so many times their difference."""


@dataclass(frozen=True, slots=True)
class CircleLineSolution:
    """One way to turn a crank so that its tip meets a point.

    Attributes:
        direction: The angle as a complex number of length 1.
        along: How far the tip is out along the crank; it is `aside` across.
        valid: 1 where the point is within reach, else 0.
    """

    angle: Angle
    direction: Planar
    along: sp.Expr
    valid: sp.Expr


@dataclass(frozen=True, slots=True)
class TwoLinkSolution:
    """One way to bend two links so that the tip of the second meets a point.

    `direction` is the sum of both angles as a complex number of length 1; `valid` is 1 where the point is within reach.
    """

    first: Angle
    second: Angle
    direction: Planar
    valid: sp.Expr


def swing_to(
    steps: OperationBuilder,
    point: Planar,
    aside: sp.Expr,
    near: sp.Expr,
    start: Planar,
    other: Planar | None = None,
    flat: sp.Expr = ZERO,
    hollow: sp.Expr | None = None,
) -> tuple[CircleLineSolution, CircleLineSolution]:
    """Turn a crank whose tip is `aside` across it so that the tip meets a point, forward and backward.

    Solves `direction * (along + i*aside) = point`, with `along` positive for the tip forward. Where the point lies on
    the axis of the crank, which then may stand anywhere, it stands at `start`.

    Args:
        steps: The let bindings.
        aside: How far the tip is off the crank.
        near: The squared distance within which the point counts as on the axis.
        start: Direction of the crank for a point on the axis.
        other: The hypotenuse and a leg of another right triangle with the leg `along`, the hypotenuse squared. Where
            its hypotenuse is the shorter one, it tells that leg better.
        flat: A tip whose squared distance along the crank is below this times the reach and `aside` is not out at all.
        hollow: What the squared distance along the crank is at least, as far as the target may be off; None if nothing
            is known of it.
    """
    square = steps.square(point)
    if aside == 0:
        chosen = steps.choose(square, near, start, point)
        return _swing_in_line(steps, chosen, square, near)
    # The leg along the crank follows from Pythagoras, from whichever triangle tells it better.
    least, rest = square, steps.name(square - aside**2)
    if other is not None:
        rest = steps.select(square, other[0], rest, steps.name(other[0] - other[1] ** 2))
        least = steps.select(square, other[0], square, other[0])
    # A point that is nearer to the axis than the tip by what a target may be off by.
    off = TARGET * steps.near.reach
    beyond = 2 * abs(aside) if aside.is_number else steps.name(2 * steps.root(least) + off)
    valid = steps.select(-off * beyond, rest, ONE, ZERO)
    # A distance that is off by e puts the tip out along the crank by the root of 2 |aside| e.
    flat = steps.name(flat * steps.near.reach * abs(aside)) if flat != 0 else ZERO
    shown = steps.select(flat, rest, rest, ZERO)
    if hollow is not None:
        filled = steps.select(steps.name(hollow - off * beyond), rest, hollow, shown)
        shown = steps.select(shown, hollow, filled, shown)
    return _swings(steps, (point, square), (shown, aside), (near, start), valid)


def _swings(
    steps: OperationBuilder, whole: tuple[Planar, sp.Expr], tip: Planar, free: tuple[sp.Expr, Planar], valid: sp.Expr
) -> tuple[CircleLineSolution, CircleLineSolution]:
    """Return both ways, for the point with its square, the tip with the square of what is along, and the free turn."""
    (point, square), (shown, aside), (near, start) = whole, tip, free
    along = ahead = steps.root(shown)
    if not aside.is_number:
        # Only the direction is replaced: how far the point is, is known all the same.
        point = steps.choose(square, near, start, point)
        # At the start and no length beside it, which would be an angle there, and another one in another unit.
        aside = steps.select(square, near, ZERO, aside)
        square, shown, ahead = (steps.select(square, near, ONE, each) for each in (square, shown, along))
    # Of length 1 also where the tip does not quite meet the point: what is turned by it must stay a rotation.
    inverse = steps.name(1 / steps.root(square * steps.name(shown + aside**2)))
    swings = []
    for sign in (1, -1):
        direction = steps.scaled(steps.times(point, (sign * ahead, -aside)), inverse)
        angle = steps.argument(point) - steps.argument((sign * ahead, aside))
        swings.append(CircleLineSolution(angle, direction, sign * along, valid))
    return swings[0], swings[1]


def _swing_in_line(
    steps: OperationBuilder, point: Planar, square: sp.Expr, near: sp.Expr
) -> tuple[CircleLineSolution, CircleLineSolution]:
    """Do the same for a tip on the line of the crank, which every point has; `point` gives the direction."""
    along = steps.root(square)
    # A direction that was chosen is near to length 1, one that was given has the length of the point.
    inverse = steps.name(1 / steps.select(square, near, ONE, along))
    direction, angle = steps.scaled(point, inverse), steps.argument(point)
    back = (-direction[0], -direction[1])
    return CircleLineSolution(angle, direction, along, ONE), CircleLineSolution(angle + HALF_TURN, back, -along, ONE)


def bend_to(
    steps: OperationBuilder, point: Planar, upper: Planar, lower: Planar, start: sp.Expr
) -> tuple[TwoLinkSolution, TwoLinkSolution]:
    """Bend two links so that the tip of the second meets a point: `turn * (upper + turn' * lower) = point`.

    The cosine rule, with 1 - cos and 1 + cos formed as products of lengths so that nothing cancels near the stretched
    and the folded arm. Where links of equal length are folded to the axis of the first joint, that stands at the angle
    `start`. The point is as seen from the axis of the first joint, the links as where all joints are at zero. The elbow
    is first to the left of the line to the point, then to the right of it.
    """
    (first, first_angle), (second, second_angle) = steps.polar(upper), steps.polar(lower)
    lengths, angles = (first, second), (first_angle, second_angle)
    square = steps.square(point)
    both = 2 * first * second
    scale = tidy(1 / both) if both.is_number else steps.name(1 / both)
    # Both factors of the squared sine vanish without a difference of large numbers.
    less = steps.name(((first + second) ** 2 - square) * scale)
    more = steps.name((square - (first - second) ** 2) * scale)
    sine_square = steps.name(less * more)
    # Links that may be equal meet the axis of the first joint, and there would be nothing to weigh with.
    least = (TARGET * steps.near.reach) ** 2 if steps.near.may_fold(first, second) else ZERO
    weight = steps.name(square + _apart(first, second) + least)
    valid = steps.select(-steps.near.beyond * weight, sine_square, ONE, ZERO)
    sine = steps.root(steps.select(steps.near.flat * weight, sine_square, sine_square, ZERO))
    is_turned = not (first.is_number and second.is_number) and _is_negative(steps, first) != _is_negative(steps, second)
    # Lengths of opposite signs are folded where less vanishes, and have to be told from that there.
    part = (1 - less, -less) if is_turned else (more - 1, more)
    ahead = (first + second, first + second) if is_turned else (first - second, second - first)
    # Angles of the triangle, for the elbow on one side; the other side is its mirror image.
    elbow = steps.argument((steps.name(part[0]), sine))
    shoulder = steps.argument((steps.name(ahead[0] + second * part[1]), steps.name(second * sine)))
    # The direction of the second link is known without the angles, for what is turned by it.
    lead = _over_length(steps, (steps.name(ahead[1] + first * part[1]), steps.name(first * sine)), square, lengths)
    back = steps.unit(-second_angle)
    terms = [steps.name(a * b) for a in lead for b in back]
    bends = []
    # Mirrored elbows share all but signs.
    for sign in (-1, 1):
        turned = (steps.name(terms[0] - sign * terms[3]), steps.name(terms[1] + sign * terms[2]))
        sided = Angle(sign * shoulder.value, *sorted((sign * shoulder.low, sign * shoulder.high)))
        bent = Angle(sign * elbow.value, *sorted((sign * elbow.low, sign * elbow.high)))
        angle = steps.argument(point) - sided - fixed(first_angle)
        bends.append(
            TwoLinkSolution(angle, bent - fixed(second_angle) + fixed(first_angle), steps.times(point, turned), valid)
        )
    if steps.near.may_fold(first, second):
        bends = [_folded(steps, each, square, lengths, angles, start) for each in bends]
    if is_turned:
        bends.reverse()
    return bends[0], bends[1]


def _apart(first: sp.Expr, second: sp.Expr) -> sp.Expr:
    """Return the sum of two lengths times their difference, not negative."""
    product = tidy(first**2 - second**2)
    return abs(product) if product.is_number else sp.Abs(product)


def _over_length(steps: OperationBuilder, vector: Planar, square: sp.Expr, lengths: Planar) -> Planar:
    """Divide a vector, which should have the square of its length, by that; times the point it is of length 1.

    A squared sine that is taken for zero changes the length a little. Where the arm is folded and its links are nearly
    equal, little is left of the length: a target that is off by its rounding changes it a lot.
    """
    numbers = [abs(length) for length in lengths if length.is_number]
    if len(numbers) < 2 or 0 < abs(numbers[0] - numbers[1]) * _SLENDER <= sum(numbers):
        inverse = steps.name(1 / steps.root(square * steps.square(vector)))
    else:
        inverse = steps.name(1 / square)
        inverse = steps.name(inverse * steps.name((3 - steps.square(vector) * inverse) / 2))
    return steps.scaled(vector, inverse)


def _is_negative(steps: OperationBuilder, length: sp.Expr) -> bool:
    """Tell whether a length has a minus sign in the file; a root never has."""
    return not any(isinstance(symbol, sp.Dummy) for symbol in length.free_symbols) and steps.value(length) < 0


def _folded(
    steps: OperationBuilder, bend: TwoLinkSolution, square: sp.Expr, lengths: Planar, angles: Planar, start: sp.Expr
) -> TwoLinkSolution:
    """Put the first joint at `start` where the point lies on its axis and the links on each other."""
    free = ALIGNED * (lengths[0] ** 2 + lengths[1] ** 2)
    first = Angle(
        steps.select(square, free, start, bend.first.value),
        min(bend.first.low, -math.pi),
        max(bend.first.high, math.pi),
    )
    # Of length 1 also where the links are only nearly equal: what is turned by it must stay a rotation.
    folded = -ONE if all(length.is_number for length in lengths) else steps.name(-lengths[0] / lengths[1])
    real, imaginary = (folded * entry for entry in steps.unit(start + angles[0] - angles[1]))
    direction = steps.choose(square, free, (real, imaginary), bend.direction)
    return TwoLinkSolution(first, bend.second, direction, bend.valid)
