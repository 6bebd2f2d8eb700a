"""Elementary transforms of the rows of a table, and the way between two frames as a sequence of them.

In: a robot. Out: turns about x, y, z and shifts along them, with exact sympy values. Nothing is multiplied here.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping

import sympy as sp

from kinegen.errors import KinegenError
from kinegen.model import row_transforms as rows
from kinegen.model.expression_parser import Arithmetic, evaluate
from kinegen.model.robot import ROOT, TOOL, WRIST, Robot, Row, Step, StepKind
from kinegen.support.dataclass import dataclass

X, Y, Z = 0, 1, 2

SYMPY = Arithmetic(
    number=lambda value: sp.Rational(value.numerator, value.denominator),
    pi=sp.pi,
    functions={"sqrt": sp.sqrt, "asin": sp.asin, "acos": sp.acos, "atan": sp.atan, "atan2": sp.atan2},
)
"""Exact sympy numbers."""


@dataclass(frozen=True, slots=True)
class Turn:
    """A rotation by `angle` (radians) about axis 0, 1 or 2."""

    axis: int
    angle: sp.Expr


@dataclass(frozen=True, slots=True)
class Shift:
    """A translation by `length` along axis 0, 1 or 2."""

    axis: int
    length: sp.Expr


Elementary = Turn | Shift

Values = Mapping[str, sp.Expr]
"""What each name of a robot file stands for: a symbol, or an exact number."""


def symbols(robot: Robot, keep_parameters: bool) -> dict[str, sp.Expr]:
    """Return the sympy value of every name.

    `keep_parameters`: whether parameters stay symbols, as people read them; otherwise only runtime parameters do and
    the others become exact numbers.
    """
    values: dict[str, sp.Expr] = {variable.name: sp.Symbol(variable.name, real=True) for variable in robot.variables}
    for parameter in robot.parameters:
        symbol = keep_parameters or parameter.runtime
        values[parameter.name] = (
            sp.Symbol(parameter.name, real=True) if symbol else evaluate(parameter.value, {}, SYMPY)
        )
    return values


def row_transforms(row: Row, values: Values) -> tuple[Elementary, ...]:
    """Return the turns and shifts of a row, from its parent frame to its own, without those that are identities."""
    return step_transforms(rows.row_transforms(row), values)


def step_transforms(steps: Iterable[Step | rows.ElementaryTransform], values: Values) -> tuple[Elementary, ...]:
    """Return the turns and shifts of a sequence, left to right, without those that are identities."""
    sequence = (elementary(step.kind, sp.expand(evaluate(step.value, values, SYMPY))) for step in steps)
    return tuple(step for step in sequence if not is_identity(step))


def elementary(kind: StepKind, value: sp.Expr) -> Elementary:
    """Return the turn or the shift of a kind."""
    return Turn(kind.axis, value) if kind.is_rotation else Shift(kind.axis, value)


def inverse(step: Elementary) -> Elementary:
    """Return the transform that undoes `step`."""
    return Turn(step.axis, -step.angle) if isinstance(step, Turn) else Shift(step.axis, -step.length)


def is_identity(step: Elementary) -> bool:
    """Tell whether a transform does nothing, exactly."""
    return bool((step.angle if isinstance(step, Turn) else step.length) == 0)


FrameName = str | int
"""A frame by name; or by number: i is the frame of row i, 0 the one after the robot's fixed base transform."""

_ORIGIN = "0"


def transforms_between(robot: Robot, start: FrameName, end: FrameName, values: Values) -> tuple[Elementary, ...]:
    """Return the elementary transforms that lead from one frame to another, through their nearest common ancestor.

    Returns:
        Turns and shifts, left to right: their product is `start_T_end`.

    Raises:
        KinegenError: If a frame does not exist; the message lists those that do.
    """
    return tuple(step for link in links_between(robot, start, end, values) for step in link)


def links_between(robot: Robot, start: FrameName, end: FrameName, values: Values) -> tuple[tuple[Elementary, ...], ...]:
    """Return the same, link by link: one sequence for each frame on the way."""
    up = _ancestry(robot, _resolve(robot, start))
    down = _ancestry(robot, _resolve(robot, end))
    while up and down and up[0] == down[0]:
        up, down = up[1:], down[1:]
    climb = [tuple(inverse(step) for step in reversed(_link(robot, name, values))) for name in reversed(up)]
    return (*climb, *(_link(robot, name, values) for name in down))


def frames_between(robot: Robot, start: FrameName, end: FrameName) -> tuple[tuple[str, str], ...]:
    """Return the links on the way between two frames, in order, each as the frame before and the frame after it.

    Returns pairs of parent and child, also where the way climbs from a child to its parent; the frame after the fixed
    base transform is called 0.
    """
    up = [robot.root, *_ancestry(robot, _resolve(robot, start))]
    down = [robot.root, *_ancestry(robot, _resolve(robot, end))]
    while len(up) > 1 and len(down) > 1 and up[1] == down[1]:
        up, down = up[1:], down[1:]
    climbed = list(itertools.pairwise(up))[::-1]
    return (*climbed, *itertools.pairwise(down))


def _resolve(robot: Robot, frame: FrameName) -> str:
    text = str(frame)
    if text.isdecimal() and int(text) <= len(robot.rows):
        return robot.rows[int(text) - 1].name if int(text) else _ORIGIN
    if text == WRIST and not robot.is_tree and text not in robot.frame_names:
        return robot.leaves[0] if robot.rows else _ORIGIN
    known = (robot.root, *robot.frame_names)
    if text not in known:
        numbers = f"0 to {len(robot.rows)}"
        names = ", ".join(name for name in known if name != ROOT)
        raise KinegenError(f"unknown frame '{text}' (expected {names}, or a number from {numbers})")
    return text


def _ancestry(robot: Robot, name: str) -> list[str]:
    """Return the frames from below the root down to `name`; the root itself is left out."""
    root = robot.root
    parents = {row.name: _ORIGIN if row.parent == root else row.parent for row in robot.rows}
    parents[_ORIGIN] = root
    if not robot.is_tree:
        parents[TOOL] = robot.leaves[0] if robot.rows else _ORIGIN
    for frame in robot.frames:
        parents[frame.name] = _resolve(robot, frame.parent)
    path: list[str] = []
    while name != root:
        path.append(name)
        name = parents[name]
    return path[::-1]


def _link(robot: Robot, name: str, values: Values) -> tuple[Elementary, ...]:
    if name == _ORIGIN:
        return step_transforms(robot.base, values)
    if name == TOOL:
        return step_transforms(robot.tool, values)
    for row in robot.rows:
        if row.name == name:
            return row_transforms(row, values)
    steps = next(frame.steps for frame in robot.frames if frame.name == name)
    return step_transforms(steps, values)
