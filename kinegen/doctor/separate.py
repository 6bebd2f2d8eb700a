"""What candidates predict elsewhere: which of them are one robot, and which pose would separate the others.

In: candidates that agree on the observed poses. Out: groups that agree at every joint vector, and the joint vector at
which the least different two are farthest apart.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from kinegen.doctor import readings
from kinegen.doctor.product import Frames
from kinegen.doctor.space import Candidate, Space, predict
from kinegen.doctor.table import BoolArray, FloatArray
from kinegen.robot.extent import joint_box
from kinegen.robot.model import Convention

_PROBES = 32
_TRIALS = 4000
_SAME = 1e-7
"""Candidates that differ by less than this part of the reach are one robot."""

_SEEN = 4.0
"""Half digits by which two predictions have to differ to be told apart."""


@dataclass(frozen=True, slots=True)
class Separation:
    """A pose that tells candidates apart.

    Attributes:
        joints: Joint values as they would be written, shape (dof,).
        positions: What each candidate predicts, shape (candidates, 3), as it would be written.
        orientations: The same for the orientation, shape (candidates, 3 or 4); (candidates, 0) where none is measured.
        distance: How far the positions of the nearest two are apart, in the length unit of the poses.
        degrees: How far their orientations are apart.
    """

    joints: tuple[float, ...]
    positions: FloatArray
    orientations: FloatArray
    distance: float
    degrees: float


def groups(space: Space, candidates: Sequence[Candidate]) -> list[list[Candidate]]:
    """Candidates that predict the same everywhere, those with fewest changes first; the order is kept."""
    q = probes(space)
    scale = space.table.reach
    found: list[tuple[FloatArray, list[Candidate]]] = []
    for candidate in candidates:
        frames = np.stack(predict(space, candidate, q))[:, :, 0]
        frames[3] /= scale * candidate.setting.scale
        for seen, members in found:
            if members[0].setting.reading == candidate.setting.reading and np.abs(seen - frames).max() < _SAME:
                members.append(candidate)
                break
        else:
            found.append((frames, [candidate]))
    return [sorted(members, key=_plainness) for _, members in found]


def _plainness(candidate: Candidate) -> tuple[int, bool, int]:
    """Few changes first, then those of the whole; a rare convention is the last explanation."""
    rare = candidate.setting.convention is Convention.MODIFIED_PREV_D and bool(candidate.changes)
    return candidate.cost, rare, len(candidate.edits)


def probes(space: Space) -> FloatArray:
    """Joint vectors on which candidates are compared, as they are written, shape (N, dof)."""
    return _samples(space, space.start.joint_angle, _PROBES)


def separation(space: Space, candidates: Sequence[Candidate]) -> Separation | None:
    """The pose that separates candidates best from each other, or None if none does.

    Args:
        space: What was tried.
        candidates: Two or more.
    """
    pairs = tuple(combinations(range(len(candidates)), 2))
    q, seen, apart = _compared(space, candidates, pairs)
    return _best(q, seen, apart)


def confirmation(space: Space, first: Candidate, rivals: Sequence[Candidate]) -> tuple[Separation | None, BoolArray]:
    """The pose that separates one candidate best from each of some others.

    Args:
        space: What was tried.
        first: The candidate.
        rivals: The others, one or more.

    Returns:
        The pose, and which of the others no pose of this kind of measurement separates from it, shape (rivals,).
    """
    pairs = tuple((0, place) for place in range(1, len(rivals) + 1))
    q, seen, apart = _compared(space, (first, *rivals), pairs)
    hidden: BoolArray = apart[:, 2].max(axis=1) < _SEEN
    if hidden.all():
        return None, hidden
    return _best(q, seen[:1], apart[~hidden]), hidden


def _compared(
    space: Space, candidates: Sequence[Candidate], pairs: tuple[tuple[int, int], ...]
) -> tuple[FloatArray, list[tuple[FloatArray, FloatArray]], FloatArray]:
    """Many joint vectors, what is written there, and for each pair distance, angle, and both in units of bounds."""
    first = candidates[0].setting
    q = _rounded(space, first.joint_angle, _samples(space, first.joint_angle, _TRIALS))
    seen = [_written(candidate, predict(space, candidate, q)) for candidate in candidates]
    limits = space.limits(first, space.observed)
    apart = []
    for i, j in pairs:
        shift, turn = _apart(candidates[j], seen[i], seen[j])
        apart.append((shift, turn, np.maximum(shift / limits.position_bound, turn / limits.rotation_bound)))
    return q, seen, np.array(apart)


def _best(q: FloatArray, seen: Sequence[tuple[FloatArray, FloatArray]], apart: FloatArray) -> Separation | None:
    """Where the least measure of all pairs is largest."""
    best = int(np.argmax(apart[:, 2].min(axis=0)))
    shift, turn, measure = apart[np.argmin(apart[:, 2, best]), :, best]
    if measure < _SEEN:
        return None
    positions = np.stack([positions[best] for positions, _ in seen])
    orientations = np.stack([numbers[best] for _, numbers in seen])
    return Separation(tuple(q[best].tolist()), positions, orientations, float(shift), float(np.degrees(turn)))


def _samples(space: Space, unit: str, count: int) -> FloatArray:
    """Joint vectors within the limits, as they are written; the same in every run."""
    table = space.table
    box = np.array(joint_box(table.robot), dtype=np.float64).reshape(-1, 2)
    box[~table.prismatic] *= 180 / np.pi if unit == "deg" else 1.0
    box[table.prismatic] *= space.start.scale
    found: FloatArray = np.random.default_rng(1).uniform(box[:, 0], box[:, 1], (count, len(box)))
    return found


def _rounded(space: Space, unit: str, q: FloatArray) -> FloatArray:
    """Numbers that are easily commanded: 5 degrees, 0.1 rad, or a fiftieth of a stroke; towards zero, so in limits."""
    steps = np.full(q.shape[1], 5.0 if unit == "deg" else 0.1)
    strokes = np.abs(q[:, space.table.prismatic]).max(axis=0, initial=0.0)
    steps[space.table.prismatic] = 10.0 ** np.floor(np.log10(np.maximum(strokes, 1e-9) / 5))
    inverse = np.round(1 / steps, 12)
    found: FloatArray = np.trunc(q * inverse) / inverse + 0.0  # no -0
    outside = _outside(space, unit, found)
    return found[~outside] if not outside.all() else q


def _outside(space: Space, unit: str, q: FloatArray) -> BoolArray:
    box = np.array(joint_box(space.table.robot), dtype=np.float64).reshape(-1, 2)
    box[~space.table.prismatic] *= 180 / np.pi if unit == "deg" else 1.0
    box[space.table.prismatic] *= space.start.scale
    slack = 1e-9 * (1 + np.abs(box))
    return np.asarray(((q < box[:, 0] - slack[:, 0]) | (q > box[:, 1] + slack[:, 1])).any(axis=1))


def _written(candidate: Candidate, frames: Frames) -> tuple[FloatArray, FloatArray]:
    """Predicted poses as they would be written: positions (K, 3) and orientations (K, 0, 3 or 4)."""
    *axes, origin = (part[:, 0].T for part in frames)
    form = candidate.setting.form
    if not form:
        return origin, np.zeros((len(origin), 0))
    numbers = readings.numbers_of(form, np.stack(axes, axis=-1))
    in_degrees = form in readings.THREE and candidate.setting.pose_angle == "deg"
    return origin, np.degrees(numbers) if in_degrees else numbers


def _apart(
    other: Candidate, seen: tuple[FloatArray, FloatArray], theirs: tuple[FloatArray, FloatArray]
) -> tuple[FloatArray, FloatArray]:
    """How far what one candidate predicts is from another's prediction, when it is read as the other one reads."""
    shift = np.linalg.norm(seen[0] - theirs[0], axis=1)
    form = other.setting.form
    if not form:
        return shift, np.zeros_like(shift)
    in_degrees = form in readings.THREE and other.setting.pose_angle == "deg"
    first, second = (
        readings.rotations(form, np.radians(numbers) if in_degrees else numbers) for numbers in (seen[1], theirs[1])
    )
    return shift, np.sqrt(((first - second) ** 2).sum(axis=(1, 2)) / 2)
