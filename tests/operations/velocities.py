"""A search for few operations of Jacobians and twists, with the numbers of `optimiser.py`.

Velocities have the axes of the base: three entries of the tip, then three of the angular velocity. The ways that are
tried for a column are levers in the joint's axes and in those of the base, each turned back joint by joint, by columns,
or first one and then the other; and levers that are added up from the tip or are differences of positions. A column
takes the cheapest beside those that are known, outwards from the base or inwards from the tip, or all columns the same.
A twist is the product of the Jacobian with the rates, a recursion inwards from the tip, or one outwards from the base
with the rates of parallel joints added up; the linear and the angular part choose for themselves.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial

from tests.operations.chain import Folded, Mark
from tests.operations.field import Number, Vector, number
from tests.operations.optimiser import NULL, Account, Rotations

ANY = 99
"""As a split: by columns from every level on."""


@dataclass(frozen=True)
class Joint:
    """Where a joint stands: the level, and its place there."""

    level: int
    place: int
    mark: Mark


@dataclass
class Work:
    """One way to compute velocities of a chain."""

    account: Account
    folded: Folded

    def __post_init__(self) -> None:
        self.rotations = Rotations(self.account, self.folded)

    def to_base(self, level: int, vector: Vector, split: int) -> Vector:
        """A vector of a level in the axes of the base: joint by joint as far as to the split, from there by columns."""
        split = min(split, level)
        for turn in reversed(self.folded.turns[split:level]):
            vector = self.account.rotated(*turn, vector)
        return self.account.applied(self.rotations.prefix(split), vector) if split else vector

    def lever(self, level: int, first: int = 0) -> Vector:
        """From an item of a level to the tip, in the axes of the level: what stands between two joints at once."""
        vector = NULL
        for at in range(len(self.folded.turns), level - 1, -1):
            if at < len(self.folded.turns):
                vector = self.account.rotated(*self.folded.turns[at], vector)
            for start, end in segments(self.folded, at, first if at == level else 0):
                vector = self.account.sum(*self.folded.sums(self.account, at, start, end), vector)
        return vector

    def lever_from_the_tip(self, level: int, first: int = 0) -> Vector:
        """The same in the axes of the base, as a sum of links there that starts at the tip."""
        vector = NULL
        for at in range(len(self.folded.turns), level - 1, -1):
            for start, end in segments(self.folded, at, first if at == level else 0):
                link = self.account.sum(*self.folded.sums(self.account, at, start, end))
                vector = self.account.sum(self.to_base(at, link, ANY), vector)
        return vector

    def origin(self, level: int, end: int | None) -> Vector:
        """From the base to an item, as a sum of links in the axes of the base."""
        vector = NULL
        for at in range(level + 1):
            for start, stop in reversed(segments(self.folded, at, 0, end if at == level else None)):
                link = self.account.sum(*self.folded.sums(self.account, at, start, stop))
                vector = self.account.sum(vector, self.to_base(at, link, ANY))
        return vector

    def difference(self, level: int, first: int) -> Vector:
        """The lever as the tip's position less that of the joint."""
        x, y, z = self.origin(level, first)
        return self.account.sum(self.origin(len(self.folded.turns), None), (-x, -y, -z))


def segments(folded: Folded, level: int, first: int, end: int | None = None) -> list[tuple[int, int]]:
    """The stretches of a level between joints, the last one first."""
    end = len(folded.levels[level]) if end is None else end
    marks = [place for place in range(first, end) if isinstance(folded.levels[level][place], Mark)]
    pairs = zip([*reversed(marks), first], [end, *reversed(marks)], strict=True)
    return [(start, stop) for start, stop in pairs if start < stop]


def joints(folded: Folded) -> list[Joint]:
    """The joints from the base outwards."""
    return [
        Joint(level, place, item)
        for level, items in enumerate(folded.levels)
        for place, item in enumerate(items)
        if isinstance(item, Mark)
    ]


Column = tuple[Vector, Vector]
"""The linear and the angular part."""
Way = Callable[[Work, Joint], Column]
Turning = Callable[[Work, Joint, int, int], Column]
"""The same of a turning joint, by where vectors and axes are split."""


