"""Holds the hypotheses for one file and its poses, and the predictions of one of them.

`Space` makes settings and batches of tables; `Candidate`s are predicted and judged one by one here, thousands at once
in `search`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import cached_property
from itertools import combinations
from typing import Any

import numpy as np

from kinegen.support.dataclass import dataclass
from kinegen.tools.doctor.base_tool_fit import mounted
from kinegen.tools.doctor.edits import Edit, EditKind, edits
from kinegen.tools.doctor.numeric_table import Change, Setting, Table, changes, stated
from kinegen.tools.doctor.observed_poses import FloatArray, Observations
from kinegen.tools.doctor.residual import (
    EXACT,
    Allowed,
    Batch,
    Frames,
    Residuals,
    Tolerance,
    allowed,
    predicted_poses,
    residuals,
    targets,
)

_FLOOR = 1 / math.sqrt(3)
"""The root mean square of rounding, in units of half a digit; what is below says nothing."""

_COARSE = 0.1, 0.1
"""Digits that leave open more than this of the reach, or of half a turn, say nothing."""

FIT_COST = 3
"""How many changes an unknown transform counts as: it has six numbers to fit with."""


@dataclass(frozen=True, slots=True)
class Candidate:
    """One combination of changes and its errors; base and tail were solved for, or are None.

    Attributes:
        base: The base that was solved for, shape (4, 4), in the length unit of the poses; else None.
        score: Root mean square of all errors, in units of what the digits leave open.
        common: The same in units of what they leave open in the file as it is, whatever the candidate reads.
        rest: The worst error without the few worst poses (see `Residuals`).
        worst: The worst error in units of its bound; at most 1 fits.
        position: The worst position error, in the length unit of the poses as they are then read.
    """

    setting: Setting
    changes: tuple[Change, ...]
    edits: tuple[Edit, ...]
    base: FloatArray | None
    tail: FloatArray | None
    score: float
    worst: float
    position: float
    position_rms: float
    rotation: float
    common: float = math.inf
    rest: float = math.inf

    @property
    def fits(self) -> bool:
        """Tell whether every pose is within the rounding of its numbers."""
        return self.worst <= 1

    @property
    def fitted(self) -> int:
        """Return how many numbers were solved from the poses."""
        ends = (self.base is not None) + (self.tail is not None)
        return 6 * ends + sum(edit.kind is EditKind.NUMBER for edit in self.edits)

    @property
    def cost(self) -> int:
        """Return how many changes it takes."""
        unknown = (self.base is not None) + (self.tail is not None)
        return len(self.changes) + len(self.edits) + FIT_COST * unknown


@dataclass(frozen=True)
class Space:
    """Everything that can be tried, with the table by the unit of angles: that of the file, and the other one."""

    tables: Mapping[str, Table]
    observed: Observations
    tolerance: Tolerance = EXACT

    @cached_property
    def table(self) -> Table:
        """Return the table as the file has it."""
        return next(iter(self.tables.values()))

    @cached_property
    def start(self) -> Setting:
        """Return how the file and the user say that everything is to be read."""
        return stated(self.table, self.observed)

    @property
    def as_it_is(self) -> Candidate:
        """No change, not yet judged."""
        return Candidate(self.start, (), (), None, None, 0, 0, 0, 0, 0)

    def errors(self, predicted: Frames) -> Residuals:
        """Deviations of frames at the observed joint values, read as stated."""
        return residuals(predicted, targets(self.observed, self.start), self.common)

    @cached_property
    def changes(self) -> tuple[Change, ...]:
        """Return all single changes of the setting."""
        found = changes(self.table, self.observed)
        return tuple(change for change in found if change.apply(self.start).table_angle in self.tables)

    @cached_property
    def edits(self) -> tuple[Edit, ...]:
        """Return all single changes of entries."""
        return edits(self.table)

    @property
    def penalty(self) -> float:
        """Return what a change has to gain: the logarithm of how many there are."""
        return math.log(max(len(self.changes) + len(self.edits), 10))

    def settings(self, count: int) -> Iterator[tuple[Setting, tuple[Change, ...]]]:
        """Yield every setting that `count` changes lead to."""
        for chosen in combinations(self.changes, count):
            if sum(len(change.places) for change in chosen) == len(frozenset().union(*(c.places for c in chosen))):
                setting = self.start
                for change in chosen:
                    setting = change.apply(setting)
                if self.says_something(setting):
                    yield setting, chosen

    def says_something(self, setting: Setting) -> bool:
        """Tell whether the digits of the poses are fine enough in a reading, or as fine as in the one that is stated.

        Whole millimetres that are read as metres would agree with almost any robot.
        """
        read, start = self._coarseness(setting), self._coarseness(self.start)
        return all(ours < most or ours <= theirs for ours, theirs, most in zip(read, start, _COARSE, strict=True))

    def _coarseness(self, setting: Setting) -> tuple[float, float]:
        """Return what the digits leave open, as a share of the reach and of half a turn."""
        limits = self.limits(setting, self.observed)
        return limits.position_bound / (self.table.reach * setting.scale), limits.rotation_bound / math.pi

    def edit_groups(self, count: int) -> tuple[tuple[Edit, ...], ...]:
        """Return every group of `count` edits of different places."""
        return tuple(
            chosen
            for chosen in combinations(self.edits, count)
            if all(first.places.isdisjoint(second.places) for first, second in combinations(chosen, 2))
        )

    def batch(self, angle: str, groups: tuple[tuple[Edit, ...], ...]) -> Batch:
        """Return the tables after each group of edits."""
        constants = np.repeat(self.tables[angle].constants[None], len(groups), axis=0)
        gains = np.ones_like(constants)
        # Edits do not commute, but equal ones of a turn are applied to all their variants at once.
        members: dict[tuple[int, int], list[int]] = {}
        known: dict[int, Edit] = {}
        for index, group in enumerate(groups):
            for turn, edit in enumerate(group):
                known[id(edit)] = edit
                members.setdefault((turn, id(edit)), []).append(index)
        for turn in sorted({turn for turn, _ in members}):
            for (when, name), which in members.items():
                if when == turn:
                    constants[which], gains[which] = known[name].apply(constants[which], gains[which])
        return Batch(constants, gains)

    def limits(self, setting: Setting, observed: Observations) -> Allowed:
        """Return what rounding explains."""
        return allowed(self.table, observed, setting, self.tolerance)

    @cached_property
    def common(self) -> Allowed:
        """Return what rounding explains in the file as it is: the scale that compares candidates which do not fit."""
        return self.limits(self.start, self.observed)

    def by_chance(self, tries: float, fitted: int = 0) -> float:
        """Return how many combinations agree with all poses by chance, putting the tip anywhere within reach."""
        limits, wanted = self.common, targets(self.observed, self.start)
        far = min(1.0, limits.position_bound / (self.table.reach * self.start.scale))
        turned = min(1.0, limits.rotation_bound / math.pi)
        log = 3 * len(self.observed) * math.log(far) + 3 * float(wanted.turned.sum()) * math.log(turned)
        return tries * math.exp(log * max(0.0, 1 - fitted / wanted.count))

    def value(self, candidate: Candidate) -> float:
        """Return what candidates are ordered by, in natural logarithms of odds: errors, and a price for each change."""
        score = candidate.score if candidate.fits else candidate.common
        return self.numbers * math.log(max(score, _FLOOR)) + candidate.cost * self.penalty

    @cached_property
    def numbers(self) -> int:
        """Return how many independent numbers are observed; a joint vector that comes twice says nothing new."""
        _, first = np.unique(self.observed.joints, axis=0, return_index=True)
        return int(3 * len(first) + 3 * targets(self.observed, self.start).turned[first].sum())


def predict(space: Space, candidate: Candidate, q: FloatArray) -> Frames:
    """Frames of one candidate for joint values as they are written, shape (K, dof)."""
    batch = space.batch(candidate.setting.table_angle, (candidate.edits,))
    frames = predicted_poses(space.tables[candidate.setting.table_angle], candidate.setting, batch, q)
    if candidate.base is None and candidate.tail is None:
        return frames
    ends = (None if end is None else end[None] for end in (candidate.base, candidate.tail))
    return mounted(frames, *ends)


def judge(space: Space, candidate: Candidate) -> Candidate:
    """Return the same candidate, judged on all poses."""
    # The reading decides units and bounds, so both are made anew for each candidate.
    wanted = targets(space.observed, candidate.setting)
    limits = space.limits(candidate.setting, space.observed)
    predicted = predict(space, candidate, space.observed.joints)
    errors = residuals(predicted, wanted, limits, common=space.common, fitted=candidate.fitted)
    deviations: dict[str, Any] = errors.of(0)
    return replace(candidate, **deviations)
