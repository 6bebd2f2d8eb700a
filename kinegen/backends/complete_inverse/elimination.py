"""The constants of Raghavan and Roth's elimination for one arm and one order of its joints.

The loop of an arm is closed by its target: Rz(a) Ma Rz(b) Mb ... Rz(f) Mf = 1. A line that the last turn leaves in
place is seen from the third joint in two ways, by (c, d, e) and by (a, b). With its direction l and its nearest point
p, the fourteen numbers l, p, p x l, (p.p) l - 2 (p.l) p, p.p and p.l are, and this is Raghavan and Roth's discovery,
linear in cosine and sine of every angle, because each rigid motion maps them linearly (with 1 as the fifteenth).
Components along the axis and both squares are free of b, the others turn with it; so a and b are eliminated from six
and from four complex equations, and six equations in (c, d, e) are left.

With cosine and sine of three halves and one half of d they are twelve, linear in twelve products of functions of d and
e, quadratic in t = tan(c / 2): degree 24. Eight roots are always t = +-i, with null vectors that do not depend on the
target. `Elimination.basis` divides them out, and 16 are left. Null spaces and complements are computed with mpmath: the
same digits on every machine.

Raghavan and Roth, "Inverse kinematics of the general 6R manipulator and related linkages", J. Mech. Design 115, 1993.
"""

from __future__ import annotations

from typing import Any

import mpmath

from kinegen.backends.complete_inverse.screws import JOINTS, Screws, cross, dot
from kinegen.support.dataclass import dataclass

Vector = list[Any]

_TINY = mpmath.mpf(10) ** -15


def null_space(rows: list[Vector]) -> list[Vector]:
    """Return an orthonormal basis of the vectors that all rows map to zero, by elimination with complete pivoting.

    The matrix has real or complex numbers of order 1.
    """
    work, size = [list(row) for row in rows], len(rows[0])
    pivots: list[int] = []
    for step in range(min(len(work), size)):
        left = [column for column in range(size) if column not in pivots]
        # Ties go to the first entry, so that every machine takes the same pivot.
        best = max((abs(work[row][column]), -row, -column) for row in range(step, len(work)) for column in left)
        if best[0] < _TINY:
            break
        row, column = -best[1], -best[2]
        work[step], work[row] = work[row], work[step]
        work[step] = [entry / work[step][column] for entry in work[step]]
        pivots.append(column)
        for other in range(len(work)):
            if other != step:
                factor = work[other][column]
                work[other] = [a - factor * b for a, b in zip(work[other], work[step], strict=True)]
    found = []
    for free in (column for column in range(size) if column not in pivots):
        vector: Vector = [mpmath.mpf(int(column == free)) for column in range(size)]
        for place, column in enumerate(pivots):
            vector[column] = -work[place][free]
        found.append(vector)
    return orthonormal(found)


def orthonormal(vectors: list[Vector]) -> list[Vector]:
    """Return the vectors made orthonormal, in their order."""
    found: list[Vector] = []
    for vector in vectors:
        found.append(unit(_rest(vector, found)))
    return found


def complement(vectors: list[Vector], size: int) -> list[Vector]:
    """Return an orthonormal basis of what is orthogonal to the vectors, which need not be orthogonal themselves."""
    basis = orthonormal(vectors)
    found: list[Vector] = []
    while len(basis) < size:
        units = ([mpmath.mpf(int(row == column)) for row in range(size)] for column in range(size))
        rests = [_rest(each, basis) for each in units]
        longest = max(range(size), key=lambda index: (round(float(_length(rests[index])), 6), -index))
        basis.append(unit(rests[longest]))
        found.append(basis[-1])
    return found


def unit(vector: Vector) -> Vector:
    """Return the vector with length 1."""
    length = _length(vector)
    return [entry / length for entry in vector]


def _rest(vector: Vector, basis: list[Vector]) -> Vector:
    for other in (*basis, *basis):
        share = sum(mpmath.conj(a) * b for a, b in zip(other, vector, strict=True))
        vector = [b - share * a for a, b in zip(other, vector, strict=True)]
    return vector


def _length(vector: Vector) -> Any:
    return mpmath.sqrt(sum(abs(entry) ** 2 for entry in vector))


X, Y, Z = (0, 3, 6, 9), (1, 4, 7, 10), (2, 5, 8, 11, 12, 13)
"""Components across the axis, and those along it with both squares."""

ORDERS = ((0, 1, 2, 3, 4, 5), (0, 5, 4, 3, 2, 1), (5, 4, 3, 2, 1, 0), (5, 0, 1, 2, 3, 4))
"""The joints a to f of each elimination; against their own order they turn backwards."""

_DEFLATED = 4
_WIDE = (
    ((0.5, 0, 0.5, 0), (0, 0.5, 0, 0.5), (0, 0, 1, 0)),
    ((0, 0.5, 0, -0.5), (-0.5, 0, 0.5, 0), (0, 0, 0, 1)),
)
"""(cos d, sin d, 1) times cos(d / 2) and sin(d / 2), in cos(3d / 2), sin(3d / 2), cos(d / 2), sin(d / 2)."""


@dataclass(frozen=True, slots=True)
class Elimination:
    """One elimination.

    Attributes:
        order: The joints a to f.
        backwards: Whether the loop is run against the order of the joints, with all angles negative.
        closes_first: Whether the target is in Ma; otherwise it is in Mf.
        left, right: The transform with the target is left target right, or left target^-1 right if not `backwards`.
        fixed: The inverse of the other one of Ma and Mf.
        along: Six rows of 27: the numbers along the axis in (cos c, sin c, 1) x (cos d, ...) x (cos e, ...).
        across: Four rows of 27 complex numbers, the components across the axis, x + iy.
        real: How many of the null vectors at t = +-i are real.
        basis: 12 vectors of length 12: the real ones, real and imaginary parts of the others, and a complement.
    """

    order: tuple[int, ...]
    backwards: bool
    closes_first: bool
    left: Any
    right: Any
    fixed: Any
    along: tuple[Vector, ...]
    across: tuple[Vector, ...]
    real: int
    basis: tuple[Vector, ...]


