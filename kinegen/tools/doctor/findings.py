"""Separates candidates by further poses, and puts them into words and changed files.

Candidates that agree at every joint vector are one explanation; the next pose to measure is where the least different
two are farthest apart. The numbers of a `Finding` are as round as the poses allow, and its text was read again.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from kinegen.errors import KinegenError
from kinegen.io.load import loads
from kinegen.io.robot_file.document import CannotRewriteError
from kinegen.model.joint_bounds import joint_box
from kinegen.model.robot import TOOL, Convention
from kinegen.support.dataclass import dataclass
from kinegen.tools.doctor import observed_poses
from kinegen.tools.doctor.base_tool_fit import round_mount
from kinegen.tools.doctor.edits import EditKind
from kinegen.tools.doctor.hypotheses import Candidate, Space, judge, predict
from kinegen.tools.doctor.number_fit import rounder, solvable_kinds
from kinegen.tools.doctor.numeric_table import BoolArray
from kinegen.tools.doctor.observed_poses import FloatArray
from kinegen.tools.doctor.residual import Frames, angles, deviations, targets
from kinegen.tools.doctor.rewrite import rewrite, with_mount
from kinegen.verify import reference

_PROBES = 32
_TRIALS = 4000
_SAME = 1e-7
"""Candidates that differ by less than this part of the reach are one robot."""

_SEEN = 4.0
"""Half digits by which two predictions have to differ to be told apart."""


@dataclass(frozen=True, slots=True)
class Separation:
    """A pose that tells candidates apart, as it would be written, and how far the nearest two are apart.

    Attributes:
        positions: What each candidate predicts, shape (candidates, 3), as it would be written.
        orientations: The same for the orientation, shape (candidates, 3 or 4); (candidates, 0) where none is measured.
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
        # Lengths count by the reach, so that one limit suits positions and rotations.
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
    """Return the pose that separates two or more candidates best from each other, or None if none does."""
    pairs = tuple(combinations(range(len(candidates)), 2))
    q, seen, apart = _compared(space, candidates, pairs)
    return _best(q, seen, apart)


def confirmation(space: Space, first: Candidate, rivals: Sequence[Candidate]) -> tuple[Separation | None, BoolArray]:
    """Return the pose that separates one candidate best from others, and which of them no pose separates from it."""
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
    """Return where the least measure of all pairs is largest."""
    best = int(np.argmax(apart[:, 2].min(axis=0)))
    shift, turn, measure = apart[np.argmin(apart[:, 2, best]), :, best]
    if measure < _SEEN:
        return None
    positions = np.stack([positions[best] for positions, _ in seen])
    orientations = np.stack([numbers[best] for _, numbers in seen])
    return Separation(tuple(q[best].tolist()), positions, orientations, float(shift), float(np.degrees(turn)))


def _samples(space: Space, unit: str, count: int) -> FloatArray:
    """Joint vectors within the limits, as they are written; the same in every run."""
    box = _box(space, unit)
    found: FloatArray = np.random.default_rng(1).uniform(box[:, 0], box[:, 1], (count, len(box)))
    return found


def _box(space: Space, unit: str) -> FloatArray:
    """Return the limits of the joints as they are written, shape (dof, 2)."""
    box = np.array(joint_box(space.table.robot), dtype=np.float64).reshape(-1, 2)
    box[~space.table.prismatic] *= 180 / np.pi if unit == "deg" else 1.0
    box[space.table.prismatic] *= space.start.scale
    return box


def _rounded(space: Space, unit: str, q: FloatArray) -> FloatArray:
    """Numbers that are easily commanded: 5 degrees, 0.1 rad, or a fiftieth of a stroke; towards zero, so in limits."""
    steps = np.full(q.shape[1], 5.0 if unit == "deg" else 0.1)
    strokes = np.abs(q[:, space.table.prismatic]).max(axis=0, initial=0.0)
    steps[space.table.prismatic] = 10.0 ** np.floor(np.log10(np.maximum(strokes, 1e-9) / 5))
    inverse = np.round(1 / steps, 12)
    found: FloatArray = np.trunc(q * inverse) / inverse + 0.0  # no -0
    # Rounding towards zero may leave limits that do not contain zero.
    box = _box(space, unit)
    slack = 1e-9 * (1 + np.abs(box))
    outside = ((found < box[:, 0] - slack[:, 0]) | (found > box[:, 1] + slack[:, 1])).any(axis=1)
    return found[~outside] if not outside.all() else q


