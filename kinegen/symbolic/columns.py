"""Velocities of the end of a chain, one for each symbol that its elementary transforms depend on.

The same code serves joints and parameters: a turn about an axis gives the angular velocity of that axis and, at the
end, its vector product with the lever; a shift gives its direction. Every transform counts with its exact rate, so a
screw joint, a joint that others follow, and a length that stands in several rows need no case of their own.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass

import sympy as sp

from kinegen.symbolic.fold import NULL, Attitude, Vector, total
from kinegen.symbolic.marks import Mark, pieces
from kinegen.symbolic.pose import UNITS
from kinegen.symbolic.route import Place, Route, cross, minus, scaled


@dataclass(frozen=True, slots=True)
class Motion:
    """A velocity, or the derivative of a pose by one symbol."""

    linear: Vector
    angular: Vector

    @property
    def entries(self) -> tuple[sp.Expr, ...]:
        """Linear, then angular."""
        return (*self.linear, *self.angular)

    def turned(self, attitude: Attitude, sign: int) -> Motion:
        """In the axes behind a constant attitude, times a sign."""
        return Motion(_behind_attitude(self.linear, attitude, sign), _behind_attitude(self.angular, attitude, sign))


@dataclass(frozen=True, slots=True)
class Mover:
    """A mark that depends on one symbol, and how fast it turns or moves with it."""

    place: Place
    mark: Mark
    rate: sp.Expr

    @property
    def axis(self) -> Vector:
        """The axis, as long as the rate."""
        return scaled(self.rate, self.mark.axis)


def movers(route: Route, symbol: int) -> tuple[Mover, ...]:
    """The marks that depend on a symbol, along the chain."""
    return tuple(
        Mover((level, index), item, item.rates[symbol])
        for level, items in enumerate(route.marked.levels)
        for index, item in enumerate(items)
        if isinstance(item, Mark) and item.rates[symbol] != 0
    )


def angular(route: Route, moving: Sequence[Mover]) -> Iterable[Vector]:
    """The angular velocity by one symbol, in the axes of the start, in several ways."""
    return route.ways(_sum((mover.place[0], mover.axis) for mover in moving if mover.mark.is_turn))


def linear(route: Route, moving: Sequence[Mover], turning: Vector, end: Vector) -> Iterator[Vector]:
    """The velocity of the end of the chain by one symbol, in the axes of the start.

    Args:
        route: The chain.
        moving: The marks that depend on the symbol.
        turning: The angular velocity by the symbol.
        end: The end of the chain as seen from the start.

    Yields:
        The same vector, computed in many ways.
    """
    if route.is_long and len(moving) == 1 and moving[0].mark.is_turn:
        yield route.ledger.tape.vector(cross(turning, route.reach(moving[0].place)))
        return
    yield from route.ways(_levered(moving, route.lever))
    if route.is_long:
        return
    yield from route.ways(_levered(moving, lambda place: route.ahead(place, end)))
    yield from route.ways(_behind(route, moving))
    if len(moving) == 1 and moving[0].mark.is_turn:
        tape = route.ledger.tape
        place = moving[0].place
        yield tape.vector(cross(turning, route.reach(route.shortened(place, moving[0].mark.axis))))
        yield tape.vector(cross(turning, tape.vector(minus(end, route.point(place)))))


def moment(route: Route, moving: Sequence[Mover], turning: Vector) -> Iterator[Vector]:
    """The velocity by one symbol of the point of the end body that passes through the start, in the axes of the start.

    Args:
        route: The chain.
        moving: The marks that depend on the symbol.
        turning: The angular velocity by the symbol.

    Yields:
        The same vector, computed in several ways.
    """
    tape = route.ledger.tape
    if len(moving) == 1 and moving[0].mark.is_turn:
        place, axis = moving[0].place, moving[0].mark.axis
        for point in (route.shortened(place, axis), place, route.lowered(place, axis)):
            yield tape.vector(cross(route.point(point), turning))
            if route.is_long:
                return
    shifting = turned = NULL
    first = min((mover.place[0] for mover in moving), default=0)
    for level in range(max((mover.place[0] for mover in moving), default=0), -1, -1):
        for mover in moving:
            if mover.place[0] == level:
                shifting = tape.vector(total(shifting, _moment(route, mover)))
                turned = tape.vector(total(turned, mover.axis)) if mover.mark.is_turn else turned
        if level <= first:
            far = cross(route.point((level, 0)), turning)
            yield tape.vector(total(route.outwards(level, shifting), far))
        if level:
            shifting, turned = route.back(level, shifting), route.back(level, turned)
            shifting = tape.vector(total(shifting, cross(pieces(route.marked.levels[level - 1]), turned)))


def _moment(route: Route, mover: Mover) -> Vector:
    """The velocity that one mark gives the origin of its level."""
    level, index = mover.place
    return cross(pieces(route.marked.levels[level][:index]), mover.axis) if mover.mark.is_turn else mover.axis


def _levered(moving: Iterable[Mover], lever: Callable[[Place], Vector]) -> dict[int, Vector]:
    """The velocity as a sum of vectors in the axes of the levels where the marks stand."""
    return _sum((m.place[0], cross(m.axis, lever(m.place)) if m.mark.is_turn else m.axis) for m in moving)


def _behind(route: Route, moving: Iterable[Mover]) -> dict[int, Vector]:
    """The same, but what the next turn carries about the mark's own axis stays in the axes behind that turn.

    A lever that is short there, such as the tool of a wrist, gives a single column of the rotation.
    """
    parts: list[tuple[int, Vector]] = []
    for mover in moving:
        level, index = mover.place
        if not mover.mark.is_turn:
            parts.append((level, mover.axis))
        elif level < len(route.marked.turns) and cross(mover.axis, UNITS[route.marked.turns[level].axis]) == NULL:
            parts.append((level, cross(mover.axis, pieces(route.marked.levels[level][index:]))))
            parts.append((level + 1, cross(mover.axis, route.lever((level + 1, 0)))))
        else:
            parts.append((level, cross(mover.axis, route.lever(mover.place))))
    return _sum(parts)


def _sum(parts: Iterable[tuple[int, Vector]]) -> dict[int, Vector]:
    found: dict[int, Vector] = {}
    for level, vector in parts:
        if vector != NULL:
            found[level] = total(found.get(level, NULL), vector)
    return found


def _behind_attitude(vector: Vector, attitude: Attitude, sign: int) -> Vector:
    x, y, z = (sign * turn * vector[axis] for axis, turn in attitude)
    return x, y, z
