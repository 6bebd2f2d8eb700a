"""Vectors along a folded chain, brought to the axes of its start in several ways.

A vector that is short in the axes of one joint costs little if it stays there as long as others do the turning: it can
be turned back joint by joint, or be a sum of the columns of a rotation that other vectors need too.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import sympy as sp

from kinegen.symbolic.fold import NULL, Vector, rotate, total
from kinegen.symbolic.ledger import Ledger
from kinegen.symbolic.marks import Mark, Marked, pieces
from kinegen.symbolic.pose import UNITS

Parts = Mapping[int, Vector]
"""A sum of vectors, each in the axes of the level that is its key."""

_NEAR = 4
"""How many levels from either end of the way back are tried as the one from which columns take over."""

LONG = 30
"""Chains of more turns than this are not searched for the cheapest way: each vector has one way, by the columns of the
rotation. The search takes time with the third power of the length."""

Place = tuple[int, int]
"""A point of a marked chain: a level, and how many of its items stand before the point."""


def cross(a: Vector, b: Vector) -> Vector:
    """The vector product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def scaled(factor: sp.Expr, vector: Vector) -> Vector:
    """A multiple of a vector."""
    return factor * vector[0], factor * vector[1], factor * vector[2]


def minus(a: Vector, b: Vector) -> Vector:
    """The difference of two vectors."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@dataclass(slots=True)
class Route:
    """A marked chain and the values computed along it.

    Attributes:
        marked: The chain.
        ledger: Knows what is computed already.
    """

    marked: Marked
    ledger: Ledger
    _columns: dict[Place, Vector] = field(default_factory=dict)
    _levers: dict[Place, Vector] = field(default_factory=dict)
    _ways: dict[tuple[tuple[int, Vector], ...], tuple[Vector, ...]] = field(default_factory=dict)
    _reaches: dict[Place, Vector] = field(default_factory=dict)
    _points: dict[Place, Vector] = field(default_factory=dict)

    @property
    def is_long(self) -> bool:
        """Whether every vector has one way alone."""
        return len(self.marked.turns) > LONG

    def column(self, level: int, axis: int) -> Vector:
        """An axis of a level in the axes of the start: a column of the rotation by all turns before it."""
        if level == 0:
            return UNITS[axis]
        if (level, axis) not in self._columns:
            turn = self.marked.turns[level - 1]
            column = self.column(level - 1, axis)
            if axis != turn.axis:
                sign = 1 if axis == (turn.axis + 1) % 3 else -1
                other = self.column(level - 1, 3 - axis - turn.axis)
                column = total(scaled(sp.cos(turn.angle), column), scaled(sign * sp.sin(turn.angle), other))
            self._columns[level, axis] = self.ledger.tape.vector(column)
        return self._columns[level, axis]

    def outwards(self, level: int, vector: Vector) -> Vector:
        """A vector of a level as a sum of the axes of that level."""
        result = NULL
        for axis in range(3):
            if vector[axis] != 0:
                result = total(result, scaled(vector[axis], self.column(level, axis)))
        return self.ledger.tape.vector(result)

    def back(self, level: int, vector: Vector) -> Vector:
        """A vector of a level in the axes of the level before."""
        turn = self.marked.turns[level - 1]
        return self.ledger.tape.vector(rotate(turn.axis, turn.angle, vector))

    def ways(self, parts: Parts) -> tuple[Vector, ...]:
        """A sum of vectors in the axes of the start: turned back to some level, and from there by columns."""
        key = tuple(sorted(parts.items(), key=lambda part: part[0]))
        if key not in self._ways:
            self._ways[key] = tuple(self._new_ways(parts))
        return self._ways[key]

    def _new_ways(self, parts: Parts) -> Iterator[Vector]:
        tape = self.ledger.tape
        vector = NULL
        if self.is_long:
            for level, part in sorted(parts.items()):
                vector = total(vector, self.outwards(level, part))
            yield tape.vector(vector)
            return
        top = max(parts, default=0)
        for level in range(top, -1, -1):
            if level in parts:
                vector = tape.vector(total(vector, parts[level]))
            if level < _NEAR or level > top - _NEAR:
                below = {key: part for key, part in parts.items() if key < level}
                yield tape.vector(total(self.outwards(level, vector), self.ways(below)[-1] if below else NULL))
            if level:
                vector = self.back(level, vector)

    def lever(self, place: Place) -> Vector:
        """From a point of the chain to its end, in the axes of the point's level."""
        level, index = place
        items = self.marked.levels[level]
        if place not in self._levers:
            if index < len(items):
                item = items[index]
                lever = self.lever((level, index + 1))
                if not isinstance(item, Mark):
                    lever = total(lever, item)
            elif level < len(self.marked.turns):
                lever = self.back(level + 1, self.lever((level + 1, 0)))
            else:
                lever = NULL
            self._levers[place] = self.ledger.tape.vector(lever)
        return self._levers[place]

    def shortened(self, place: Place, axis: Vector) -> Place:
        """The furthest point on a line through a point: pieces along the line are stepped over."""
        level, index = place
        items = self.marked.levels[level]
        if index < len(items):
            item = items[index]
            if isinstance(item, Mark) or cross(axis, item) == NULL:
                return self.shortened((level, index + 1), axis)
        elif level < len(self.marked.turns) and cross(axis, UNITS[self.marked.turns[level].axis]) == NULL:
            return self.shortened((level + 1, 0), axis)
        return place

    def lowered(self, place: Place, axis: Vector) -> Place:
        """The nearest point on a line through a point, the other way."""
        level, index = place
        if index:
            item = self.marked.levels[level][index - 1]
            if isinstance(item, Mark) or cross(axis, item) == NULL:
                return self.lowered((level, index - 1), axis)
        elif level and cross(axis, UNITS[self.marked.turns[level - 1].axis]) == NULL:
            return self.lowered((level - 1, len(self.marked.levels[level - 1])), axis)
        return place

    def start(self, level: int, vector: Vector) -> Vector:
        """A vector of a level in the axes of the start, as it is cheapest now."""
        return self.ledger.cheapest(self.ways({level: vector}))

    def reach(self, place: Place) -> Vector:
        """From a point of the chain to its end, in the axes of the start, added up from the end."""
        if place not in self._reaches:
            level, index = place
            items = self.marked.levels[level]
            if index < len(items):
                item = items[index]
                reach = self.reach((level, index + 1))
                if not isinstance(item, Mark):
                    reach = self.ledger.tape.vector(total(reach, self.start(level, item)))
            else:
                reach = self.reach((level + 1, 0)) if level < len(self.marked.turns) else NULL
            self._reaches[place] = reach
        return self._reaches[place]

    def positions(self) -> Iterator[Vector]:
        """The end of the chain as seen from the start: turned back from some level, and from there by columns."""
        if self.is_long:
            for level in reversed(range(len(self.marked.turns) + 1)):
                self.reach((level, 0))  # in this order none waits for many others
            yield self.reach((0, 0))
            return
        yield self.lever((0, 0))
        for level in reversed(range(len(self.marked.turns))):
            near = self._turned_back(level, pieces(self.marked.levels[level]))
            yield self.ledger.tape.vector(total(near, self.reach((level + 1, 0))))
        yield self.reach((0, 0))

    def _turned_back(self, level: int, offset: Vector) -> Vector:
        """A point as seen from the start, from its offset in its level."""
        vector = self.ledger.tape.vector(offset)
        for before in reversed(range(level)):
            vector = total(self.back(before + 1, vector), pieces(self.marked.levels[before]))
            vector = self.ledger.tape.vector(vector)
        return vector

    def point(self, place: Place) -> Vector:
        """A point of the chain as seen from the start, as it was cheapest when it was first needed."""
        if place not in self._points:
            level, index = place
            offset = pieces(self.marked.levels[level][:index])
            ways = [] if self.is_long and level else [self._turned_back(level, offset)]
            if level:
                before = self.point((level - 1, len(self.marked.levels[level - 1])))
                ways.append(self.ledger.tape.vector(total(before, self.start(level, offset))))
            self._points[place] = self.ledger.cheapest(ways)
        return self._points[place]

    def ahead(self, place: Place, end: Vector) -> Vector:
        """The lever of a point, found from the end as it is seen from the start."""
        level, index = place
        vector = end
        for passed in range(level):
            turn = self.marked.turns[passed]
            rest = minus(vector, pieces(self.marked.levels[passed]))
            vector = self.ledger.tape.vector(rotate(turn.axis, -turn.angle, self.ledger.tape.vector(rest)))
        return self.ledger.tape.vector(minus(vector, pieces(self.marked.levels[level][:index])))
