"""The whole examination: what is tried, in which order, and what may be said of it.

In: a robot file and observed poses. Out: `Diagnosis`. Single changes and pairs are always tried; triples and an unknown
base or tool if none of these fits. A finding is only called the mistake if nothing else with as few changes agrees with
the poses.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from kinegen import reference
from kinegen.doctor.mounts import round_mount, turn_about_one_axis
from kinegen.doctor.poses import Observations
from kinegen.doctor.residual import targets
from kinegen.doctor.rewrite import rewrite, with_mount, with_unit
from kinegen.doctor.search import Search
from kinegen.doctor.separate import Separation, confirmation, groups, probes, separation
from kinegen.doctor.settings import OTHER
from kinegen.doctor.space import Candidate, Space, judge, predict
from kinegen.doctor.table import table_of
from kinegen.errors import KinegenError
from kinegen.formats.load import loads
from kinegen.formats.yaml.document import CannotRewriteError
from kinegen.older import StrEnum
from kinegen.robot.model import TOOL

MOST_CHANGES = 3

_ODDS = math.log(100)
"""A candidate that is this much less likely than the best one is not shown beside it."""

_AS_GOOD = 0.5
_SHOWN = 6
_NEARER = 0.1
"""A candidate that does not fit is shown if its errors are less than this part of those of the file."""


_ROUNDER = 1.5
"""How much larger the errors may become for rounder numbers of a base or tool."""

_LEAST_POSES = 3
"""Poses with orientation that base and tool together take."""

_SPARE = 6
"""Numbers that have to be left over to see whether a solved transform is right."""

_LEVELS = ((0, "no change"), (1, "one change"), (2, "two changes at once"))
_UNKNOWN = ((True, False, "the base"), (False, True, "the tool"), (True, True, "base and tool"))


class Verdict(StrEnum):
    """What the poses say."""

    AGREES = "agrees"
    FOUND = "found"
    AMBIGUOUS = "ambiguous"
    NOTHING = "nothing"


@dataclass(frozen=True, slots=True)
class Finding:
    """One explanation.

    Attributes:
        candidate: The changes, and how well they fit.
        words: Each change in words.
        same: Other ways to write the same robot: the words of each.
        text: The changed file; None where the file does not change, or not by an edit of its text.
        reason: Why the text cannot be changed, if so.
    """

    candidate: Candidate
    words: tuple[str, ...]
    same: tuple[tuple[str, ...], ...]
    text: str | None
    reason: str = ""


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """What the examination found.

    Attributes:
        verdict: What the poses say.
        start: The file as it is.
        findings: Explanations, the most likely first.
        untested: Single changes that the poses do not test, in words.
        hidden: Those that no pose tests, if no more is measured of it than now.
        separation: The pose to measure next, for the findings, or for what is not tested.
        tried: How many combinations were evaluated.
        left_out: What was not tried because it would take too long, in words.
    """

    verdict: Verdict
    start: Candidate
    findings: tuple[Finding, ...]
    untested: tuple[str, ...]
    hidden: tuple[str, ...]
    separation: Separation | None
    tried: int
    left_out: tuple[str, ...]


def examine(
    text: str, source: str, observed: Observations, frame: str, *, tolerance: float | None = None, most: int = 3
) -> Diagnosis:
    """Look for the changes that make a robot file agree with poses.

    Args:
        text: The robot file.
        source: What messages call it.
        observed: The poses.
        frame: The frame whose poses they are.
        tolerance: How far positions may be off, in their unit; None for what their digits say.
        most: Changes at once, 1 to `MOST_CHANGES`.
    """
    space = _space(text, source, observed, frame, tolerance)
    search = Search(space)
    left_out = _run(search, space, most)
    found = search.found
    start = judge(space, Candidate(space.start, (), (), None, None, 0, 0, 0, 0, 0))
    shown = _shown(space, found, start)
    findings = tuple(_finding(space, text, source, members) for members in shown)
    verdict = _verdict(findings, start)
    best, untested, hidden = None, tuple[str, ...](), tuple[str, ...]()
    if verdict is Verdict.AMBIGUOUS:
        best = separation(space, [finding.candidate for finding in findings])
    elif verdict is not Verdict.NOTHING and (open_ones := _untested(space, findings[0].candidate)):
        best, never = confirmation(space, findings[0].candidate, [candidate for _, candidate in open_ones])
        untested = tuple(words for (words, _), lost in zip(open_ones, never, strict=True) if not lost)
        hidden = tuple(words for (words, _), lost in zip(open_ones, never, strict=True) if lost)
    return Diagnosis(verdict, start, findings, untested, hidden, best, search.tried, left_out)


def _space(text: str, source: str, observed: Observations, frame: str, tolerance: float | None) -> Space:
    robot = loads(text, source)
    tables = {robot.units.angle: table_of(robot, frame)}
    other = OTHER[robot.units.angle]
    # If the file cannot be read in the other unit, that was not the mistake.
    with suppress(KinegenError, CannotRewriteError):
        tables[other] = table_of(loads(with_unit(text, "angle", other), source), frame)
    return Space(tables, observed, tolerance)


def _run(search: Search, space: Space, most: int) -> tuple[str, ...]:
    """Try everything, the simple first; returns what was left out."""
    left_out = [words for count, words in _LEVELS[: min(most, 2) + 1] if not search.level(count)]
    if any(candidate.fits for candidate in search.found):
        return tuple(left_out)
    if most > 2 and not search.level(3):
        left_out.append("three changes at once")
    known = space.numbers
    wanted = targets(space.observed, space.start)
    turned = bool(wanted.turned.sum() >= _LEAST_POSES)
    for base, tail, words in _UNKNOWN:
        fitted = 6 * (base + tail)
        if known < fitted + _SPARE or (base and tail and not turned):
            left_out.append(f"{words} unknown: that takes more poses{' with orientation' * (base and tail)}")
            continue
        if base and tail and turn_about_one_axis(wanted):
            left_out.append(f"{words} unknown: the orientations turn about one axis only")
            continue
        levels = _LEVELS[: min(most, 2) + 1]
        left_out += [f"{words} unknown and {also}" for n, also in levels if not search.level(n, base=base, tail=tail)]
    return tuple(left_out)


def _shown(space: Space, found: tuple[Candidate, ...], start: Candidate) -> list[list[Candidate]]:
    """Groups of candidates that are shown: those that fit about as well as the best, or the nearest ones."""
    best = found[0]
    if not best.fits:
        better = [candidate for candidate in found if candidate.score < _NEARER * start.score][: 4 * _SHOWN]
        return groups(space, better)[:_SHOWN]
    bar = space.value(best) + _ODDS
    rivals = [c for c in found if c.fits and c.cost <= best.cost and space.value(c) <= bar]
    return groups(space, rivals)


def _verdict(findings: tuple[Finding, ...], start: Candidate) -> Verdict:
    if not findings or not findings[0].candidate.fits:
        return Verdict.NOTHING
    if start.fits and not findings[0].candidate.cost:
        return Verdict.AGREES
    return Verdict.FOUND if len(findings) == 1 else Verdict.AMBIGUOUS


def _finding(space: Space, text: str, source: str, members: list[Candidate]) -> Finding:
    """The simplest of some candidates that are one robot, and the others in words."""
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
    """Each change in words."""
    unknown = [
        f"the transform '{name}' is another one, solved from the poses"
        for name, end in (("base", candidate.base), ("tool", candidate.tail))
        if end is not None
    ]
    return (*(change.words for change in candidate.changes), *(edit.words for edit in candidate.edits), *unknown)


def _rewritten(space: Space, text: str, source: str, candidate: Candidate) -> str:
    """The changed file, which is read again and compared with what was evaluated."""
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
    theirs = reference.frames(robot, q * units)[space.table.frame][:, :3].copy()
    theirs[:, :, 3] *= setting.scale
    reach = space.table.reach * setting.scale
    solved = candidate.base is not None or candidate.tail is not None
    slack = 2 * step + 1e-4 * reach if solved else 1e-9 * reach
    if np.abs(ours - theirs)[:, :, 3].max() > slack or np.abs(ours - theirs)[:, :, :3].max() > (
        1e-4 if solved else 1e-9
    ):
        raise CannotRewriteError("an entry is used in several places, so its text cannot be changed alone")
    return document.text


def _untested(space: Space, best: Candidate) -> tuple[tuple[str, Candidate], ...]:
    """Single changes that would make another robot, and agree with the poses as well as the best."""
    if best.base is not None or best.tail is not None:
        return ()
    bar = space.value(best) + space.penalty + _AS_GOOD
    found = []
    for words, candidate in _one_more(space, best):
        judged = judge(space, candidate)
        if judged.fits and space.value(judged) <= bar:
            found.append((words, judged))
    different = groups(space, [best, *(candidate for _, candidate in found)])
    names = {id(candidate): words for words, candidate in found}
    return tuple((names[id(members[0])], members[0]) for members in different[1:])


def _one_more(space: Space, best: Candidate) -> Iterator[tuple[str, Candidate]]:
    """The best candidate with each further change."""
    edited = frozenset().union(*(edit.places for edit in best.edits))
    for edit in space.edits:
        if edited.isdisjoint(edit.places):
            order = {id(each): place for place, each in enumerate(space.edits)}
            chosen = tuple(sorted((*best.edits, edit), key=lambda each: order[id(each)]))
            yield edit.words, replace(best, edits=chosen)
    changed = frozenset().union(*(change.places for change in best.changes))
    for change in space.changes:
        if changed.isdisjoint(change.places):
            yield change.words, replace(best, changes=(*best.changes, change), setting=change.apply(best.setting))
