"""The geometry of the named forms: triangles and four-bar linkages, both ways, with sine, cosine and rate of the angle.

Angles come out of `atan2` of two sides of a right triangle, never of an arc cosine, so they keep their accuracy where
a linkage is stretched or folded. Where the bars do not close, a root of a negative number makes the result NaN.
"""

from __future__ import annotations

from dataclasses import dataclass

import sympy as sp

from kinegen.symbolic.coordinates import less
from kinegen.symbolic.expressions import Tape

_STRETCHED = sp.Rational(1, 10**9)
"""How far past a stretched or folded triangle, as a sine, rounding may lead."""


@dataclass(frozen=True, slots=True)
class Turned:
    """An angle that a linkage makes.

    Attributes:
        angle: The angle, in radians.
        cosine: Its cosine, without a trigonometric function of the angle.
        sine: Its sine.
        rate: Its derivative by the length or angle that drives it.
    """

    angle: sp.Expr
    cosine: sp.Expr
    sine: sp.Expr
    rate: sp.Expr


def triangle(tape: Tape, sides: tuple[sp.Expr, sp.Expr], length: sp.Expr) -> Turned:
    """The angle between two sides of a triangle whose third side is given.

    Law of cosines; four times the area is Heron's product, in the order of Kahan (Miscalculating area and angles of a
    needle-like triangle, 2014), so that it is NaN exactly where the three do not close or the length is negative.

    Args:
        tape: Receives the intermediate values.
        sides: Two positive lengths.
        length: The third side, which grows at unit rate.
    """
    a, b = sides
    l = tape.name(length)
    inner = tape.name(tape.name(sp.sqrt(tape.name(l - (a - b)))) * tape.name(sp.sqrt(tape.name(l + (a - b)))))
    outer = tape.name(sp.sqrt(tape.name((a + b - l) * (a + b + l))))
    area = tape.name(inner * outer)
    # The difference of these squares, unlike that of the sides, is NaN where the three do not close.
    along = tape.name((outer**2 - inner**2) / 2)
    angle = tape.name(sp.atan2(area, along, evaluate=False))
    return Turned(angle, tape.name(along / (2 * a * b)), tape.name(area / (2 * a * b)), tape.name(2 * l / area))


def triangle_length(tape: Tape, sides: tuple[sp.Expr, sp.Expr], angle: sp.Expr) -> sp.Expr:
    """The third side of a triangle, from the angle between the two others.

    Args:
        tape: Receives the intermediate values.
        sides: Two positive lengths.
        angle: In [0, pi] or whole turns from it; NaN comes out where it is not, as the actuator cannot get there.
    """
    a, b = sides
    square = tape.name(a**2 + b**2 - 2 * a * b * sp.cos(angle))
    return tape.name(sp.sqrt(less(tape, sp.sin(angle), -_STRETCHED, sp.S.NegativeOne, square)))


@dataclass(frozen=True, slots=True)
class Bars:
    """The lengths of a four-bar linkage, and how it is put together; see `robot.actuators.FourBar`."""

    ground: sp.Expr
    crank: sp.Expr
    coupler: sp.Expr
    rocker: sp.Expr
    crossed: bool
    ahead: int
    turns: tuple[int, int]


def rocker(tape: Tape, bars: Bars, angle: sp.Expr) -> Turned:
    """The rocker of a four-bar linkage whose crank stands at an angle.

    The diagonal from the rocker's pivot to the tip of the crank cuts the linkage into two triangles (Norton, Design of
    Machinery, section 4.5); the rate follows from the coupler's constant length.

    Args:
        tape: Receives the intermediate values.
        bars: The linkage.
        angle: Of the crank, from the ground line.
    """
    a, c, side = bars.crank, bars.rocker, 1 if bars.crossed else -1
    x = tape.name(a * sp.cos(angle) - bars.ground)
    y = tape.name(a * sp.sin(angle))
    square = tape.name(x**2 + y**2)
    along, area = _corner(tape, square, c, bars.coupler)
    corner = tape.name(sp.atan2(area, along, evaluate=False))
    found = tape.name(_towards_crank(tape, bars, angle) + side * corner + 2 * sp.pi * bars.turns[0])
    scale = tape.name(1 / tape.name(2 * c * square))
    cosine = tape.name(scale * tape.name(x * along - side * y * area))
    sine = tape.name(scale * tape.name(y * along + side * x * area))
    tip = tape.name(bars.ground + c * cosine), tape.name(c * sine)
    lever = tape.name(tip[0] * sp.sin(angle) - tip[1] * sp.cos(angle))
    return Turned(found, cosine, sine, tape.name(-2 * side * a * lever / area))


def crank(tape: Tape, bars: Bars, angle: sp.Expr) -> sp.Expr:
    """The angle of the crank of a four-bar linkage whose rocker stands at an angle.

    Args:
        tape: Receives the intermediate values.
        bars: The linkage.
        angle: Of the rocker, from the ground line.
    """
    x = tape.name(bars.ground + bars.rocker * sp.cos(angle))
    y = tape.name(bars.rocker * sp.sin(angle))
    along, area = _corner(tape, tape.name(x**2 + y**2), bars.crank, bars.coupler)
    corner = tape.name(sp.atan2(area, along, evaluate=False))
    return tape.name(_towards_rocker(tape, bars, angle) + bars.ahead * corner + 2 * sp.pi * bars.turns[1])


def _corner(tape: Tape, square: sp.Expr, side: sp.Expr, opposite: sp.Expr) -> tuple[sp.Expr, sp.Expr]:
    """The corner between a diagonal, given by its square, and a bar: cosine and sine, times twice both lengths."""
    along = tape.name(square + (side**2 - opposite**2))
    whole = tape.name(2 * side * tape.name(sp.sqrt(square)))
    return along, tape.name(sp.sqrt(tape.name(tape.name(whole - along) * tape.name(whole + along))))


def _towards_crank(tape: Tape, bars: Bars, angle: sp.Expr) -> sp.Expr:
    """The direction from the rocker's pivot to the tip of the crank, which does not jump where the crank moves on.

    The tip of a crank shorter than the ground never leaves the far side of the rocker's pivot; a longer one goes
    around that pivot, and the direction is never far from the crank's own.
    """
    a, ground = bars.crank, bars.ground
    if a > ground:
        y, x = tape.name(ground * sp.sin(angle)), tape.name(a - ground * sp.cos(angle))
        return angle + tape.name(sp.atan2(y, x, evaluate=False))
    y, x = tape.name(-a * sp.sin(angle)), tape.name(ground - a * sp.cos(angle))
    return sp.pi + tape.name(sp.atan2(y, x, evaluate=False))


def _towards_rocker(tape: Tape, bars: Bars, angle: sp.Expr) -> sp.Expr:
    """The direction from the crank's pivot to the tip of the rocker, in the same way."""
    c, ground = bars.rocker, bars.ground
    if c > ground:
        y, x = tape.name(-ground * sp.sin(angle)), tape.name(c + ground * sp.cos(angle))
        return angle + tape.name(sp.atan2(y, x, evaluate=False))
    y, x = tape.name(c * sp.sin(angle)), tape.name(ground + c * sp.cos(angle))
    return tape.name(sp.atan2(y, x, evaluate=False))
