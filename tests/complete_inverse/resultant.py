"""All solutions of six joints by a resultant in 60 digits: a polynomial of degree 16, and its roots.

Written from the papers and not from kinegen's elimination, with which it shares no code: the axes are read off poses of
the reference, every equation is found by interpolation at angles, and the resultant by interpolation at roots of unity.
The polynomial has all solutions, complex ones too, so that the number of real roots is the number of solutions.

The fourteen equations are those of Raghavan and Roth (1993, section 3): for a line with direction l and point p, the
entries of l, p, p x l and (p.p) l - 2 (p.l) p, and p.p and p.l. They bring joints 1 and 2 of a loop to one side and 3,
4 and 5 to the other. Joints 1 and 2 occur in eight products of cosines and sines, which leaves six equations without
them. In tangents of half angles, these and the same times that of joint 4 are twelve equations in twelve products of
those of joints 4 and 5; their determinant in that of joint 3 is (1 + x^2)^4 times the polynomial.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import mpmath
import numpy as np
from numpy.typing import NDArray

from kinegen.model.robot import Robot
from kinegen.verify import reference

DIGITS = 60
SHIFT = 1
"""The half angle of joint 3 is that of an angle turned by so much, so that half a turn is nothing special."""

REAL = mpmath.mpf(10) ** -20
CLOSES = mpmath.mpf(10) ** -30
"""How far a solution leads from the target; half of the digits, for roots that are nearly double."""

_DEGREE = 24
_SAMPLES = 25
_THIRD = 2 * mpmath.pi / 3

Matrix = Any
"""A matrix of mpmath."""


class NotSeparated(Exception):  # noqa: N818 - an answer, not an error
    """The arm is too special for this loop: other joints have to be in the middle."""


@dataclass(frozen=True, slots=True)
class Axis:
    """An axis as a direction and a point of it, in the base frame where all joints are 0."""

    direction: Matrix
    point: Matrix


def axes_of(robot: Robot) -> tuple[list[Axis], Matrix]:
    """The axes of the joints, and the pose where these are 0."""
    zero = [mpmath.mpf(0)] * robot.dof
    home = reference.pose_mp(robot, zero)[0]
    found = []
    for place in range(robot.dof):
        quarter, half = list(zero), list(zero)
        quarter[place], half[place] = mpmath.pi / 2, mpmath.pi
        turned = reference.pose_mp(robot, quarter)[0] * mpmath.inverse(home)
        direction = [turned[2, 1] - turned[1, 2], turned[0, 2] - turned[2, 0], turned[1, 0] - turned[0, 1]]
        over = reference.pose_mp(robot, half)[0] * mpmath.inverse(home)
        found.append(Axis(mpmath.matrix(direction) / 2, over[:3, 3] / 2))
    return found, home


def motion(axis: Axis, angle: Any) -> Matrix:
    """The turn about an axis, 4x4 (Rodrigues)."""
    x, y, z = axis.direction
    cross = mpmath.matrix([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    turn = mpmath.eye(3) + mpmath.sin(angle) * cross + (1 - mpmath.cos(angle)) * cross * cross
    shift = axis.point - turn * axis.point
    found = mpmath.eye(4)
    for row in range(3):
        for column in range(3):
            found[row, column] = turn[row, column]
        found[row, 3] = shift[row]
    return found


@dataclass(frozen=True, slots=True)
class Solved:
    """All solutions for a pose.

    Attributes:
        joints: Joint vectors, shape (n, 6), angles from -pi to pi; a double root comes twice.
        others: The number of complex solutions; there are 16 of both kinds together.
        loop: The joint with which the loop began that led to them.
    """

    joints: NDArray[np.float64]
    others: int
    loop: int


def solutions(robot: Robot, q: list[float], loops: Iterable[int] = range(6)) -> Solved:
    """All joint vectors for the pose of a joint vector.

    Args:
        robot: The robot; all joints turn, by rates of 1.
        q: The joint vector, six angles.
        loops: Joints to begin a loop with, the first ones first.

    Raises:
        NotSeparated: If no loop has a polynomial of degree 16 whose roots have one solution each.
    """
    with mpmath.workdps(DIGITS):
        axes, home = axes_of(robot)
        goal = reference.pose_mp(robot, list(map(mpmath.mpf, q)))[0] * mpmath.inverse(home)
        for start in loops:
            try:
                found, others = _of_loop(_begun_at(axes, goal, start), goal)
            except (NotSeparated, ZeroDivisionError):
                continue
            rows = [each[6 - start :] + each[: 6 - start] for each in found]
            return Solved(np.array(rows, dtype=float).reshape(-1, 6), others, start)
    raise NotSeparated(robot.name)


def _begun_at(axes: list[Axis], goal: Matrix, start: int) -> list[Axis]:
    """The loop from another joint on: what comes before it follows, as seen from the other side of the target."""
    back = mpmath.inverse(goal)
    turned = [Axis(back[:3, :3] * axis.direction, back[:3, :3] * axis.point + back[:3, 3]) for axis in axes[:start]]
    return [*axes[start:], *turned]


def _of_loop(axes: list[Axis], goal: Matrix) -> tuple[list[list[Any]], int]:
    """Angles of a loop whose motions multiply to the goal, and the number of complex solutions."""
    line = axes[5].direction, axes[5].point
    seen = goal[:3, :3] * line[0], goal[:3, :3] * line[1] + goal[:3, 3]
    left = _interpolated([axes[2], axes[3], axes[4]], line, inverse=False)
    right = _interpolated([axes[0], axes[1]], seen, inverse=True)
    free = _left_null(right[:, 1:])
    rest = free * left
    for row, number in enumerate(free * right[:, 0]):
        rest[row, 0] -= number
    found, others = [], 0
    polynomial = _polynomial(rest)
    for root in mpmath.polyroots(polynomial, maxsteps=400, extraprec=400):
        if abs(mpmath.im(root)) > REAL * (1 + abs(root) ** 2):
            others += 1
            continue
        found.append(_angles(axes, goal, (rest, right, left), mpmath.re(root)))
    return found, others


def _fourteen(direction: Matrix, point: Matrix) -> list[Any]:
    """The numbers of a line that are linear in the cosine and the sine of every joint."""
    l, p = list(direction), list(point)
    pp, pl = sum(a * a for a in p), sum(a * b for a, b in zip(p, l, strict=True))
    cross = [p[1] * l[2] - p[2] * l[1], p[2] * l[0] - p[0] * l[2], p[0] * l[1] - p[1] * l[0]]
    return [*l, *p, *cross, *(pp * a - 2 * pl * b for a, b in zip(l, p, strict=True)), pp, pl]


def _interpolated(axes: list[Axis], line: tuple[Matrix, Matrix], *, inverse: bool) -> Matrix:
    """Factors of the products of 1, cosine and sine of each joint in the fourteen numbers, a row for each."""
    angles = [0 * _THIRD, _THIRD, -_THIRD]
    count = len(axes)
    motions = [[motion(axis, -angle if inverse else angle) for angle in angles] for axis in axes]
    found = mpmath.zeros(14, 3**count)
    once = mpmath.inverse(mpmath.matrix([[1, mpmath.cos(angle), mpmath.sin(angle)] for angle in angles]))
    for places in itertools.product(range(3), repeat=count):
        whole = mpmath.eye(4)
        order = list(zip(motions, places, strict=True))
        for each, place in reversed(order) if inverse else order:
            whole = whole * each[place]
        numbers = _fourteen(whole[:3, :3] * line[0], whole[:3, :3] * line[1] + whole[:3, 3])
        for column, kinds in enumerate(itertools.product(range(3), repeat=count)):
            factor = mpmath.fprod(once[kind, place] for kind, place in zip(kinds, places, strict=True))
            for row, number in enumerate(numbers):
                found[row, column] += factor * number
    return found


def _left_null(matrix: Matrix) -> Matrix:
    """Rows that make every column zero, six of them: what reducing with row pivots leaves."""
    rows, columns = matrix.rows, matrix.cols
    work, made = matrix.copy(), mpmath.eye(rows)
    for step in range(columns):
        best = max(range(step, rows), key=lambda row: abs(work[row, step]))
        if abs(work[best, step]) < mpmath.mpf(10) ** -(DIGITS // 3):
            raise NotSeparated
        for table in (work, made):
            for column in range(table.cols):
                table[step, column], table[best, column] = table[best, column], table[step, column]
        for row in range(step + 1, rows):
            factor = work[row, step] / work[step, step]
            for table in (work, made):
                for column in range(table.cols):
                    table[row, column] -= factor * table[step, column]
    return made[columns:, :]


def _of_half(kind: int) -> tuple[int, int, int]:
    """Factors of 1, x and x^2 in 1 + x^2 times 1, the cosine or the sine of the angle 2 atan x."""
    return ((1, 0, 1), (1, 0, -1), (0, 2, 0))[kind]


def _at(rest: Matrix, tangent: Any) -> Matrix:
    """The twelve equations for a tangent of half the angle of joint 3, less the shift."""
    square = 1 + tangent**2
    cosine, sine = (1 - tangent**2), 2 * tangent
    shifted = (
        square,
        cosine * mpmath.cos(SHIFT) - sine * mpmath.sin(SHIFT),
        sine * mpmath.cos(SHIFT) + cosine * mpmath.sin(SHIFT),
    )
    found = mpmath.zeros(12, 12)
    for column, (third, fourth, fifth) in enumerate(itertools.product(range(3), repeat=3)):
        for (i, a), (j, b) in itertools.product(enumerate(_of_half(fourth)), enumerate(_of_half(fifth))):
            if a and b:
                for row in range(6):
                    value = rest[row, column] * shifted[third] * a * b
                    found[row, 3 * i + j] += value
                    found[row + 6, 3 * (i + 1) + j] += value
    return found


def _polynomial(rest: Matrix) -> list[Any]:
    """The resultant without its eight roots i and -i, the highest power first.

    Raises:
        NotSeparated: If it vanishes, or is of a lower degree.
    """
    unit = [mpmath.expjpi(mpmath.mpf(2 * k) / _SAMPLES) for k in range(_SAMPLES)]
    values = [mpmath.det(_at(rest, each)) for each in unit]
    powers = [
        mpmath.re(sum(value * unit[-k * power % _SAMPLES] for k, value in enumerate(values))) / _SAMPLES
        for power in range(_SAMPLES)
    ]
    size = max(map(abs, powers))
    found = powers[::-1]
    for _ in range(4):
        for place in range(len(found) - 2):
            found[place + 2] -= found[place]
        if not size or max(map(abs, found[-2:])) > mpmath.mpf(10) ** -25 * size:
            raise NotSeparated
        found = found[:-2]
    if abs(found[0]) < mpmath.mpf(10) ** -15 * max(map(abs, found)) or size < mpmath.mpf(10) ** -30:
        raise NotSeparated
    return found


def _angles(axes: list[Axis], goal: Matrix, tables: tuple[Matrix, ...], tangent: Any) -> list[Any]:
    """All six angles of a real root.

    Raises:
        NotSeparated: If the root has more than one solution.
    """
    rest, right, left = tables
    vector = _null(_at(rest, tangent))
    pairs = [(abs(vector[k]), vector[k + 3] / vector[k]) for k in range(9) if vector[k]]
    fourth = max(pairs, key=lambda pair: pair[0])[1]
    pairs = [(abs(vector[k]), vector[k + 1] / vector[k]) for k in range(12) if k % 3 < 2 and vector[k]]
    fifth = max(pairs, key=lambda pair: pair[0])[1]
    three = [2 * mpmath.atan(tangent) + SHIFT, 2 * mpmath.atan(fourth), 2 * mpmath.atan(fifth)]
    terms = [[1, mpmath.cos(angle), mpmath.sin(angle)] for angle in three]
    products = mpmath.matrix([mpmath.fprod(each) for each in itertools.product(*terms)])
    two = mpmath.qr_solve(right[:, 1:], left * products - right[:, 0])[0]
    # Columns of the products of joints 1 and 2 but the first: (1, c2), (1, s2), (c1, 1), ..., (s1, 1), ...
    angles = [mpmath.atan2(two[5], two[2]), mpmath.atan2(two[1], two[0]), *three]
    done = mpmath.eye(4)
    for axis, angle in zip(axes, angles, strict=False):
        done = done * motion(axis, angle)
    last = mpmath.inverse(done) * goal
    x, y, z = axes[5].direction
    sine = (x * (last[2, 1] - last[1, 2]) + y * (last[0, 2] - last[2, 0]) + z * (last[1, 0] - last[0, 1])) / 2
    angles.append(mpmath.atan2(sine, (last[0, 0] + last[1, 1] + last[2, 2] - 1) / 2))
    if mpmath.mnorm(done * motion(axes[5], angles[5]) - goal, "f") > CLOSES:
        raise NotSeparated
    return [angle - 2 * mpmath.pi * mpmath.nint(angle / (2 * mpmath.pi)) for angle in angles]


def _null(matrix: Matrix) -> Matrix:
    """The vector that a singular matrix makes zero, by inverse iteration."""
    nudged = matrix + mpmath.mpf(10) ** -(DIGITS - 10) * mpmath.eye(matrix.rows)
    found = mpmath.matrix([mpmath.mpf(k + 1) for k in range(matrix.rows)])
    for _ in range(2):
        found = mpmath.lu_solve(nudged, found)
        found = found / mpmath.norm(found)
    return found
