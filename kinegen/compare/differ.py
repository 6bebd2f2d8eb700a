"""The greatest difference of two functions of the joint vector: samples in a fixed order, then a search from the worst.

Everything is in metres and radians.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kinegen import reference
from kinegen.robot.expressions import evaluate
from kinegen.robot.extent import reach
from kinegen.robot.floats import FLOATS
from kinegen.robot.model import JointType, Robot
from kinegen.tables.joints import METRES

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
    """What one radian or metre of each joint variable is in the units of a robot, shape (dof,)."""
    slides = [variable.type is JointType.PRISMATIC for variable in robot.variables]
    return np.array([1 / metres_of(robot) if each else 1.0 for each in slides])


def box_of(robot: Robot) -> Box:
    """The limits of a robot; a turn without limits is a whole one, a shift without limits the size of the robot."""
    size = max(float(reach(robot)), 1e-3)
    bounds = []
    for variable in robot.variables:
        if variable.limits is not None:
            bounds.append(tuple(float(evaluate(limit, {}, FLOATS)) for limit in variable.limits))
        else:
            span = size if variable.type is JointType.PRISMATIC else math.pi
            bounds.append((-span, span))
    low, high = np.array(bounds, dtype=np.float64).reshape(-1, 2).T
    return Box(low / units_of(robot), high / units_of(robot))


def poses(robot: Robot, frame: str, q: FloatArray) -> FloatArray:
    """Poses of a frame in metres, shape (N, 4, 4), for joint vectors in radians and metres."""
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
    """Find the greatest difference in a box.

    Args:
        difference: Joint vectors of shape (N, dof) -> distances and turns, shape (2, N).
        box: The bounds.
        q: Joint vectors to begin with.
        search: Whether to search from the worst of them; otherwise the worst are the answer.
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

    Args:
        robot: The robot.
        order: Which entry of a joint vector each of its joints takes.
        signs: 1 or -1 for each joint.
        offsets: What is added, in radians and metres.
    """

    def __init__(self, robot: Robot, order: list[int], signs: FloatArray, offsets: FloatArray) -> None:
        self.robot, self.order, self.signs, self.offsets = robot, order, signs, offsets
        self.last: tuple[FloatArray, dict[str, FloatArray]] | None = None

    def __call__(self, frame: str, q: FloatArray) -> FloatArray:
        """Poses in metres, shape (N, 4, 4)."""
        if self.last is None or self.last[0] is not q:
            own = (q[:, self.order] * self.signs + self.offsets) * units_of(self.robot)
            self.last = q, dict(reference.frames(self.robot, own))
        found = np.array(self.last[1][frame])
        found[:, :3, 3] *= metres_of(self.robot)
        return found
