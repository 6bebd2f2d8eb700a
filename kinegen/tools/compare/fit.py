"""Signs and zero offsets of joints: what makes the joints of one robot those of another.

The axes are matched from the base outwards: a turn of one joint brings the next axis onto that of the other robot, in
one direction or the other. What that leaves open, such as the stroke of a slide between parallel axes, is fitted to
poses. Both robots have the same base and tip.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from kinegen.model.robot import JointType, Robot
from kinegen.support.dataclass import dataclass
from kinegen.tools.compare.frame_differences import FloatArray, Motions, box_of, distances, poses

_CLOSE = 1e-3
"""How far axes may be apart while they are matched; the fit to poses decides."""
_MOST = 512
_FOUND = 1e-9
_STEP = 1e-6


@dataclass(frozen=True, slots=True)
class Side:
    """A frame of one of the robots, also as screws."""

    robot: Robot
    frame: str
    motions: Motions


@dataclass(frozen=True, slots=True)
class Fit:
    """`q_second = signs * q_first + offsets`, in radians and metres; `residual` in metres and radians."""

    signs: tuple[int, ...]
    offsets: tuple[float, ...]
    residual: float


@dataclass(frozen=True, slots=True)
class _Line:
    turns: bool
    direction: FloatArray
    point: FloatArray


def _lines(found: Motions, names: list[str]) -> list[_Line] | None:
    """Joint axes in the order of the joint vector, along positive motion; None where a joint is not one motion."""
    lines = []
    by_name = {motion.factors[0][0]: motion for motion in found.motions}
    if sorted(by_name) != sorted(names) or len(found.motions) != len(names):
        return None
    for motion in (by_name[name] for name in names):
        if len(motion.factors) != 1 or abs(abs(float(motion.factors[0][1])) - 1) > 1e-12:
            return None
        sign = math.copysign(1.0, float(motion.factors[0][1]))
        point = np.array([float(each) for each in motion.point])
        lines.append(_Line(motion.turns, sign * np.array([float(each) for each in motion.direction]), point))
    return lines


def _pose(found: Motions) -> FloatArray:
    pose = np.eye(4)
    pose[:3, :3] = [[float(each) for each in row] for row in found.rotation]
    pose[:3, 3] = [float(each) for each in found.position]
    return pose


def candidates(first: Side, second: Side) -> Iterator[tuple[list[int], list[float]]]:
    """Signs and first guesses of the offsets, from the axes at zero."""
    left, right = (_lines(each.motions, [v.name for v in each.robot.variables]) for each in (first, second))
    if left is None or right is None or len(left) != len(right):
        return
    if any(a.turns != b.turns for a, b in zip(left, right, strict=True)):
        return
    yield from _match(left, right, _pose(first.motions), _pose(second.motions), np.eye(4), [], [], loose=False)


def _match(
    left: list[_Line],
    right: list[_Line],
    end: FloatArray,
    other_end: FloatArray,
    moved: FloatArray,
    signs: list[int],
    offsets: list[float],
    *,
    loose: bool,
) -> Iterator[tuple[list[int], list[float]]]:
    """Match the next axis, and go on with each turn that fits."""
    place = len(signs)
    if place == len(left):
        yield signs, offsets
        return
    a, b = left[place], _moved(right[place], moved)
    for sign in (1, -1):
        if np.linalg.norm(a.direction - sign * b.direction) > _CLOSE:
            continue
        beside = a.point - b.point
        beside = beside - (beside @ a.direction) * a.direction
        if a.turns and not loose and np.linalg.norm(beside) > _CLOSE:
            continue
        # A shift along the axis says nothing of the turn about it: the line behind it does.
        ahead = place + 1
        while a.turns and ahead < len(left) and not left[ahead].turns and _parallel(left[ahead], a):
            ahead += 1
        after = (left[ahead], _moved(right[ahead], moved)) if ahead < len(left) else None
        for offset, known in _offsets(a, b, after, end, moved @ other_end):
            step = _motion(b, offset) @ moved
            yield from _match(
                left, right, end, other_end, step, [*signs, sign], [*offsets, offset], loose=loose or not known
            )


def _offsets(
    a: _Line, b: _Line, after: tuple[_Line, _Line] | None, end: FloatArray, other_end: FloatArray
) -> list[tuple[float, bool]]:
    """Return how far the second joint goes until the next axis, or the end, is where it is in the first robot."""
    # A slide brings the next axis or the end to its place along its direction.
    if not a.turns:
        target, source = (after[0].point, after[1].point) if after else (end[:3, 3], other_end[:3, 3])
        across = b.direction
        if after and after[0].turns:
            across = across - (across @ after[0].direction) * after[0].direction
        size = float(across @ across)
        return [(float((target - source) @ across) / size, True)] if size > 1e-6 else [(0.0, False)]
    # A turn brings an axis of the end, or the next joint axis in either direction, onto the other one.
    if after is None:
        pairs = [(other_end[:3, k], end[:3, k]) for k in range(3)]
    else:
        near, far = after
        pairs = [(far.direction, near.direction), (far.direction, -near.direction)]
        if np.linalg.norm(np.cross(near.direction, b.direction)) < 1e-6:
            pairs = [(far.point - b.point, near.point - b.point)] if near.turns else []
    # Only what is square to the axis tells an angle.
    found = []
    for source, target in pairs:
        start, stop = (each - (each @ b.direction) * b.direction for each in (source, target))
        if min(np.linalg.norm(start), np.linalg.norm(stop)) > 1e-6:
            angle = math.atan2(float(np.cross(start, stop) @ b.direction), float(start @ stop))
            found.append((angle, True))
            if after is None:
                break
    return list(dict.fromkeys(found)) or [(0.0, False)]


def _parallel(left: _Line, right: _Line) -> bool:
    return float(np.linalg.norm(np.cross(left.direction, right.direction))) < 1e-6


def _moved(line: _Line, pose: FloatArray) -> _Line:
    return _Line(line.turns, pose[:3, :3] @ line.direction, pose[:3, :3] @ line.point + pose[:3, 3])


def _motion(line: _Line, amount: float) -> FloatArray:
    """Return the transform of a joint about its line, shape (4, 4)."""
    pose = np.eye(4)
    if not line.turns:
        pose[:3, 3] = amount * line.direction
        return pose
    x, y, z = line.direction
    skew = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    pose[:3, :3] = np.eye(3) + math.sin(amount) * skew + (1 - math.cos(amount)) * skew @ skew
    pose[:3, 3] = line.point - pose[:3, :3] @ line.point
    return pose


def fit(first: Side, second: Side) -> Fit | None:
    """Find the best signs and offsets; return None where the axes do not match."""
    box = box_of(first.robot)
    q = np.random.default_rng(7).uniform(np.maximum(box.low, -2), np.minimum(box.high, 2), (24, len(box.low)))
    wanted = poses(first.robot, first.frame, q)
    best: Fit | None = None
    for number, (signs, guess) in enumerate(candidates(first, second)):
        if number == _MOST:
            break
        # A guess from axes is refined on poses; the first that fits to rounding is taken.
        offsets = _refined(second, wanted, q * signs, np.array(guess))
        found = poses(second.robot, second.frame, q * signs + offsets)
        residual = float(distances(wanted, found).max())
        if best is None or residual < best.residual * 0.999:
            best = Fit(tuple(signs), tuple(_round(each) for each in offsets), residual)
        if best.residual < _FOUND:
            break
    return best


def _round(value: float) -> float:
    """Return an offset without the noise of the fit, a multiple of a degree where it is one."""
    degrees = round(math.degrees(value), 9)
    return math.radians(degrees) if degrees == round(degrees, 3) else round(value, 12)


def _refined(second: Side, wanted: FloatArray, q: FloatArray, offsets: FloatArray) -> FloatArray:
    """Least squares of the poses by Gauss and Newton, with differences for derivatives."""

    def entries(shift: FloatArray) -> FloatArray:
        return poses(second.robot, second.frame, q + shift)[:, :3].reshape(-1)

    for _ in range(8):
        here = entries(offsets)
        slopes = np.stack([(entries(offsets + _STEP * each) - here) / _STEP for each in np.eye(len(offsets))], axis=1)
        change = np.linalg.lstsq(slopes, wanted[:, :3].reshape(-1) - here, rcond=1e-9)[0]
        offsets = offsets + change
        if np.abs(change).max() < 1e-12:
            break
    # Whole turns are no offset.
    whole = 2 * math.pi * np.round(offsets / (2 * math.pi))
    turns = [variable.type is not JointType.PRISMATIC for variable in second.robot.variables]
    return offsets - np.where(turns, whole, 0.0)
