"""Examines a robot file with observed poses, and decides what may be said of it.

Single changes and pairs are always tried; triples and an unknown base or tool if none of these fits. A finding is only
called the mistake if nothing else with as few changes agrees with the poses.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace

from kinegen.errors import KinegenError
from kinegen.io.load import loads
from kinegen.io.robot_file.document import CannotRewriteError
from kinegen.support.compat import StrEnum
from kinegen.support.dataclass import dataclass
from kinegen.tools.doctor.base_tool_fit import turn_about_one_axis
from kinegen.tools.doctor.findings import (
    Finding,
    Separation,
    Unexplained,
    confirmation,
    finding_of,
    groups,
    separation,
    shortened,
    unexplained,
)
from kinegen.tools.doctor.hypotheses import Candidate, Space, judge
from kinegen.tools.doctor.number_fit import single_numbers
from kinegen.tools.doctor.numeric_table import OTHER, table_of
from kinegen.tools.doctor.observed_poses import Observations
from kinegen.tools.doctor.residual import EXACT, Tolerance, targets
from kinegen.tools.doctor.rewrite import with_unit
from kinegen.tools.doctor.search import CHANCE, Search

MOST_CHANGES = 3

_ODDS = math.log(100)
"""A candidate that is this much less likely than the best one is not shown beside it."""

_AS_GOOD = 0.5
_SHOWN = 6
_NEARER = 0.1
"""A candidate that does not fit is shown if its errors are less than this part of those of the file."""


_LEAST_POSES = 3
"""Poses with orientation that base and tool together take."""

_SPARE = 6
"""Numbers that have to be left over to see whether a solved transform is right."""

_LEVELS = ((0, "no change"), (1, "one change"), (2, "two changes at once"))
_UNKNOWN = ((True, False, "the base"), (False, True, "the tool"), (True, True, "base and tool"))


class Verdict(StrEnum):
    """Answers that poses give."""

    AGREES = "agrees"
    FOUND = "found"
    AMBIGUOUS = "ambiguous"
    NOTHING = "nothing"


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """The result of an examination; what was not tried or tested is in words.

    Attributes:
        untested: Single changes that the poses do not test, in words.
        hidden: Those that no pose tests, if no more is measured of it than now.
        separation: The pose to measure next, for the findings, or for what is not tested.
        left_out: What was not tried because it would take too long, in words.
        unexplained: What can be said where nothing explains the poses; None elsewhere.
    """

    verdict: Verdict
    start: Candidate
    findings: tuple[Finding, ...]
    untested: tuple[str, ...]
    hidden: tuple[str, ...]
    separation: Separation | None
    tried: int
    left_out: tuple[str, ...]
    unexplained: Unexplained | None


def examine(
    text: str, source: str, observed: Observations, frame: str, *, tolerance: Tolerance = EXACT, most: int = 3
) -> Diagnosis:
    """Look for the changes, 1 to `MOST_CHANGES` at once, that make a robot file agree with poses of a frame."""
    space = _space(text, source, observed, frame, tolerance)
    search = Search(space)
    left_out = _run(search, space, most)
    found = tuple(shortened(space, candidate) for candidate in search.found)
    start = judge(space, space.as_it_is)
    shown = _shown(space, found, start)
    findings = tuple(finding_of(space, text, source, members) for members in shown)
    verdict = _verdict(findings, start)
    # One explanation is confirmed against what was not tested; several are told apart by a further pose.
    best, untested, hidden = None, tuple[str, ...](), tuple[str, ...]()
    if verdict is Verdict.AMBIGUOUS:
        best = separation(space, [finding.candidate for finding in findings])
    elif verdict is not Verdict.NOTHING and (open_ones := _untested(space, findings[0].candidate)):
        best, never = confirmation(space, findings[0].candidate, [candidate for _, candidate in open_ones])
        untested = tuple(words for (words, _), lost in zip(open_ones, never, strict=True) if not lost)
        hidden = tuple(words for (words, _), lost in zip(open_ones, never, strict=True) if lost)
    left = unexplained(space, text, source, start, found) if verdict is Verdict.NOTHING else None
    return Diagnosis(verdict, start, findings, untested, hidden, best, search.tried, left_out, left)


def _space(text: str, source: str, observed: Observations, frame: str, tolerance: Tolerance) -> Space:
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
    # Usual mistakes go first: if one of them fits, no other is looked for.
    if any(candidate.fits for candidate in search.found):
        return tuple(left_out)
    if most and not search.rarer():
        left_out.append("rarer mistakes, such as exchanged columns: that takes more poses, or more exact ones")
    if most and space.by_chance(len(space.table.slots), 1) < CHANCE:
        search.add(single_numbers(space))
    if any(candidate.fits for candidate in search.found):
        return tuple(left_out)
    # Three changes fit by chance more easily, so they come last.
    if most > 2 and not search.level(3):
        left_out.append("three changes at once")
    # An unknown base or tool has six numbers to fit, and takes as many observations and more.
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
        better = [candidate for candidate in found if _is_nearer(space, candidate, start)][: 4 * _SHOWN]
        return groups(space, better)[:_SHOWN]
    bar = space.value(best) + _ODDS
    rivals = [c for c in found if c.fits and c.cost <= best.cost and space.value(c) <= bar]
    return groups(space, rivals)


def _is_nearer(space: Space, candidate: Candidate, start: Candidate) -> bool:
    """Tell whether a candidate is worth its changes, and makes neither positions nor orientations worse."""
    limits = space.common
    return (
        candidate.common < _NEARER * start.common
        and space.value(candidate) < space.value(start)
        and candidate.position <= max(start.position, limits.position_bound)
        and candidate.rotation <= max(start.rotation, limits.rotation_bound)
    )


def _verdict(findings: tuple[Finding, ...], start: Candidate) -> Verdict:
    if not findings or not findings[0].candidate.fits:
        return Verdict.NOTHING
    if start.fits and not findings[0].candidate.cost:
        return Verdict.AGREES
    return Verdict.FOUND if len(findings) == 1 else Verdict.AMBIGUOUS


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
    """Yield the best candidate with each further change."""
    edited = frozenset().union(*(edit.places for edit in best.edits))
    for edit in space.edits:
        if edited.isdisjoint(edit.places):
            order = {id(each): place for place, each in enumerate(space.edits)}
            chosen = tuple(sorted((*best.edits, edit), key=lambda each: order.get(id(each), len(order))))
            yield edit.words, replace(best, edits=chosen)
    changed = frozenset().union(*(change.places for change in best.changes))
    for change in space.changes:
        if changed.isdisjoint(change.places):
            yield change.words, replace(best, changes=(*best.changes, change), setting=change.apply(best.setting))
