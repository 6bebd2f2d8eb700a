"""Nearly parallel neighbours: rows whose common normal is not defined well get a second twist.

Between parallel axes a small error of direction moves the common normal by metres. Hayati and Mirmirani (1985)
describe such a link by two twists, alpha and beta, and need no d. A standard row whose twist is exactly 0 or 180
degrees becomes a row of their convention, and its d moves to the next row, where it means the same. Any other row
becomes the elementary sequence of its own convention with a turn by beta in it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from kinegen.calibrate.choice import Choice
from kinegen.naming import check_name
from kinegen.robot.dimension import Dimension
from kinegen.robot.entries import ANGLE_ENTRIES
from kinegen.robot.expressions import ZERO, Expression, Name, add, evaluate, linear, negate, substitute
from kinegen.robot.floats import FLOATS
from kinegen.robot.model import Convention, JointType, Parameter, Robot, Row, Step, StepKind
from kinegen.robot.units import join

NEARLY = math.radians(5)
"""Axes that differ by less count as nearly parallel."""

SEQUENCES = {
    Convention.STANDARD: (("Rz", "theta"), ("Tz", "d"), ("Tx", "a"), ("Rx", "alpha"), ("Ry", "beta")),
    Convention.MODIFIED: (("Rx", "alpha"), ("Tx", "a"), ("Ry", "beta"), ("Rz", "theta"), ("Tz", "d")),
    Convention.MODIFIED_PREV_D: (("Rx", "alpha"), ("Ry", "beta"), ("Rz", "theta"), ("Tx", "a"), ("Tz", "d")),
}
"""The elementary steps of a row of each convention, with a second twist at the link between the two axes."""


@dataclass(frozen=True, slots=True)
class Parallel:
    """A row that got a second twist.

    Attributes:
        row: Its name.
        neighbours: The two joints whose axes are nearly parallel.
        angle: The angle between these axes in the file, in radians, up to 90 degrees.
        hayati: Whether it is a row of the Hayati convention now; otherwise an elementary sequence.
        heir: The row that takes over its d, if it is a Hayati row; empty if its d was zero.
        sign: The factor of d there, 1 or -1.
    """

    row: str
    neighbours: tuple[str, str]
    angle: float
    hayati: bool
    heir: str = ""
    sign: int = 1


@dataclass(frozen=True, slots=True)
class Prepared:
    """A robot whose nearly parallel neighbours have second twists.

    Attributes:
        robot: Equal to the one of the file in every pose of its tips.
        parallels: The rows that changed, in the order of the table.
        names: What is varied of the table and of the parameters: names for `calibrated`.
    """

    robot: Robot
    parallels: tuple[Parallel, ...]
    names: tuple[str, ...]


def prepare(robot: Robot, choice: Choice) -> Prepared:
    """Give second twists to the rows whose alpha is varied and whose axes are nearly parallel.

    Args:
        robot: The robot of the file.
        choice: What is varied.

    Returns:
        The robot to fit, and the names of what is varied in it.
    """
    own = {parameter.name: parameter.value for parameter in robot.parameters}
    floats = {name: evaluate(value, {}, FLOATS) for name, value in own.items()}
    rows, parallels = {row.name: row for row in robot.rows}, list[Parallel]()
    for name in (row.name for row in robot.rows):
        neighbours = _neighbours(robot, rows[name])
        if name not in choice.twists or neighbours is None or rows[name].convention is Convention.HAYATI:
            continue
        alpha = evaluate(rows[name].alpha or ZERO, floats, FLOATS)
        angle = abs(math.remainder(alpha, math.pi))
        if angle > NEARLY:
            continue
        held = any(frame.parent == name for frame in robot.frames)
        found = _as_hayati(rows, name, neighbours, alpha, floats, held=held)
        parallels.append(found or Parallel(name, neighbours, angle, hayati=False))
    left = replace(robot, rows=tuple(rows[row.name] for row in robot.rows))
    sequences = {parallel.row for parallel in parallels if not parallel.hayati}
    for name in (row.name for row in robot.rows if row.name in sequences):
        left = _as_sequence(left, name, own, _varied_keys(choice, name))
    return Prepared(left, tuple(parallels), _names(choice, parallels))


def _varied_keys(choice: Choice, name: str) -> frozenset[str]:
    return frozenset((*(key for row, key in choice.entries if row == name), "beta"))


def _neighbours(robot: Robot, row: Row) -> tuple[str, str] | None:
    """The two revolute joints whose axes the twist of a row is between, if there are two."""
    by_name = {each.name: each for each in robot.rows}
    first: Row | None = row
    second = by_name.get(row.parent)
    if row.convention in (Convention.MODIFIED, Convention.MODIFIED_PREV_D):
        first, second = second, row
    else:
        children = [each for each in robot.rows if each.parent == row.name]
        second = children[0] if len(children) == 1 else None
    if first is None or second is None or {first.type, second.type} != {JointType.REVOLUTE}:
        return None
    return first.name, second.name


def _as_hayati(
    rows: dict[str, Row],
    name: str,
    neighbours: tuple[str, str],
    alpha: float,
    floats: dict[str, float],
    *,
    held: bool,
) -> Parallel | None:
    """Turn a standard row into a Hayati row, exactly; None where only an elementary sequence is exact.

    A row that holds named frames keeps its d, with which they would move.
    """
    row, heir = rows[name], rows[neighbours[1]]
    angle = abs(math.remainder(alpha, math.pi))
    flat = angle < 1e-15
    if row.convention is not Convention.STANDARD or row.d is None:
        return None
    free = evaluate(row.d, floats, FLOATS) == 0.0
    # d of the row can pass along parallel axes, to a row that has a d and begins with its own axis.
    passes = flat and not held and heir.convention is Convention.STANDARD and heir.d is not None
    if not (free or passes):
        return None
    sign = 1 if math.cos(alpha) > 0 else -1
    rows[name] = replace(row, convention=Convention.HAYATI, d=None, beta=ZERO)
    if free or heir.d is None:
        return Parallel(name, neighbours, angle, hayati=True)
    rows[heir.name] = replace(heir, d=add(heir.d, row.d if sign > 0 else negate(row.d)))
    return Parallel(name, neighbours, angle, hayati=True, heir=heir.name, sign=sign)


def _as_sequence(robot: Robot, name: str, own: dict[str, Expression], varied: frozenset[str]) -> Robot:
    """Turn a row into an elementary sequence with a second twist; its varied numbers become parameters."""
    joints = frozenset(variable.name for variable in robot.variables)
    (row,) = (each for each in robot.rows if each.name == name)
    added, steps = list[Parameter](), list[Step]()
    for step, key in SEQUENCES[row.convention]:
        entry: Expression = ZERO if key == "beta" else getattr(row, key)
        if key in varied:
            factors, offset = linear(entry, joints)
            called = f"{key}_{name}"
            check_name("parameter", called)
            dimension = Dimension.ANGLE if key in ANGLE_ENTRIES else Dimension.LENGTH
            added.append(Parameter(called, substitute(offset, own), dimension, runtime=False, line=row.line))
            entry = join(factors, Name(called))
        steps.append(Step(StepKind(step), entry))
    new = replace(row, convention=Convention.ETS, alpha=None, a=None, d=None, theta=None, beta=None, steps=tuple(steps))
    rows = tuple(new if each is row else each for each in robot.rows)
    return replace(robot, rows=rows, parameters=(*robot.parameters, *added))


def _names(choice: Choice, parallels: list[Parallel]) -> tuple[str, ...]:
    """The varied names of the prepared robot; a Hayati row has no d."""
    lost = {(parallel.row, "d") for parallel in parallels if parallel.hayati}
    entries = [f"{key}_{row}" for row, key in choice.entries if (row, key) not in lost]
    return (*choice.parameters, *entries, *(f"beta_{parallel.row}" for parallel in parallels))
