"""Coordinates of a rotation: quaternions, three angles, the rotation vector; and how fast they change.

In: the entries of a rotation matrix R, and the angular velocity w in the axes of the base (dR/dt = [w]x R). Out:
coordinates and their rates, as expressions without a branch: every choice is a select between two values that both
exist, so nothing is ever divided by zero.

Beside a singularity two small entries decide one angle, and the other is found with the sine and cosine of that one,
never on its own; so the angles give the rotation back to rounding wherever they are. At the singularity itself, where
both entries are zero, the last angle is 0, the first takes the whole turn, and what three angles cannot show is left
out of the rates.

A joint may have a part in only one of these two entries. The length of both is NaN if the joint is, and stays NaN in
comparisons, so that every angle that depends on the joint is NaN too.

Constants become numbers of many digits at once. The rotation of an arm that only shifts has nothing else, and sympy
would analyse nested roots and arc tangents of these for minutes.
"""

from __future__ import annotations

from collections.abc import Callable

import sympy as sp

from kinegen.derive.expressions import LetBindings, decimal, exact_number
from kinegen.derive.folding import Vector, cross, dot
from kinegen.support.dataclass import dataclass

Rows = tuple[Vector, Vector, Vector]
"""The rows of a rotation matrix."""

Numbers = tuple[sp.Expr, ...]

HALF = sp.Rational(1, 2)

_NO_LENGTH = sp.Rational(1, 10**25)
"""A length below this is zero. In single precision there is none: squares of smaller numbers are zero."""


@dataclass(frozen=True, slots=True)
class Coordinates:
    """Coordinates of one rotation.

    `rates`: their derivatives by time, from the angular velocity in the axes of the base.
    """

    values: Numbers
    rates: Callable[[Vector], Numbers]


def named(bindings: LetBindings, value: sp.Expr) -> sp.Expr:
    """Return a name for a value; a constant becomes a number of many digits."""
    return decimal(value) if value.is_number else bindings.name(value)


def less(bindings: LetBindings, left: sp.Expr, right: sp.Expr, yes: sp.Expr, no: sp.Expr) -> sp.Expr:
    """`yes` where `left` is smaller than `right`, else `no`."""
    if yes == no:
        return yes
    if (left - right).is_number:
        return named(bindings, yes if exact_number(left - right) < 0 else no)
    condition = sp.StrictLessThan(named(bindings, left), named(bindings, right))
    return bindings.name(sp.Piecewise((named(bindings, yes), condition), (named(bindings, no), True)))


def unless_zero(bindings: LetBindings, length: sp.Expr, value: sp.Expr, zero: sp.Expr) -> sp.Expr:
    """`value`, also where a length is NaN; `zero` where it is 0."""
    if length.is_number:
        return named(bindings, value if length else zero)
    return less(bindings, length, _NO_LENGTH, zero, value)


def root(bindings: LetBindings, *squared: sp.Expr) -> sp.Expr:
    """Return the square root of a sum of squares."""
    # The sum gets a name first, or sympy would see through the root of a single square.
    total = named(bindings, sum((value**2 for value in squared), sp.S.Zero))
    return named(bindings, sp.sqrt(total))


def arc_tangent(bindings: LetBindings, y: sp.Expr, x: sp.Expr) -> sp.Expr:
    """Return the angle of the point (x, y)."""
    return sp.atan2(named(bindings, y), named(bindings, x))


# Quaternions ----------------------------------------------------------------------------------------------------------


