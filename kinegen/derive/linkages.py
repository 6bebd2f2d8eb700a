"""The geometry of triangles and four-bar linkages, both ways, with sine, cosine and rate of the angle.

Angles come out of `atan2` of two sides of a right triangle, never of an arc cosine, so they keep their accuracy where
a linkage is stretched or folded. Where the bars do not close, a root of a negative number makes the result NaN.
"""

from __future__ import annotations

import sympy as sp

from kinegen.derive.coordinates import less
from kinegen.derive.expressions import LetBindings
from kinegen.support.dataclass import dataclass


def write(expression: sp.Expr, bindings: LetBindings) -> sp.Expr:
    """Write arc functions as `atan2`, powers of roots as roots, and signs as selects."""
    if not expression.free_symbols or expression.is_Symbol:
        return expression
    parts = [write(argument, bindings) for argument in expression.args]
    if isinstance(expression, (sp.acos, sp.asin)):
        value = bindings.name(parts[0])
        other = _root(bindings, (1 - value) * (1 + value))
        pair = (other, value) if isinstance(expression, sp.acos) else (value, other)
        return sp.atan2(*pair, evaluate=False)
    if isinstance(expression, sp.atan2):
        return sp.atan2(bindings.name(parts[0]), bindings.name(parts[1]), evaluate=False)
    if isinstance(expression, (sp.Abs, sp.sign)):
        value = bindings.name(parts[0])
        negative, positive = (-value, value) if isinstance(expression, sp.Abs) else (sp.S.NegativeOne, sp.S.One)
        return less(bindings, value, sp.S.Zero, negative, positive)
    if isinstance(expression, sp.Pow) and (2 * expression.exp).is_Integer and not expression.exp.is_Integer:
        return _root(bindings, parts[0]) ** (2 * expression.exp)
    return expression.func(*parts)


def _root(bindings: LetBindings, square: sp.Expr) -> sp.Expr:
    # The square gets a name first, or sympy would see through the root.
    return bindings.name(sp.sqrt(bindings.name(square)))


_STRETCHED = sp.Rational(1, 10**9)
"""How far past a stretched or folded triangle, as a sine, rounding may lead."""


@dataclass(frozen=True, slots=True)
class Turned:
    """An angle that a linkage makes.

    `cosine`: its cosine, without a trigonometric function of the angle. `rate`: its derivative by the length or angle
    that drives it.
    """

    angle: sp.Expr
    cosine: sp.Expr
    sine: sp.Expr
    rate: sp.Expr


def triangle(bindings: LetBindings, sides: tuple[sp.Expr, sp.Expr], length: sp.Expr) -> Turned:
    """Return the angle between two sides of a triangle whose third side is given.

    Law of cosines; four times the area is Heron's product, in the order of Kahan (Miscalculating area and angles of a
    needle-like triangle, 2014), so that it is NaN exactly where the three do not close or the length is negative.

    `length`: the third side, which grows at unit rate.
    """
    a, b = sides
    l = bindings.name(length)
    inner = bindings.name(
        bindings.name(sp.sqrt(bindings.name(l - (a - b)))) * bindings.name(sp.sqrt(bindings.name(l + (a - b))))
    )
    outer = bindings.name(sp.sqrt(bindings.name((a + b - l) * (a + b + l))))
    area = bindings.name(inner * outer)
    # The difference of these squares, unlike that of the sides, is NaN where the three do not close.
    along = bindings.name((outer**2 - inner**2) / 2)
    angle = bindings.name(sp.atan2(area, along, evaluate=False))
    return Turned(
        angle, bindings.name(along / (2 * a * b)), bindings.name(area / (2 * a * b)), bindings.name(2 * l / area)
    )


