"""How far a robot moves: the box of its joint vectors, and an upper bound on its reach.

In: a `Robot`. Out: floats in radians and the file's length unit. Lengths are added up along the table; no pose is
computed here.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from functools import lru_cache

from kinegen.robot.expressions import Expression, evaluate, linear
from kinegen.robot.floats import FLOATS
from kinegen.robot.model import TOOL, WRIST, JointType, JointVariable, Robot, Step

SMALLEST_REACH = 1e-6
"""Reach of a robot without any length, so that tolerances that scale with the reach never vanish."""


@lru_cache(maxsize=32)
def joint_box(robot: Robot) -> tuple[tuple[float, float], ...]:
    """The box of joint vectors over which kernels are compared.

    Args:
        robot: The robot.

    Returns:
        A lower and an upper bound for each joint variable, in radians or the file's length unit. Where the file has no
        limits: half a turn to either side, or for a prismatic joint the sum of the robot's constant lengths to either
        side (1 if there are none).
    """
    stroke = sum(_constant(robot, length) for lengths in _lengths(robot).values() for length in lengths) or 1.0
    return tuple(_bounds(variable, stroke) for variable in robot.variables)


def reach(robot: Robot, frames: Iterable[str] | None = None) -> float:
    """An upper bound on how far frames get from the base.

    Args:
        robot: The robot.
        frames: Names of the frames; the tips if left out.

    Returns:
        The longest sum of link lengths and strokes between the base and one of the frames, over the joint box and with
        the parameters of the file, in the file's length unit; at least `SMALLEST_REACH`.
    """
    box = zip(robot.variables, joint_box(robot), strict=True)
    largest = {variable.name: max(abs(low), abs(high)) for variable, (low, high) in box}
    lengths = _lengths(robot)
    totals = {robot.root: 0.0}
    for name, parent in _parents(robot):
        totals[name] = totals[parent] + sum(_largest(robot, length, largest) for length in lengths[name])
    return max(SMALLEST_REACH, *(totals[name] for name in (robot.tips if frames is None else frames)))


def _bounds(variable: JointVariable, stroke: float) -> tuple[float, float]:
    if variable.limits is not None:
        low, high = (float(evaluate(limit, {}, FLOATS)) for limit in variable.limits)
        return low, high
    half = stroke if variable.type is JointType.PRISMATIC else math.pi
    return -half, half


def _parents(robot: Robot) -> Iterator[tuple[str, str]]:
    """Every frame but the base with its parent, parents first; the base transform counts to each first row."""
    last = robot.rows[-1].name if robot.rows else robot.root
    for row in robot.rows:
        yield row.name, row.parent
    if not robot.is_tree:
        yield TOOL, last
        if WRIST not in robot.frame_names:
            yield WRIST, last
    for frame in robot.frames:
        yield frame.name, frame.parent


def _lengths(robot: Robot) -> dict[str, tuple[Expression, ...]]:
    """Every length on the way from a frame's parent to the frame, by frame."""
    base = _shifts(robot.base)
    found = {TOOL: _shifts(robot.tool) + (() if robot.rows else base), WRIST: ()}
    for row in robot.rows:
        entries = tuple(entry for entry in (row.a, row.d) if entry is not None)
        found[row.name] = (base if row.parent == robot.root else ()) + _shifts(row.steps) + entries
    return found | {frame.name: _shifts(frame.steps) for frame in robot.frames}


def _shifts(steps: tuple[Step, ...]) -> tuple[Expression, ...]:
    return tuple(step.value for step in steps if not step.kind.is_rotation)


def _split(robot: Robot, length: Expression) -> tuple[dict[str, Expression], Expression]:
    return linear(length, frozenset(variable.name for variable in robot.variables))


def _values(robot: Robot) -> dict[str, float]:
    return {entry.name: float(evaluate(entry.value, {}, FLOATS)) for entry in robot.parameters}


def _constant(robot: Robot, length: Expression) -> float:
    """What a length measures when all joint variables are zero."""
    return abs(float(evaluate(_split(robot, length)[1], _values(robot), FLOATS)))


def _largest(robot: Robot, length: Expression, largest: Mapping[str, float]) -> float:
    """The most that a length can measure over the joint box."""
    factors, _ = _split(robot, length)
    values = _values(robot)
    strokes = (abs(float(evaluate(factor, values, FLOATS))) * largest[name] for name, factor in factors.items())
    return _constant(robot, length) + sum(strokes)
