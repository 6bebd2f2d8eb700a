"""The nearest arm of a family: of one that misses conditions by noise, and of a calibrated one.

Only the lines count, not the table: where axes are nearly parallel, their common normals are far away and the lengths
of the table are huge and cancel, but the lines themselves are where the arm is. For a calibrated arm each line is held
where its neighbours come near to it, and turned about that place. Noise, such as 1e-15 where a conversion meant 0, goes
by comparing each axis with those before it, and moving it.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import sympy as sp

from kinegen.derive.folding import Vector
from kinegen.derive.inverse.axes import Axes, JointAxis
from kinegen.derive.inverse.exact_geometry import combined, cross, dot, is_null, minus, unit
from kinegen.derive.inverse.geometry import are_parallel, feet, foot
from kinegen.support.dataclass import dataclass

SINGULAR_PER_DEFECT = 12.0
"""Branches may merge where the least singular value of the Jacobian is below so many times the defect.

Of joint vectors on each set on which branches merge, and beside it from 1e-7 rad on, the missed ones were below 0.7
defects at the elbow, 4.5 at the axis of the waist and 7.2 at the wrist in line: of a KR16 with an offset of its wrist,
a UR5 and an arm solved from the tool, for defects from 4e-10 to 1.5e-3.
"""


@dataclass(frozen=True, slots=True)
class Failing:
    """One condition of a family, such as `axes 2, 3, 4 are parallel`, that an arm meets only nearly.

    `amount` says how far it fails, in radians or in the length unit of the file.
    """

    text: str
    amount: float
    is_angle: bool


@dataclass(frozen=True, slots=True)
class Defect:
    """What an arm is apart from the nearest one of a family.

    Attributes:
        axes: The arm's own axes, from the base to the tool.
        failing: The conditions that fail.
        angle: The largest angle between an axis and that of the arm of the family, in radians.
        length: The largest distance between an axis and that of the arm of the family, where other axes meet it.
    """

    axes: Axes
    failing: tuple[Failing, ...]
    angle: float
    length: float

    def singular_below(self, reach: float) -> float:
        """Return the least singular value of the Jacobian, lengths by the reach, below which branches may merge."""
        return SINGULAR_PER_DEFECT * self.size(reach)

    def size(self, reach: float) -> float:
        """Return the larger of the angle and of the length by the reach."""
        return max(self.angle, self.length / reach)


_CLEAR = 0.1
"""The sine of an angle from which on two axes are far from parallel, and come near to each other at one place."""

_EXACT = 1e-100
"""What the rounding of exact numbers may leave of a condition that is met."""


@dataclass(frozen=True, slots=True)
class Special:
    """Axes of an arm of a family beside those of another arm.

    Attributes:
        axes: The axes, in the direction in which the family is looked for.
        failing: The conditions of the family that the other arm fails, and how far.
        angle: The largest angle between an axis and the other arm's, in radians.
        length: The largest distance between the two, where the axes are held.
    """

    axes: Axes
    failing: tuple[Failing, ...]
    angle: float
    length: float


def special_arms(axes: Axes) -> tuple[Special, ...]:
    """Return the nearest arms of the families with six turning joints, on the chain and on the reversed chain.

    The joints have no runtime parameters. Whether the arms are near enough, and of a family, is not looked at here.
    """
    chains = held(axes), held(axes.reversed())
    found = (_special(chain, shape) for chain in chains for shape in (_triple, _elbow, _gimbal))
    return tuple(special for special in found if special is not None)


def held(axes: Axes) -> Axes:
    """Return the same lines, each with the point in the middle of where its neighbours come near to it."""
    joints: list[JointAxis] = []
    for index, joint in enumerate(axes.joints):
        beside = [axes.joints[other] for other in (index - 1, index + 1) if 0 <= other < len(axes.joints)]
        near = [feet(joint, other)[0] for other in beside if is_clear(joint, other)]
        if not near:
            near = [foot(joint, joints[-1].point if joints else axes.position)]
        joints.append(replace(joint, point=combined(*((sp.Rational(1, len(near)), point) for point in near))))
    return replace(axes, joints=tuple(joints))


def is_clear(left: JointAxis, right: JointAxis) -> bool:
    """Tell whether two axes are far from parallel."""
    normal = cross(left.direction, right.direction)
    return bool(dot(normal, normal) > _CLEAR**2)


@dataclass(slots=True)
class _Draft:
    """Axes that are changed until they meet the conditions of a family, and how far the given ones fail these."""

    given: tuple[JointAxis, ...]
    joints: list[JointAxis]
    failing: list[Failing]

    def parallel(self, *places: int) -> None:
        """Make axes parallel, to the mean of their directions."""
        first = self.given[places[0]].direction
        signs = [1 if dot(self.given[place].direction, first) > 0 else -1 for place in places]
        mean = unit(combined(*zip(signs, (self.given[place].direction for place in places), strict=True)))
        for place, sign in zip(places, signs, strict=True):
            self._direct(place, combined((sign, mean)))
        pairs = itertools.combinations(places, 2)
        off = max(_angle(self.given[left].direction, self.given[right].direction) for left, right in pairs)
        self._fails(f"{self._named(places)} are parallel", off, is_angle=True)

    def square(self, fixed: int, place: int) -> None:
        """Bring an axis at right angles to another one, which stays."""
        axis, direction = self.joints[fixed].direction, self.joints[place].direction
        self._direct(place, unit(combined((1, direction), (-dot(direction, axis), axis))))
        sine = dot(self.given[fixed].direction, self.given[place].direction)
        self._fails(f"{self._named((fixed, place))} are at right angles", math.asin(abs(sine)), is_angle=True)

    def meet(self, *places: int) -> None:
        """Shift axes into the mean of the places where neighbours come near to each other."""
        if not all(is_clear(self.joints[left], self.joints[right]) for left, right in itertools.pairwise(places)):
            raise ValueError("nearly parallel axes do not intersect")
        points = _near(self.joints, places)
        centre = combined(*((sp.Rational(1, len(points)), point) for point in points))
        pairs = itertools.combinations(_near(self.given, places), 2)
        off = max(math.hypot(*map(float, minus(left, right))) for left, right in pairs)
        for place in places:
            self.joints[place] = replace(self.joints[place], point=centre)
        self._fails(f"{self._named(places)} meet", off, is_angle=False)

    def _direct(self, place: int, direction: Vector) -> None:
        self.joints[place] = replace(self.joints[place], direction=direction)

    def _named(self, places: Sequence[int]) -> str:
        *others, last = sorted(self.given[place].number for place in places)
        return f"axes {', '.join(map(str, others))} and {last}"

    def _fails(self, text: str, amount: float, *, is_angle: bool) -> None:
        if amount > _EXACT:
            self.failing.append(Failing(text, amount, is_angle))


def _triple(draft: _Draft) -> None:
    """Make a waist, three parallel axes, and two more at right angles which meet: the UR type."""
    draft.parallel(1, 2, 3)
    draft.square(3, 4)
    draft.square(4, 5)
    draft.meet(4, 5)


def _elbow(draft: _Draft) -> None:
    """Make two parallel axes and a spherical wrist."""
    draft.parallel(1, 2)
    _wrist(draft)


def _gimbal(draft: _Draft) -> None:
    """Make two axes that meet and a spherical wrist."""
    draft.meet(0, 1)
    _wrist(draft)


def _wrist(draft: _Draft) -> None:
    draft.square(4, 3)
    draft.square(4, 5)
    draft.meet(3, 4, 5)


def _special(axes: Axes, shape: Callable[[_Draft], None]) -> Special | None:
    draft = _Draft(axes.joints, list(axes.joints), [])
    try:
        shape(draft)
    except ValueError:
        return None
    pairs = list(zip(axes.joints, draft.joints, strict=True))
    return Special(
        replace(axes, joints=tuple(draft.joints)),
        tuple(draft.failing),
        max(_angle(given.direction, joint.direction) for given, joint in pairs),
        max(_distance(joint, given.point) for given, joint in pairs),
    )


def _near(joints: Sequence[JointAxis], places: Sequence[int]) -> list[Vector]:
    """Return where neighbours come near to each other: a point on either."""
    return [point for left, right in itertools.pairwise(places) for point in feet(joints[left], joints[right])]


def _angle(left: Vector, right: Vector) -> float:
    """Return the angle between two lines."""
    normal = cross(left, right)
    return math.atan2(math.sqrt(dot(normal, normal)), abs(dot(left, right)))


def _distance(joint: JointAxis, point: Vector) -> float:
    return math.hypot(*map(float, minus(foot(joint, point), point)))


NOISE = 1e-12
"""Axes that miss a condition by less count as meeting it: radians, or parts of the arm's length."""


