"""Rows as elementary transforms, and what can be folded in them without numbers.

In: rows and fixed transforms. Out: lists of steps with exact values, of which neighbours about one axis are one step.
"""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction

from kinegen.robot.expressions import (
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
from kinegen.robot.model import Convention, Row, Step, StepKind

Steps = tuple[Step, ...]

QUARTER = multiply(number("1/2"), PI)


def terms(expression: Expression) -> dict[Expression, Fraction]:
    """An expression as a sum of rational multiples of terms without numbers, in order of appearance."""
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
    """An expression with equal terms put together; shares of pi and numbers are last, as a file has them."""
    found = sorted(terms(expression).items(), key=lambda each: each[0] == PI)
    return add(*(multiply(Number(factor), term) for term, factor in found), ZERO)


def total(*parts: Expression) -> Expression:
    """A sum with equal terms put together."""
    return tidy(add(*parts, ZERO))


def row_steps(row: Row) -> Steps:
    """The elementary transforms of a row, from its parent to its frame; without those that do nothing."""
    z, x = (StepKind.RZ, StepKind.TZ), (StepKind.TX, StepKind.RX)
    match row.convention:
        case Convention.ETS:
            return tuple(step for step in row.steps if tidy(step.value) != ZERO)
        case Convention.STANDARD:
            found = zip((*z, *x), (row.theta, row.d, row.a, row.alpha), strict=True)
        case Convention.MODIFIED:
            found = zip((*x[::-1], *z), (row.alpha, row.a, row.theta, row.d), strict=True)
        case Convention.MODIFIED_PREV_D:
            kinds = (StepKind.RX, StepKind.RZ, StepKind.TX, StepKind.TZ)
            found = zip(kinds, (row.alpha, row.theta, row.a, row.d), strict=True)
        case Convention.HAYATI:
            kinds = (StepKind.RZ, StepKind.TX, StepKind.RX, StepKind.RY)
            found = zip(kinds, (row.theta, row.a, row.alpha, row.beta), strict=True)
    return tuple(Step(kind, entry) for kind, entry in found if entry is not None and tidy(entry) != ZERO)


def inverse(steps: Steps) -> Steps:
    """The steps that undo others."""
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
    """An angle without whole turns, where it is a share of pi alone."""
    share = terms(angle)
    if set(share) != {PI}:
        return angle
    rest = share[PI] % 2
    return multiply(Number(rest if rest <= 1 else rest - 2), PI)


def kept_turn(angle: Expression) -> Expression:
    """An angle without whole turns, for people: between -180 and 180 degrees where it is a share of pi."""
    return _within_a_turn(tidy(angle))


def upright(steps: Iterable[Step]) -> Steps:
    """Steps about z and x alone: what is about y is turned there and back."""
    found: list[Step] = []
    for step in steps:
        if step.kind.axis != 1:
            found.append(step)
            continue
        about_x = StepKind.RX if step.kind.is_rotation else StepKind.TX
        found += [Step(StepKind.RZ, QUARTER), Step(about_x, step.value), Step(StepKind.RZ, negate(QUARTER))]
    return folded(found)
