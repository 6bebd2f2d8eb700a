"""The axes of an arm with six turning joints, and the fixed transforms between frames on them.

These are mpmath matrices, in units of the arm's reach. The axes are read from poses of the reference, so conventions do
not matter here.
"""

from __future__ import annotations

import itertools
import random
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import mpmath

from kinegen.errors import KinegenError
from kinegen.model.joint_bounds import reach
from kinegen.model.robot import JointType, Robot
from kinegen.support.dataclass import dataclass
from kinegen.verify import reference

JOINTS = 6

_TINY = mpmath.mpf(10) ** -15
_SLANTED = mpmath.mpf("0.05")
"""Axes with a smaller sine between them count as parallel where a frame is placed, for its origin would be far."""


@dataclass(frozen=True, slots=True)
class Screws:
    """The arm as base_T_tool = first Rz(q1) links[0] Rz(q2) ... Rz(q6) last, lengths divided by `scale`.

    Links lead from the frame on each axis to that on the next one; `last` is the tool in the frame on the last axis.
    """

    first: Any
    links: tuple[Any, ...]
    last: Any
    scale: float


def refusal(robot: Robot) -> str:
    """Say why an arm cannot have the complete inverse; empty if it can."""
    if robot.is_tree:
        return "it has several tips"
    if robot.dof != JOINTS:
        return f"it has {robot.dof} joints, not {JOINTS}"
    shifting = [variable.name for variable in robot.variables if variable.type is JointType.PRISMATIC]
    if shifting:
        return f"joint {shifting[0]} is prismatic"
    if robot.runtime_parameters:
        return f"{robot.runtime_parameters[0].name} is a runtime parameter, and the elimination needs its value"
    return ""


def screws_of(robot: Robot) -> Screws:
    """Find the axes of an arm.

    Raises:
        KinegenError: If its joints do not turn about one fixed axis each, by their variable.
    """
    home = _pose(robot, [0] * JOINTS)
    axes = []
    # The motion of one joint by 1 rad about its own axis, from two poses.
    for index in range(JOINTS):
        moved = _pose(robot, [int(place == index) for place in range(JOINTS)])
        axis = _axis(moved * mpmath.inverse(home))
        if axis is None:
            name = robot.variables[index].name
            raise refused(robot, f"joint {name} does not turn by its variable about one axis")
        axes.append(axis)
    size = reach(robot, robot.tips)
    frames = _frames([(axis, point / size) for axis, point in axes])
    home = _scaled(home, 1 / mpmath.mpf(size))
    links = tuple(mpmath.inverse(one) * other for one, other in itertools.pairwise(frames))
    screws = Screws(frames[0], links, mpmath.inverse(frames[-1]) * home, float(size))
    # Axes that move with other joints would pass so far, but not at a random joint vector.
    source = random.Random(1)  # noqa: S311 - a test of the model, not a secret
    q = [mpmath.mpf(source.randrange(-300, 300)) / 100 for _ in range(JOINTS)]
    if mpmath.mnorm(pose_of(screws, q) - _scaled(_pose(robot, q), 1 / mpmath.mpf(size)), "f") > _TINY:
        raise refused(robot, "a joint variable moves more than one axis")
    return screws


def refused(robot: Robot, reason: str) -> KinegenError:
    """Return the error for an arm without the complete inverse."""
    return KinegenError(f"no complete inverse for {robot.name}: {reason}", robot.source)


def require_double(robot: Robot, reals: Sequence[str]) -> None:
    """Refuse a build without double, in which the complete inverse computes, with a `KinegenError`."""
    if "double" not in reals:
        raise refused(robot, "it computes in double, which this build leaves out")


