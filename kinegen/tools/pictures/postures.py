"""Selects the posture that a robot is shown in, and places its joints, links and frames in space.

Coordinates are floats in the base frame, in radians and the file's length unit; nothing has a size on paper. Where
actuators drive the joints, the posture and its ranges are read off actuator vectors on a grid, so that what is shown is
something that the actuators can do.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from kinegen.errors import KinegenError
from kinegen.model.actuator_limits import reading_box, reading_ranges
from kinegen.model.expression_parser import evaluate, names
from kinegen.model.expression_values import FLOAT64
from kinegen.model.joint_bounds import joint_box, parameter_values, reach
from kinegen.model.robot import TOOL, WRIST, Convention, JointType, Robot, StepKind
from kinegen.model.row_transforms import ElementaryTransform, row_transforms, step_transforms
from kinegen.support.dataclass import dataclass
from kinegen.verify.reference import frames
from kinegen.verify.reference.actuators import Actuation, readings
from kinegen.verify.reference.chain import ORIGIN, parents

FloatArray = NDArray[np.float64]
Range = tuple[float, float]

_LEVELS = (7, 3)
_MOST = 20_000
_SAMPLES = 4_000
"""Values of each reading, the middle among them; the largest grid, and how many vectors are tried of a larger one."""

_ENOUGH = 0.25
"""How far above the ground an arm should be that is shown, as a share of its reach."""

_ROUNDING = 1e-9
"""Share of a range or of the reach that counts as nothing."""


def home(robot: Robot) -> FloatArray:
    """Return the posture that is drawn if none is given, (dof,), with runtime parameters as in the file.

    It is zero for every joint, or the limit next to zero where zero is outside the limits. Where no actuator vector
    within its ranges leads there, it is that of the vector next to the middle that keeps every frame that moves a
    quarter of the reach above the plane z = 0 of the base, or as far above it as any.
    """
    return _start(robot)[0].copy()


def home_readings(robot: Robot) -> FloatArray:
    """Return the actuator vector of that posture: radians, the file's length unit, or bare numbers."""
    return _start(robot)[1].copy()


@lru_cache(maxsize=8)
def _start(robot: Robot) -> tuple[FloatArray, FloatArray]:
    """The posture at first, and the actuator vector that leads to it; of a robot without actuators an empty one."""
    zero = np.array([min(max(0.0, low), high) for low, high in joint_box(robot)])
    if not robot.actuators.readings:
        return zero, np.zeros(0)
    found = _readings(robot, zero)
    if found is not None:
        return zero, found
    # Zero is out of reach of the actuators: a vector near their middle, with the arm off the ground.
    vectors, joints = _driven(robot)
    box = np.array(reading_box(robot))
    if not len(vectors):
        return zero, np.asarray(box.mean(axis=1), dtype=np.float64)
    width = np.where(box[:, 1] > box[:, 0], box[:, 1] - box[:, 0], 1.0)
    off_middle = np.abs((vectors - box.mean(axis=1)) / width).sum(axis=1)
    best = np.lexsort((off_middle, -_clearance(robot, joints)))[0]
    return joints[best], vectors[best]


def _clearance(robot: Robot, joints: FloatArray) -> FloatArray:
    """Return the height of the lowest frame that moves, as a share of the reach; 0.25 is enough."""
    heights = np.stack([matrices[:, 2, 3] for matrices in frames(robot, joints).values()]) / reach(robot)
    moves = np.ptp(heights, axis=1) > _ROUNDING
    return np.asarray(np.minimum(heights[moves].min(axis=0, initial=_ENOUGH).round(9), _ENOUGH), dtype=np.float64)


def joint_ranges(robot: Robot) -> tuple[Range, ...]:
    """Return a lower and an upper bound for each joint variable, with runtime parameters as in the file.

    Bounds are limits; without them what its actuators reach on the grid, ends of their ranges included; without those
    the box of `joint_box`.
    """
    boxes = joint_box(robot)
    # Readings without bounds take their joints anywhere; the grid then is only a part of that.
    if not robot.actuators.readings or not np.isfinite(reading_ranges(robot)).all():
        return boxes
    _, joints = _driven(robot)
    if not len(joints):
        return boxes
    ends = [(low, high) for low, high in np.stack([joints.min(axis=0), joints.max(axis=0)], axis=1).tolist()]
    return tuple(
        box if each.limits is not None else found for each, box, found in zip(robot.variables, boxes, ends, strict=True)
    )


@lru_cache(maxsize=8)
def _driven(robot: Robot) -> tuple[FloatArray, FloatArray]:
    """Actuator vectors on a grid, and the joint vectors that they lead to, where linkages close and limits are kept."""
    vectors = _vectors(np.array(reading_box(robot)))
    joints = np.asarray(Actuation(robot, vectors).joints, dtype=np.float64)
    box = np.array(joint_box(robot))
    free = [each.limits is None for each in robot.variables]
    kept = np.isfinite(joints).all(axis=1) & (free | ((joints >= box[:, 0]) & (joints <= box[:, 1]))).all(axis=1)
    return vectors[kept], joints[kept]


def _vectors(box: FloatArray) -> FloatArray:
    """A grid over a box; of a grid that is too large, the middle and some of its vectors, the same ones each time."""
    for count in _LEVELS:
        if count ** len(box) <= _MOST:
            return np.array(list(itertools.product(*(np.linspace(low, high, count) for low, high in box))))
    shares = np.random.default_rng(0).integers(0, 3, (_SAMPLES, len(box))) / 2
    shares[0] = 0.5
    return np.asarray(box[:, 0] + shares * (box[:, 1] - box[:, 0]), dtype=np.float64)