def _in_the_joints_axes(work: Work, joint: Joint, split: int, axis_split: int) -> Column:
    axis = work.account.turned(joint.mark)
    linear = work.account.cross(axis, work.lever(joint.level, joint.place))
    return work.to_base(joint.level, linear, split), work.to_base(joint.level, axis, axis_split)


def _in_the_axes_of_the_base(work: Work, joint: Joint, split: int, axis_split: int) -> Column:
    axis = work.to_base(joint.level, work.account.turned(joint.mark), axis_split)
    return work.account.cross(axis, work.to_base(joint.level, work.lever(joint.level, joint.place), split)), axis


def _added_up(work: Work, joint: Joint, split: int, axis_split: int) -> Column:
    axis = work.to_base(joint.level, work.account.turned(joint.mark), axis_split)
    lever = work.difference if split else work.lever_from_the_tip
    return work.account.cross(axis, lever(joint.level, joint.place)), axis


def _column(work: Work, joint: Joint, *, way: Turning, split: int, axis_split: int) -> Column:
    if joint.mark.is_turning:
        return way(work, joint, split, axis_split)
    return work.to_base(joint.level, work.account.turned(joint.mark), split), NULL


def ways(folded: Folded) -> list[Way]:
    """The ways to compute a column."""
    splits = (*range(len(folded.turns) + 1), ANY)
    return [
        partial(_column, way=way, split=split, axis_split=axis_split)
        for way, those in ((_in_the_joints_axes, splits), (_in_the_axes_of_the_base, splits), (_added_up, (0, 1)))
        for split in those
        for axis_split in (0, ANY)
    ]


def _entries(columns: Iterable[Column]) -> list[Number]:
    return [entry for column in columns for vector in column for entry in vector]


def jacobian_cost(folded: Folded) -> int:
    """The least cost of a Jacobian."""
    found = []
    movers, choices = joints(folded), ways(folded)
    for way in choices:
        work = Work(Account(), folded)
        found.append(work.account.cost_of(_entries([way(work, joint) for joint in movers])))
    for order in (movers, movers[::-1]):
        account = Account()
        outputs: list[Number] = []
        for joint in order:
            trials = []
            for way in choices:
                trial = Work(Account(account), folded)
                entries = [*outputs, *_entries([way(trial, joint)])]
                trials.append((trial.account.cost_of(entries), trial.account, entries))
            _, account, outputs = min(trials, key=lambda each: each[0])
        found.append(account.cost_of(outputs))
    return min(found)


def _rate(joint: Mark) -> Number:
    return number(f"qd{joint.joint}")


@dataclass
class Motion:
    """The motion of the tip against a level, in the axes of the level, and the lever from there."""

    linear: Vector = NULL
    angular: Vector = NULL
    lever: Vector = NULL


def _level_inwards(work: Work, level: int, motion: Motion) -> Motion:
    """A level's joints one by one, from the tip inwards: each adds its rate times axis cross lever."""
    account, folded = work.account, work.folded
    for start, end in segments(folded, level, 0):
        motion.lever = account.sum(*folded.sums(account, level, start, end), motion.lever)
        mark = folded.levels[level][start]
        if not isinstance(mark, Mark):
            continue
        axis = account.turned(mark)
        if mark.is_turning:
            linear = account.scaled(_rate(mark), account.cross(axis, motion.lever))
            motion.angular = account.sum(motion.angular, account.scaled(_rate(mark), axis))
        else:
            linear = account.scaled(_rate(mark), axis)
        motion.linear = account.sum(motion.linear, linear)
    return motion


def _level_outwards(work: Work, level: int, motion: Motion) -> Motion:
    """A level's joints from the base outwards: the sum of their rates so far turns each link, all turn what follows."""
    account, folded = work.account, work.folded
    spin = linear = NULL
    far = motion.lever
    for start, end in reversed(segments(folded, level, 0)):
        mark = folded.levels[level][start]
        if isinstance(mark, Mark):
            moved = account.scaled(_rate(mark), account.turned(mark))
            spin, linear = (account.sum(spin, moved), linear) if mark.is_turning else (spin, account.sum(linear, moved))
        link = account.sum(*folded.sums(account, level, start, end))
        last = end == len(folded.levels[level])
        linear = account.sum(linear, account.cross(spin, account.sum(link, far) if last else link))
        motion.lever = account.sum(link, motion.lever)
    motion.lever = work.lever(level)
    motion.linear = account.sum(motion.linear, linear)
    motion.angular = account.sum(motion.angular, spin)
    return motion


