"""How far a robot moves: the box of its joint vectors, an upper bound on its reach, the lead of screw joints.

In: a `Robot`. Out: floats in radians and the file's length unit. Lengths are added up along the table; no pose is
computed here.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator, Mapping
from functools import lru_cache

from kinegen.model.expression_parser import Expression, evaluate, linear
from kinegen.model.expression_values import FLOAT64
from kinegen.model.robot import TOOL, WRIST, JointType, JointVariable, Robot, Row, Step, angles_of, lengths_of, shifting

SMALLEST_REACH = 1e-6
"""Reach of a robot without any length, so that tolerances that scale with the reach never vanish."""


@lru_cache(maxsize=32)
def joint_box(robot: Robot) -> tuple[tuple[float, float], ...]:
    """Return the box of joint vectors over which kernels are compared.

    Returns:
        A lower and an upper bound for each joint variable, in radians or the file's length unit. Where the file has no
        limits: half a turn to either side, or for a prismatic joint the sum of the robot's constant lengths to either
        side (1 if there are none).
    """
    values, joints = parameter_values(robot), frozenset(variable.name for variable in robot.variables)
    lengths = itertools.chain.from_iterable(_lengths(robot).values())
    stroke = sum(_constant(linear(length, joints)[1], values) for length in lengths) or 1.0
    return tuple(_bounds(variable, stroke) for variable in robot.variables)


def reach(robot: Robot, frames: Iterable[str] | None = None) -> float:
    """Return an upper bound on how far frames get from the base.

    Args:
        frames: Names of the frames; the tips if left out. `frame/other` is a frame as seen from another one.

    Returns:
        The longest sum of link lengths and strokes between the base and one of the frames, over the joint box and with
        the parameters of the file, in the file's length unit; at least `SMALLEST_REACH`.
    """
    totals = _totals(robot)
    ways = robot.tips if frames is None else frames
    return max(SMALLEST_REACH, *(_apart(robot, way) if "/" in way else totals[way] for way in ways))


def endless(robot: Robot) -> tuple[str, ...]:
    """Return the joints without limits that lengths depend on, so that nothing bounds the reach."""
    used = shifting(robot)
    return tuple(each.name for each in robot.variables if each.limits is None and each.name in used)


def _apart(robot: Robot, way: str) -> float:
    """Return the lengths between two frames, without those above both."""
    own, parents = _own(robot), dict(_parents(robot))
    first, other = ([*_up(name, parents)] for name in way.split("/"))
    return sum(own[name] for name in (*first, *other) if (name in first) != (name in other))


def _up(name: str, parents: Mapping[str, str]) -> Iterator[str]:
    """Return a frame and those between it and the base, upwards."""
    while name in parents:
        yield name
        name = parents[name]


@lru_cache(maxsize=32)
def _totals(robot: Robot) -> Mapping[str, float]:
    """Return how far each frame gets from the base."""
    own, totals = _own(robot), {robot.root: 0.0}
    for name, parent in _parents(robot):
        totals[name] = totals[parent] + own[name]
    return totals


@lru_cache(maxsize=32)
def _own(robot: Robot) -> Mapping[str, float]:
    """Return how far each frame gets from its parent."""
    box = zip(robot.variables, joint_box(robot), strict=True)
    largest = {variable.name: max(abs(low), abs(high)) for variable, (low, high) in box}
    values, lengths = parameter_values(robot), _lengths(robot)
    return {name: sum(_largest(length, values, largest) for length in lengths[name]) for name, _ in _parents(robot)}


def _bounds(variable: JointVariable, stroke: float) -> tuple[float, float]:
    if variable.limits is not None:
        low, high = (float(evaluate(limit, {}, FLOAT64)) for limit in variable.limits)
        return low, high
    half = stroke if variable.type is JointType.PRISMATIC else math.pi
    return -half, half


def _parents(robot: Robot) -> Iterator[tuple[str, str]]:
    """Return every frame but the base with its parent, parents first; the base transform counts to each first row."""
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
    """Return every length on the way from a frame's parent to the frame, by frame."""
    base = _shifts(robot.base)
    root = robot.root
    found = {TOOL: _shifts(robot.tool) + (() if robot.rows else base), WRIST: ()}
    for row in robot.rows:
        found[row.name] = (base if row.parent == root else ()) + lengths_of(row)
    return found | {frame.name: _shifts(frame.steps) for frame in robot.frames}


def _shifts(steps: tuple[Step, ...]) -> tuple[Expression, ...]:
    return tuple(step.value for step in steps if not step.kind.is_rotation)


def parameter_values(robot: Robot) -> dict[str, float]:
    """Return the values of the parameters in the file, in radians and its length unit."""
    return {entry.name: float(evaluate(entry.value, {}, FLOAT64)) for entry in robot.parameters}


def _constant(length: Expression, values: Mapping[str, float]) -> float:
    """Return what the part of a length measures that has no joint variable."""
    return abs(float(evaluate(length, values, FLOAT64)))


def _largest(length: Expression, values: Mapping[str, float], largest: Mapping[str, float]) -> float:
    """Return the most that a length can measure over the joint box, from the magnitudes of parameters and joints."""
    factors, constant = linear(length, frozenset(largest))
    strokes = (abs(float(evaluate(factor, values, FLOAT64))) * largest[name] for name, factor in factors.items())
    return _constant(constant, values) + sum(strokes)


def screw_leads(robot: Robot) -> dict[str, float]:
    """Return the lead of every screw joint, in lengths a turn, with the parameters of the file.

    It is negative where the joint goes back along its axis.
    """
    values = parameter_values(robot)

    def pitch(row: Row, parts: tuple[Expression, ...]) -> float:
        factors = (linear(part, frozenset({row.name}))[0].get(row.name) for part in parts)
        return sum(float(evaluate(factor, values, FLOAT64)) for factor in factors if factor is not None)

    return {
        row.name: 2 * math.pi * pitch(row, lengths_of(row)) / pitch(row, angles_of(row))
        for row in robot.rows
        if row.type is JointType.SCREW
    }