def _readings(robot: Robot, joints: FloatArray) -> FloatArray | None:
    """Return the actuator vector that leads to some joints; None if there is none within its ranges."""
    try:
        found = np.asarray(readings(robot, [joints.tolist()]), dtype=np.float64)[0]
    except (KinegenError, ValueError, ZeroDivisionError, TypeError):
        # A linkage that cannot close: the search fails, or its root is complex.
        return None
    ranges = np.array(reading_ranges(robot))
    slack = _ROUNDING * np.where(np.isfinite(ranges), np.abs(ranges), 0.0).max(axis=1)
    if not ((found >= ranges[:, 0] - slack) & (found <= ranges[:, 1] + slack)).all():
        return None
    there = np.asarray(Actuation(robot, found).joints, dtype=np.float64)[0]
    return found if np.allclose(there, joints, rtol=0.0, atol=1e-6 * max(1.0, reach(robot))) else None


@dataclass(frozen=True, slots=True)
class Move:
    """One elementary transform, by radians or the file's length unit; a step of a sequence has no entry."""

    kind: StepKind
    entry: str
    value: float
    moving: bool

    def matrix(self) -> FloatArray:
        """Return the transform, shape (4, 4)."""
        found = np.eye(4)
        axis = self.kind.axis
        if not self.kind.is_rotation:
            found[axis, 3] = self.value
            return found
        j, k = (axis + 1) % 3, (axis + 2) % 3
        c, s = np.cos(self.value), np.sin(self.value)
        found[j, j], found[j, k], found[k, j], found[k, k] = c, -s, s, c
        return found


def moves_of(robot: Robot, q: FloatArray) -> dict[str, tuple[Move, ...]]:
    """Return the moves from its parent to every frame, by name; `chain.ORIGIN` is after the base transform."""
    values = parameter_values(robot)
    values |= {variable.name: float(entry) for variable, entry in zip(robot.variables, q, strict=True)}
    joints = frozenset(variable.name for variable in robot.variables)
    fixed = {ORIGIN: robot.base, TOOL: robot.tool, WRIST: (), **{frame.name: frame.steps for frame in robot.frames}}
    found = {name: step_transforms(steps) for name, steps in fixed.items()}
    found |= {row.name: row_transforms(row) for row in robot.rows}
    return {name: _moves(transforms, values, joints) for name, transforms in found.items()}


def _moves(
    transforms: Iterable[ElementaryTransform], values: Mapping[str, float], joints: frozenset[str]
) -> tuple[Move, ...]:
    return tuple(
        Move(
            each.kind,
            each.entry,
            float(evaluate(each.value, values, FLOAT64)),
            not joints.isdisjoint(names(each.value)),
        )
        for each in transforms
    )


_HUGE = 1e100
"""Beyond this, squares of coordinates overflow."""


@dataclass(frozen=True, slots=True, eq=False)
class Place:
    """A move, its number among those of the frame that it leads towards, and `base_T` of the frame before it."""

    frame: str
    number: int
    move: Move
    before: FloatArray

    @property
    def start(self) -> FloatArray:
        """Return where the move happens."""
        return np.asarray(self.before[:3, 3])

    @property
    def axis(self) -> FloatArray:
        """Return the axis that it turns about or shifts along."""
        return np.asarray(self.before[:3, self.move.kind.axis])

    @property
    def end(self) -> FloatArray:
        """Return where it leads."""
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
        """Return its length."""
        return float(np.linalg.norm(self.end - self.start))


@dataclass(frozen=True, slots=True, eq=False)
class Skeleton:
    """One posture: joints in the order of the table, every move of base, rows and tool in order, and the tips.

    Attributes:
        frames: `base_T_frame`, shape (4, 4), by name: root, rows, tool of a chain, named frames.
        links: Base outwards; parts without length are left out.
    """

    frames: dict[str, FloatArray]
    joints: tuple[Joint, ...]
    links: tuple[Link, ...]
    places: tuple[Place, ...]
    tips: tuple[str, ...]

    @property
    def points(self) -> FloatArray:
        """Return every origin and every end of a link, shape (n, 3)."""
        ends = [end for link in self.links for end in (link.start, link.end)]
        return np.array([*(frame[:3, 3] for frame in self.frames.values()), *ends])


def make_skeleton(robot: Robot, q: FloatArray) -> Skeleton:
    """Place a robot at a joint vector; refuse a posture that is too large to be drawn."""
    moves, found = moves_of(robot, q), {robot.root: np.eye(4)}
    places: list[Place] = []
    # Numbers that overflow are refused below, in words.
    with np.errstate(over="ignore", invalid="ignore"):
        for name, parent in parents(robot):
            matrix = found[parent]
            for number, move in enumerate(moves[name]):
                places.append(Place(name, number, move, matrix))
                matrix = matrix @ move.matrix()
            found[name] = matrix
    if not all(np.abs(matrix).max() < _HUGE for matrix in found.values()):
        raise KinegenError(f"{robot.name} is too large to be drawn with these joint values")
    # Frames without a name of their own are not drawn, but lead to others.
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
    """Return the named frames that a tip is on or reached by."""
    above = {frame.name: frame.parent for frame in robot.frames}
    found: set[str] = set()
    for name in robot.tips:
        while name in above:
            found.add(name)
            name = above[name]  # noqa: PLW2901 - the way down to the row
    return found


def _joints(robot: Robot, places: Iterable[Place]) -> Iterable[Joint]:
    """Yield each joint, at the first move in which a joint variable stands."""
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
