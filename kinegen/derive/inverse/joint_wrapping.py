"""From angles to joint variables: whole turns into the limits, and whether the limits hold."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable, Mapping

import sympy as sp

from kinegen.derive.expressions import Candidate, LetBindings
from kinegen.derive.inverse.axes import JointAxis
from kinegen.derive.inverse.exact_geometry import tidy
from kinegen.derive.inverse.straight_line_operations import ONE, ZERO, Angle, OperationBuilder
from kinegen.support.dataclass import dataclass

_ROUNDING = 1e-6

JointValues = tuple[tuple[sp.Expr, ...], sp.Expr]
Turned = Callable[[OperationBuilder, JointAxis, Angle], sp.Expr]


@dataclass(frozen=True, slots=True)
class Solution:
    """One branch before its limits are seen to.

    Attributes:
        angles: For each joint that turns how far its axis is turned, for each other how far it is shifted.
        valid: 1 where the target is within reach, else 0; one factor for each condition, the shared ones first.
    """

    angles: tuple[tuple[JointAxis, Angle | sp.Expr], ...]
    valid: tuple[sp.Expr, ...]


@dataclass(frozen=True, slots=True)
class Given:
    """The variables of joints that are not solved for, by their places in the joint vector, from 1.

    `valid` is 1 where these are within their limits, else 0.
    """

    values: Mapping[int, sp.Expr]
    valid: sp.Expr


def rest_value(joint: JointAxis) -> sp.Expr:
    """Return where a joint stands that may stand anywhere: at 0, or at its limit nearest to 0."""
    if joint.limits is None:
        return ZERO
    low, high = joint.inner
    return min(max(low, ZERO), high)


def rest_angle(joint: JointAxis) -> sp.Expr:
    """Return how far the axis of such a joint is turned."""
    return joint.rate * rest_value(joint)


def joint_values(
    steps: OperationBuilder, solution: Solution, given: Given | None = None, turned: Turned | None = None
) -> JointValues:
    """Return the joint vector of a branch, and 1 where it holds, else 0.

    Each variable is brought by whole turns into the turn about the middle of its limits, or about 0 as far as they
    leave room for more than one turn; `turned`, if given, brings those of joints that turn elsewhere.
    """
    turned = turned or wrapped
    valid = given.valid if given else ONE
    for factor in solution.valid:
        valid = factor if valid == ONE else valid if factor == ONE else steps.name(valid * factor)
    values: dict[int, sp.Expr] = dict(given.values) if given else {}
    for joint, amount in solution.angles:
        value = turned(steps, joint, amount) if isinstance(amount, Angle) else steps.name(amount / joint.rate)
        values[joint.number] = value
        valid = limited(steps, joint, value, valid)
    return tuple(values[number] for number in sorted(values)), valid


def branch_results(bindings: LetBindings, found: Iterable[JointValues]) -> Candidate:
    """Return the joint vectors of all branches, then whether each holds, with their let bindings."""
    values, valid = zip(*found, strict=True)
    return Candidate("", tuple(bindings.definitions), (*itertools.chain.from_iterable(values), *valid))


def wrapped(steps: OperationBuilder, joint: JointAxis, angle: Angle) -> sp.Expr:
    """Bring the variable of a joint that turns by whole turns into its window."""
    turn = turn_of(joint)
    start = _window(joint, turn)
    value = steps.name(angle.value / joint.rate)
    bounds = sorted((angle.low / float(joint.rate), angle.high / float(joint.rate)))
    period, first = float(sp.N(turn)), float(sp.N(start))
    for _ in range(math.ceil((bounds[1] - first - period - _ROUNDING) / period)):
        value = steps.select(start + turn, value, value - turn, value)
    for _ in range(math.ceil((first - bounds[0] - _ROUNDING) / period)):
        value = steps.select(value, start, value + turn, value)
    return value


def turn_of(joint: JointAxis) -> sp.Expr:
    """Return a whole turn of the axis, in units of the variable."""
    return tidy(2 * sp.pi / abs(joint.rate))


def _window(joint: JointAxis, turn: sp.Expr) -> sp.Expr:
    """Return where the turn begins into which values are brought."""
    if joint.limits is None:
        return -turn / 2
    low, high = joint.limits
    if high - low < turn:
        return (low + high - turn) / 2
    return min(max(-turn / 2, low), high - turn)


def limited(steps: OperationBuilder, joint: JointAxis, value: sp.Expr, valid: sp.Expr) -> sp.Expr:
    """Return `valid`, or 0 where a value is outside its limits."""
    if joint.limits is None:
        return valid
    low, high = joint.limits
    if joint.turns and high - low >= turn_of(joint):
        return valid
    return inside(steps, (low, high), steps.near.room(joint), value, valid)


def inside(
    steps: OperationBuilder, limits: tuple[sp.Expr, sp.Expr], room: sp.Expr, value: sp.Expr, valid: sp.Expr
) -> sp.Expr:
    """Return `valid`, or 0 where a value is outside limits by more than some room; at a limit it is inside."""
    low, high = limits
    if room == 0:
        # Two comparisons let NaN pass, and the third does not.
        reached = steps.select(high, value, ZERO, steps.select(value, low, ZERO, valid))
        return steps.select(value, high + 1, reached, ZERO)
    return steps.select(value, high + room, steps.select(low - room, value, valid, ZERO), ZERO)
