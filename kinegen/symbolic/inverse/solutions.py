"""From angles to joint variables: whole turns into the limits, and whether the limits hold."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import sympy as sp

from kinegen.symbolic.inverse.axes import JointAxis
from kinegen.symbolic.inverse.exact import tidy
from kinegen.symbolic.inverse.steps import ONE, ZERO, Angle, Steps

_ROUNDING = 1e-6


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
    """Joints that are not solved for.

    Attributes:
        values: Their variables, by their places in the joint vector, from 1.
        valid: 1 where these are within their limits, else 0.
    """

    values: Mapping[int, sp.Expr]
    valid: sp.Expr


def rest_value(joint: JointAxis) -> sp.Expr:
    """Where a joint stands that may stand anywhere: at 0, or at its limit nearest to 0."""
    if joint.limits is None:
        return ZERO
    low, high = joint.limits
    return min(max(low, ZERO), high)


def rest_angle(joint: JointAxis) -> sp.Expr:
    """How far the axis of such a joint is turned."""
    return joint.rate * rest_value(joint)


def joint_values(steps: Steps, solution: Solution, given: Given | None = None) -> tuple[tuple[sp.Expr, ...], sp.Expr]:
    """The joint vector of a branch, and whether it holds.

    Args:
        steps: The tape.
        solution: The branch.
        given: Joints that are not among the solutions.

    Returns:
        The joint variables in their order, each brought by whole turns into the turn about the middle of its limits, or
        about 0 as far as they leave room for more than one turn, and 1 or 0.
    """
    valid = given.valid if given else ONE
    for factor in solution.valid:
        valid = _both(steps, valid, factor)
    values: dict[int, sp.Expr] = dict(given.values) if given else {}
    for joint, amount in solution.angles:
        value = wrapped(steps, joint, amount) if isinstance(amount, Angle) else steps.name(amount / joint.rate)
        values[joint.number] = value
        valid = limited(steps, joint, value, valid)
    return tuple(values[number] for number in sorted(values)), valid


def _both(steps: Steps, left: sp.Expr, right: sp.Expr) -> sp.Expr:
    return right if left == ONE else left if right == ONE else steps.name(left * right)


def wrapped(steps: Steps, joint: JointAxis, angle: Angle) -> sp.Expr:
    """The variable of a joint that turns, brought by whole turns into its window."""
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
    """A whole turn of the axis, in units of the variable."""
    return tidy(2 * sp.pi / abs(joint.rate))


def _window(joint: JointAxis, turn: sp.Expr) -> sp.Expr:
    """Where the turn begins into which values are brought."""
    if joint.limits is None:
        return -turn / 2
    low, high = joint.limits
    if high - low < turn:
        return (low + high - turn) / 2
    return min(max(-turn / 2, low), high - turn)


def limited(steps: Steps, joint: JointAxis, value: sp.Expr, valid: sp.Expr) -> sp.Expr:
    """`valid`, or 0 where a value is outside its limits."""
    if joint.limits is None:
        return valid
    low, high = joint.limits
    if joint.turns and high - low >= turn_of(joint):
        return valid
    room = steps.near.room(joint)
    above = steps.select(low - room, value, valid, ZERO)
    return steps.select(value, high + room, above, ZERO)