def _written(candidate: Candidate, frames: Frames) -> tuple[FloatArray, FloatArray]:
    """Predicted poses as they would be written: positions (K, 3) and orientations (K, 0, 3 or 4)."""
    *axes, origin = (part[:, 0].T for part in frames)
    form = candidate.setting.form
    if not form:
        return origin, np.zeros((len(origin), 0))
    numbers = observed_poses.numbers_of(form, np.stack(axes, axis=-1))
    in_degrees = form in observed_poses.THREE and candidate.setting.pose_angle == "deg"
    return origin, np.degrees(numbers) if in_degrees else numbers


def _apart(
    other: Candidate, seen: tuple[FloatArray, FloatArray], theirs: tuple[FloatArray, FloatArray]
) -> tuple[FloatArray, FloatArray]:
    """Return the distance of two predictions, where one is read as the candidate of the other one reads."""
    shift = np.linalg.norm(seen[0] - theirs[0], axis=1)
    form = other.setting.form
    if not form:
        return shift, np.zeros_like(shift)
    in_degrees = form in observed_poses.THREE and other.setting.pose_angle == "deg"
    first, second = (
        observed_poses.rotations(form, np.radians(numbers) if in_degrees else numbers)
        for numbers in (seen[1], theirs[1])
    )
    return shift, angles(np.sqrt(((first - second) ** 2).sum(axis=(1, 2)) / 2))


_ROUNDER = 1.5
"""How much larger the errors may become for rounder numbers of a base or tool."""


@dataclass(frozen=True, slots=True)
class Finding:
    """One explanation: a candidate, and its changes in words.

    Attributes:
        same: Other ways to write the same robot: the words of each.
        text: The changed file; None where the file does not change, or not by an edit of its text.
        reason: Why the text cannot be changed, if so.
    """

    candidate: Candidate
    words: tuple[str, ...]
    same: tuple[tuple[str, ...], ...]
    text: str | None
    reason: str = ""


def shortened(space: Space, candidate: Candidate) -> Candidate:
    """Return the candidate with a solved number in as few digits as the poses allow."""
    return rounder(space, candidate) if any(edit.kind is EditKind.NUMBER for edit in candidate.edits) else candidate


def finding_of(space: Space, text: str, source: str, members: list[Candidate]) -> Finding:
    """Return the simplest of some candidates that are one robot, and the others in words."""
    first = rounded(space, members[0])
    words = tuple(words_of(member) for member in members if member.cost == first.cost)
    try:
        changed = _rewritten(space, text, source, first)
    except (CannotRewriteError, KinegenError) as error:
        return Finding(first, words[0], words[1:], None, str(error))
    return Finding(first, words[0], words[1:], changed if changed != text else None)


def rounded(space: Space, candidate: Candidate) -> Candidate:
    """The candidate with rounder numbers in a base or tool that was solved for, where the poses agree with them too."""
    if candidate.base is None and candidate.tail is None:
        return candidate
    limits = space.limits(candidate.setting, space.observed)
    for angle in (90.0, 15.0, 1.0, 0.1):
        for length in (200.0, 20.0, 2.0):
            ends = [
                None if end is None else round_mount(end, angle, length * limits.position)
                for end in (candidate.base, candidate.tail)
            ]
            found = judge(space, replace(candidate, base=ends[0], tail=ends[1]))
            if found.fits and found.score < _ROUNDER * max(candidate.score, 1.0):
                return found
    return candidate


def words_of(candidate: Candidate) -> tuple[str, ...]:
    """Return each change in words."""
    unknown = [
        f"the transform '{name}' is another one, solved from the poses"
        for name, end in (("base", candidate.base), ("tool", candidate.tail))
        if end is not None
    ]
    return (*(change.words for change in candidate.changes), *(edit.words for edit in candidate.edits), *unknown)