def beside(screws: Screws, amount: float) -> Screws:
    """Return another arm without any special geometry: each link moved by up to so many rad and parts of the scale."""
    source = random.Random(3)  # noqa: S311 - the same arm every time
    links = []
    for link in screws.links:
        a, b, *shift = (mpmath.mpf(source.randrange(-1000, 1000)) / 1000 * amount for _ in range(5))
        across, along = turn(a)[:3, :3], turn(b)[:3, :3]
        moved = mpmath.eye(4)
        # About x, then about y: the rows of a turn about z in another order.
        tilted = _reordered(across, (2, 0, 1)) * _reordered(along, (1, 2, 0))
        for row in range(3):
            moved[row, 3] = shift[row]
            for column in range(3):
                moved[row, column] = tilted[row, column]
        links.append(link * moved)
    return replace(screws, links=tuple(links))


def _reordered(matrix: Any, order: tuple[int, int, int]) -> Any:
    return mpmath.matrix([[matrix[row, column] for column in order] for row in order])


def pose_of(screws: Screws, q: Sequence[Any]) -> Any:
    """Return the pose for a joint vector, lengths divided by the scale."""
    found = screws.first
    for angle, link in zip(q, (*screws.links, screws.last), strict=True):
        found = found * turn(angle) * link
    return found


def turn(angle: Any) -> Any:
    """Return Rz of an angle, 4x4."""
    c, s = mpmath.cos(angle), mpmath.sin(angle)
    return mpmath.matrix([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])


def _pose(robot: Robot, q: Sequence[Any]) -> Any:
    return reference.pose_mp(robot, q)[0]


def _scaled(pose: Any, factor: Any) -> Any:
    found = pose.copy()
    for row in range(3):
        found[row, 3] *= factor
    return found


def _axis(motion: Any) -> tuple[Any, Any] | None:
    """Return direction and nearest point to the origin of the axis of a turn by 1 rad; None if it is another motion."""
    r, t = motion[:3, :3], motion[:3, 3]
    skew = mpmath.matrix([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]])
    sine, cosine = mpmath.norm(skew), r[0, 0] + r[1, 1] + r[2, 2] - 1
    if abs(mpmath.atan2(sine, cosine) - 1) > _TINY:
        return None
    axis = skew / sine
    if abs(dot(axis, t)) > _TINY * (1 + mpmath.norm(t)):
        return None
    return axis, (t + cross(axis, t) * mpmath.cot(mpmath.mpf(1) / 2)) / 2


def _frames(axes: list[tuple[Any, Any]]) -> list[Any]:
    """Put a frame on each axis: z along it, the origin where the normal to the next axis leaves it."""
    found: list[Any] = []
    for index, (axis, point) in enumerate(axes):
        other, far = axes[index + 1 if index + 1 < len(axes) else index - 1]
        normal, way = cross(axis, other), far - point
        # Nearly parallel axes have their normal far away: the origin of the frame before is taken over.
        if mpmath.norm(normal) < _SLANTED:
            before = found[-1][:3, 3] if found else mpmath.matrix([0, 0, 0])
            origin = point + axis * dot(axis, before - point)
            normal = way - axis * dot(axis, way)
        else:
            slant = dot(axis, other)
            origin = point + axis * ((dot(axis, way) - slant * dot(other, way)) / (1 - slant**2))
        if mpmath.norm(normal) < _TINY:
            normal = cross(axis, mpmath.matrix([0, 1, 0] if abs(axis[0]) > mpmath.mpf("0.9") else [1, 0, 0]))
        x = normal / mpmath.norm(normal)
        columns = (x, cross(axis, x), axis, origin)
        rows = [[column[row] for column in columns] for row in range(3)]
        found.append(mpmath.matrix([*rows, [0, 0, 0, 1]]))
    return found


def dot(a: Any, b: Any) -> Any:
    """Return the inner product of two vectors with three entries."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Any, b: Any) -> Any:
    """Return the cross product of two vectors with three entries."""
    after = ((1, 2), (2, 0), (0, 1))
    return mpmath.matrix([a[j] * b[k] - a[k] * b[j] for j, k in after])
