"""The pose of the tips, evaluated from the tip towards the base, and their position alone.

Two columns of the rotation are turned from joint to joint and the third is their cross product, or all three are
turned; the last shift (usually the tool) is added either at once or where its direction is known. The candidates
are counted and the cheapest is kept; for a pose alone other associations and rows are tried too.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import field, replace

import sympy as sp

from kinegen.derive.chain_forms import PAIR, foldings, forms, moved_back, without_last_turns
from kinegen.derive.expressions import (
    Candidate,
    Expressions,
    LetBindings,
    by_joints,
    chains_of,
    cost,
    pairs,
    point_array,
    pose_array,
)
from kinegen.derive.folding import (
    NULL,
    UNITS,
    AxisPermutation,
    FoldedChain,
    Last,
    Vector,
    combined,
    fold,
    fold_apart,
    fold_for_readers,
    rotate,
    total,
)
from kinegen.derive.frame_poses import forward_poses
from kinegen.derive.product_associations import (
    Association,
    ByRows,
    associated,
    associations,
    by_rows,
    completed,
    evaluate_by_rows,
    fixed_runs,
    is_inclined,
)
from kinegen.derive.transforms import Elementary, FrameName, Turn, symbols, transforms_between
from kinegen.model.outputs import Quantity
from kinegen.model.robot import Robot
from kinegen.support.dataclass import dataclass

_NEAR_THE_TIP = 6
"""How many turns from the tip on are tried as the place at which the last shift is added."""

_SHORT = 9
"""All plans of a chain of so many turns are handed on; of a longer one the best, as its operations stand."""

_WORTH = 1.1
"""How many times as many operations as the best plan another may have to be handed on."""

_LONG = 48
"""A chain of more turns is planned by its end: what candidates differ in is near the tip."""

_END = 24
"""How many turns this end has."""


@dataclass(frozen=True, slots=True)
class Plan:
    """One way to evaluate a folded chain.

    `carried`: axes whose columns are turned from joint to joint; a missing third is a cross product. `attach`: number
    of turns still to come when the last shift is added, as a multiple of the columns; None to add it before all of
    them.
    """

    carried: tuple[int, ...]
    attach: int | None = None

    def __str__(self) -> str:
        columns = " and ".join("xyz"[axis] for axis in self.carried) if len(self.carried) < 3 else "all columns"
        third = ", the third their cross product" if len(self.carried) < 3 else ""
        if self.attach is None:
            place = "at the tip"
        else:
            place = f"with {self.attach} turns to come" if self.attach else "at the base"
        return f"{columns} turned{third}; last shift added {place}"


_Way = Plan | Association | ByRows

_LAST_TURNS = {
    Last.SHARED: "one sine and cosine for angles that differ by a constant",
    Last.OWN: "last turn with its own sine and cosine",
    Last.SPLIT: "last turn as two turns",
}
"""What builds tell of the last turn."""

_CARRIED = tuple(Plan(carried) for carried in ((0, 1, 2), (0, 1), (0, 2), (1, 2)))


def derive_pose(robot: Robot, quantity: Quantity = Quantity.POSE) -> Expressions:
    """Return the pose of every tip, or of one frame, in the base frame.

    Returns twelve entries for each frame, the upper three rows of `base_T_frame`, row by row.
    """
    values = symbols(robot, keep_parameters=False)
    chains = chains_of(robot, quantity, values)
    ways = tuple(pose_ways(chains[0]) if len(chains) == 1 else _ways_of_many(chains))
    return by_joints(robot, quantity, values, ways, pose_array(robot, quantity))


def pose_ways(steps: Sequence[Elementary]) -> Iterator[Candidate]:
    """Yield the ways to compute the pose of one frame; plans first, that with the least operations before the others.

    Of angles that differ by a constant, one pair of sine and cosine serves for all, or each has its own.
    """
    for number, (form,) in enumerate(forms([steps])):
        yield from (replace(way, form=number) for way in _ways_of_form(form))


def _ways_of_form(steps: Sequence[Elementary]) -> Iterator[Candidate]:
    # Foldings differ in which turns are merged; those with shifts moved back only where that matters.
    rotations = _rotations(steps)
    folds = tuple(rotations)
    others = tuple(each for each in map(moved_back, folds) if each not in folds)
    moved = {moved_back(folded): f"{words}, shifts before turns" for folded, words in rotations.items()}
    rotations = moved | rotations
    found = [(folded, plan) for folded in folds for plan in _plans(folded)]
    found += [
        (folded, plan)
        for folded in others
        if all(folded.shifts[-1] != each.shifts[-1] for each in folds) and any(folded.shifts[-1])
        for plan in _plans(folded)
        if _is_by_columns(plan)
    ]
    short = [folded for folded in (*folds, *others) if len(folded.turns) <= _SHORT]
    rows = [(folded, way) for folded in short for way in by_rows(folded)]
    # All are evaluated with shared names and counted; the best of each kind are handed on.
    bindings: LetBindings = _Trials()
    costs = {each: _cost(*each, bindings) for each in (*found, *rows)}
    least = min(costs[each] for each in found)
    kept = [each for each in found if costs[each] <= _WORTH * least]
    kept.sort(key=lambda each: (isinstance(each[1], Association), costs[each]))
    ways = [*kept, *(each for each in sorted(rows, key=costs.__getitem__)[:1] if costs[each] <= least)]
    several = Counter(str(plan) for _, plan in ways)
    for each in ways:
        fresh = LetBindings(names=bindings.names)
        entries = _entries(*each, fresh)
        plan = str(each[1])
        name = f"{plan}; {rotations[each[0]]}" if several[plan] > 1 else plan
        yield fresh.way(entries, name)


def _rotations(steps: Sequence[Elementary]) -> dict[FoldedChain, str]:
    """The forms that the rotation of a chain can have, each in words."""
    found: dict[FoldedChain, str] = {}
    kinds: tuple[tuple[frozenset[int] | None, str], ...] = (
        (None, ""),
        (frozenset(), ", turns about parallel axes apart"),
    )
    for last in Last:
        for apart, words in kinds:
            found.setdefault(fold_apart(steps, last, apart)[0], f"{_LAST_TURNS[last]}{words}")
    return found


def _is_by_columns(plan: Plan | Association) -> bool:
    return plan.by_columns if isinstance(plan, Association) else plan.attach is not None


def _entries(folded: FoldedChain, plan: _Way, bindings: LetBindings) -> tuple[sp.Expr, ...]:
    match plan:
        case Association():
            walk = associated(folded, plan, bindings)
        case ByRows():
            walk = evaluate_by_rows(folded, plan, bindings)
        case Plan():
            walk = evaluate(folded, plan, bindings)
    return tuple(pose_entries(*walk, folded.attitude))


def _cost(folded: FoldedChain, plan: _Way, bindings: LetBindings) -> int:
    entries = _entries(folded, plan, bindings)
    return cost(bindings.definitions, entries) + PAIR * pairs(bindings.definitions, entries)


def _ways_of_many(chains: Sequence[Sequence[Elementary]]) -> Iterator[Candidate]:
    """Yield each tip by itself from its end, and all from the base outwards, which pays with a shared trunk."""
    for number, form in enumerate(forms(chains)):
        bindings = LetBindings()
        entries: list[sp.Expr] = []
        for steps in form:
            folded = fold(steps)
            columns, position = evaluate(folded, cheapest_plan(folded), bindings)
            entries += pose_entries(columns, position, folded.attitude)
        yield replace(bindings.way(entries, "each tip from its end"), form=number)
        yield Candidate("from the base outwards", *forward_poses(form), number)


def cheapest_plan(folded: FoldedChain) -> Plan:
    """Count the candidates and keep the cheapest; the first of equals wins.

    Long chains are planned by their last turns, so that the time grows with the length once and not with every
    candidate. Any plan is right; the one that is kept there may take a few operations more than the cheapest.
    """
    before = len(folded.turns) - _END
    if len(folded.turns) > _LONG:
        plan = cheapest_plan(replace(folded, turns=folded.turns[before:], shifts=folded.shifts[before:]))
        return replace(plan, attach=plan.attach + before) if plan.attach else plan
    bindings = _Trials()
    best = min(_CARRIED, key=lambda plan: _plan_cost(folded, plan, bindings))
    return min((best, *_attachments(folded, best)), key=lambda plan: _plan_cost(folded, plan, bindings))


def _plans(folded: FoldedChain) -> tuple[Plan | Association, ...]:
    """Return all plans for a short chain, the best one first as its operations stand; for a longer one that alone."""
    best = cheapest_plan(folded)
    if len(folded.turns) > _SHORT:
        return (best,)
    plans = dict.fromkeys((best, *(each for plan in _CARRIED for each in (plan, *_attachments(folded, plan)))))
    return (*plans, *(associations(folded) if is_inclined(folded.turns) else ()))


def _attachments(folded: FoldedChain, plan: Plan) -> Iterator[Plan]:
    axes = [axis for axis in range(3) if folded.shifts[-1][axis] != 0]
    if axes and folded.turns:
        yield Plan(plan.carried, 0)
        if all(axis in plan.carried for axis in axes):
            # Further from the tip it pays less and less, and each candidate of a long chain takes its time.
            last = len(folded.turns) - 1
            yield from (Plan(plan.carried, level) for level in range(max(1, last - _NEAR_THE_TIP), last + 1))


@dataclass(slots=True)
class _Trials(LetBindings):
    """Bindings that all plans share, so that a column which several of them carry is turned once."""

    _turned: dict[tuple[Turn, Vector], Vector] = field(default_factory=dict)

    def turned(self, turn: Turn, vector: Vector) -> Vector:
        key = (turn, vector)
        if key not in self._turned:
            self._turned[key] = LetBindings.turned(self, turn, vector)
        return self._turned[key]


def _plan_cost(folded: FoldedChain, plan: Plan, bindings: LetBindings) -> int:
    columns, position = evaluate(folded, plan, bindings)
    return cost(tuple(bindings.definitions), tuple(pose_entries(columns, position, folded.attitude)))


def evaluate(folded: FoldedChain, plan: Plan, bindings: LetBindings) -> tuple[tuple[Vector, Vector, Vector], Vector]:
    """Evaluate a folded chain from its end: columns of the rotation before the attitude, and the position."""
    columns = {axis: UNITS[axis] for axis in plan.carried}
    position = folded.shifts[-1] if plan.attach is None else NULL
    for level in reversed(range(len(folded.turns))):
        turn = folded.turns[level]
        columns = {axis: bindings.turned(turn, column) for axis, column in columns.items()}
        position = bindings.turned(turn, position)
        if plan.attach == level:
            if level == 0:
                columns = dict(enumerate(completed(columns, bindings)))
            position = combined(folded.shifts[-1], columns.__getitem__, position)
        position = bindings.vector(total(position, folded.shifts[level]))
    return completed(columns, bindings), position


def pose_entries(columns: tuple[Vector, Vector, Vector], position: Vector, attitude: AxisPermutation) -> list[sp.Expr]:
    """Return the twelve entries of a pose, row by row, with the final attitude applied to the columns."""
    return [
        entry for row in range(3) for entry in (*(sign * columns[axis][row] for axis, sign in attitude), position[row])
    ]


def transform(robot: Robot, start: FrameName, end: FrameName) -> sp.Matrix:
    """Return the exact transform between two frames, in sines and cosines of joint angle sums.

    Args:
        robot: The robot; all its parameters stay symbols.
        start: Frame of reference, by name or row number.
        end: Frame that is reached.

    Returns:
        The 4x4 matrix `start_T_end`, nested as it arises, not expanded.

    Raises:
        KinegenError: If a frame does not exist.
    """
    return product(transforms_between(robot, start, end, symbols(robot, keep_parameters=True)))


def product(steps: tuple[Elementary, ...]) -> sp.Matrix:
    """Return the exact product of elementary transforms, 4x4, nested as it arises, not expanded."""
    folded = fold_for_readers(steps)
    columns = UNITS
    position = folded.shifts[-1]
    for turn, shift in zip(reversed(folded.turns), reversed(folded.shifts[:-1]), strict=True):
        turned = [rotate(turn.axis, turn.angle, column) for column in columns]
        columns = (turned[0], turned[1], turned[2])
        position = total(rotate(turn.axis, turn.angle, position), shift)
    entries = pose_entries(columns, position, folded.attitude)
    return sp.Matrix(4, 4, [*entries, 0, 0, 0, 1])


_PLAN = Plan((0, 1))
"""A position needs no columns; what is computed of them is left out."""


def derive_position(robot: Robot, quantity: Quantity = Quantity.POSITION) -> Expressions:
    """Return the position of every tip, or of one frame, in the base frame. Returns three entries for each frame."""
    values = symbols(robot, keep_parameters=False)
    chains = chains_of(robot, quantity, values)
    return by_joints(robot, quantity, values, tuple(_position_ways(chains)), point_array(robot, quantity))


def _position_ways(chains: Sequence[Sequence[Elementary]]) -> Iterator[Candidate]:
    """Yield the ways that are tried; of several frames, which share values, one for each form of their chains."""
    for number, form in enumerate(forms(list(map(without_last_turns, chains)))):
        if len(form) == 1:
            yield from (replace(way, form=number) for way in _position_ways_of_form(form[0]))
            continue
        bindings = LetBindings()
        entries = [entry for steps in form for entry in evaluate(fold(steps, Last.OWN), _PLAN, bindings)[1]]
        yield replace(bindings.way(entries), form=number)


def _position_ways_of_form(steps: Sequence[Elementary]) -> Iterator[Candidate]:
    folds = tuple(foldings(steps, Last.OWN))
    for place, folded in enumerate(folds, 1):
        name = f"folding {place} of {len(folds)}, {len(folded.turns)} turns"
        bindings = LetBindings()
        position = evaluate(folded, _PLAN, bindings)[1]
        yield bindings.way(position, name)
        if runs := fixed_runs(folded):
            bindings = LetBindings()
            position = associated(folded, Association(_PLAN.carried, runs), bindings)[1]
            yield bindings.way(position, f"{name}, fixed ones as one matrix")
