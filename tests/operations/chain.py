"""The chain of a table with parallel axes merged."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from tests.operations.field import Number, Vector, length, number
from tests.operations.tables import Mount, Row, Table

if TYPE_CHECKING:
    from tests.operations.optimiser import Account


@dataclass(frozen=True)
class Angle:
    """A sum of joint variables with signs, and an angle in degrees."""

    joints: tuple[tuple[int, int], ...] = ()
    degrees: float = 0.0

    def plus(self, other: Angle) -> Angle:
        """The sum; every joint stands in one of them alone."""
        return Angle(tuple(sorted((*self.joints, *other.joints))), (self.degrees + other.degrees) % 360)

    def times(self, sign: int) -> Angle:
        """The same or its negative."""
        return Angle(tuple((joint, sign * each) for joint, each in self.joints), sign * self.degrees % 360)

    @property
    def offset(self) -> Number:
        """The angle in degrees as a term of a sum."""
        return length(f"{self.degrees}") if self.degrees else Number(0, is_constant=True)


Turns = tuple[tuple[int, Angle], ...]
"""Rotations of a vector, the first one that is applied first."""


@dataclass(frozen=True)
class Piece:
    """A translation."""

    vector: Vector
    turns: Turns = ()


@dataclass(frozen=True)
class Mark:
    """Where a joint turns or moves what follows, about or along which axis."""

    joint: int
    is_turning: bool
    vector: Vector
    turns: Turns = ()


@dataclass
class Folded:
    """A chain: levels, and a turn between each two of them."""

    levels: list[list[Piece | Mark]] = field(default_factory=lambda: [[]])
    turns: list[tuple[int, Angle]] = field(default_factory=list)
    attitude: list[tuple[int, int]] = field(default_factory=lambda: [(0, 1), (1, 1), (2, 1)])

    def shift(self, axis: int, size: Number, joint: int | None, sign: int) -> None:
        """A translation along an axis, after a mark if it is a joint's."""
        place, direction = self.attitude[axis]
        if joint is not None:
            self.levels[-1].append(
                Mark(joint, False, _along(place, Number(1, is_constant=True).times(direction * sign)))
            )
            self.levels[-1].append(Piece(_along(place, number(f"q{joint}").times(direction * sign))))
        if size.value:
            self.levels[-1].append(Piece(_along(place, size.times(direction))))

    def turn(self, axis: int, angle: Angle) -> None:
        """A rotation about an axis, after a mark if it is a joint's."""
        place, direction = self.attitude[axis]
        angle = angle.times(direction)
        if not angle.joints and not angle.degrees:
            return
        merged = bool(self.turns) and self.turns[-1][0] == place
        if merged:
            self._retreat(self.turns[-1])
        for joint, sign in angle.joints:
            self.levels[-1].append(Mark(joint, True, _along(place, Number(1, is_constant=True).times(sign))))
        if merged:
            angle = self.turns.pop()[1].plus(angle)
        if not angle.joints and angle.degrees % 90 == 0:
            self._quarters(place, round(angle.degrees / 90) % 4)
            return
        if angle.degrees % 90 == 0:
            self._quarters(place, round(angle.degrees / 90) % 4)
            angle = Angle(angle.joints)
        self.turns.append((place, angle))
        self.levels.append([])

    def _retreat(self, last: tuple[int, Angle]) -> None:
        for item in self.levels.pop():
            vector = item.vector
            along = all(not vector[axis].value for axis in range(3) if axis != last[0])
            turns = item.turns if along and not item.turns else (*item.turns, last)
            moved = (
                Piece(vector, turns) if isinstance(item, Piece) else Mark(item.joint, item.is_turning, vector, turns)
            )
            self.levels[-1].append(moved)

    def _quarters(self, axis: int, count: int) -> None:
        i, j = (axis + 1) % 3, (axis + 2) % 3
        for _ in range(count):
            image = {axis: (axis, 1), i: (j, 1), j: (i, -1)}
            self.attitude = [(image[to][0], sign * image[to][1]) for to, sign in self.attitude]

    def sums(self, account: Account, level: int, first: int = 0, end: int | None = None) -> Iterator[Vector]:
        """The translations of a level between two items; those that are turned alike are added first."""
        alike: dict[Turns, list[Vector]] = {}
        for item in self.levels[level][first:end]:
            if isinstance(item, Piece):
                alike.setdefault(item.turns, []).append(item.vector)
        for turns, vectors in alike.items():
            yield account.turned(Piece(account.sum(*vectors), turns))


def _along(axis: int, size: Number) -> Vector:
    x, y, z = (size if place == axis else Number(0, is_constant=True) for place in range(3))
    return x, y, z


def folded(table: Table) -> Folded:
    """The chain of a table: Rz Tz Tx Rx for each row of a standard one, Rx Tx Rz Tz for each of a modified one."""
    chain = Folded()
    joint = -1
    for row in table.rows:
        if isinstance(row, Mount):
            for axis, size in enumerate(row.xyz):
                chain.shift(axis, length(size), None, 1)
            for axis, angle in row.turns:
                chain.turn(axis, Angle((), float(angle) % 360))
            continue
        joint += 1
        if table.convention == "standard":
            _about_z(chain, joint, row)
            chain.shift(0, length(row.a), None, 1)
            chain.turn(0, Angle((), float(row.alpha) % 360))
        else:
            chain.turn(0, Angle((), float(row.alpha) % 360))
            chain.shift(0, length(row.a), None, 1)
            _about_z(chain, joint, row)
    for axis, size in enumerate(table.tool):
        chain.shift(axis, length(size), None, 1)
    return chain


def _about_z(chain: Folded, joint: int, row: Row) -> None:
    chain.turn(2, Angle(((joint, row.sign),) if row.is_turning else (), float(row.theta) % 360))
    chain.shift(2, length(row.d), None if row.is_turning else joint, row.sign)
