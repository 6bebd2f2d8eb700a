"""The nearest special geometry of an arm that is nearly of a family, as calibrated arms are.

In: axes of six joints that turn. Out: axes that meet the conditions of a family exactly, as near as may be, and how far
they are from the given ones. Only the lines count, not the table: where axes are nearly parallel, their common normals
are far away and the lengths of the table are huge and cancel, but the lines themselves are where the arm is. Each line
is held where its neighbours come near to it, and turned about that place.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import sympy as sp

from kinegen.symbolic.fold import Vector
from kinegen.symbolic.inverse.axes import Axes, JointAxis
from kinegen.symbolic.inverse.defect import Failing
from kinegen.symbolic.inverse.exact import combined, cross, dot, minus, unit
from kinegen.symbolic.inverse.geometry import feet, foot

_CLEAR = 0.1
"""The sine of an angle from which on two axes are far from parallel, and come near to each other at one place."""


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
    """The nearest arms of the families with six turning joints, on the chain and on the reversed chain.

    Args:
        axes: Six joints that turn, without runtime parameters.

    Returns:
        The arms; whether they are near enough, and of a family, is not looked at here.
    """
    chains = held(axes), held(axes.reversed())
    found = (_special(chain, shape) for chain in chains for shape in (_triple, _elbow, _gimbal))
    return tuple(special for special in found if special is not None)


def held(axes: Axes) -> Axes:
    """The same lines, each with the point in the middle of where its neighbours come near to it."""
    joints: list[JointAxis] = []
    for index, joint in enumerate(axes.joints):
        beside = [axes.joints[other] for other in (index - 1, index + 1) if 0 <= other < len(axes.joints)]
        near = [feet(joint, other)[0] for other in beside if is_clear(joint, other)]
        if not near:
            near = [foot(joint, joints[-1].point if joints else axes.position)]
        joints.append(replace(joint, point=combined(*((sp.Rational(1, len(near)), point) for point in near))))
    return replace(axes, joints=tuple(joints))


def is_clear(left: JointAxis, right: JointAxis) -> bool:
    """Whether two axes are far from parallel."""
    normal = cross(left.direction, right.direction)
    return bool(dot(normal, normal) > _CLEAR**2)


@dataclass(slots=True)
class _Draft:
    """Axes that are changed until they meet the conditions of a family.

    Attributes:
        given: The joints as they are.
        joints: The joints as they become.
        failing: The conditions, and how far the given joints fail them.
    """

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
            raise ValueError("axes that are nearly parallel have no place to meet")
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
        if amount > 0:
            self.failing.append(Failing(text, amount, is_angle))


def _triple(draft: _Draft) -> None:
    """A waist, three parallel axes, and two more at right angles which meet: the UR type."""
    draft.parallel(1, 2, 3)
    draft.square(3, 4)
    draft.square(4, 5)
    draft.meet(4, 5)


def _elbow(draft: _Draft) -> None:
    """Two parallel axes and a spherical wrist."""
    draft.parallel(1, 2)
    _wrist(draft)


def _gimbal(draft: _Draft) -> None:
    """Two axes that meet and a spherical wrist."""
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
    """Where neighbours come near to each other: a point on either."""
    return [point for left, right in itertools.pairwise(places) for point in feet(joints[left], joints[right])]


def _angle(left: Vector, right: Vector) -> float:
    """The angle between two lines."""
    normal = cross(left, right)
    return math.atan2(math.sqrt(dot(normal, normal)), abs(dot(left, right)))


def _distance(joint: JointAxis, point: Vector) -> float:
    return math.hypot(*map(float, minus(foot(joint, point), point)))