def _rewritten(space: Space, text: str, source: str, candidate: Candidate) -> str:
    """Return the changed file, which is read again and compared with what was evaluated."""
    setting = candidate.setting
    document = rewrite(text, space.table, candidate.changes, candidate.edits, setting)
    # A fitted number is printed to a tenth of what the poses resolve.
    step = space.limits(setting, space.observed).position / 10
    for field, end in (("base", candidate.base), ("tail", candidate.tail)):
        if end is not None:
            if field == "tail" and space.table.frame != TOOL:
                raise CannotRewriteError(f"the frame {space.table.frame} would need another transform")
            document = with_mount(document, field, end, setting, step)
    robot = loads(document.text, source)
    q = probes(space)
    ours = np.stack(predict(space, candidate, q))[:, :, 0].transpose(2, 1, 0)
    units = np.where(space.table.prismatic, 1 / setting.scale, np.pi / 180 if setting.joint_angle == "deg" else 1.0)
    values = q @ setting.matrix(q.shape[1]).T
    theirs = reference.frames(robot, values * units)[space.table.frame][:, :3].copy()
    theirs[:, :, 3] *= setting.scale
    reach = space.table.reach * setting.scale
    solved = candidate.base is not None or candidate.tail is not None
    slack = 2 * step + 1e-4 * reach if solved else 1e-9 * reach
    away = np.abs(ours - theirs)
    if away[:, :, 3].max() > slack or away[:, :, :3].max() > (1e-4 if solved else 1e-9):
        raise CannotRewriteError("an entry is used in several places, so its text cannot be changed alone")
    return document.text


_MOST_CHANGES = 1
"""Changes that are worth a statement where not even all poses agree with them."""


@dataclass(frozen=True, slots=True)
class PoseError:
    """The distance of one pose from what is predicted, in the length unit of the poses.

    Attributes:
        rotation: The angle, in radians; 0 where no orientation is observed.
        fits: Whether both are within the tolerance.
    """

    line: int
    position: float
    rotation: float
    fits: bool


def pose_errors(space: Space, candidate: Candidate) -> tuple[PoseError, ...]:
    """Return the errors of all poses, in their order."""
    limits = space.limits(candidate.setting, space.observed)
    predicted = predict(space, candidate, space.observed.joints)
    shift, turn = (part[0] for part in deviations(predicted, targets(space.observed, candidate.setting)))
    fits = np.maximum(shift / limits.position_bound, turn / limits.rotation_bound) <= 1
    each = zip(space.observed.lines, shift, turn, fits, strict=True)
    return tuple(PoseError(line, float(far), float(angle), bool(good)) for line, far, angle, good in each)


_NEAR = 0.02
"""Errors below this part of the reach, or this angle, may be those of a right table of a real arm."""


@dataclass(frozen=True, slots=True)
class MostAgree:
    """The file as it is, or a change of it, with which all poses but a few agree, and the errors of each pose."""

    finding: Finding
    errors: tuple[PoseError, ...]


@dataclass(frozen=True, slots=True)
class Unexplained:
    """Remarks on poses that nothing explains, and what all but a few agree with.

    Attributes:
        kinds: Kinds of entries with which a calibration would explain the poses; empty for none.
        positions_agree: Whether only the orientations differ.
        is_near: Whether the errors are small beside the reach.
    """

    errors: tuple[PoseError, ...]
    most_agree: MostAgree | None
    kinds: tuple[str, ...]
    positions_agree: bool
    is_near: bool


def unexplained(space: Space, text: str, source: str, start: Candidate, found: tuple[Candidate, ...]) -> Unexplained:
    """Look at the poses one by one, and at whole kinds of entries; `found` is the best of what was tried."""
    # All poses but the few worst may agree with the file as it is, or else with one change of it.
    each = [candidate for candidate in (start, *found) if candidate.rest <= 1 and candidate.cost <= _MOST_CHANGES]
    near, most = min(each, key=lambda candidate: candidate.cost, default=None), None
    if near is not None:
        most = MostAgree(finding_of(space, text, source, [near]), pose_errors(space, near))
    return Unexplained(
        errors=pose_errors(space, start),
        most_agree=most,
        kinds=solvable_kinds(space),
        positions_agree=bool(space.start.form) and start.position <= space.common.position_bound,
        is_near=start.position < _NEAR * space.table.reach * space.start.scale and start.rotation < _NEAR,
    )
