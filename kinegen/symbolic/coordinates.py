"""Coordinates of a rotation: quaternions, three angles, the rotation vector; and how fast they change.

In: the entries of a rotation matrix R, and the angular velocity w in the axes of the base (dR/dt = [w]x R). Out:
coordinates and their rates, as expressions without a branch: every choice is a select between two values that both
exist, so nothing is ever divided by zero.

Beside a singularity two small entries decide one angle, and the other is found with the sine and cosine of that one,
never on its own; so the angles give the rotation back to rounding wherever they are. At the singularity itself, where
both entries are zero, the last angle is 0, the first takes the whole turn, and what three angles cannot show is left
out of the rates.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import sympy as sp

from kinegen.symbolic.expressions import Tape
from kinegen.symbolic.fold import Vector
from kinegen.symbolic.route import cross

Rows = tuple[Vector, Vector, Vector]
"""The rows of a rotation matrix."""

Numbers = tuple[sp.Expr, ...]

HALF = sp.Rational(1, 2)


@dataclass(frozen=True, slots=True)
class Coordinates:
    """Coordinates of one rotation.

    Attributes:
        values: The coordinates.
        rates: Their derivatives by time, from the angular velocity in the axes of the base.
    """

    values: Numbers
    rates: Callable[[Vector], Numbers]


def less(tape: Tape, left: sp.Expr, right: sp.Expr, yes: sp.Expr, no: sp.Expr) -> sp.Expr:
    """`yes` where `left` is smaller than `right`, else `no`."""
    if yes == no:
        return yes
    condition = sp.StrictLessThan(tape.name(left), tape.name(right))
    return tape.name(sp.Piecewise((tape.name(yes), condition), (tape.name(no), True)))


def root(tape: Tape, *squared: sp.Expr) -> sp.Expr:
    """The square root of a sum of squares."""
    # The sum gets a name first, or sympy would see through the root of a single square.
    total = tape.name(sum((value**2 for value in squared), sp.S.Zero))
    return tape.name(sp.sqrt(total))


def dot(left: Vector, right: Vector) -> sp.Expr:
    """The scalar product."""
    return sum((a * b for a, b in zip(left, right, strict=True)), sp.S.Zero)


# Quaternions ----------------------------------------------------------------------------------------------------------


def quaternion_wxyz(R: Rows, tape: Tape) -> Coordinates:
    """The unit quaternion of a rotation, the scalar first, w >= 0; where w is 0, the first other that is not is > 0.

    A component that is at least a half is taken from the diagonal by a root, and the others are quotients by it
    (Shepperd, Quaternion from rotation matrix, Journal of Guidance and Control 1, 1978): of the pairs (w, z) and (x, y)
    the one with the larger sum of squares, which the sign of r22 tells, and of that pair the larger.
    """
    x_pair = tape.name(less(tape, R[2][2], sp.S.Zero, R[0][0] - R[1][1], R[0][0] + R[1][1]))
    # Four times the square of the chosen component: 1 + |r22| + |r00 -+ r11|, which is at least 1.
    square = tape.name(1 + _absolute(tape, R[2][2]) + _absolute(tape, x_pair))

    def pick(x: sp.Expr, y: sp.Expr, z: sp.Expr, w: sp.Expr) -> sp.Expr:
        first, second = (less(tape, x_pair, sp.S.Zero, a, b) for a, b in ((y, x), (z, w)))
        return less(tape, R[2][2], sp.S.Zero, first, second)

    minus = [tape.name(R[i][j] - R[j][i]) for i, j in ((2, 1), (0, 2), (1, 0))]
    plus = [tape.name(R[i][j] + R[j][i]) for i, j in ((2, 1), (0, 2), (1, 0))]
    w = pick(minus[0], minus[1], minus[2], square)
    x = pick(square, plus[2], plus[1], minus[0])
    y = pick(plus[2], square, plus[0], minus[1])
    z = pick(plus[1], plus[0], square, minus[2])
    scale = tape.name(HALF / tape.name(sp.sqrt(square)))
    scale = _signed(tape, (w, x, y), scale)
    q = tuple(tape.name(scale * value) for value in (w, x, y, z))

    def rates(omega: Vector) -> Numbers:
        w, x, y, z = (tape.name(HALF * value) for value in q)
        turned = cross(omega, (x, y, z))
        return -dot(omega, (x, y, z)), *(w * omega[axis] + turned[axis] for axis in range(3))

    return Coordinates(q, rates)


def quaternion_xyzw(R: Rows, tape: Tape) -> Coordinates:
    """The same quaternion with the scalar last."""
    found = quaternion_wxyz(R, tape)
    return Coordinates(_scalar_last(found.values), lambda omega: _scalar_last(found.rates(omega)))


def _scalar_last(numbers: Numbers) -> Numbers:
    return (*numbers[1:], numbers[0])


def _absolute(tape: Tape, value: sp.Expr) -> sp.Expr:
    return less(tape, value, sp.S.Zero, -value, value)


def _signed(tape: Tape, deciding: Numbers, scale: sp.Expr) -> sp.Expr:
    """The scale with the sign of the first deciding number that is not zero; plus, if all are."""
    signed = scale
    for value in reversed(deciding):
        signed = less(tape, sp.S.Zero, value, scale, signed)
        signed = less(tape, value, sp.S.Zero, -scale, signed)
    return signed


# Rotation vector ------------------------------------------------------------------------------------------------------


def axis_angle(R: Rows, tape: Tape) -> Coordinates:
    """The rotation vector: the angle, in [0, pi], times the unit axis; at angle pi the axis that the quaternion has."""
    w, x, y, z = quaternion_wxyz(R, tape).values
    length = root(tape, x, y, z)
    safe = less(tape, sp.S.Zero, length, length, sp.S.One)
    half_angle = tape.name(sp.atan2(length, w))
    stretch = less(tape, sp.S.Zero, length, 2 * half_angle / safe, sp.Integer(2))
    v = tape.vector((stretch * x, stretch * y, stretch * z))

    def rates(omega: Vector) -> Numbers:
        unit = (x / safe, y / safe, z / safe)
        # Half the angle times the cotangent of half the angle: from 1 at angle 0 to 0 at angle pi.
        straight = less(tape, sp.S.Zero, length, half_angle * w / safe, sp.S.One)
        matrix = _left_inverse(tape, tape.vector(unit), tape.vector((HALF * v[0], HALF * v[1], HALF * v[2])), straight)
        return tuple(dot(row, omega) for row in matrix)

    return Coordinates(v, rates)


def _left_inverse(tape: Tape, unit: Vector, half: Vector, straight: sp.Expr) -> Rows:
    """The matrix from angular velocities to rates: `k I - [v/2]x + (1 - k) u u^T`, `k` being `straight`."""
    x, y, z = half
    bent = tape.name(1 - straight)
    ux, uy, uz = tape.vector((bent * unit[0], bent * unit[1], bent * unit[2]))
    xy, yz, zx = tape.vector((ux * unit[1], uy * unit[2], uz * unit[0]))
    return (
        tape.vector((straight + ux * unit[0], z + xy, zx - y)),
        tape.vector((xy - z, straight + uy * unit[1], x + yz)),
        tape.vector((y + zx, yz - x, straight + uz * unit[2])),
    )


# Three angles ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Last:
    """The last of three angles: its sine and cosine, the length they were divided by, and one over that (or 0)."""

    sine: sp.Expr
    cosine: sp.Expr
    length: sp.Expr
    over: sp.Expr

    @property
    def angle(self) -> sp.Expr:
        """The angle."""
        return sp.atan2(self.sine, self.cosine)


def _last(tape: Tape, sine: sp.Expr, cosine: sp.Expr) -> _Last:
    """The angle whose sine and cosine have this ratio; 0 where both are zero."""
    length = root(tape, sine, cosine)
    over = tape.name(1 / less(tape, sp.S.Zero, length, length, sp.S.One))
    return _Last(
        sine=tape.name(sine * over),
        cosine=less(tape, sp.S.Zero, length, cosine * over, sp.S.One),
        length=length,
        over=less(tape, sp.S.Zero, length, over, sp.S.Zero),
    )


def _rates(omega: Vector, first: int, across: Vector, middle: Vector, *, lean: sp.Expr, over: sp.Expr) -> Numbers:
    """The rates of the first, middle and last angle.

    Args:
        omega: Angular velocity in the axes of the base.
        first: Axis of the first turn.
        across: Unit vector square to the axes of the first and the middle turn.
        middle: Axis of the middle turn.
        lean: Component of the axis of the last turn along that of the first.
        over: One over its component along `across`.
    """
    last = over * dot(across, omega)
    return omega[first] - lean * last, dot(middle, omega), last


def rpy_zyx(R: Rows, tape: Tape) -> Coordinates:
    """Roll, pitch and yaw of `R = Rz(yaw) Ry(pitch) Rx(roll)`; pitch in [-pi/2, pi/2]; roll 0 where it is singular."""
    roll = _last(tape, R[2][1], R[2][2])
    sine = tape.name(roll.sine * R[0][2] - roll.cosine * R[0][1])
    cosine = tape.name(roll.cosine * R[1][1] - roll.sine * R[1][2])

    def rates(omega: Vector) -> Numbers:
        across, middle = (cosine, sine, sp.S.Zero), (-sine, cosine, sp.S.Zero)
        return _rates(omega, 2, across, middle, lean=R[2][0], over=roll.over)[::-1]

    return Coordinates((roll.angle, sp.atan2(-R[2][0], roll.length), sp.atan2(sine, cosine)), rates)


def rpy_xyz(R: Rows, tape: Tape) -> Coordinates:
    """Roll, pitch and yaw of `R = Rx(roll) Ry(pitch) Rz(yaw)`; pitch in [-pi/2, pi/2]; yaw 0 where it is singular."""
    yaw = _last(tape, -R[0][1], R[0][0])
    sine = tape.name(yaw.sine * R[2][0] + yaw.cosine * R[2][1])
    cosine = tape.name(yaw.sine * R[1][0] + yaw.cosine * R[1][1])

    def rates(omega: Vector) -> Numbers:
        across, middle = (sp.S.Zero, -sine, cosine), (sp.S.Zero, cosine, sine)
        return _rates(omega, 0, across, middle, lean=R[0][2], over=yaw.over)

    return Coordinates((sp.atan2(sine, cosine), sp.atan2(R[0][2], yaw.length), yaw.angle), rates)


def euler_zyz(R: Rows, tape: Tape) -> Coordinates:
    """The angles of `R = Rz(phi) Ry(theta) Rz(psi)`, theta in [0, pi]; psi 0 where sin(theta) is 0."""
    psi = _last(tape, R[2][1], -R[2][0])
    sine = tape.name(-psi.sine * R[0][0] - psi.cosine * R[0][1])
    cosine = tape.name(psi.sine * R[1][0] + psi.cosine * R[1][1])

    def rates(omega: Vector) -> Numbers:
        across, middle = (cosine, sine, sp.S.Zero), (-sine, cosine, sp.S.Zero)
        return _rates(omega, 2, across, middle, lean=R[2][2], over=psi.over)

    return Coordinates((sp.atan2(sine, cosine), sp.atan2(psi.length, R[2][2]), psi.angle), rates)
