"""A robot in one posture as points and lines in space: joints, links, frames, and the place of every move.

In: a robot and q. Out: a `Skeleton`, in the base frame and the file's length unit. Nothing here has a size on paper.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from kinegen.errors import KinegenError
from kinegen.pictures.moves import FloatArray, Move, moves_of
from kinegen.reference.chain import ORIGIN, parents
from kinegen.robot.model import TOOL, WRIST, Convention, JointType, Robot

_HUGE = 1e100
"""Beyond this, squares of coordinates overflow."""


@dataclass(frozen=True, slots=True, eq=False)
class Place:
    """A move with the frame in which it happens.

    Attributes:
        frame: Name of the frame that the move leads towards.
        number: Its place among the moves of that frame, from 0.
        move: The move.
        before: Shape (4, 4), `base_T` of the frame before the move.
    """

    frame: str
    number: int
    move: Move
    before: FloatArray

    @property
    def start(self) -> FloatArray:
        """Where the move happens."""
        return np.asarray(self.before[:3, 3])

    @property
    def axis(self) -> FloatArray:
        """The axis that it turns about or shifts along."""
        return np.asarray(self.before[:3, self.move.kind.axis])

    @property
    def end(self) -> FloatArray:
        """Where it leads."""
        return self.start if self.move.kind.is_rotation else self.start + self.move.value * self.axis


@dataclass(frozen=True, slots=True, eq=False)
class Joint:
    """A joint: its row, what it does, a point on its axis and the direction of that."""

    name: str
    type: JointType
    follows: bool
    point: FloatArray
    axis: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Link:
    """A straight part of a link, which belongs to the frame that it leads towards."""

    frame: str
    start: FloatArray
    end: FloatArray
    sliding: bool

    @property
    def length(self) -> float:
        """Its length."""
        return float(np.linalg.norm(self.end - self.start))


@dataclass(frozen=True, slots=True, eq=False)
class Skeleton:
    """One posture.

    Attributes:
        frames: `base_T_frame`, shape (4, 4), by name: root, rows, tool of a chain, named frames.
        joints: In the order of the table.
        links: Base outwards; parts without length are left out.
        places: Every move of base, rows and tool, in order.
        tips: Names of the frames at which the robot ends.
    """

    frames: dict[str, FloatArray]
    joints: tuple[Joint, ...]
    links: tuple[Link, ...]
    places: tuple[Place, ...]
    tips: tuple[str, ...]

    @property
    def points(self) -> FloatArray:
        """Every origin and every end of a link, shape (n, 3)."""
        ends = [end for link in self.links for end in (link.start, link.end)]
        return np.array([*(frame[:3, 3] for frame in self.frames.values()), *ends])


def make_skeleton(robot: Robot, q: FloatArray) -> Skeleton:
    """Place a robot.

    Args:
        robot: The robot.
        q: One joint vector, shape (dof,), radians and the file's length unit.

    Raises:
        KinegenError: If the posture is too large to be drawn.
    """
    moves, found = moves_of(robot, q), {robot.root: np.eye(4)}
    places: list[Place] = []
    with np.errstate(over="ignore", invalid="ignore"):
        for name, parent in parents(robot):
            matrix = found[parent]
            for number, move in enumerate(moves[name]):
                places.append(Place(name, number, move, matrix))
                matrix = matrix @ move.matrix()
            found[name] = matrix
    if not all(np.abs(matrix).max() < _HUGE for matrix in found.values()):
        raise KinegenError(f"{robot.name} is too large to be drawn with these joint values")
    hidden = {ORIGIN} | ({WRIST} - {frame.name for frame in robot.frames})
    carried = {ORIGIN, TOOL, *(row.name for row in robot.rows), *_ways_to_tips(robot)}
    return Skeleton(
        frames={name: matrix for name, matrix in found.items() if name not in hidden},
        joints=tuple(_joints(robot, places)),
        links=tuple(_links(robot, [place for place in places if place.frame in carried])),
        places=tuple(places),
        tips=robot.tips,
    )


def _ways_to_tips(robot: Robot) -> set[str]:
    """The named frames that a tip is on or reached by."""
    above = {frame.name: frame.parent for frame in robot.frames}
    found: set[str] = set()
    for name in robot.tips:
        while name in above:
            found.add(name)
            name = above[name]  # noqa: PLW2901 - the way down to the row
    return found


def _joints(robot: Robot, places: Iterable[Place]) -> Iterable[Joint]:
    """A joint is where the first move with a joint variable happens."""
    rows = {row.name: row for row in robot.rows}
    done: set[str] = set()
    for place in places:
        if place.frame not in rows or not place.move.moving or place.frame in done:
            continue
        done.add(place.frame)
        row = rows[place.frame]
        moves = JointType.REVOLUTE if place.move.kind.is_rotation else JointType.PRISMATIC
        kind = JointType.SCREW if row.type is JointType.SCREW else moves
        yield Joint(row.name, kind, row.type is JointType.FOLLOWER, place.start, place.axis)


def _links(robot: Robot, places: list[Place]) -> Iterable[Link]:
    """Straight parts; shifts that follow each other in a sequence are one part, as people mean an offset x, y, z."""
    tables = {row.name for row in robot.rows if row.convention is not Convention.ETS}
    open_link: Link | None = None
    for place in places:
        joins = open_link is not None and open_link.frame == place.frame and place.frame not in tables
        if open_link is not None and (place.move.kind.is_rotation or not joins or place.move.moving):
            yield from _kept(open_link)
            open_link = None
        if place.move.kind.is_rotation:
            continue
        start = open_link.start if open_link is not None else place.start
        open_link = Link(place.frame, start, place.end, place.move.moving)
        if place.move.moving:
            yield from _kept(open_link)
            open_link = None
    yield from () if open_link is None else _kept(open_link)


def _kept(link: Link) -> tuple[Link, ...]:
    return (link,) if link.length > 0 else ()