def quaternion_wxyz(R: Rows, bindings: LetBindings) -> Coordinates:
    """Return the unit quaternion, scalar first, w >= 0; where w is 0, the first other that is not is > 0.

    A component that is at least a half is taken from the diagonal by a root, and the others are quotients by it
    (Shepperd, Quaternion from rotation matrix, Journal of Guidance and Control 1, 1978): of the pairs (w, z) and (x, y)
    the one with the larger sum of squares, which the sign of r22 tells, and of that pair the larger.
    """
    x_pair = named(bindings, less(bindings, R[2][2], sp.S.Zero, R[0][0] - R[1][1], R[0][0] + R[1][1]))
    # Four times the square of the chosen component: 1 + |r22| + |r00 -+ r11|, which is at least 1.
    square = named(bindings, 1 + _absolute(bindings, R[2][2]) + _absolute(bindings, x_pair))

    def pick(x: sp.Expr, y: sp.Expr, z: sp.Expr, w: sp.Expr) -> sp.Expr:
        first, second = (less(bindings, x_pair, sp.S.Zero, a, b) for a, b in ((y, x), (z, w)))
        return less(bindings, R[2][2], sp.S.Zero, first, second)

    # All four candidates exist, and two selections pick one: nothing is divided by a small number.
    minus = [named(bindings, R[i][j] - R[j][i]) for i, j in ((2, 1), (0, 2), (1, 0))]
    plus = [named(bindings, R[i][j] + R[j][i]) for i, j in ((2, 1), (0, 2), (1, 0))]
    w = pick(minus[0], minus[1], minus[2], square)
    x = pick(square, plus[2], plus[1], minus[0])
    y = pick(plus[2], square, plus[0], minus[1])
    z = pick(plus[1], plus[0], square, minus[2])
    # The sign makes w positive; at w = 0 the next component decides.
    scale = named(bindings, HALF / named(bindings, sp.sqrt(square)))
    scale = _signed(bindings, (w, x, y), scale)
    q = tuple(named(bindings, scale * value) for value in (w, x, y, z))

    def rates(omega: Vector) -> Numbers:
        w, x, y, z = (named(bindings, HALF * value) for value in q)
        turned = cross(omega, (x, y, z))
        return -dot(omega, (x, y, z)), *(w * omega[axis] + turned[axis] for axis in range(3))

    return Coordinates(q, rates)


def quaternion_xyzw(R: Rows, bindings: LetBindings) -> Coordinates:
    """Return the same quaternion with the scalar last."""
    found = quaternion_wxyz(R, bindings)
    return Coordinates(_scalar_last(found.values), lambda omega: _scalar_last(found.rates(omega)))


def _scalar_last(numbers: Numbers) -> Numbers:
    return (*numbers[1:], numbers[0])


def _absolute(bindings: LetBindings, value: sp.Expr) -> sp.Expr:
    return less(bindings, value, sp.S.Zero, -value, value)


def _signed(bindings: LetBindings, deciding: Numbers, scale: sp.Expr) -> sp.Expr:
    """Return the scale with the sign of the first deciding number that is not zero; plus, if all are."""
    signed = scale
    for value in reversed(deciding):
        signed = less(bindings, sp.S.Zero, value, scale, signed)
        signed = less(bindings, value, sp.S.Zero, -scale, signed)
    return signed


# Rotation vector ------------------------------------------------------------------------------------------------------


def axis_angle(R: Rows, bindings: LetBindings) -> Coordinates:
    """Return the rotation vector: the angle in [0, pi] times the unit axis; at pi the axis of the quaternion."""
    w, x, y, z = quaternion_wxyz(R, bindings).values
    length = root(bindings, x, y, z)
    safe = unless_zero(bindings, length, length, sp.S.One)
    half_angle = named(bindings, arc_tangent(bindings, length, w))
    stretch = unless_zero(bindings, length, 2 * half_angle / safe, sp.Integer(2))
    v = bindings.vector((stretch * x, stretch * y, stretch * z))

    def rates(omega: Vector) -> Numbers:
        unit = (x / safe, y / safe, z / safe)
        # Half the angle times the cotangent of half the angle: from 1 at angle 0 to 0 at angle pi.
        straight = unless_zero(bindings, length, half_angle * w / safe, sp.S.One)
        matrix = _left_inverse(
            bindings, bindings.vector(unit), bindings.vector((HALF * v[0], HALF * v[1], HALF * v[2])), straight
        )
        return tuple(dot(row, omega) for row in matrix)

    return Coordinates(v, rates)


def _left_inverse(bindings: LetBindings, unit: Vector, half: Vector, straight: sp.Expr) -> Rows:
    """Return the matrix from angular velocities to rates: `k I - [v/2]x + (1 - k) u u^T`, `k` being `straight`."""
    x, y, z = half
    bent = named(bindings, 1 - straight)
    ux, uy, uz = bindings.vector((bent * unit[0], bent * unit[1], bent * unit[2]))
    xy, yz, zx = bindings.vector((ux * unit[1], uy * unit[2], uz * unit[0]))
    return (
        bindings.vector((straight + ux * unit[0], z + xy, zx - y)),
        bindings.vector((xy - z, straight + uy * unit[1], x + yz)),
        bindings.vector((y + zx, yz - x, straight + uz * unit[2])),
    )