Level = Callable[[Work, int, Motion], Motion]


def _inwards(work: Work, by: Level, split: int, is_near_outwards: bool) -> Column:
    """Levels from a split on from the tip inwards, then by columns; those before it inwards too, or in base axes."""
    folded, account = work.folded, work.account
    motion, far = Motion(), Motion()
    for level in range(len(folded.turns), -1, -1):
        if level < len(folded.turns):
            turn = folded.turns[level]
            motion = Motion(*(account.rotated(*turn, each) for each in (motion.linear, motion.angular, motion.lever)))
        motion = by(work, level, motion)
        if level == split and level:
            far = Motion(*(work.to_base(level, each, ANY) for each in (motion.linear, motion.angular, motion.lever)))
            motion = Motion(lever=motion.lever)
            if is_near_outwards:
                motion = _near(work, split, far.lever)
                break
    return account.sum(far.linear, motion.linear), account.sum(far.angular, motion.angular)


def _near(work: Work, split: int, lever: Vector) -> Motion:
    """What the joints before a level move, in the axes of the base, with the lever from the level on."""
    account = work.account
    linear = angular = NULL
    end = work.origin(split - 1, None)
    for joint in joints(work.folded):
        if joint.level >= split:
            continue
        moved = account.scaled(_rate(joint.mark), work.to_base(joint.level, account.turned(joint.mark), ANY))
        if joint.mark.is_turning:
            x, y, z = work.origin(joint.level, joint.place)
            linear = account.sum(linear, account.cross(moved, account.sum(lever, account.sum(end, (-x, -y, -z)))))
            angular = account.sum(angular, moved)
        else:
            linear = account.sum(linear, moved)
    return Motion(linear, angular)


def _outwards(work: Work, split: int) -> Column:
    """From the base outwards in its axes: the angular velocity so far turns each link."""
    account, folded = work.account, work.folded
    spin = linear = NULL
    for level in range(len(folded.levels)):
        for start, end in reversed(segments(folded, level, 0)):
            mark = folded.levels[level][start]
            if isinstance(mark, Mark):
                moved = work.to_base(level, account.scaled(_rate(mark), account.turned(mark)), split)
                spin, linear = (
                    (account.sum(spin, moved), linear) if mark.is_turning else (spin, account.sum(linear, moved))
                )
            link = account.sum(*folded.sums(account, level, start, end))
            linear = account.sum(linear, account.cross(spin, work.to_base(level, link, split)))
    return linear, spin


def _product(work: Work, way: Way) -> Column:
    """The Jacobian times the rates."""
    linear = angular = NULL
    for joint in joints(work.folded):
        column = way(work, joint)
        linear = work.account.sum(linear, work.account.scaled(_rate(joint.mark), column[0]))
        angular = work.account.sum(angular, work.account.scaled(_rate(joint.mark), column[1]))
    return linear, angular


def twists(folded: Folded) -> Iterator[Callable[[Work], Column]]:
    """The ways to compute a twist."""
    for split in range(len(folded.turns) + 1):
        for by in (_level_inwards, _level_outwards):
            for is_near_outwards in (False, True):
                yield partial(_inwards, by=by, split=split, is_near_outwards=is_near_outwards)
        yield partial(_outwards, split=split)
    yield partial(_outwards, split=ANY)
    for way in ways(folded):
        yield partial(_product, way=way)


def twist_cost(folded: Folded) -> int:
    """The least cost of a twist."""
    candidates = list(twists(folded))
    alone = [_cost(folded, (each,), (each,)) for each in candidates]
    order = sorted(range(len(candidates)), key=alone.__getitem__)
    # The angular part of each way with the linear part of the cheapest ones, and the other way round.
    best = [candidates[place] for place in order[:4]]
    mixed = [_cost(folded, (a,), (b,)) for one in best for each in candidates for a, b in ((one, each), (each, one))]
    return min(*alone, *mixed)


def _cost(
    folded: Folded, linear: Sequence[Callable[[Work], Column]], angular: Sequence[Callable[[Work], Column]]
) -> int:
    work = Work(Account(), folded)
    entries = [entry for each in linear for entry in each(work)[0]]
    entries += [entry for each in angular for entry in each(work)[1]]
    return work.account.cost_of(entries)