def elimination(screws: Screws, order: tuple[int, ...]) -> Elimination:
    """Return the constants for an order of the joints."""
    backwards = order[1] != (order[0] + 1) % JOINTS
    closes_first = {order[0], order[1]} == {0, JOINTS - 1}
    # The loop is opened where the target is: in Ma or in Mf.
    links = [_between(screws, one, order[(place + 1) % JOINTS]) for place, one in enumerate(order)]
    first, last = mpmath.inverse(screws.first), mpmath.inverse(screws.last)
    left, right = (first, last) if backwards else (screws.last, screws.first)
    # What (c, d, e) show does not depend on the target.
    rows = _seen(links[1:5])
    along = tuple(rows[index] for index in Z)
    across = tuple([x + 1j * y for x, y in zip(rows[i], rows[k], strict=True)] for i, k in zip(X, Y, strict=True))
    real, basis = _basis([*along, *(rows[index] for index in (*X, *Y))])
    fixed = mpmath.inverse(links[5] if closes_first else links[0])
    return Elimination(order, backwards, closes_first, left, right, fixed, along, across, real, basis)


def _between(screws: Screws, one: int, other: int) -> Any:
    """Return the transform from the frame on one axis to that on the next of an order; None where the target is."""
    if {one, other} == {0, JOINTS - 1}:
        return None
    link = screws.links[min(one, other)]
    return link if one < other else mpmath.inverse(link)


def carried(motion: Any, numbers: Vector) -> Vector:
    """Return the fifteen numbers of a line after a rigid motion, 4x4."""
    r, t = motion[:3, :3], motion[:3, 3]
    l, p, w, c = (r * mpmath.matrix(numbers[first : first + 3]) for first in (0, 3, 6, 9))
    square, product, one = numbers[12:]
    far, lead = dot(t, t), dot(t, l)
    across, aside = cross(t, l), cross(t, w)
    return [
        *l,
        *(p[i] + t[i] * one for i in range(3)),
        *(w[i] + across[i] for i in range(3)),
        *(c[i] + far * l[i] - 2 * aside[i] - 2 * (product + lead) * t[i] for i in range(3)),
        square + 2 * dot(t, p) + far * one,
        product + lead,
        one,
    ]


def split(numbers: Vector) -> tuple[Vector, Vector, Vector]:
    """Return the factors of cosine, sine and 1 in the numbers of a line after a turn about z."""
    cosine, sine, rest = ([mpmath.mpf(0)] * 15 for _ in range(3))
    for index in range(15):
        if index in X:
            cosine[index], sine[index + 1] = numbers[index], numbers[index]
        elif index in Y:
            cosine[index], sine[index - 1] = numbers[index], -numbers[index]
        else:
            rest[index] = numbers[index]
    return cosine, sine, rest


def _seen(links: list[Any]) -> list[Vector]:
    """Return the line as (c, d, e) show it: 15 rows of 27, for Mb Rz(c) Mc Rz(d) Md Rz(e) Me."""
    numbers = [mpmath.mpf(entry) for entry in (0, 0, 1, *[0] * 11, 1)]
    columns = [carried(links[3], numbers)]
    for link in reversed(links[:3]):
        columns = [carried(link, part) for part in map(list, _turned(columns))]
    return [[column[row] for column in columns] for row in range(15)]


def _turned(columns: list[Vector]) -> list[Vector]:
    """Return all cosine parts, then all sine parts, then the rest."""
    parts = [split(column) for column in columns]
    return [part[which] for which in range(3) for part in parts]


def widened(row: Vector) -> tuple[Vector, Vector]:
    """Return a row of nine, in d and e, times cos(d / 2) and times sin(d / 2): two rows of twelve."""
    cosine, sine = (
        [sum(row[3 * i + j] * factors[i][k] for i in range(3)) for k in range(4) for j in range(3)] for factors in _WIDE
    )
    return cosine, sine


def _basis(rows: list[Vector]) -> tuple[int, tuple[Vector, ...]]:
    """Return how many of the null vectors at t = i are real, and the basis."""
    leading = [[a + 1j * b for a, b in zip(row[:9], row[9:18], strict=True)] for row in rows]
    # Null vectors at t = i that do not depend on the target; real mixtures of them are shared with t = -i.
    null = null_space([wide for row in leading for wide in widened(row)])[:_DEFLATED]
    sides = [[*(v[k].imag for v in null), *(v[k].real for v in null)] for k in range(12)]
    mixes = [[mpmath.mpc(a, b) for a, b in zip(m[:4], m[4:], strict=True)] for m in null_space(sides)]
    real = orthonormal([[entry.real for entry in _mixed(null, mix)] for mix in mixes])
    others = [_mixed(null, mix) for mix in complement(mixes, _DEFLATED)]
    columns = [*real, *([e.real for e in v] for v in others), *([e.imag for e in v] for v in others)]
    return len(real), (*columns, *complement(columns, 12))


def _mixed(vectors: list[Vector], factors: Vector) -> Vector:
    return [sum(mpmath.mpc(f) * v[k] for f, v in zip(factors, vectors, strict=True)) for k in range(12)]
