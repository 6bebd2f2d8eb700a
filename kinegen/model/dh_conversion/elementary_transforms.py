"""Rows as elementary transforms folded without numbers, and the way from one frame to another as a chain.

In: rows and fixed transforms. Out: lists of steps with exact values, of which neighbours about one axis are one step.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from fractions import Fraction
from functools import lru_cache

from kinegen.errors import KinegenError
from kinegen.model.actuators import NO_ACTUATORS
from kinegen.model.expression_parser import (
    ONE,
    PI,
    ZERO,
    Expression,
    Number,
    Product,
    Sum,
    add,
    multiply,
    negate,
    number,
)
from kinegen.model.outputs import Quantity
from kinegen.model.robot import ROOT, TOOL, Convention, Robot, Row, Step, StepKind, root_name
from kinegen.model.row_transforms import row_transforms

Steps = tuple[Step, ...]

QUARTER = multiply(number("1/2"), PI)


def terms(expression: Expression) -> dict[Expression, Fraction]:
    """Return an expression as a sum of rational multiples of terms without numbers, in order of appearance."""
    found: dict[Expression, Fraction] = {}
    for part in expression.terms if isinstance(expression, Sum) else (expression,):
        for term, factor in _parts(part):
            found[term] = found.get(term, Fraction(0)) + factor
    return {term: factor for term, factor in found.items() if factor}


def _parts(part: Expression) -> Iterable[tuple[Expression, Fraction]]:
    if isinstance(part, Number):
        return ((ONE, part.value),)
    if not isinstance(part, Product):
        return ((part, Fraction(1)),)
    first = part.factors[0]
    scale, rest = (first.value, part.factors[1:]) if isinstance(first, Number) else (Fraction(1), part.factors)
    sums = [factor for factor in rest if isinstance(factor, Sum)]
    if not sums:
        return ((multiply(*rest), scale),)
    # A sum in brackets is multiplied out.
    others = list(rest)
    others.remove(sums[0])
    inner = (terms(multiply(*others, term)) for term in sums[0].terms)
    return [(term, factor * scale) for each in inner for term, factor in each.items()]


def tidy(expression: Expression) -> Expression:
    """Return an expression with equal terms put together; shares of pi and numbers are last, as a file has them."""
    found = sorted(terms(expression).items(), key=lambda each: each[0] == PI)
    return add(*(multiply(Number(factor), term) for term, factor in found), ZERO)


def total(*parts: Expression) -> Expression:
    """Return a sum with equal terms put together."""
    return tidy(add(*parts, ZERO))


def row_steps(row: Row) -> Steps:
    """Return the elementary transforms of a row, from its parent to its frame; without those that do nothing."""
    return tuple(Step(each.kind, each.value) for each in row_transforms(row) if tidy(each.value) != ZERO)


def inverse(steps: Steps) -> Steps:
    """Return the steps that undo others."""
    return tuple(Step(step.kind, tidy(negate(step.value))) for step in reversed(steps))


def folded(steps: Iterable[Step]) -> Steps:
    """Neighbours about or along one axis as one turn and one shift; what does nothing is left out."""
    groups: list[tuple[int, Expression, Expression]] = []
    for step in steps:
        axis = step.kind.axis
        turn, shift = (step.value, ZERO) if step.kind.is_rotation else (ZERO, step.value)
        if groups and groups[-1][0] == axis:
            _, before, along = groups.pop()
            turn, shift = total(before, turn), total(along, shift)
        turn, shift = _within_a_turn(tidy(turn)), tidy(shift)
        if turn != ZERO or shift != ZERO:
            groups.append((axis, turn, shift))
    found = []
    for axis, turn, shift in groups:
        found += [Step(StepKind(f"R{'xyz'[axis]}"), turn)] * (turn != ZERO)
        found += [Step(StepKind(f"T{'xyz'[axis]}"), shift)] * (shift != ZERO)
    return tuple(found)


def _within_a_turn(angle: Expression) -> Expression:
    """Return an angle without whole turns, where it is a share of pi alone."""
    share = terms(angle)
    if set(share) != {PI}:
        return angle
    rest = share[PI] % 2
    return multiply(Number(rest if rest <= 1 else rest - 2), PI)


def kept_turn(angle: Expression) -> Expression:
    """Return an angle without whole turns, for people: between -180 and 180 degrees where it is a share of pi."""
    return _within_a_turn(tidy(angle))


def upright(steps: Iterable[Step]) -> Steps:
    """Return steps about z and x alone: what is about y is turned there and back."""
    found: list[Step] = []
    for step in steps:
        if step.kind.axis != 1:
            found.append(step)
            continue
        about_x = StepKind.RX if step.kind.is_rotation else StepKind.TX
        found += [Step(StepKind.RZ, QUARTER), Step(about_x, step.value), Step(StepKind.RZ, negate(QUARTER))]
    return folded(found)


_BASE = ""
"""The frame after the fixed base transform, which no file can name."""

Link = tuple[Row | None, Steps]
"""A row or None, and the transform from the frame before to the frame after."""


@lru_cache(maxsize=32)
def chain_of(robot: Robot, quantity: Quantity) -> Robot:
    """Return the chain for which a quantity is computed: the robot itself, or the way between the frames it names."""
    return seen_chain(robot, quantity.frame, quantity.seen_from) if quantity.frame else robot


def seen_chain(robot: Robot, frame: str, seen_from: str = "") -> Robot:
    """Return the chain from one frame, the base if empty, to another as a robot of its own.

    It has the joint vector, the parameters and the redundancy of the whole robot. Rows on the way from the first frame
    towards the base are climbed: each becomes the sequence that undoes it. Joints that move both frames alike, or
    neither, are in the joint vector and move nothing.

    Raises:
        KinegenError: If there is no such frame; the message lists those that there are.
    """
    # The rows above both frames move both alike, so they cancel.
    up, down = _path(robot, seen_from or robot.root), _path(robot, frame)
    while up and down and up[0] == down[0]:
        up, down = up[1:], down[1:]
    links = [*(_climbed(_link(robot, name)) for name in reversed(up)), *(_link(robot, name) for name in down)]
    # Fixed steps before the first row and after the last one are base and tool.
    moving = [place for place, (row, _) in enumerate(links) if row is not None]
    first, last = (moving[0], moving[-1] + 1) if moving else (len(links), len(links))
    rows = [row for row, _ in links[first:last] if row is not None]
    parents = (root_name(row.name for row in rows), *(row.name for row in rows))
    return replace(
        robot,
        rows=tuple(
            replace(row, parent=parent, number=number)
            for number, (row, parent) in enumerate(zip(rows, parents, strict=False), 1)
        ),
        base=_joined(links[:first]),
        tool=_joined(links[last:]),
        frames=(),
        links=(),
        actuators=NO_ACTUATORS,
    )


def _path(robot: Robot, name: str) -> list[str]:
    """Return the frames from below the root down to one of them; the root itself is left out."""
    root = robot.root
    parents = {_BASE: root} | {row.name: _BASE if row.parent == root else row.parent for row in robot.rows}
    last = robot.rows[-1].name if robot.rows else _BASE
    if not robot.is_tree:
        parents[TOOL] = last
    for frame in robot.frames:
        parents[frame.name] = frame.parent if frame.parent in (*parents, root) else last
    if name not in (root, *parents) or name == _BASE:
        known = ", ".join(each for each in (root, *robot.frame_names) if each != ROOT)
        raise KinegenError(f"unknown frame '{name}' (expected {known})", robot.source)
    path: list[str] = []
    while name != root:
        path.append(name)
        name = parents[name]
    return path[::-1]


def _link(robot: Robot, name: str) -> Link:
    """Return the transform from the parent of a frame to the frame."""
    if name == _BASE:
        return None, robot.base
    if name == TOOL and not robot.is_tree:
        return None, robot.tool
    row = next((row for row in robot.rows if row.name == name), None)
    if row is not None:
        return row, ()
    return None, next(frame.steps for frame in robot.frames if frame.name == name)


def _climbed(link: Link) -> Link:
    """Return the same from the frame to its parent."""
    row, steps = link
    if row is None:
        return None, inverse(steps)
    undone = inverse(row_steps(row))
    return replace(row, convention=Convention.ETS, steps=undone, alpha=None, a=None, d=None, theta=None, beta=None), ()


def _joined(links: list[Link]) -> Steps:
    return tuple(step for _, steps in links for step in steps)
