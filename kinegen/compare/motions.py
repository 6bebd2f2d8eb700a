"""A frame as a product of screws: where each axis is at q = 0, what moves about it, and the pose at zero.

Two robots with the same screws in the same order and the same pose at zero have the same pose for every joint vector
(Brockett 1984). Numbers have 150 digits and are compared to 100 of them, so the comparison has no tolerance that a
table could meet by accident.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from kinegen.robot.expressions import linear
from kinegen.robot.model import TOOL, JointType, Robot, Step
from kinegen.tables.joints import METRES
from kinegen.tables.numbers import MP, is_small, settled, value_of
from kinegen.tables.poses import IDENTITY, Pose, Values, pose_of
from kinegen.tables.steps import row_steps

Vector = tuple[Any, Any, Any]


@dataclass(frozen=True, slots=True)
class Motion:
    """A turn about a line, or a shift along a direction, at q = 0.

    Attributes:
        turns: Whether it turns.
        direction: Unit vector; the first entry that is not zero is positive.
        point: Of the line, the one nearest to the origin, in metres; zero for a shift.
        factors: How far it goes for one radian or metre of each variable, in the order of their names.
    """

    turns: bool
    direction: Vector
    point: Vector
    factors: tuple[tuple[str, Any], ...]

    def same_axis(self, other: Motion) -> bool:
        """Whether both move about the same line, or along the same direction."""
        return self.turns == other.turns and _equal(self.direction, other.direction) and _equal(self.point, other.point)

    def same(self, other: Motion) -> bool:
        """Whether both are the same motion."""
        named = [name for name, _ in self.factors] == [name for name, _ in other.factors]
        moved = zip(self.factors, other.factors, strict=False)
        return self.same_axis(other) and named and all(is_small(a - b) for (_, a), (_, b) in moved)


@dataclass(frozen=True, slots=True)
class Motions:
    """A frame of a robot.

    Attributes:
        motions: From the base outwards; neighbours about one axis are one.
        rotation: Of the frame in the base at q = 0, by rows.
        position: In metres.
    """

    motions: tuple[Motion, ...]
    rotation: tuple[Vector, Vector, Vector]
    position: Vector

    def same(self, other: Motions) -> bool:
        """Whether the frame has the same pose for every joint vector."""
        poses = zip((*self.rotation, self.position), (*other.rotation, other.position), strict=True)
        if len(self.motions) != len(other.motions) or not all(_equal(a, b) for a, b in poses):
            return False
        return all(a.same(b) for a, b in zip(self.motions, other.motions, strict=True))


def _equal(left: Vector, right: Vector) -> bool:
    return all(is_small(a - b) for a, b in zip(left, right, strict=True))


class Describer:
    """Describes the frames of a robot, with the values that the parameters have in the file.

    Args:
        robot: The robot.
        names: What each joint variable is called in the comparison.
    """

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
        """A frame as screws."""
        found, pose = self._reach(frame)
        return Motions(found, pose.rotation, _position(pose, self.values, self.scale))

    def _reach(self, frame: str) -> tuple[tuple[Motion, ...], Pose]:
        """The screws up to a frame and its pose at zero; those of its parent first, and each once."""
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
        """The parent of a frame, and the steps from there; None where there is only the root before it."""
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
    while place and _commute(found[place - 1], motion):
        place -= 1
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
    """Whether the order of two neighbours means nothing: shifts, or motions about one line."""
    if not left.turns and not right.turns:
        return True
    if left.turns and right.turns:
        return left.same_axis(right)
    return _equal(left.direction, right.direction)


def _rank(motion: Motion) -> tuple[bool, tuple[str, ...]]:
    return not motion.turns, tuple(name for name, _ in motion.factors)