def triangle_length(bindings: LetBindings, sides: tuple[sp.Expr, sp.Expr], angle: sp.Expr) -> sp.Expr:
    """Return the third side of a triangle, from the angle between the two others.

    `angle`: in [0, pi] or whole turns from it; NaN comes out where it is not, as the actuator cannot get there.
    """
    a, b = sides
    square = bindings.name(a**2 + b**2 - 2 * a * b * sp.cos(angle))
    return bindings.name(sp.sqrt(less(bindings, sp.sin(angle), -_STRETCHED, sp.S.NegativeOne, square)))


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


def rocker(bindings: LetBindings, bars: Bars, angle: sp.Expr) -> Turned:
    """Return the rocker of a four-bar linkage, given the angle of the crank from the ground line.

    The diagonal from the rocker's pivot to the tip of the crank cuts the linkage into two triangles (Norton, Design of
    Machinery, section 4.5); the rate follows from the coupler's constant length.
    """
    a, c, side = bars.crank, bars.rocker, 1 if bars.crossed else -1
    x = bindings.name(a * sp.cos(angle) - bars.ground)
    y = bindings.name(a * sp.sin(angle))
    square = bindings.name(x**2 + y**2)
    along, area = _corner(bindings, square, c, bars.coupler)
    corner = bindings.name(sp.atan2(area, along, evaluate=False))
    found = bindings.name(
        _towards(bindings, bars.ground, bars.crank, angle, -1) + side * corner + 2 * sp.pi * bars.turns[0]
    )
    scale = bindings.name(1 / bindings.name(2 * c * square))
    cosine = bindings.name(scale * bindings.name(x * along - side * y * area))
    sine = bindings.name(scale * bindings.name(y * along + side * x * area))
    tip = bindings.name(bars.ground + c * cosine), bindings.name(c * sine)
    lever = bindings.name(tip[0] * sp.sin(angle) - tip[1] * sp.cos(angle))
    return Turned(found, cosine, sine, bindings.name(-2 * side * a * lever / area))


def crank(bindings: LetBindings, bars: Bars, angle: sp.Expr) -> sp.Expr:
    """Return the angle of the crank of a four-bar linkage, given that of the rocker from the ground line."""
    x = bindings.name(bars.ground + bars.rocker * sp.cos(angle))
    y = bindings.name(bars.rocker * sp.sin(angle))
    along, area = _corner(bindings, bindings.name(x**2 + y**2), bars.crank, bars.coupler)
    corner = bindings.name(sp.atan2(area, along, evaluate=False))
    return bindings.name(
        _towards(bindings, bars.ground, bars.rocker, angle, 1) + bars.ahead * corner + 2 * sp.pi * bars.turns[1]
    )


def _corner(bindings: LetBindings, square: sp.Expr, side: sp.Expr, opposite: sp.Expr) -> tuple[sp.Expr, sp.Expr]:
    """Return the cosine and sine, times twice both lengths, of the corner between a diagonal and a bar."""
    along = bindings.name(square + (side**2 - opposite**2))
    whole = bindings.name(2 * side * bindings.name(sp.sqrt(square)))
    return along, bindings.name(sp.sqrt(bindings.name(bindings.name(whole - along) * bindings.name(whole + along))))


def _towards(bindings: LetBindings, ground: sp.Expr, bar: sp.Expr, angle: sp.Expr, side: int) -> sp.Expr:
    """Return the direction to the tip of a bar from the pivot of the other one, without jumps as the bar moves.

    The tip of a bar shorter than the ground never leaves the near side of its own pivot; a longer one goes around the
    other pivot, and the direction is never far from the bar's own. The crank is at side -1, the rocker at side 1.
    """
    if bar > ground:
        y, x = bindings.name(-side * ground * sp.sin(angle)), bindings.name(bar + side * ground * sp.cos(angle))
        return angle + bindings.name(sp.atan2(y, x, evaluate=False))
    y, x = bindings.name(side * bar * sp.sin(angle)), bindings.name(ground + side * bar * sp.cos(angle))
    return (sp.pi if side < 0 else sp.S.Zero) + bindings.name(sp.atan2(y, x, evaluate=False))
