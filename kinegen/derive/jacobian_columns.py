"""Velocities of the end of a chain, one for each symbol that its elementary transforms depend on.

The same code serves joints and parameters: a turn about an axis gives the angular velocity of that axis and, at the
end, its vector product with the lever; a shift gives its direction. Every transform counts with its exact rate, so a
screw joint, a joint that others follow, and a length that stands in several rows need no case of their own.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import reduce
from itertools import pairwise

import sympy as sp

from kinegen.derive.annotated_chain import JointScrew, pieces
from kinegen.derive.folding import NULL, UNITS, AxisPermutation, Vector, cross, minus, scaled, total
from kinegen.derive.lever_arms import FrameVectors, Place
from kinegen.support.dataclass import dataclass


@dataclass(frozen=True, slots=True)
class ColumnTwist:
    """A velocity, or the derivative of a pose by one symbol.

    `linear`: of the end of the chain, or of a point of its body. `drawn`: where it was asked for and a single turn
    depends on the symbol, the vector product of both: the second derivative by the symbol.
    """

    linear: Vector
    angular: Vector
    drawn: Vector = NULL
    mark: JointScrew | None = None
    level: int = 0

    @property
    def entries(self) -> tuple[sp.Expr, ...]:
        """Linear, then angular."""
        return (*self.linear, *self.angular)

    def turned(self, attitude: AxisPermutation, sign: int) -> ColumnTwist:
        """In the axes behind a constant attitude, times a sign."""
        return ColumnTwist(
            _behind_attitude(self.linear, attitude, sign), _behind_attitude(self.angular, attitude, sign)
        )


@dataclass(frozen=True, slots=True)
class Generator:
    """A mark that depends on one symbol, and how fast it turns or moves with it."""

    place: Place
    mark: JointScrew
    rate: sp.Expr

    @property
    def axis(self) -> Vector:
        """The axis, as long as the rate."""
        return scaled(self.rate, self.mark.axis)


def movers(route: FrameVectors, symbol: int) -> tuple[Generator, ...]:
    """Return the marks that depend on a symbol, along the chain."""
    return tuple(
        Generator((level, index), item, item.rates[symbol])
        for level, items in enumerate(route.marked.levels)
        for index, item in enumerate(items)
        if isinstance(item, JointScrew) and item.rates[symbol] != 0
    )


def angular(route: FrameVectors, moving: Sequence[Generator]) -> Iterable[Vector]:
    """Return the angular velocity by one symbol, in the axes of the start, in several ways."""
    return route.ways(_sum((mover.place[0], mover.axis) for mover in moving if mover.mark.is_turn))


def linear(route: FrameVectors, moving: Sequence[Generator], turning: Vector, end: Vector) -> Iterator[Vector]:
    """Yield the velocity of the end of the chain by one symbol, in the axes of the start, in many ways."""
    bindings = route.cost_model.bindings
    if route.is_long and len(moving) == 1 and moving[0].mark.is_turn:
        yield bindings.vector(cross(turning, route.reach(moving[0].place)))
        return
    shifts = _sum((mover.place[0], mover.axis) for mover in moving if not mover.mark.is_turn)
    for runs in _runs(route, moving):
        yield from route.ways(_levered(runs, shifts, route.lever))
        if route.is_long:
            return
        yield from route.ways(_levered(runs, shifts, lambda place: route.ahead(place, end)))
        yield from route.ways(_behind(route, runs, shifts))
        if len(runs) == 1 and not shifts:
            run = runs[0]
            inner = route.start(run.place[0], run.inner)
            far = cross(turning, route.reach(route.shortened(run.place, run.axis)))
            yield bindings.vector(total(inner, far))
            yield bindings.vector(total(inner, cross(turning, bindings.vector(minus(end, route.point(run.place))))))


def drawn(route: FrameVectors, mover: Generator, motion: ColumnTwist, end: Vector) -> Iterator[Vector]:
    """Yield the second derivative of the end of the chain by the angle of one turn, in the axes of the start."""
    yield route.cost_model.bindings.vector(cross(motion.angular, motion.linear))
    if route.is_long:
        return
    level, index = mover.place
    for lever in (route.lever(mover.place), route.ahead(mover.place, end)):
        yield from route.ways(_sum([(level, cross(mover.axis, cross(mover.axis, lever)))]))
    if level < len(route.marked.turns) and cross(mover.axis, UNITS[route.marked.turns[level].axis]) == NULL:
        near, far = pieces(route.marked.levels[level][index:]), route.lever((level + 1, 0))
        parts = [(level + place, cross(mover.axis, cross(mover.axis, each))) for place, each in enumerate((near, far))]
        yield from route.ways(_sum(parts))


def moment(route: FrameVectors, moving: Sequence[Generator], turning: Vector) -> Iterator[Vector]:
    """Yield the velocity by one symbol of the point of the end body that passes through the start, in its axes."""
    if len(moving) == 1 and moving[0].mark.is_turn:
        bindings = route.cost_model.bindings
        place, axis = moving[0].place, moving[0].mark.axis
        for point in (route.shortened(place, axis), place, route.lowered(place, axis)):
            yield bindings.vector(cross(route.point(point), turning))
            if route.is_long:
                return
    yield from _added_up(route, moving, turning, _moment)
    if any(_is_alike(turns) for turns in _by_level(moving)):
        yield from _added_up(route, moving, turning, _moment_of_sums)


def _added_up(
    route: FrameVectors,
    moving: Sequence[Generator],
    turning: Vector,
    found: Callable[[FrameVectors, Sequence[Generator]], Vector],
) -> Iterator[Vector]:
    """Yield the moments of all levels, added up from the last one to the start."""
    bindings = route.cost_model.bindings
    shifting = turned = NULL
    first = min((mover.place[0] for mover in moving), default=0)
    for level in range(max((mover.place[0] for mover in moving), default=0), -1, -1):
        here = [mover for mover in moving if mover.place[0] == level]
        if here:
            shifting = bindings.vector(total(shifting, found(route, here)))
            turned = bindings.vector(total(turned, _axis([mover for mover in here if mover.mark.is_turn])))
        if level <= first:
            far = cross(route.point((level, 0)), turning)
            yield bindings.vector(total(route.outwards(level, shifting), far))
        if level:
            shifting, turned = route.back(level, shifting), route.back(level, turned)
            shifting = bindings.vector(total(shifting, cross(pieces(route.marked.levels[level - 1]), turned)))


def _moment(route: FrameVectors, here: Sequence[Generator]) -> Vector:
    """Return the velocity that the marks of a level give its origin, one by one, except where the turns cancel."""
    turns = [mover for mover in here if mover.mark.is_turn]
    if len(turns) > 1 and _axis(turns) == NULL:
        return _moment_of_sums(route, here)
    level = here[0].place[0]
    turned = (cross(pieces(route.marked.levels[level][: mover.place[1]]), mover.axis) for mover in turns)
    return reduce(total, (*turned, *(mover.axis for mover in here if not mover.mark.is_turn)), NULL)


def _moment_of_sums(route: FrameVectors, here: Sequence[Generator]) -> Vector:
    result = reduce(total, (mover.axis for mover in here if not mover.mark.is_turn), NULL)
    axis, end = NULL, here[-1].place
    for mover in reversed([mover for mover in here if mover.mark.is_turn]):
        result = total(result, cross(route.between(mover.place, end), axis))
        axis, end = total(axis, mover.axis), mover.place
    return total(result, cross(route.between((end[0], 0), end), axis)) if axis != NULL else result


def _axis(turns: Iterable[Generator]) -> Vector:
    """Return the angular velocity that turns of one level give what is behind them."""
    return reduce(total, (mover.axis for mover in turns), NULL)


def _by_level(moving: Iterable[Generator]) -> tuple[list[Generator], ...]:
    levels: dict[int, list[Generator]] = {}
    for mover in moving:
        if mover.mark.is_turn:
            levels.setdefault(mover.place[0], []).append(mover)
    return tuple(levels.values())


def _is_alike(turns: Sequence[Generator]) -> bool:
    """Tell whether turns of one level may be taken together or one by one; those that cancel are taken together."""
    return len(turns) > 1 and _axis(turns) != NULL


@dataclass(frozen=True, slots=True)
class _Run:
    """Turns of one level by one symbol, taken together.

    `place`: where the last of them is. `axis`: the sum of their axes, as long as the rates: the angular velocity that
    they give what is behind them. `inner`: the velocity that they give the last of them, in the axes of the level.
    """

    place: Place
    axis: Vector
    inner: Vector


def _runs(route: FrameVectors, moving: Sequence[Generator]) -> Iterator[tuple[_Run, ...]]:
    """Yield the turns by a symbol one by one, except where they cancel, and those of each level together."""
    levels = _by_level(moving)
    split = ([[mover] for mover in turns] if _is_alike(turns) else [turns] for turns in levels)
    yield tuple(_run(route, turns) for each in split for turns in each)
    if any(_is_alike(turns) for turns in levels):
        yield tuple(_run(route, turns) for turns in levels)


def _run(route: FrameVectors, turns: Sequence[Generator]) -> _Run:
    """Move each piece between two turns by the sum of the rates before it: no difference of levers is formed."""
    inner, axis = NULL, turns[0].axis
    for before, after in pairwise(turns):
        inner = total(inner, cross(axis, route.between(before.place, after.place)))
        axis = total(axis, after.axis)
    return _Run(turns[-1].place, axis, route.cost_model.bindings.vector(inner))


def _levered(runs: Iterable[_Run], shifts: Mapping[int, Vector], lever: Callable[[Place], Vector]) -> dict[int, Vector]:
    """Return the velocity as a sum of vectors in the axes of the levels where the marks stand."""
    turned = (
        (run.place[0], total(run.inner, cross(run.axis, lever(run.place)) if run.axis != NULL else NULL))
        for run in runs
    )
    return _sum((*turned, *shifts.items()))


def _behind(route: FrameVectors, runs: Iterable[_Run], shifts: Mapping[int, Vector]) -> dict[int, Vector]:
    """Return the same, but what the next turn carries about the mark's own axis stays in the axes behind that turn.

    A lever that is short there, such as the tool of a wrist, gives a single column of the rotation.
    """
    parts: list[tuple[int, Vector]] = list(shifts.items())
    for run in runs:
        level, index = run.place
        parts.append((level, run.inner))
        if run.axis == NULL:
            continue
        if level < len(route.marked.turns) and cross(run.axis, UNITS[route.marked.turns[level].axis]) == NULL:
            parts.append((level, cross(run.axis, pieces(route.marked.levels[level][index:]))))
            parts.append((level + 1, cross(run.axis, route.lever((level + 1, 0)))))
        else:
            parts.append((level, cross(run.axis, route.lever(run.place))))
    return _sum(parts)


def _sum(parts: Iterable[tuple[int, Vector]]) -> dict[int, Vector]:
    found: dict[int, Vector] = {}
    for level, vector in parts:
        if vector != NULL:
            found[level] = total(found.get(level, NULL), vector)
    return found


def _behind_attitude(vector: Vector, attitude: AxisPermutation, sign: int) -> Vector:
    x, y, z = (sign * turn * vector[axis] for axis, turn in attitude)
    return x, y, z
