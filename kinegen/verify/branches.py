"""The names of branches against what they mean: signs that the axes of the joints have in each solution.

Axes are read off the Jacobian of the reference, at the solution itself, so that nothing here knows how it was found.
Which way an axis points is what its family says: a joint may turn the other way than its axis.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from kinegen.derive.inverse.axes import JointAxis
from kinegen.derive.inverse.derive import size_of
from kinegen.derive.inverse.family import (
    Arm,
    ColumnArm,
    ElbowArm,
    Family,
    FlatArm,
    GimbalArm,
    PointArm,
    SphericalArm,
    StrokeArm,
    TripleArm,
    WristArm,
)
from kinegen.derive.inverse.geometry import Waist, Wrist
from kinegen.errors import ProofError
from kinegen.model.robot import TOOL, Robot
from kinegen.verify import reference
from kinegen.verify.samples import FloatArray, Truths
from kinegen.verify.singular_samples import may_merge

DOUBTFUL = 1e-3
"""Signs of smaller numbers are not looked at: lengths against the reach, and sines."""

_WORDS = {
    "shoulder left": ("shoulder", 1),
    "shoulder right": ("shoulder", -1),
    "elbow up": ("elbow", 1),
    "elbow down": ("elbow", -1),
    "elbow left": ("elbow", 1),
    "elbow right": ("elbow", -1),
    "stroke forward": ("stroke", 1),
    "stroke backward": ("stroke", -1),
    "wrist no-flip": ("wrist", 1),
    "wrist flip": ("wrist", -1),
    # Solved from the tool: the last joint is the waist, and the first three are the wrist.
    "hand left": ("shoulder", 1),
    "hand right": ("shoulder", -1),
    "shoulder no-flip": ("wrist", 1),
    "shoulder flip": ("wrist", -1),
}

_SPHERICAL_WORDS = _WORDS | {"shoulder no-flip": ("shoulder", 1), "shoulder flip": ("shoulder", -1)}
"""The same for an arm with a wrist at either end."""


def require_names(
    robot: Robot, names: Sequence[str], family: Family, target: str, joints: FloatArray, solved: Truths
) -> None:
    """See that every solution stands in the branch whose name describes it.

    `joints`: solutions, shape (N, branches, dof); `solved`: which of them are valid, shape (N, branches). Solutions of
    an arm that is nearly of its family are left out where its branches may merge, as it is stated. Raises `ProofError`
    naming the first branch that holds another solution, or if there are too few names.
    """
    if len(names) != joints.shape[1] or len(set(names)) != len(names):
        raise ProofError(f"{robot.name}: {target} has {joints.shape[1]} branches, {len(names)} names for them")
    places = np.nonzero(solved)
    if family.defect is not None:
        clear = ~may_merge(robot, family, joints[places])
        places = places[0][clear], places[1][clear]
    rows = joints[places]
    found = signs(robot, family, rows) if len(rows) else {}
    words = _SPHERICAL_WORDS if isinstance(family.build, SphericalArm) else _WORDS
    for index, name in enumerate(names):
        own = places[1] == index
        for word in name.split(", "):
            choice, wanted = words.get(word, ("", 0))
            wrong = own & (found[choice] * wanted < -DOUBTFUL) if choice in found else own[:0]
            if wrong.any():
                place = ", ".join(f"{entry:.6g}" for entry in rows[wrong.argmax()])
                raise ProofError(f"{robot.name}: {target} has ({place}) in the branch '{name}', which is not {word}")


def signs(robot: Robot, family: Family, q: FloatArray) -> dict[str, FloatArray]:
    """Returns for each choice that an arm has a number for each joint vector whose sign tells which one it is.

    `q`: joint vectors, shape (N, dof). By the name of the choice, shape (N,); small where the branches meet, NaN where
    nothing says which is which.
    """
    zero = np.zeros((1, robot.dof))
    size = size_of(robot, family)
    now, rest = (Lines(robot, each, size, family.axes.numbers, is_reversed=family.is_reversed) for each in (q, zero))
    return dict(_signs(now, rest, family))


class Lines:
    """The axes of all joints: directions and points, in the base frame.

    Attributes:
        directions: Unit vectors, shape (N, joints, 3), in the order of the chain.
        points: A point of each axis, shape (N, joints, 3).
        tool: Where the tool is, shape (N, 3).

    Args:
        q: Joint vectors, shape (N, dof).
        numbers: The joints of the chain in its order, by their places in the joint vector from 1; others are left out.
        is_reversed: Whether the chain goes from the tool to the base.
    """

    def __init__(
        self, robot: Robot, q: FloatArray, extent: float, numbers: Sequence[int], *, is_reversed: bool = False
    ) -> None:
        jacobian = reference.Kinematics(robot, q).jacobian(TOOL)
        place = reference.pose(robot, q)[:, 0, :3, 3]
        jacobian = jacobian[..., [number - 1 for number in numbers]]
        linear, angular = jacobian[:, :3].swapaxes(1, 2), jacobian[:, 3:].swapaxes(1, 2)
        rates = np.linalg.norm(angular, axis=2, keepdims=True)
        turns = rates > 0
        self.directions = np.where(turns, angular, linear)
        self.directions = self.directions / np.linalg.norm(self.directions, axis=2, keepdims=True)
        lever = np.cross(angular, linear) / np.where(turns, rates, 1) ** 2
        self.points = place[:, None] + np.where(turns, lever, 0)
        self.tool, self.extent = place, extent
        if is_reversed:
            # From the tool, a joint turns everything before it the other way.
            self.directions = -self.directions
        self._numbers = list(numbers)

    def direction(self, number: int) -> FloatArray:
        """Of an axis, by its place along the chain from 1."""
        found: FloatArray = self.directions[:, number - 1]
        return found

    def place(self, joint: JointAxis) -> int:
        """Returns the place of a joint along the chain, from 1."""
        return self._numbers.index(joint.number) + 1

    def pointing(self, joint: JointAxis) -> FloatArray:
        """Returns the same, the way that the axis points, whichever way its joint turns."""
        return self.direction(self.place(joint)) * (1.0 if joint.rate > 0 else -1.0)

    def from_axis(self, number: int, point: FloatArray) -> FloatArray:
        """From an axis to points, across it."""
        apart = point - self.points[:, number - 1]
        return apart - _dot(apart, self.direction(number))[:, None] * self.direction(number)

    def meeting(self, first: int, second: int) -> FloatArray:
        """Returns the point of one axis that is nearest to another."""
        a, b = self.direction(first), self.direction(second)
        apart = self.points[:, second - 1] - self.points[:, first - 1]
        normal = np.cross(a, b)
        along = _dot(np.cross(apart, b), normal) / (normal**2).sum(axis=1)
        found: FloatArray = self.points[:, first - 1] + along[:, None] * a
        return found


def _dot(a: FloatArray, b: FloatArray) -> FloatArray:
    found: FloatArray = (a * b).sum(axis=-1)
    return found


def _signs(now: Lines, zero: Lines, family: Family) -> Iterator[tuple[str, FloatArray]]:
    match family.build:
        case PointArm(arm):
            yield from _arm_signs(now, zero, arm, now.tool, zero.tool)
        case WristArm(arm, wrist):
            yield from _arm_signs(now, zero, arm, now.meeting(4, 5), zero.meeting(4, 5))
            yield "wrist", _turned(now, wrist)
        case SphericalArm(shoulder, elbow, wrist):
            yield "elbow", _left_of_line(now, now.pointing(elbow))
            yield "shoulder", _turned(now, shoulder)
            yield "wrist", _turned(now, wrist)
        case FlatArm(turns):
            first, second = now.place(turns[0]), now.place(turns[1])
            carried = now.tool if len(turns) == 2 else now.points[:, now.place(turns[2]) - 1]
            yield "elbow", _bent(now, first, second, carried, now.pointing(turns[0]))
        case TripleArm(wrist=wrist):
            other = 4 if wrist is None else 6
            yield "shoulder", _side(now, zero, now.meeting(5, other), zero.meeting(5, other))
            yield "elbow", _above(now, family.build.waist, now.meeting(5, other), now.points[:, 3])
            if wrist is not None:
                yield "wrist", _turned(now, wrist)


def _arm_signs(
    now: Lines, zero: Lines, arm: Arm, point: FloatArray, rest: FloatArray
) -> Iterator[tuple[str, FloatArray]]:
    if isinstance(arm, ElbowArm | GimbalArm | StrokeArm):
        yield "shoulder", _side(now, zero, point, rest)
    if isinstance(arm, GimbalArm):
        yield "elbow", _left(now, point, now.pointing(arm.elbow))
    if isinstance(arm, ElbowArm):
        yield "elbow", _above(now, arm.waist, point, point)
    if isinstance(arm, StrokeArm | ColumnArm):
        turn = 2 if isinstance(arm, StrokeArm) else now.place(arm.turn)
        yield "stroke", _dot(now.from_axis(turn, point), now.pointing(arm.stroke)) / now.extent


def _turned(lines: Lines, wrist: Wrist) -> FloatArray:
    """Returns the sine of how far axis 6 is turned from axis 4 about axis 5."""
    fourth, fifth, sixth = (lines.pointing(joint) for joint in wrist.joints)
    return _dot(np.cross(fourth, sixth), fifth)


def _side(now: Lines, zero: Lines, point: FloatArray, rest: FloatArray) -> FloatArray:
    """How far a point is out on the side of the waist on which it is in the zero pose; NaN where it is on neither."""
    start = _ahead(zero, rest)[0] / zero.extent
    return _ahead(now, point) / now.extent * (np.sign(start) if abs(start) > DOUBTFUL else np.nan)


def _ahead(lines: Lines, point: FloatArray) -> FloatArray:
    """Returns how far a point is out along the common normal of axes 1 and 2."""
    normal = np.cross(lines.direction(1), lines.direction(2))
    return _dot(lines.from_axis(1, point), normal / np.linalg.norm(normal, axis=1, keepdims=True))


def _above(lines: Lines, waist: Waist, reached: FloatArray, carried: FloatArray) -> FloatArray:
    """How far axis 3 is above the line from axis 2 to what is carried, seen with what is reached on the right."""
    outward = np.cross(lines.direction(1), lines.direction(2)) * np.sign(_ahead(lines, reached))[:, None]
    upward = np.cross(lines.direction(2), np.cross(lines.pointing(waist.joint), lines.direction(2)))
    return _bent(lines, 2, 3, carried, np.cross(outward, upward))


def _bent(lines: Lines, first: int, second: int, carried: FloatArray, viewer: FloatArray) -> FloatArray:
    """How far one axis is to the left of the line from another one to what is carried, for a viewer above them."""
    to_point, to_elbow = lines.from_axis(first, carried), lines.from_axis(first, lines.points[:, second - 1])
    return _leftness(to_point, to_elbow, viewer)


def _left(lines: Lines, carried: FloatArray, viewer: FloatArray) -> FloatArray:
    """Returns how far axis 3 is to the left of the line from where axes 1 and 2 meet to what is carried."""
    centre = lines.meeting(1, 2)
    to_point, to_elbow = carried - centre, -lines.from_axis(3, centre)
    return _leftness(to_point - _dot(to_point, viewer)[:, None] * viewer, to_elbow, viewer)


def _left_of_line(lines: Lines, viewer: FloatArray) -> FloatArray:
    """Returns how far axis 4 is to the left of the line from where axes 1 and 2 meet to where axes 5 and 6 meet."""
    shoulder = lines.meeting(1, 2)
    return _leftness(lines.meeting(5, 6) - shoulder, -lines.from_axis(4, shoulder), viewer)


def _leftness(to_point: FloatArray, to_elbow: FloatArray, viewer: FloatArray) -> FloatArray:
    """Returns the sine of the angle from one vector to another for a viewer above both; 0 where there is no angle."""
    sizes = np.linalg.norm(to_point, axis=1) * np.linalg.norm(to_elbow, axis=1) * np.linalg.norm(viewer, axis=1)
    turned = _dot(np.cross(to_point, to_elbow), viewer)
    found: FloatArray = np.divide(turned, sizes, out=np.zeros_like(turned), where=sizes > 0)
    return found
