"""Vectors along a folded chain, brought to the axes of its start in the way that costs least.

A vector that is short in the axes of one joint costs little if it stays there as long as others do the turning: it can
be turned back joint by joint, or be a sum of the columns of a rotation that other vectors need too.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import field

import sympy as sp

from kinegen.derive.annotated_chain import AnnotatedChain, JointScrew, pieces
from kinegen.derive.expressions import Definition, LetBindings, cost
from kinegen.derive.folding import NULL, UNITS, Vector, combined, cross, minus, rotate, scaled, total
from kinegen.derive.transforms import Turn
from kinegen.support.dataclass import dataclass


@dataclass(slots=True)
class CostModel:
    """A bindings, and which of its definitions are paid for because a result needs them.

    `bindings`: receives the intermediate values of every way that is tried, also of those that are not taken.
    """

    bindings: LetBindings = field(default_factory=LetBindings)
    _read: int = 0
    _prices: dict[sp.Symbol, int] = field(default_factory=dict)
    _needs: dict[sp.Symbol, tuple[sp.Symbol, ...]] = field(default_factory=dict)
    _bought: set[sp.Symbol] = field(default_factory=set)
    _results: list[Vector] = field(default_factory=list)

    def price(self, named: Vector) -> int:
        """Multiplications and additions that a vector of named values costs beyond what is paid for."""
        return sum(self._prices[symbol] for symbol in self._missing(named))

    def cheapest(self, ways: Iterable[Vector]) -> Vector:
        """Return the cheapest of several ways to compute the same; the first of equals."""
        return min(ways, key=self.price)

    def choose(self, ways: Iterable[Vector], instead_of: Vector | None = None) -> Vector:
        """Take the cheapest of several ways to compute a result, and pay for it.

        `instead_of`: the way that was taken before other results were known; it is given back and tried again.
        """
        if instead_of is not None:
            self.give_back(instead_of)
            ways = (instead_of, *ways)
        best = self.cheapest(ways)
        self._results.append(best)
        self._bought.update(self._missing(best))
        return best

    def give_back(self, result: Vector) -> None:
        """Take back a result; what only it needs is no longer paid for."""
        self._results.remove(result)
        self._bought.clear()
        for other in self._results:
            self._bought.update(self._missing(other))

    def live(self, entries: Iterable[sp.Expr]) -> tuple[Definition, ...]:
        """Return the definitions that some entries need, in order."""
        self._bought.clear()
        needed = set(self._missing(tuple(entries)))
        return tuple(definition for definition in self.bindings.definitions if definition[0] in needed)

    def _missing(self, expressions: tuple[sp.Expr, ...]) -> Iterator[sp.Symbol]:
        """Yield the definitions that the expressions need and nobody has paid for, each once."""
        for symbol, expression in self.bindings.definitions[self._read :]:
            self._prices[symbol] = cost((), (expression,))
            self._needs[symbol] = tuple(found for found in expression.free_symbols if found in self._prices)
        self._read = len(self.bindings.definitions)
        # What is paid for is passed over with all that it needs.
        pending = [symbol for expression in expressions for symbol in expression.free_symbols]
        seen: set[sp.Symbol] = set()
        while pending:
            symbol = pending.pop()
            if symbol in self._prices and symbol not in seen and symbol not in self._bought:
                seen.add(symbol)
                yield symbol
                pending += self._needs[symbol]


Parts = Mapping[int, Vector]
"""A sum of vectors, each in the axes of the level that is its key."""

_NEAR = 4
"""How many levels from either end of the way back are tried as the one from which columns take over."""

LONG = 30
"""Chains of more turns than this are not searched for the cheapest way: each vector has one way, by the columns of the
rotation. The search takes time with the third power of the length."""

Place = tuple[int, int]
"""A point of a marked chain: a level, and how many of its items stand before the point."""


@dataclass(slots=True)
class FrameVectors:
    """A marked chain and the values computed along it.

    `by_axes`: whether a vector along an axis may also be a multiple of that axis as seen from the start.
    """

    marked: AnnotatedChain
    cost_model: CostModel
    by_axes: bool = False
    _columns: dict[Place, Vector] = field(default_factory=dict)
    _levers: dict[Place, Vector] = field(default_factory=dict)
    _ways: dict[tuple[tuple[int, Vector], ...], tuple[Vector, ...]] = field(default_factory=dict)
    _reaches: dict[Place, Vector] = field(default_factory=dict)
    _points: dict[Place, Vector] = field(default_factory=dict)

    @property
    def is_long(self) -> bool:
        """Tell whether every vector has one way alone."""
        return len(self.marked.turns) > LONG

    def column(self, level: int, axis: int) -> Vector:
        """Return an axis of a level in the axes of the start: a column of the rotation by all turns before it."""
        if level == 0:
            return UNITS[axis]
        if (level, axis) not in self._columns:
            turn, before = self._merged(level)
            column = self.column(before, axis)
            if axis != turn.axis:
                sign = 1 if axis == (turn.axis + 1) % 3 else -1
                other = self.column(before, 3 - axis - turn.axis)
                column = total(scaled(sp.cos(turn.angle), column), scaled(sign * sp.sin(turn.angle), other))
            self._columns[level, axis] = self.cost_model.bindings.vector(column)
        return self._columns[level, axis]

    def _merged(self, level: int) -> tuple[Turn, int]:
        """Return the turn before a level, merged with those before it about its axis, and the level before them."""
        turn = self.marked.turns[level - 1]
        before = level - 1
        while before and self.marked.turns[before - 1].axis == turn.axis:
            before -= 1
            turn = Turn(turn.axis, self.marked.turns[before].angle + turn.angle)
        return turn, before

    def outwards(self, level: int, vector: Vector) -> Vector:
        """Return a vector of a level as a sum of the axes of that level."""
        return self.cost_model.bindings.vector(combined(vector, lambda axis: self.column(level, axis)))

    def back(self, level: int, vector: Vector) -> Vector:
        """Return a vector of a level in the axes of the level before."""
        turn = self.marked.turns[level - 1]
        return self.cost_model.bindings.vector(rotate(turn.axis, turn.angle, vector))

    def ways(self, parts: Parts) -> tuple[Vector, ...]:
        """Return a sum of vectors in the axes of the start: turned back to some level, and from there by columns."""
        key = tuple(sorted(parts.items(), key=lambda part: part[0]))
        if key not in self._ways:
            self._ways[key] = tuple(self._new_ways(parts))
        return self._ways[key]

    def _new_ways(self, parts: Parts) -> Iterator[Vector]:
        bindings = self.cost_model.bindings
        vector = NULL
        # Long chains: one way by columns, which takes linear time.
        if self.is_long:
            for level, part in sorted(parts.items()):
                vector = total(vector, self.outwards(level, part))
            yield bindings.vector(vector)
            return
        # Turned back to a level near either end, and from there by columns.
        top = max(parts, default=0)
        for level in range(top, -1, -1):
            if level in parts:
                vector = bindings.vector(total(vector, parts[level]))
            if level < _NEAR or level > top - _NEAR:
                below = {key: part for key, part in parts.items() if key < level}
                yield bindings.vector(total(self.outwards(level, vector), self.ways(below)[-1] if below else NULL))
            if level:
                vector = self.back(level, vector)
            if level == 1 and self.by_axes:
                yield from self._multiples(parts)

    def _multiples(self, parts: Parts) -> Iterator[Vector]:
        """Yield a vector along an axis of its level as a multiple of that axis, which others may need too."""
        entries = [(level, axis, part[axis]) for level, part in parts.items() for axis in range(3) if part[axis] != 0]
        if len(entries) == 1 and abs(entries[0][2]) != 1:
            level, axis, length = entries[0]
            for way in self.ways({level: UNITS[axis]}):
                yield self.cost_model.bindings.vector(scaled(length, way))

    def lever(self, place: Place) -> Vector:
        """From a point of the chain to its end, in the axes of the point's level."""
        level, index = place
        items = self.marked.levels[level]
        if place not in self._levers:
            if index < len(items):
                item = items[index]
                lever = self.lever((level, index + 1))
                if not isinstance(item, JointScrew):
                    lever = total(lever, item)
            elif level < len(self.marked.turns):
                lever = self.back(level + 1, self.lever((level + 1, 0)))
            else:
                lever = NULL
            self._levers[place] = self.cost_model.bindings.vector(lever)
        return self._levers[place]

    def between(self, start: Place, end: Place) -> Vector:
        """From one point of a level to another one."""
        return self.cost_model.bindings.vector(pieces(self.marked.levels[start[0]][start[1] : end[1]]))

    def shortened(self, place: Place, axis: Vector) -> Place:
        """Return the furthest point on a line through a point: pieces along the line are stepped over."""
        level, index = place
        items = self.marked.levels[level]
        if index < len(items):
            item = items[index]
            if isinstance(item, JointScrew) or cross(axis, item) == NULL:
                return self.shortened((level, index + 1), axis)
        elif level < len(self.marked.turns) and cross(axis, UNITS[self.marked.turns[level].axis]) == NULL:
            return self.shortened((level + 1, 0), axis)
        return place

    def lowered(self, place: Place, axis: Vector) -> Place:
        """Return the nearest point on a line through a point, the other way."""
        level, index = place
        if index:
            item = self.marked.levels[level][index - 1]
            if isinstance(item, JointScrew) or cross(axis, item) == NULL:
                return self.lowered((level, index - 1), axis)
        elif level and cross(axis, UNITS[self.marked.turns[level - 1].axis]) == NULL:
            return self.lowered((level - 1, len(self.marked.levels[level - 1])), axis)
        return place

    def start(self, level: int, vector: Vector) -> Vector:
        """Return a vector of a level in the axes of the start, as it is cheapest now."""
        return self.cost_model.cheapest(self.ways({level: vector}))

    def reach(self, place: Place) -> Vector:
        """From a point of the chain to its end, in the axes of the start, added up from the end."""
        if place not in self._reaches:
            level, index = place
            items = self.marked.levels[level]
            if index < len(items):
                item = items[index]
                reach = self.reach((level, index + 1))
                if not isinstance(item, JointScrew):
                    reach = self.cost_model.bindings.vector(total(reach, self.start(level, item)))
            else:
                reach = self.reach((level + 1, 0)) if level < len(self.marked.turns) else NULL
            self._reaches[place] = reach
        return self._reaches[place]

    def forget_reaches(self) -> None:
        """Let reaches be found anew, as they are cheapest beside what is computed by now."""
        self._reaches.clear()

    def positions(self) -> Iterator[Vector]:
        """Yield the end of the chain as seen from the start: turned back from some level, and from there by columns."""
        if self.is_long:
            for level in reversed(range(len(self.marked.turns) + 1)):
                self.reach((level, 0))  # in this order none waits for many others
            yield self.reach((0, 0))
            return
        yield self.lever((0, 0))
        for level in reversed(range(len(self.marked.turns))):
            near = self._turned_back(level, pieces(self.marked.levels[level]))
            yield self.cost_model.bindings.vector(total(near, self.reach((level + 1, 0))))
        yield self.reach((0, 0))

    def _turned_back(self, level: int, offset: Vector) -> Vector:
        """Return a point as seen from the start, from its offset in its level."""
        vector = self.cost_model.bindings.vector(offset)
        for before in reversed(range(level)):
            vector = total(self.back(before + 1, vector), pieces(self.marked.levels[before]))
            vector = self.cost_model.bindings.vector(vector)
        return vector

    def point(self, place: Place) -> Vector:
        """Return a point of the chain as seen from the start, as it was cheapest when it was first needed."""
        if place not in self._points:
            level, index = place
            offset = pieces(self.marked.levels[level][:index])
            ways = [] if self.is_long and level else [self._turned_back(level, offset)]
            if level:
                before = self.point((level - 1, len(self.marked.levels[level - 1])))
                ways.append(self.cost_model.bindings.vector(total(before, self.start(level, offset))))
            self._points[place] = self.cost_model.cheapest(ways)
        return self._points[place]

    def ahead(self, place: Place, end: Vector) -> Vector:
        """Return the lever of a point, found from the end as it is seen from the start."""
        level, index = place
        vector = end
        for passed in range(level):
            turn = self.marked.turns[passed]
            rest = minus(vector, pieces(self.marked.levels[passed]))
            vector = self.cost_model.bindings.vector(
                rotate(turn.axis, -turn.angle, self.cost_model.bindings.vector(rest))
            )
        return self.cost_model.bindings.vector(minus(vector, pieces(self.marked.levels[level][:index])))
