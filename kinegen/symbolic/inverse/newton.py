"""One Newton step of an arm with six turning joints, from where it is to a pose nearby.

The last joint only turns the last frame about its own z axis, so that the other five are found from five equations: the
position of that frame and its turns about x and y.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import sympy as sp

from kinegen.symbolic.expressions import by_type
from kinegen.symbolic.fold import Vector
from kinegen.symbolic.inverse.exact import Rotation
from kinegen.symbolic.inverse.geometry import Planar
from kinegen.symbolic.inverse.own_chain import Link, OwnChain
from kinegen.symbolic.inverse.steps import Steps
from kinegen.symbolic.inverse.vectors import Vectors

_LEAST_PIVOT = by_type(sp.Rational(1, 10**15), sp.Rational(1, 10**7))
"""Smaller pivots are rounding: the pose is singular, and the step may be anything."""


@dataclass(frozen=True, slots=True)
class Reached:
    """Where an arm is.

    Attributes:
        columns: Of the last frame.
        place: Of the last frame.
        axes: Direction and a point of each axis before the last.
    """

    columns: Rotation
    place: Vector
    axes: tuple[tuple[Vector, Vector], ...]


def reached(steps: Steps, chain: OwnChain, units: Sequence[Planar]) -> Reached:
    """The pose of the last frame.

    Args:
        steps: The tape.
        chain: The arm.
        units: Cosine and sine of each joint's angle, its lead added.
    """
    vectors = Vectors(steps)
    (x, y, z), place = zip(*chain.rotation, strict=True), chain.origin
    axes = []
    for unit, link in zip(units, (*chain.links, None), strict=True):
        x, y = vectors.combined((unit[0], x), (unit[1], y)), vectors.combined((unit[0], y), (-unit[1], x))
        if link is not None:
            axes.append((z, place))
            place = vectors.combined((sp.S.One, place), (link.shift, z), (link.across, x))
            x, y, z = _tilted(vectors, link, (x, y, z))
    return Reached((x, y, z), place, tuple(axes))


def _tilted(vectors: Vectors, link: Link, frame: Rotation) -> Rotation:
    x, y, z = frame
    (cosine, sine), (upright, lean) = link.tilt, link.lean
    y, z = vectors.combined((cosine, y), (sine, z)), vectors.combined((cosine, z), (-sine, y))
    if lean == 0:
        return x, y, z
    return vectors.combined((upright, x), (-lean, z)), y, vectors.combined((upright, z), (lean, x))


def turn_left(steps: Steps, found: Reached, wanted: Rotation) -> Vector:
    """Twice the small turn from where an arm is to the columns of a frame, about the axes of the last frame."""
    dot = Vectors(steps).dot
    x, y, z = found.columns
    pairs = ((z, wanted[1], y, wanted[2]), (x, wanted[2], z, wanted[0]), (y, wanted[0], x, wanted[1]))
    first, second, third = (steps.name(dot(a, b) - dot(c, d)) for a, b, c, d in pairs)
    return first, second, third


def half_turns(steps: Steps, found: Reached, wanted: Rotation, place: Vector, weight: sp.Expr) -> list[sp.Expr]:
    """Half of how far each joint has to turn, to first order.

    Args:
        steps: The tape.
        found: Where the arm is.
        wanted: Columns of the frame where it has to be.
        place: Of that frame.
        weight: What lengths are multiplied by to be compared with angles.
    """
    name, vectors = steps.name, Vectors(steps)
    turn = turn_left(steps, found, wanted)
    x, y, z = found.columns
    off = [*vectors.scaled(vectors.minus(place, found.place), weight / 2), name(turn[0] / 4), name(turn[1] / 4)]
    moves = []
    for axis, point in found.axes:
        lever = vectors.cross(axis, vectors.minus(found.place, point))
        moves.append([*vectors.scaled(lever, weight), vectors.dot(x, axis), vectors.dot(y, axis)])
    halves = _least_squares(steps, moves, off)
    about = [-name(vectors.dot(z, axis) * half) for (axis, _), half in zip(found.axes, halves, strict=True)]
    return [*halves, name(sp.Add(name(turn[2] / 4), *about))]


def _least_squares(steps: Steps, moves: list[list[sp.Expr]], off: list[sp.Expr]) -> list[sp.Expr]:
    """Solve by the normal equations as L D L^T (Golub and Van Loan, 4.1.2); `moves` are the columns of the matrix."""
    name, size = steps.name, len(moves)

    def inner(left: list[sp.Expr], right: list[sp.Expr]) -> sp.Expr:
        return name(sp.Add(*(name(a * b) for a, b in zip(left, right, strict=True))))

    def less(start: sp.Expr, pairs: list[tuple[sp.Expr, sp.Expr]]) -> sp.Expr:
        return name(sp.Add(start, *(-name(a * b) for a, b in pairs)))

    lower = [[inner(moves[row], moves[column]) for column in range(row + 1)] for row in range(size)]
    found = [inner(move, off) for move in moves]
    inverse = []
    for c in range(size):
        scaled = [name(lower[c][k] * lower[k][k]) for k in range(c)]
        pivot = less(lower[c][c], list(zip(lower[c][:c], scaled, strict=True)))
        lower[c][c] = steps.select(_LEAST_PIVOT, pivot, pivot, _LEAST_PIVOT)
        inverse.append(name(1 / lower[c][c]))
        for r in range(c + 1, size):
            rest = less(lower[r][c], list(zip(lower[r][:c], scaled, strict=True)))
            lower[r][c] = name(rest * inverse[c])
    for r in range(size):
        found[r] = less(found[r], [(lower[r][k], found[k]) for k in range(r)])
    for r in reversed(range(size)):
        found[r] = less(name(found[r] * inverse[r]), [(lower[k][r], found[k]) for k in range(r + 1, size)])
    return found
