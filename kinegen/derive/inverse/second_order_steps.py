"""Steps that lead the joints of an arm to a target, of second order where two branches are about to meet.

A step of Newton's d solves J d = r for what is left, r. Where two branches meet, J has no inverse, the curve of poses
along d bends back, and what bends it is known: the second derivative F(d, d) of the pose. With c = J^-1 F(d, d), which
is along d there, the pose is reached at the part l of d with l + b l^2 / 2 = 1, b = d.c / d.d, and the step is d - l^2
c / 2 (Euler; Traub 1964). Far from there b is small, and the step is that of Chebyshev. Of the two roots l is the one
on the side where the joints are. Where there is none, the pose is not reached along d, and the step goes as near as it
can: to l = -1 / b.

The last joint only turns the last frame about its own z axis, so that the other five are found from five equations: the
position of that frame and its turns about x and y. Their columns are made square to one another (Gram and Schmidt;
Golub and Van Loan, 5.2.8) and not multiplied with each other, which would square how nearly singular they are.
"""

from __future__ import annotations

from collections.abc import Sequence

import sympy as sp

from kinegen.derive.expressions import by_type
from kinegen.derive.folding import NULL, Vector
from kinegen.derive.inverse.compact_chain import CompactChain, Link
from kinegen.derive.inverse.exact_geometry import IDENTITY, Rotation
from kinegen.derive.inverse.geometry import Planar
from kinegen.derive.inverse.straight_line_operations import ZERO, OperationBuilder
from kinegen.support.dataclass import dataclass

_LEAST_PIVOT = by_type(sp.Rational(1, 10**30), sp.Rational(1, 10**14))
"""Smaller squares of columns are rounding: the pose is singular, and the step may be anything."""

_LEAST_STEP = sp.Rational(1, 10**30)
"""Squares of steps below this are no steps, and bend nothing."""


@dataclass(frozen=True, slots=True)
class Reached:
    """Where an arm is: its last frame, by columns and place, and direction and a point of each axis before the last."""

    columns: Rotation
    place: Vector
    axes: tuple[tuple[Vector, Vector], ...]


def reached(steps: OperationBuilder, chain: CompactChain, units: Sequence[Planar]) -> Reached:
    """Return the pose of the last frame in the first one, and the axes there, for angles with their leads as units."""
    (x, y, z), place = IDENTITY, NULL
    axes = []
    for unit, link in zip(units, (*chain.links, None), strict=True):
        x, y = steps.combined((unit[0], x), (unit[1], y)), steps.combined((unit[0], y), (-unit[1], x))
        if link is not None:
            axes.append((z, place))
            place = steps.combined((sp.S.One, place), (link.shift, z), (link.across, x))
            x, y, z = _tilted(steps, link, (x, y, z))
    return Reached((x, y, z), place, tuple(axes))


def _tilted(steps: OperationBuilder, link: Link, frame: Rotation) -> Rotation:
    x, y, z = frame
    (cosine, sine), (upright, lean) = link.tilt, link.lean
    y, z = steps.combined((cosine, y), (sine, z)), steps.combined((cosine, z), (-sine, y))
    if lean == 0:
        return x, y, z
    return steps.combined((upright, x), (-lean, z)), y, steps.combined((upright, z), (lean, x))


def turn_left(steps: OperationBuilder, found: Reached, wanted: Rotation) -> Vector:
    """Return twice the small turn from where an arm is to the columns of a frame, about the axes of the last frame."""
    dot = steps.dot
    x, y, z = found.columns
    pairs = ((z, wanted[1], y, wanted[2]), (x, wanted[2], z, wanted[0]), (y, wanted[0], x, wanted[1]))
    first, second, third = (steps.name(dot(a, b) - dot(c, d)) for a, b, c, d in pairs)
    return first, second, third


