"""The pose of the tips, evaluated from the tip towards the base.

Two columns of the rotation are turned from joint to joint and the third is their cross product, or all three are
turned; the last shift (usually the tool) is added either at once or where its direction is at hand. The candidates
are counted and the cheapest is kept.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import sympy as sp

from kinegen.outputs import Quantity
from kinegen.robot.model import Robot
from kinegen.symbolic.chain import FrameName, transforms_between
from kinegen.symbolic.expressions import Definition, Expressions, Tape, cost
from kinegen.symbolic.fold import NULL, Attitude, Folded, Vector, fold, rotate, total
from kinegen.symbolic.forward import forward_poses
from kinegen.symbolic.signatures import (
    frames_of,
    joint_array,
    joint_symbols,
    parameter_symbols,
    pose_array,
    signature,
    start_of,
)
from kinegen.symbolic.transforms import Elementary, Turn, symbols

UNITS: tuple[Vector, Vector, Vector] = (
    (sp.S.One, sp.S.Zero, sp.S.Zero),
    (sp.S.Zero, sp.S.One, sp.S.Zero),
    (sp.S.Zero, sp.S.Zero, sp.S.One),
)


_NEAR_THE_TIP = 6
"""How many turns from the tip on are tried as the place at which the last shift is added."""

_LONG = 48
"""A chain of more turns is planned by its end: what candidates differ in is near the tip."""

_END = 24
"""How many turns this end has."""


@dataclass(frozen=True, slots=True)
class Plan:
    """One way to evaluate a folded chain.

    Attributes:
        carried: Axes whose columns are turned from joint to joint; a missing third is a cross product.
        attach: Number of turns still to come when the last shift is added, as a multiple of the columns; None to add
            it before all of them.
    """

    carried: tuple[int, ...]
    attach: int | None = None


def derive_pose(robot: Robot, quantity: Quantity = Quantity.POSE) -> Expressions:
    """The pose of every tip, or of one frame, in the base frame.

    Args:
        robot: The robot; parameters that are not runtime parameters become exact numbers.
        quantity: The pose, and of which frame.

    Returns:
        Twelve entries for each frame, the upper three rows of `base_T_frame`, row by row.

    Raises:
        KinegenError: If there is no such frame.
    """
    values = symbols(robot, keep_parameters=False)
    tape = Tape()
    entries: list[sp.Expr] = []
    frames = frames_of(robot, quantity)
    for frame in frames:
        folded = fold(transforms_between(robot, start_of(robot, quantity), frame, values))
        columns, position = evaluate(folded, cheapest_plan(folded), tape)
        entries += pose_entries(columns, position, folded.attitude)
    best = (tuple(tape.definitions), tuple(entries))
    if len(frames) > 1:
        best = min(best, _forward(robot), key=lambda way: cost(*way))
    return Expressions(
        signature=signature(robot, quantity, (joint_array(robot),), pose_array(robot, quantity)),
        variables=joint_symbols(robot, values),
        parameters=parameter_symbols(robot, values),
        definitions=best[0],
        entries=best[1],
    )


def _forward(robot: Robot) -> tuple[tuple[Definition, ...], tuple[sp.Expr, ...]]:
    """All tips from the base outwards, which pays where they share a trunk."""
    definitions, entries = forward_poses(robot, robot.tips, symbols(robot, keep_parameters=False))
    return definitions, entries


def cheapest_plan(folded: Folded) -> Plan:
    """Count the candidates and keep the cheapest; the first of equals wins.

    Long chains are planned by their last turns, so that the time grows with the length once and not with every
    candidate. Any plan is right; the one that is kept there may take a few operations more than the cheapest.
    """
    before = len(folded.turns) - _END
    if len(folded.turns) > _LONG:
        plan = cheapest_plan(replace(folded, turns=folded.turns[before:], shifts=folded.shifts[before:]))
        return replace(plan, attach=plan.attach + before) if plan.attach else plan
    plans = [Plan(carried) for carried in ((0, 1, 2), (0, 1), (0, 2), (1, 2))]
    tape = _Trials()
    best = min(plans, key=lambda plan: _plan_cost(folded, plan, tape))
    return min((best, *_attachments(folded, best)), key=lambda plan: _plan_cost(folded, plan, tape))


def _attachments(folded: Folded, plan: Plan) -> Iterator[Plan]:
    axes = [axis for axis in range(3) if folded.shifts[-1][axis] != 0]
    if axes and folded.turns:
        yield Plan(plan.carried, 0)
        if all(axis in plan.carried for axis in axes):
            # Further from the tip it pays less and less, and each candidate of a long chain takes its time.
            last = len(folded.turns) - 1
            yield from (Plan(plan.carried, level) for level in range(max(1, last - _NEAR_THE_TIP), last + 1))


@dataclass(slots=True)
class _Trials(Tape):
    """A tape that all plans share, so that a column which several of them carry is turned once."""

    _turned: dict[tuple[Turn, Vector], Vector] = field(default_factory=dict)

    def turned(self, turn: Turn, vector: Vector) -> Vector:
        """A vector turned by one turn, named."""
        key = (turn, vector)
        if key not in self._turned:
            self._turned[key] = Tape.turned(self, turn, vector)
        return self._turned[key]


def _plan_cost(folded: Folded, plan: Plan, tape: Tape) -> int:
    columns, position = evaluate(folded, plan, tape)
    return cost(tuple(tape.definitions), tuple(pose_entries(columns, position, folded.attitude)))


def evaluate(folded: Folded, plan: Plan, tape: Tape) -> tuple[tuple[Vector, Vector, Vector], Vector]:
    """Evaluate a folded chain from its end to its start.

    Args:
        folded: The chain.
        plan: Which columns to carry, and where the last shift is added.
        tape: Receives the intermediate values.

    Returns:
        The three columns of the rotation without the final attitude, and the position.
    """
    columns = {axis: UNITS[axis] for axis in plan.carried}
    position = folded.shifts[-1] if plan.attach is None else NULL
    for level in reversed(range(len(folded.turns))):
        turn = folded.turns[level]
        columns = {axis: tape.turned(turn, column) for axis, column in columns.items()}
        position = tape.turned(turn, position)
        if plan.attach == level:
            if level == 0:
                columns = _completed(columns, tape)
            position = _attached(position, folded.shifts[-1], columns)
        position = tape.vector(total(position, folded.shifts[level]))
    columns = _completed(columns, tape)
    return (columns[0], columns[1], columns[2]), position


def _attached(position: Vector, shift: Vector, columns: dict[int, Vector]) -> Vector:
    for axis in range(3):
        if shift[axis] != 0:
            x, y, z = columns[axis]
            position = total(position, (shift[axis] * x, shift[axis] * y, shift[axis] * z))
    return position


def _completed(columns: dict[int, Vector], tape: Tape) -> dict[int, Vector]:
    """Add the third column, the cross product of the two others in cyclic order."""
    missing = [axis for axis in range(3) if axis not in columns]
    for axis in missing:
        a, b = columns[(axis + 1) % 3], columns[(axis + 2) % 3]
        product = (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])
        columns = {**columns, axis: tape.vector(product)}
    return columns


def pose_entries(columns: tuple[Vector, Vector, Vector], position: Vector, attitude: Attitude) -> list[sp.Expr]:
    """The twelve entries of a pose, row by row, with the final attitude applied to the columns."""
    return [
        entry for row in range(3) for entry in (*(sign * columns[axis][row] for axis, sign in attitude), position[row])
    ]


def transform(robot: Robot, start: FrameName, end: FrameName) -> sp.Matrix:
    """The exact transform between two frames, in sines and cosines of joint angle sums.

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
    """The exact product of elementary transforms, 4x4, nested as it arises, not expanded."""
    folded = fold(steps)
    columns = UNITS
    position = folded.shifts[-1]
    for turn, shift in zip(reversed(folded.turns), reversed(folded.shifts[:-1]), strict=True):
        turned = [rotate(turn.axis, turn.angle, column) for column in columns]
        columns = (turned[0], turned[1], turned[2])
        position = total(rotate(turn.axis, turn.angle, position), shift)
    entries = pose_entries(columns, position, folded.attitude)
    return sp.Matrix(4, 4, [*entries, 0, 0, 0, 1])