# Three angles ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Last:
    """The last of three angles, its sine and cosine, the length they were divided by, and one over that (or 0)."""

    angle: sp.Expr
    sine: sp.Expr
    cosine: sp.Expr
    length: sp.Expr
    over: sp.Expr


def _last(bindings: LetBindings, sine: sp.Expr, cosine: sp.Expr) -> _Last:
    """Return the angle whose sine and cosine have this ratio; 0 where both are zero."""
    length = root(bindings, sine, cosine)
    over = named(bindings, 1 / unless_zero(bindings, length, length, sp.S.One))
    sine = named(bindings, sine * over)
    cosine = unless_zero(bindings, length, cosine * over, sp.S.One)
    return _Last(
        angle=arc_tangent(bindings, sine, cosine),
        sine=sine,
        cosine=cosine,
        length=length,
        over=unless_zero(bindings, length, over, sp.S.Zero),
    )


def _rates(omega: Vector, first: int, across: Vector, middle: Vector, *, lean: sp.Expr, over: sp.Expr) -> Numbers:
    """Return the rates of the first, middle and last angle.

    `across`: unit vector square to the axes of the first and the middle turn. `lean`: component of the axis of the last
    turn along that of the first. `over`: one over its component along `across`.
    """
    last = over * dot(across, omega)
    return omega[first] - lean * last, dot(middle, omega), last


def rpy_zyx(R: Rows, bindings: LetBindings) -> Coordinates:
    """Roll, pitch and yaw of `R = Rz(yaw) Ry(pitch) Rx(roll)`; pitch in [-pi/2, pi/2]; roll 0 where it is singular."""
    roll = _last(bindings, R[2][1], R[2][2])
    sine = named(bindings, roll.sine * R[0][2] - roll.cosine * R[0][1])
    cosine = named(bindings, roll.cosine * R[1][1] - roll.sine * R[1][2])

    def rates(omega: Vector) -> Numbers:
        across, middle = (cosine, sine, sp.S.Zero), (-sine, cosine, sp.S.Zero)
        return _rates(omega, 2, across, middle, lean=R[2][0], over=roll.over)[::-1]

    return Coordinates(
        (roll.angle, arc_tangent(bindings, -R[2][0], roll.length), arc_tangent(bindings, sine, cosine)), rates
    )


def rpy_xyz(R: Rows, bindings: LetBindings) -> Coordinates:
    """Roll, pitch and yaw of `R = Rx(roll) Ry(pitch) Rz(yaw)`; pitch in [-pi/2, pi/2]; yaw 0 where it is singular."""
    yaw = _last(bindings, -R[0][1], R[0][0])
    sine = named(bindings, yaw.sine * R[2][0] + yaw.cosine * R[2][1])
    cosine = named(bindings, yaw.sine * R[1][0] + yaw.cosine * R[1][1])

    def rates(omega: Vector) -> Numbers:
        across, middle = (sp.S.Zero, -sine, cosine), (sp.S.Zero, cosine, sine)
        return _rates(omega, 0, across, middle, lean=R[0][2], over=yaw.over)

    return Coordinates(
        (arc_tangent(bindings, sine, cosine), arc_tangent(bindings, R[0][2], yaw.length), yaw.angle), rates
    )


def euler_zyz(R: Rows, bindings: LetBindings) -> Coordinates:
    """Return the angles of `R = Rz(phi) Ry(theta) Rz(psi)`, theta in [0, pi]; psi 0 where sin(theta) is 0."""
    psi = _last(bindings, R[2][1], -R[2][0])
    sine = named(bindings, -psi.sine * R[0][0] - psi.cosine * R[0][1])
    cosine = named(bindings, psi.sine * R[1][0] + psi.cosine * R[1][1])

    def rates(omega: Vector) -> Numbers:
        across, middle = (cosine, sine, sp.S.Zero), (-sine, cosine, sp.S.Zero)
        return _rates(omega, 2, across, middle, lean=R[2][2], over=psi.over)

    return Coordinates(
        (arc_tangent(bindings, sine, cosine), arc_tangent(bindings, psi.length, R[2][2]), psi.angle), rates
    )
