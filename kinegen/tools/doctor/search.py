"""Searches for combinations of changes that explain the poses: singles, pairs and triples, each evaluated.

Changes of the whole (`Change`) give settings; for each of them the combinations of entries (`Edit`) are one batch of
constants and signs, which is made once. So three changes of a 6-joint arm are some 25,000 tables, evaluated in about a
second.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from kinegen.tools.doctor.base_tool_fit import Fit, fit, plausible
from kinegen.tools.doctor.edits import Edit, rarer_changes, rarer_edits
from kinegen.tools.doctor.hypotheses import Candidate, Space, judge
from kinegen.tools.doctor.numeric_table import Change, Mount, Setting
from kinegen.tools.doctor.residual import (
    Allowed,
    Batch,
    Frames,
    Residuals,
    Targets,
    predicted_poses,
    residuals,
    targets,
)

KEPT = 200
"""Candidates that are kept; those that fit and the best of the others."""

SCREENED = 16
"""Poses that every combination is tried on; what is kept is judged on all of them."""

JUDGED = 60
"""Candidates that are judged on all poses, where there are more than `SCREENED`."""

MOST_WORK = 400_000_000
"""Slots times variants times poses beyond which a level is left out."""

CHANCE = 0.01
"""Combinations that may agree by chance; where it would be more, what is rare is not tried."""

_CHUNK = 60_000
"""Variants times poses that are evaluated at once, so that arrays stay in the cache."""


class Search:
    """Tries combinations, and keeps the best."""

    def __init__(self, space: Space) -> None:
        self._space = space
        self._few = space.observed.spread(SCREENED)
        self._found: list[Candidate] = []
        self._targets: dict[tuple[str, str], Targets] = {}
        self._batches: dict[tuple[str, int], tuple[tuple[tuple[Edit, ...], ...], Batch]] = {}
        self._bar = math.inf
        self.tried = 0

    @property
    def found(self) -> tuple[Candidate, ...]:
        """Return the best so far, judged on all poses, best first."""
        self._trim()
        if len(self._few) == len(self._space.observed):
            return tuple(self._found)
        return tuple(sorted((judge(self._space, one) for one in self._found[:JUDGED]), key=self._order))

    def level(self, count: int, base: bool = False, tail: bool = False) -> bool:
        """Try all combinations of `count` changes, with an unknown base or tool; tell whether they were few enough."""
        if self._work(count) > MOST_WORK:
            return False
        for whole in range(count + 1):
            for setting, chosen in self._space.settings(whole):
                self._try(setting, chosen, count - whole, base=base, tail=tail)
        return True

    def rarer(self) -> bool:
        """Try each of the rarer mistakes, alone and with one of the usual changes.

        Tells whether that was done: not where one of so many would agree with so few poses by chance.
        """
        space = self._space
        rare = rarer_edits(space.table)
        kinds = len(rare) + len(rarer_changes(space.table))
        if space.by_chance(kinds * (1 + len(space.changes) + len(space.edits))) > CHANCE:
            return False
        # Alone first, then each with one usual change of another place.
        usual = [(setting, chosen, chosen[0].places) for setting, chosen in space.settings(1)]
        for change in rarer_changes(space.table):
            setting = change.apply(space.start)
            for count in (0, 1):
                self._try(setting, (change,), count, base=False, tail=False)
            for _, (other,), places in usual:
                if places.isdisjoint(change.places):
                    self._try(other.apply(setting), (other, change), 0, base=False, tail=False)
        alone = tuple((edit,) for edit in rare)
        pairs = tuple((other, edit) for edit in rare for other in space.edits if other.places.isdisjoint(edit.places))
        for setting, chosen, groups in ((space.start, (), (*alone, *pairs)), *((s, c, alone) for s, c, _ in usual)):
            if groups:
                self._evaluate(setting, chosen, groups, space.batch(setting.table_angle, groups))
        return True

    def add(self, candidates: Iterable[Candidate]) -> None:
        """Keep candidates that were judged elsewhere."""
        self._found += candidates

    def _work(self, count: int) -> float:
        ways = sum(
            math.comb(len(self._space.changes), whole) * math.comb(len(self._space.edits), count - whole)
            for whole in range(count + 1)
        )
        return float(ways) * len(self._space.table.slots) * len(self._few)

    def _try(self, setting: Setting, chosen: tuple[Change, ...], count: int, *, base: bool, tail: bool) -> None:
        if (base and setting.base is not Mount.GIVEN) or (tail and setting.tail is not Mount.GIVEN):
            return
        if base or tail:
            ends = [Mount.UNKNOWN if end else Mount.GIVEN for end in (base, tail)]
            setting = replace(setting, base=ends[0], tail=ends[1])
        key = setting.table_angle, count
        if key not in self._batches:
            groups = self._space.edit_groups(count)
            self._batches[key] = groups, self._space.batch(setting.table_angle, groups)
        self._evaluate(setting, chosen, *self._batches[key])

    def _evaluate(
        self, setting: Setting, chosen: tuple[Change, ...], groups: tuple[tuple[Edit, ...], ...], batch: Batch
    ) -> None:
        wanted, limits = self._wanted(setting), self._space.limits(setting, self._few)
        step = max(1, _CHUNK // len(self._few))
        self.tried += len(groups)
        for first in range(0, len(groups), step):
            part = batch.part(slice(first, first + step))
            frames = predicted_poses(self._space.tables[setting.table_angle], setting, part, self._few.joints)
            names = groups[first : first + step]
            self._judge(setting, chosen, names, frames, wanted, limits)

    def _wanted(self, setting: Setting) -> Targets:
        key = setting.form, setting.pose_angle
        if key not in self._targets:
            self._targets[key] = targets(self._few, setting)
        return self._targets[key]

    def _judge(
        self,
        setting: Setting,
        chosen: tuple[Change, ...],
        groups: tuple[tuple[Edit, ...], ...],
        frames: Frames,
        wanted: Targets,
        limits: Allowed,
    ) -> None:
        base, tail = setting.base is Mount.UNKNOWN, setting.tail is Mount.UNKNOWN
        fitted = Fit(None, None, frames)
        if base or tail:
            which = np.flatnonzero(plausible(frames, wanted, limits, base=base, tail=tail))
            if not which.size:
                return
            groups = tuple(groups[place] for place in which)
            x, y, z, origin = (part[:, which] for part in frames)
            fitted = fit((x, y, z, origin), wanted, limits, base=base, tail=tail)
        errors = residuals(fitted.frames, wanted, limits, common=self._space.common, fitted=fitted.numbers)
        self._keep(setting, chosen, groups, fitted, errors)

    def _keep(
        self,
        setting: Setting,
        chosen: tuple[Change, ...],
        groups: tuple[tuple[Edit, ...], ...],
        fitted: Fit,
        errors: Residuals,
    ) -> None:
        """Remember the best of a batch."""
        # Whatever fits is kept; of the rest the best as far as they are better than those before.
        order = np.where(errors.worst <= 1, -1.0, errors.common)
        for place in np.argsort(order, kind="stable")[:KEPT]:
            if order[place] > self._bar:
                break
            self._found.append(
                Candidate(
                    setting,
                    chosen,
                    groups[place],
                    None if fitted.base is None else fitted.base[place],
                    None if fitted.tail is None else fitted.tail[place],
                    **errors.of(int(place)),
                )
            )
        if len(self._found) > 20 * KEPT:
            self._trim()

    def _order(self, candidate: Candidate) -> tuple[bool, float]:
        """Return what fits first, then by likelihood."""
        return not candidate.fits, self._space.value(candidate)

    def _trim(self) -> None:
        self._found.sort(key=self._order)
        if len(self._found) >= KEPT:
            del self._found[KEPT:]
            self._bar = max(candidate.common for candidate in self._found)
