"""Everything that can be tried for one file and its poses, and what one combination of it predicts.

In: the `Table`s of a file, `Observations`. Out: `Space`, which makes settings and batches of tables, and `Candidate`s,
which are predicted and judged one by one here, thousands at once in `search`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations

import numpy as np

from kinegen.doctor.edits import Edit, edits
from kinegen.doctor.mounts import mounted
from kinegen.doctor.poses import Observations
from kinegen.doctor.product import Batch, Frames, poses
from kinegen.doctor.residual import Allowed, allowed, residuals, targets
from kinegen.doctor.settings import Change, Setting, changes, stated
from kinegen.doctor.table import FloatArray, Table

_FLOOR = 1 / math.sqrt(3)
"""The root mean square of rounding, in units of half a digit; what is below says nothing."""

FIT_COST = 3
"""How many changes an unknown transform counts as: it has six numbers to fit with."""


@dataclass(frozen=True, slots=True)
class Candidate:
    """One combination of changes and how well it fits.

    Attributes:
        setting: How table and poses are read.
        changes: Changes of the setting.
        edits: Changes of entries.
        base: The base that was solved for, shape (4, 4), in the length unit of the poses; else None.
        tail: The same for the tool.
        score: Root mean square of all errors, in units of what the digits leave open.
        worst: The worst error in units of its bound; at most 1 fits.
        position: The worst position error, in the length unit of the poses as they are then read.
        position_rms: The root mean square of the position errors.
        rotation: The worst rotation error, in radians.
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

    @property
    def fits(self) -> bool:
        """Whether every pose is within the rounding of its numbers."""
        return self.worst <= 1

    @property
    def cost(self) -> int:
        """How many changes it takes."""
        unknown = (self.base is not None) + (self.tail is not None)
        return len(self.changes) + len(self.edits) + FIT_COST * unknown


@dataclass(frozen=True)
class Space:
    """Everything that can be tried.

    Attributes:
        tables: The table by the unit of its angles: that of the file, and the other one if the file can be read so.
        observed: The poses.
        tolerance: How far positions may be off; None for what their digits say.
    """

    tables: Mapping[str, Table]
    observed: Observations
    tolerance: float | None = None

    @cached_property
    def table(self) -> Table:
        """The table as the file has it."""
        return next(iter(self.tables.values()))

    @cached_property
    def start(self) -> Setting:
        """How the file and the user say that everything is to be read."""
        return stated(self.table, self.observed)

    @cached_property
    def changes(self) -> tuple[Change, ...]:
        """All single changes of the setting."""
        found = changes(self.table, self.observed)
        return tuple(change for change in found if change.apply(self.start).table_angle in self.tables)

    @cached_property
    def edits(self) -> tuple[Edit, ...]:
        """All single changes of entries."""
        return edits(self.table)

    @property
    def penalty(self) -> float:
        """What a change has to gain: the logarithm of how many there are."""
        return math.log(max(len(self.changes) + len(self.edits), 10))

    def settings(self, count: int) -> Iterator[tuple[Setting, tuple[Change, ...]]]:
        """Every setting that `count` changes lead to."""
        for chosen in combinations(self.changes, count):
            if sum(len(change.places) for change in chosen) == len(frozenset().union(*(c.places for c in chosen))):
                setting = self.start
                for change in chosen:
                    setting = change.apply(setting)
                yield setting, chosen

    def edit_groups(self, count: int) -> tuple[tuple[Edit, ...], ...]:
        """Every group of `count` edits of different places."""
        return tuple(
            chosen
            for chosen in combinations(self.edits, count)
            if all(first.places.isdisjoint(second.places) for first, second in combinations(chosen, 2))
        )

    def batch(self, angle: str, groups: tuple[tuple[Edit, ...], ...]) -> Batch:
        """The tables after each group of edits."""
        constants = np.repeat(self.tables[angle].constants[None], len(groups), axis=0)
        gains = np.ones_like(constants)
        members: dict[tuple[int, int], list[int]] = {}
        order = {id(edit): place for place, edit in enumerate(self.edits)}
        for index, group in enumerate(groups):
            for turn, edit in enumerate(group):
                members.setdefault((turn, order[id(edit)]), []).append(index)
        for (_, place), which in sorted(members.items()):
            constants[which], gains[which] = self.edits[place].apply(constants[which], gains[which])
        return Batch(constants, gains)

    def limits(self, setting: Setting, observed: Observations) -> Allowed:
        """What rounding explains."""
        return allowed(self.table, observed, setting, self.tolerance)

    def value(self, candidate: Candidate) -> float:
        """What candidates are ordered by, in natural logarithms of odds: errors, and a price for each change."""
        return self.numbers * math.log(max(candidate.score, _FLOOR)) + candidate.cost * self.penalty

    @cached_property
    def numbers(self) -> int:
        """How many independent numbers are observed."""
        return targets(self.observed, self.start).count


def predict(space: Space, candidate: Candidate, q: FloatArray) -> Frames:
    """Frames of one candidate for joint values as they are written, shape (K, dof)."""
    batch = space.batch(candidate.setting.table_angle, (candidate.edits,))
    frames = poses(space.tables[candidate.setting.table_angle], candidate.setting, batch, q)
    if candidate.base is None and candidate.tail is None:
        return frames
    ends = (None if end is None else end[None] for end in (candidate.base, candidate.tail))
    return mounted(frames, *ends)


def judge(space: Space, candidate: Candidate) -> Candidate:
    """The same candidate, judged on all poses."""
    wanted = targets(space.observed, candidate.setting)
    limits = space.limits(candidate.setting, space.observed)
    fitted = 6 * ((candidate.base is not None) + (candidate.tail is not None))
    errors = residuals(predict(space, candidate, space.observed.joints), wanted, limits, fitted=fitted)
    return replace(
        candidate,
        score=float(errors.score[0]),
        worst=float(errors.worst[0]),
        position=float(errors.position[0]),
        position_rms=float(errors.position_rms[0]),
        rotation=float(errors.rotation[0]),
    )
