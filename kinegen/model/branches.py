"""What a closed-form inverse is beside its numbers: its branches, its allowances, and the joints that come in line."""

from __future__ import annotations

from kinegen.support.dataclass import dataclass


@dataclass(frozen=True, slots=True)
class Allowance:
    """The greatest error of a length or an angle in each number type."""

    double: float
    single: float

    def of(self, is_single: bool) -> float:
        """That of a type."""
        return self.single if is_single else self.double


@dataclass(frozen=True, slots=True)
class InLine:
    """Two joints that turn about one line where the joint between them has some value, so that they share one angle.

    Attributes:
        first: Index of the joint before that one; of the two, the one that comes first in the joint vector.
        middle: Its own index.
        at: Its value, to which whole turns may be added.
        are_opposed: Whether the pose then sets the difference of both joints; else it sets their sum.
    """

    first: int
    middle: int
    last: int
    at: float
    near: Allowance
    are_opposed: bool


@dataclass(frozen=True, slots=True)
class OnAxis:
    """A joint is free where a point of the tool is on its axis.

    Solutions of other poses with that point there are the same whatever the joint is turned by in advance, so that
    `along` need not be asked.

    Attributes:
        point: The point, in the frame of the tool.
        near: How near to the axis it must be: a squared distance.
        along: The axis of the last joint in the frame of the tool, where that must be along the axis, too.
    """

    point: tuple[float, float, float]
    near: Allowance
    along: tuple[float, float, float] | None = None


@dataclass(frozen=True, slots=True)
class Parallel:
    """A joint is free where the joint before it has one of some values, so that its axis is parallel to others.

    Of the axes beside, `places` say that these are parallel.
    """

    places: tuple[InLine, ...]


@dataclass(frozen=True, slots=True)
class FreeEnd:
    """The first or the last joint, where a pose may leave it free; the others follow it.

    Attributes:
        is_first: Whether it is the first one, which moves the base frame; else the last one, which moves the tool.
        direction: Its axis, in the base frame, or in the frame of the tool: a unit vector.
        point: A point of the axis, likewise.
        rate: How far the axis is turned for one unit of the joint's variable, in radians.
        rest: Its value in the solutions of poses that leave it free, unless limits exclude that.
    """

    joint: int
    is_first: bool
    direction: tuple[float, float, float]
    point: tuple[float, float, float]
    rate: float
    rest: float
    where: OnAxis | Parallel


@dataclass(frozen=True, slots=True)
class Branches:
    """The branches of a closed-form inverse, and what it asks of a target.

    Attributes:
        family: What such arms are called.
        names: The branches, in the order of the results.
        meanings: What the words in their names mean; sentences.
        conditions: What a target must be, and what is chosen where there is a choice; sentences.
        turns: What a whole turn of each joint is in its variable; infinite for one that shifts.
        rooms: How far outside its limits each joint of a valid solution may be.
        rigid: How far the columns of a target may be from those of a rotation.
        reads_attitude: Whether the rotation of a target is read.
        redundancy: As in `Robot`.
        in_line: The joints that come in line, in the order of the chain.
        free_end: None where no pose leaves the first or last joint free.
    """

    family: str
    names: tuple[str, ...]
    meanings: tuple[str, ...]
    conditions: tuple[str, ...]
    turns: tuple[float, ...]
    rooms: tuple[Allowance, ...]
    rigid: Allowance
    reads_attitude: bool
    redundancy: str = ""
    in_line: tuple[InLine, ...] = ()
    free_end: FreeEnd | None = None

    @property
    def given(self) -> int:
        """Return how many numbers are given besides the target."""
        return len(self.redundancy.split(",")) if self.redundancy else 0