@dataclass(frozen=True, slots=True)
class Rounded:
    """Axes without noise, and how far one was turned, in radians, and shifted at most."""

    axes: Axes
    angle: float
    length: float

    @property
    def changed(self) -> bool:
        """Whether any axis was moved."""
        return self.angle > 0 or self.length > 0

    def words(self, unit_of_length: str) -> str:
        """Say what was done, for the conditions of a family."""
        return (
            f"axes that are parallel, square or meet within {NOISE:g} (rad, parts of the arm's length) count as exact: "
            f"they were moved by up to {self.angle:.2g} rad and {self.length:.2g} {unit_of_length}"
        )


def rounded(axes: Axes) -> Rounded:
    """Move the axes of an arm by less than `NOISE`, so that they meet the conditions which they nearly meet."""
    if len(axes.joints) < 2:
        return Rounded(axes, 0.0, 0.0)
    joints: list[JointAxis] = []
    for joint in axes.joints:
        joints.append(replace(joint, direction=_direction(joint.direction, joints)))
    angle = max(_length(cross(new.direction, old.direction)) for new, old in zip(joints, axes.joints, strict=True))
    # Points are moved after directions, which decide where axes come near; runtime lengths are left as they are.
    length, fixed = 0.0, all(entry.is_number for joint in joints for entry in joint.point)
    if fixed:
        far, placed, meets = NOISE * _size(replace(axes, joints=tuple(joints))), list[JointAxis](), list[Vector]()
        for joint in joints:
            moved = _placed(joint, placed, meets, far) if joint.turns else joint
            length = max(length, _length(minus(foot(moved, joint.point), joint.point)))
            placed.append(moved)
        joints = placed
    return Rounded(replace(axes, joints=tuple(joints)), angle, length)


