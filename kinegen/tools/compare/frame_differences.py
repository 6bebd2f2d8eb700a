"""Describes a frame as a product of screws, for proofs, and finds the greatest difference of two frames.

Two robots with the same screws in the same order and the same pose at q = 0 have the same pose for every joint vector
(Brockett 1984). Numbers have 150 digits and are compared to 100 of them, so the comparison has no tolerance that a
table could meet by accident. The greatest difference comes from samples in a fixed order, then a search from the worst.
Everything is in metres and radians.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinegen.model.dh_conversion.elementary_transforms import row_steps
from kinegen.model.dh_conversion.exact_poses import IDENTITY, MP, Pose, Values, is_small, pose_of, settled, value_of
from kinegen.model.dh_conversion.link_tree import METRES
from kinegen.model.expression_parser import evaluate, linear
from kinegen.model.expression_values import FLOAT64
from kinegen.model.joint_bounds import reach
from kinegen.model.robot import TOOL, JointType, Robot, Step
from kinegen.support.dataclass import dataclass
from kinegen.verify import reference

FloatArray = NDArray[np.float64]

SAMPLES = 2000
_ROUNDS = 30
_STARTS = 2


@dataclass(frozen=True, slots=True)
class Box:
    """Bounds of the joint vector of the first robot, in radians and metres, each of shape (dof,)."""

    low: FloatArray
    high: FloatArray


@dataclass(frozen=True, slots=True)
class Worst:
    """The greatest distance (metres) and turn (radians) between two poses of a frame, and the joint vectors."""

    distance: float
    distance_at: tuple[float, ...]
    angle: float
    angle_at: tuple[float, ...]


def metres_of(robot: Robot) -> float:
    """Metres in a length unit of a robot."""
    return float(METRES[robot.units.length])


def units_of(robot: Robot) -> FloatArray:
    """Return what one radian or metre of each joint variable is in the units of a robot, shape (dof,)."""
    slides = [variable.type is JointType.PRISMATIC for variable in robot.variables]
    return np.array([1 / metres_of(robot) if each else 1.0 for each in slides])


def box_of(robot: Robot) -> Box:
    """The limits of a robot; a turn without limits is a whole one, a shift without limits the size of the robot."""
    size = max(float(reach(robot)), 1e-3)
    bounds = []
    for variable in robot.variables:
        if variable.limits is not None:
            bounds.append(tuple(float(evaluate(limit, {}, FLOAT64)) for limit in variable.limits))
        else:
            span = size if variable.type is JointType.PRISMATIC else math.pi
            bounds.append((-span, span))
    low, high = np.array(bounds, dtype=np.float64).reshape(-1, 2).T
    return Box(low / units_of(robot), high / units_of(robot))


def poses(robot: Robot, frame: str, q: FloatArray) -> FloatArray:
    """Return poses of a frame in metres, shape (N, 4, 4), for joint vectors in radians and metres."""
    found = np.array(reference.frames(robot, q * units_of(robot))[frame])
    found[:, :3, 3] *= metres_of(robot)
    return found


def distances(first: FloatArray, second: FloatArray) -> FloatArray:
    """Distance and turn between poses, shape (2, N)."""
    apart = np.linalg.norm(first[:, :3, 3] - second[:, :3, 3], axis=1)
    # Twice the arc sine of half the chord: right for small turns, where the arc cosine of the trace is not.
    chord = np.linalg.norm(first[:, :3, :3] - second[:, :3, :3], axis=(1, 2)) / math.sqrt(8)
    return np.stack([apart, 2 * np.arcsin(np.minimum(chord, 1.0))])


def samples(box: Box) -> FloatArray:
    """Joint vectors of a box, shape (N, dof): zero, corners, and random ones, the same on every machine."""
    rng = np.random.default_rng(0)
    dof = len(box.low)
    corners = np.where(rng.random((200, dof)) < 0.5, box.low, box.high)
    q = np.concatenate([np.clip(np.zeros((1, dof)), box.low, box.high), corners])
    return np.concatenate([q, rng.uniform(box.low, box.high, (SAMPLES, dof))]) if dof else q[:1]


def worst(difference: Callable[[FloatArray], FloatArray], box: Box, q: FloatArray, *, search: bool) -> Worst:
    """Find the greatest difference in a box, starting from joint vectors.

    `difference` takes joint vectors of shape (N, dof) to distances and turns, shape (2, N). Without `search` the worst
    start is the answer.
    """
    found = difference(q)
    starts = _STARTS if search else 1
    climbed = [
        _climb(difference, box, q[np.argsort(-found[kind], kind="stable")[:starts]], kind, _ROUNDS * search)
        for kind in (0, 1)
    ]
    (distance, at), (angle, angle_at) = climbed
    return Worst(distance, tuple(at.tolist()), angle, tuple(angle_at.tolist()))


def _climb(
    difference: Callable[[FloatArray], FloatArray], box: Box, starts: FloatArray, kind: int, rounds: int
) -> tuple[float, FloatArray]:
    """Search along each joint from some joint vectors, with steps that shrink."""
    best_value, best = -1.0, starts[0]
    for start in starts:
        here, value, step = start, float(difference(start[None])[kind, 0]), 0.25 * (box.high - box.low)
        for _ in range(rounds if len(start) else 0):
            # A compass search needs no derivative and stops at bounds as willingly as inside.
            tries = np.clip(np.concatenate([here + np.diag(step), here - np.diag(step)]), box.low, box.high)
            found = difference(tries)[kind]
            place = int(np.argmax(found))
            if found[place] > value:
                here, value = tries[place], float(found[place])
            else:
                step = step / 2
        if value > best_value:
            best_value, best = value, here
    return best_value, best


class Poser:
    """Poses of the frames of a robot; those of one array of joint vectors are computed once for all frames.

    A joint takes entry `order` of a vector, times a sign 1 or -1, plus an offset in radians and metres.
    """

    def __init__(self, robot: Robot, order: list[int], signs: FloatArray, offsets: FloatArray) -> None:
        self.robot, self.order, self.signs, self.offsets = robot, order, signs, offsets
        self.last: tuple[FloatArray, dict[str, FloatArray]] | None = None

    def __call__(self, frame: str, q: FloatArray) -> FloatArray:
        """Return poses in metres, shape (N, 4, 4)."""
        if self.last is None or self.last[0] is not q:
            own = (q[:, self.order] * self.signs + self.offsets) * units_of(self.robot)
            self.last = q, dict(reference.frames(self.robot, own))
        found = np.array(self.last[1][frame])
        found[:, :3, 3] *= metres_of(self.robot)
        return found


Vector = tuple[Any, Any, Any]


@dataclass(frozen=True, slots=True)
class Motion:
    """A turn about a line, or a shift along a direction, at q = 0.

    Attributes:
        direction: Unit vector; the first entry that is not zero is positive.
        point: Of the line, the one nearest to the origin, in metres; zero for a shift.
        factors: How far it goes for one radian or metre of each variable, in the order of their names.
    """

    turns: bool
    direction: Vector
    point: Vector
    factors: tuple[tuple[str, Any], ...]

    def same_axis(self, other: Motion) -> bool:
        """Tell whether both move about the same line, or along the same direction."""
        return self.turns == other.turns and _equal(self.direction, other.direction) and _equal(self.point, other.point)

    def same(self, other: Motion) -> bool:
        """Tell whether both are the same motion."""
        named = [name for name, _ in self.factors] == [name for name, _ in other.factors]
        moved = zip(self.factors, other.factors, strict=False)
        return self.same_axis(other) and named and all(is_small(a - b) for (_, a), (_, b) in moved)


@dataclass(frozen=True, slots=True)
class Motions:
    """A frame of a robot at q = 0: its motions from the base, of which no neighbours share an axis, and its pose."""

    motions: tuple[Motion, ...]
    rotation: tuple[Vector, Vector, Vector]
    position: Vector

    def same(self, other: Motions) -> bool:
        """Tell whether the frame has the same pose for every joint vector."""
        poses = zip((*self.rotation, self.position), (*other.rotation, other.position), strict=True)
        if len(self.motions) != len(other.motions) or not all(_equal(a, b) for a, b in poses):
            return False
        return all(a.same(b) for a, b in zip(self.motions, other.motions, strict=True))


def _equal(left: Vector, right: Vector) -> bool:
    return all(is_small(a - b) for a, b in zip(left, right, strict=True))


class Describer:
    """Describes the frames of a robot by the parameters of the file; `names` are those of the joint variables."""

    def __init__(self, robot: Robot, names: Mapping[str, str]) -> None:
        self.robot, self.names = robot, names
        self.known = {each.name: value_of(each.value, {}) for each in robot.parameters}
        self.values = Values(tuple(self.known.items()), frozenset())
        self.slides = {each.name for each in robot.variables if each.type is JointType.PRISMATIC}
        metres = METRES[robot.units.length]
        self.scale = MP.mpf(metres.numerator) / metres.denominator
        self.rows = {row.name: row for row in robot.rows}
        self.frames = {frame.name: frame for frame in robot.frames}
        self.reached: dict[str, tuple[tuple[Motion, ...], Pose]] = {}

    def motions(self, frame: str) -> Motions:
        """Return a frame as screws."""
        found, pose = self._reach(frame)
        return Motions(found, pose.rotation, _position(pose, self.values, self.scale))

    def _reach(self, frame: str) -> tuple[tuple[Motion, ...], Pose]:
        """Return the screws up to a frame and its pose at zero; those of its parent first, and each once."""
        waiting = [frame]
        while waiting[-1] not in self.reached:
            parent, _ = self._last(waiting[-1])
            if parent is None or parent in self.reached:
                self.reached[waiting[-1]] = self._walk(waiting[-1])
                waiting = waiting[:-1] or [frame]
            else:
                waiting.append(parent)
        return self.reached[frame]

    def _last(self, frame: str) -> tuple[str | None, tuple[Step, ...]]:
        """Return the parent of a frame, and the steps from there; None where there is only the root before it."""
        robot = self.robot
        if frame == robot.root:
            return None, ()
        if frame in self.rows:
            row = self.rows[frame]
            at_root = row.parent == robot.root
            return (None, (*robot.base, *row_steps(row))) if at_root else (row.parent, row_steps(row))
        if frame in self.frames:
            return self.frames[frame].parent, self.frames[frame].steps
        steps = robot.tool if frame == TOOL else ()
        return (robot.rows[-1].name, steps) if robot.rows else (None, (*robot.base, *steps))

    def _walk(self, frame: str) -> tuple[tuple[Motion, ...], Pose]:
        parent, steps = self._last(frame)
        before, pose = self.reached[parent] if parent is not None else ((), IDENTITY)
        found = list(before)
        for step in steps:
            factors, rest = linear(step.value, frozenset(self.names))
            if factors:
                turns = step.kind.is_rotation
                moved = []
                for name, factor in factors.items():
                    # A shift is in metres, and so is the variable of a joint that shifts.
                    unit = (MP.mpf(1) if turns else self.scale) / (self.scale if name in self.slides else MP.mpf(1))
                    moved.append((self.names[name], value_of(factor, self.known) * unit))
                origin = _position(pose, self.values, self.scale)
                _append(found, _motion(pose, origin, step.kind.axis, turns=turns, factors=moved))
            pose = pose_of((Step(step.kind, rest),), self.values, pose)
        return tuple(found), pose


def _position(pose: Pose, values: Values, scale: Any) -> Vector:
    x, y, z = (values.length(form) * scale for form in pose.shift)
    return x, y, z


def _motion(pose: Pose, origin: Vector, axis: int, *, turns: bool, factors: list[tuple[str, Any]]) -> Motion:
    direction = tuple(row[axis] for row in pose.rotation)
    sign = next((MP.sign(each) for each in direction if not is_small(each)), MP.mpf(1))
    ahead = (sign * direction[0], sign * direction[1], sign * direction[2])
    along = sum((a * b for a, b in zip(ahead, origin, strict=True)), MP.mpf(0))
    near = tuple(settled(p - along * a) if turns else MP.mpf(0) for p, a in zip(origin, ahead, strict=True))
    return Motion(turns, ahead, (near[0], near[1], near[2]), tuple(sorted((n, sign * f) for n, f in factors)))


def _append(found: list[Motion], motion: Motion) -> None:
    """Append a motion; neighbours about one axis are one, and a turn is before a shift along its own axis."""
    place = len(found)
    # Motions that commute are sorted, so that equal products have equal lists.
    while place and _commute(found[place - 1], motion):
        place -= 1
        # Motions about one axis are one motion.
        if found[place].same_axis(motion):
            sums = dict(found[place].factors)
            for name, factor in motion.factors:
                sums[name] = sums.get(name, MP.mpf(0)) + factor
            kept = tuple(sorted((name, factor) for name, factor in sums.items() if not is_small(factor)))
            found[place : place + 1] = [Motion(motion.turns, motion.direction, motion.point, kept)] if kept else []
            return
    while place < len(found) and _rank(found[place]) <= _rank(motion):
        place += 1
    found.insert(place, motion)


def _commute(left: Motion, right: Motion) -> bool:
    """Tell whether the order of two neighbours means nothing: shifts, or motions about one line."""
    if not left.turns and not right.turns:
        return True
    if left.turns and right.turns:
        return left.same_axis(right)
    return _equal(left.direction, right.direction)


def _rank(motion: Motion) -> tuple[bool, tuple[str, ...]]:
    return not motion.turns, tuple(name for name, _ in motion.factors)