def half_turns(
    steps: OperationBuilder, found: Reached, wanted: Rotation, place: Vector, weight: sp.Expr
) -> list[sp.Expr]:
    """Return half of how far each joint has to turn to second order, to a frame by its columns and its place.

    Lengths are multiplied by `weight` to be compared with angles.
    """
    name = steps.name
    turn = turn_left(steps, found, wanted)
    x, y, z = found.columns
    # The last joint takes the turn about z, so that five equations are left for five joints.
    off = [*steps.scaled(steps.minus(place, found.place), weight / 2), name(turn[0] / 4), name(turn[1] / 4)]
    levers = [steps.scaled(steps.cross(axis, steps.minus(found.place, point)), weight) for axis, point in found.axes]
    moves = [
        (*lever, steps.dot(x, axis), steps.dot(y, axis)) for lever, (axis, _) in zip(levers, found.axes, strict=True)
    ]
    system = _orthogonal(steps, moves)
    halves = system.solved(steps, off)

    def last(halves: Sequence[sp.Expr], bent: sp.Expr) -> sp.Expr:
        about = [-name(steps.dot(z, axis) * half) for (axis, _), half in zip(found.axes, halves, strict=True)]
        return name(sp.Add(name(turn[2] / 4), -bent, *about))

    # What bends the way there, and how much of that the step takes back.
    path, spin = _bent(steps, found, levers, [*halves, last(halves, ZERO)])
    bend = system.solved(steps, (*path, steps.dot(x, spin), steps.dot(y, spin)))
    part = _part(steps, halves, bend)
    turned = [name(half - name(part * each)) for half, each in zip(halves, bend, strict=True)]
    return [*turned, last(turned, name(part * steps.dot(z, spin)))]


def _bent(
    steps: OperationBuilder, found: Reached, levers: Sequence[Vector], halves: Sequence[sp.Expr]
) -> tuple[Vector, Vector]:
    """Return the acceleration of the last frame, and that of its turns, for joints that turn at constant rates."""
    path, turn, spin = NULL, NULL, NULL
    for (axis, _), lever, half in zip(found.axes, levers, halves[:-1], strict=True):
        own = steps.scaled(axis, half)
        faster = steps.plus(spin, own)
        # The second derivative for two joints is the axis of the one before across the lever of the one after.
        path = steps.plus(path, steps.cross(steps.plus(spin, faster), steps.scaled(lever, half)))
        turn, spin = steps.plus(turn, steps.cross(spin, own)), faster
    return path, steps.plus(turn, steps.cross(spin, steps.scaled(found.columns[2], halves[-1])))


def _part(steps: OperationBuilder, halves: Sequence[sp.Expr], bend: Sequence[sp.Expr]) -> sp.Expr:
    """Return the square of the part l of a step with l + b l^2 / 2 = 1; what leads to l = -1 / b where none has it."""
    name = steps.name
    scale = name(2 / name(steps.square(halves) + _LEAST_STEP))
    b = name(steps.dot(halves, bend) * scale)
    inside = name(1 + 2 * b)
    along = name(2 / name(1 + steps.root_of_positive(inside)))
    return steps.select(inside, ZERO, name(name(2 + 2 * b) / name(b**2)), name(along**2))


@dataclass(frozen=True, slots=True)
class _Orthogonal:
    """The columns of a matrix, made square to those before them.

    Attributes:
        columns: These columns.
        inverses: One over the square of each.
        shares: How much of each column, by its place, was taken from every one after it.
    """

    columns: tuple[tuple[sp.Expr, ...], ...]
    inverses: tuple[sp.Expr, ...]
    shares: tuple[tuple[sp.Expr, ...], ...]

    def solved(self, steps: OperationBuilder, right: Sequence[sp.Expr]) -> list[sp.Expr]:
        """Return how much of each column of the matrix makes up a right side, or comes nearest to it."""
        found: list[sp.Expr] = []
        for column, inverse in zip(self.columns, self.inverses, strict=True):
            found.append(steps.name(steps.dot(column, right) * inverse))
            right = _less(steps, right, column, found[-1])
        # Back from the last one.
        for row in reversed(range(len(found))):
            later = [-steps.name(a * b) for a, b in zip(self.shares[row], found[row + 1 :], strict=True)]
            found[row] = steps.name(sp.Add(found[row], *later))
        return found


def _orthogonal(steps: OperationBuilder, matrix: Sequence[Sequence[sp.Expr]]) -> _Orthogonal:
    """Make the columns of a matrix square to one another, each of the later ones as soon as one is done."""
    left, columns, inverses, shares = [tuple(column) for column in matrix], [], [], []
    while left:
        column, *left = left
        size = steps.dot(column, column)
        inverse = steps.name(1 / steps.select(_LEAST_PIVOT, size, size, _LEAST_PIVOT))
        share = tuple(steps.name(steps.dot(column, other) * inverse) for other in left)
        left = [_less(steps, other, column, part) for other, part in zip(left, share, strict=True)]
        columns.append(column)
        inverses.append(inverse)
        shares.append(share)
    return _Orthogonal(tuple(columns), tuple(inverses), tuple(shares))


def _less(
    steps: OperationBuilder, vector: Sequence[sp.Expr], column: Sequence[sp.Expr], part: sp.Expr
) -> tuple[sp.Expr, ...]:
    """Return a vector less a part of a column."""
    return tuple(steps.name(a - steps.name(part * b)) for a, b in zip(vector, column, strict=True))
