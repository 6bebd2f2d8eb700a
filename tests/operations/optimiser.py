"""Another search for few operations, which shares nothing with the compiler: values are numbers modulo a prime.

Every sine and cosine is a random point of the unit circle over a finite field, every length and joint variable a random
number. Two formulas that give the same number there are the same formula, but for a chance of 1 in 10^17. So operations
are counted by their results, up to sign, and one that gives what is known already costs nothing. The ways that are
tried: every association of the product of rotations, the third column or row as a cross product, and every place from
which a lever is turned by columns and not joint by joint. Axes that are parallel are merged first.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import cache, reduce
from itertools import groupby

from tests.operations.chain import Angle, Folded, Mark, Piece
from tests.operations.field import Number, Vector, cosine_sine, number

PAIR = 30
"""What a sine and cosine cost, in operations."""

MOST_FACTORS = 8
"""Rotations in a product of which every association is tried: 429 of them."""

ZERO = Number(0, is_constant=True)
ONE = Number(1, is_constant=True)
NULL: Vector = (ZERO, ZERO, ZERO)
Entries = Callable[[int, int], Number]
"""A matrix that computes an entry when it is asked for."""


class Account:
    """What has been computed from what, and what it cost."""

    def __init__(self, other: Account | None = None) -> None:
        self.known: dict[int, tuple[int, ...]] = dict(other.known) if other else {}
        self.pairs: dict[int, Angle] = dict(other.pairs) if other else {}

    @property
    def cost(self) -> int:
        """Operations of all that is known, with each pair of sine and cosine as so many."""
        return len(self.known) - len(self.pairs) + PAIR * len(set(self.pairs.values()))

    def cost_of(self, outputs: Iterable[Number]) -> int:
        """Operations of what some outputs need."""
        todo = [output.size for output in outputs]
        needed: set[int] = set()
        while todo:
            size = todo.pop()
            if size in self.known and size not in needed:
                needed.add(size)
                todo += self.known[size]
        angles = {self.pairs[size] for size in needed if size in self.pairs}
        return sum(size not in self.pairs for size in needed) + PAIR * len(angles)

    def times(self, a: Number, b: Number) -> Number:
        """A product, which is free if a factor is 0, 1 or -1."""
        return a * b if a.is_unit or b.is_unit else self._pay(a * b, a, b)

    def plus(self, a: Number, b: Number) -> Number:
        """A sum, which is free if a term is 0."""
        return a + b if not a.value or not b.value else self._pay(a + b, a, b)

    def _pay(self, found: Number, a: Number, b: Number) -> Number:
        if not found.is_constant and found.value and found.size not in self.known:
            self.known[found.size] = (a.size, b.size)
        return found

    def total(self, terms: Sequence[Number]) -> Number:
        """A sum from the left, constants first."""
        result = ZERO
        for term in sorted(terms, key=lambda each: not each.is_constant):
            result = self.plus(result, term)
        return result

    def pair(self, angle: Angle) -> tuple[Number, Number]:
        """The cosine and sine of an angle, whose sum is made first."""
        if not angle.joints:
            return cosine_sine(angle)
        sine_sign = angle.joints[0][1]
        angle = angle.times(sine_sign)
        cosine, sine = cosine_sine(angle)
        found = self.total([*(number(f"q{joint}").times(sign) for joint, sign in angle.joints), angle.offset])
        for each in (cosine, sine):
            if each.size not in self.known:
                self.known[each.size] = (found.size,)
                self.pairs[each.size] = angle
        return cosine, sine.times(sine_sign)

    def rotated(self, axis: int, angle: Angle, vector: Vector) -> Vector:
        """A vector turned about an axis."""
        c, s = self.pair(angle) if any(vector[each].value for each in range(3) if each != axis) else (ONE, ZERO)
        i, j = (axis + 1) % 3, (axis + 2) % 3
        found = list(vector)
        found[i] = self.plus(self.times(c, vector[i]), -self.times(s, vector[j]))
        found[j] = self.plus(self.times(s, vector[i]), self.times(c, vector[j]))
        return found[0], found[1], found[2]

    def turned(self, item: Piece | Mark) -> Vector:
        """The vector of an item in the axes of its level."""
        vector = item.vector
        for axis, angle in item.turns:
            vector = self.rotated(axis, angle, vector)
        return vector

    def sum(self, *vectors: Vector) -> Vector:
        """A sum of vectors."""
        x, y, z = (self.total([vector[axis] for vector in vectors]) for axis in range(3))
        return x, y, z

    def cross(self, a: Vector, b: Vector) -> Vector:
        """The cross product."""
        x, y, z = (
            self.plus(self.times(a[(i + 1) % 3], b[(i + 2) % 3]), -self.times(a[(i + 2) % 3], b[(i + 1) % 3]))
            for i in range(3)
        )
        return x, y, z

    def scaled(self, factor: Number, vector: Vector) -> Vector:
        """A vector times a number."""
        x, y, z = (self.times(factor, entry) for entry in vector)
        return x, y, z

    def applied(self, matrix: Entries, vector: Vector) -> Vector:
        """A matrix times a vector."""
        x, y, z = (
            self.total([self.times(matrix(i, j), vector[j]) for j in range(3) if vector[j].value]) for i in range(3)
        )
        return x, y, z


Tree = int | tuple["Tree", "Tree"]


@cache
def trees(factors: tuple[Tree, ...]) -> tuple[Tree, ...]:
    """Every association of a product of factors."""
    if len(factors) == 1:
        return factors
    return tuple(
        (left, right)
        for middle in range(1, len(factors))
        for left in trees(factors[:middle])
        for right in trees(factors[middle:])
    )


def factors_of(folded: Folded) -> tuple[Tree, ...]:
    """The turns; where they are many, those of one mount are one factor: each more makes four times as many trees."""
    places = range(len(folded.turns))
    if len(places) <= MOST_FACTORS:
        return tuple(places)
    runs = groupby(places, key=lambda place: -1 if not folded.turns[place][1].joints else place)
    return tuple(reduce(lambda left, right: (left, right), run) for _, run in runs)


def _span(tree: Tree) -> tuple[int, int]:
    if isinstance(tree, int):
        return tree, tree + 1
    return _span(tree[0])[0], _span(tree[1])[1]


@dataclass
class Rotations:
    """Products of turns, of which entries are computed when they are needed."""

    account: Account
    folded: Folded
    nodes: dict[tuple[int, int], Entries] = field(default_factory=dict)

    def of(self, tree: Tree) -> Entries:
        """The product of the factors of a tree."""
        span = _span(tree)
        if span not in self.nodes:
            self.nodes[span] = self._turn(tree) if isinstance(tree, int) else self._product(*map(self.of, tree))
        return self.nodes[span]

    def prefix(self, length: int) -> Entries:
        """The product of the first turns, one after the other unless a tree has it."""
        if not length:
            return lambda i, j: ONE if i == j else ZERO
        if (0, length) not in self.nodes:
            last = self.of(length - 1)
            self.nodes[0, length] = last if length == 1 else self._product(self.prefix(length - 1), last)
        return self.nodes[0, length]

    def _turn(self, place: int) -> Entries:
        axis, angle = self.folded.turns[place]
        units = [tuple(ONE if row == column else ZERO for row in range(3)) for column in range(3)]

        @cache
        def entry(i: int, j: int) -> Number:
            x, y, z = units[j]
            return self.account.rotated(axis, angle, (x, y, z))[i]

        return entry

    def _product(self, left: Entries, right: Entries) -> Entries:
        account = self.account

        @cache
        def entry(i: int, j: int) -> Number:
            middle = [k for k in range(3) if left(i, k).value and right(k, j).value]
            return account.total([account.times(left(i, k), right(k, j)) for k in middle])

        return entry


def lever(account: Account, folded: Folded, level: int) -> Vector:
    """From the start of a level to the end, in its axes, turned back joint by joint."""
    vector = NULL
    for place in range(len(folded.turns), level - 1, -1):
        if place < len(folded.turns):
            vector = account.rotated(*folded.turns[place], vector)
        vector = account.sum(*folded.sums(account, place), vector)
    return vector


def position_by(account: Account, rotations: Rotations, split: int) -> None:
    """The position: the lever of a level by columns, and what stands before it turned back joint by joint."""
    folded = rotations.folded
    far = lever(account, folded, split)
    if not split:
        return
    near = NULL
    for place in range(split - 1, -1, -1):
        near = account.sum(*folded.sums(account, place), near)
        if place:
            near = account.rotated(*folded.turns[place - 1], near)
    account.sum(near, account.applied(rotations.prefix(split), far))


def position_cost(folded: Folded) -> int:
    """The least cost of a position."""
    costs = []
    for split in range(len(folded.turns) + 1):
        account = Account()
        position_by(account, Rotations(account, folded), split)
        costs.append(account.cost)
    return min(costs)


def _orientation(rotations: Rotations, tree: Tree, variant: tuple[str, int]) -> None:
    """All entries of the rotation; a third column or row by a cross product."""
    account, root = rotations.account, rotations.of(tree)
    kind, left_out = variant
    kept = [each for each in range(3) if each != left_out]
    if kind == "row":
        rows = {i: (root(i, 0), root(i, 1), root(i, 2)) for i in kept}
        account.cross(rows[kept[0]], rows[kept[1]])
    else:
        columns = {j: (root(0, j), root(1, j), root(2, j)) for j in kept}
        if kind == "column":
            account.cross(columns[kept[0]], columns[kept[1]])


VARIANTS = (("all", -1), *((kind, place) for kind in ("row", "column") for place in range(3)))


def pose_cost(folded: Folded) -> int:
    """The least cost of a pose."""
    if not folded.turns:
        return position_cost(folded)
    found = []
    for tree in trees(factors_of(folded)):
        for variant in VARIANTS:
            account = Account()
            _orientation(Rotations(account, folded), tree, variant)
            found.append((account.cost, tree, variant))
    found.sort(key=lambda each: each[0])
    costs = []
    for _, tree, variant in found[:12]:
        for split in range(len(folded.turns) + 1):
            account = Account()
            rotations = Rotations(account, folded)
            _orientation(rotations, tree, variant)
            position_by(account, rotations, split)
            costs.append(account.cost)
    return min(costs)