def _direction(direction: Vector, before: list[JointAxis]) -> Vector:
    """Return a direction, parallel or square to those before it where it nearly is; the last ones count first."""
    square: list[Vector] = []
    for other in reversed(before):
        if _length(cross(direction, other.direction)) < NOISE:
            return combined((1 if dot(direction, other.direction) > 0 else -1, other.direction))
        is_new = all(_length(cross(each, other.direction)) > NOISE for each in square)
        if abs(dot(direction, other.direction)) < NOISE and is_new:
            square.append(other.direction)
    if all(dot(direction, each) == 0 for each in square[:2]):
        return direction
    if len(square) == 1:
        return unit(combined((1, direction), (-dot(direction, square[0]), square[0])))
    # Two directions that it is square to leave one.
    normal = unit(cross(square[0], square[1]))
    return combined((1 if dot(direction, normal) > 0 else -1, normal))


def _placed(joint: JointAxis, before: list[JointAxis], meets: list[Vector], far: float) -> JointAxis:
    """Return a joint on an axis that goes through a point of those before it where it nearly does."""
    others = [each for each in reversed(before) if each.turns]
    for point in meets:
        # Where several meet already comes before where two do.
        if 0 < _length(minus(foot(joint, point), point)) < far:
            joint = replace(joint, point=point)
            break
    for other in others:
        here, there = _nearest_points(other, joint)
        gap = _length(minus(here, there))
        if gap == 0:
            break
        if gap < far:
            joint = replace(joint, point=here)
            break
    meets += [here for here, there in (_nearest_points(each, joint) for each in others) if is_null(minus(here, there))]
    return joint


def _nearest_points(other: JointAxis, joint: JointAxis) -> tuple[Vector, Vector]:
    """Return the points of two axes that are nearest to each other; of parallel ones, beside the second one's point."""
    return (foot(other, joint.point), joint.point) if are_parallel(other, joint) else feet(other, joint)


def _size(axes: Axes) -> float:
    """Return the length of the way along the arm, through the places where its axes come near to each other.

    A tool whose length is a runtime parameter is not part of it.
    """
    points = [joint.point for joint in held(axes).joints]
    points += [axes.position] if all(entry.is_number for entry in axes.position) else []
    return sum(_length(minus(one, other)) for one, other in itertools.pairwise(points))


def _length(vector: Vector) -> float:
    """Return the length of a vector: 0 only for one that is null but for the rounding of exact numbers."""
    found = math.hypot(*map(float, vector))
    return found if found > 1e-100 else 0.0
