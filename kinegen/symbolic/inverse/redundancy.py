"""Some joints are given: the chain that is left to solve, and the pose that it has to reach.

In: the axes of all joints. Out: those of the others, whose inverse is a family like any other, and the target moved
back by the joints that are given. Only joints at the beginning and at the end of the chain leave the axes of the others
where they are, so that their geometry is constant; joints beside the chain do not move it at all.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from dataclasses import replace

import sympy as sp

from kinegen.symbolic.expressions import by_type
from kinegen.symbolic.inverse.axes import Axes, JointAxis
from kinegen.symbolic.inverse.family import Aim, Family, Held
from kinegen.symbolic.inverse.solutions import Given
from kinegen.symbolic.inverse.solve import LARGEST
from kinegen.symbolic.inverse.steps import ONE, ZERO, Steps
from kinegen.symbolic.inverse.target import Target
from kinegen.symbolic.inverse.thresholds import ROUNDOFFS

_UNITS = 4
"""Units of the last digit of the larger limit by which rounding moves a limit, and a value that is exactly there."""


def held_joints(axes: Axes, names: tuple[str, ...], beside: tuple[JointAxis, ...]) -> Held | tuple[str, ...]:
    """Where the joints are that are given.

    Args:
        axes: The chain.
        names: The joints in the order in which their values are given.
        beside: Those that are not on the chain.

    Returns:
        The joints; or why their values cannot be given, one line each.
    """
    first, last = (
        tuple(itertools.takewhile(lambda joint: joint.name in names, order))
        for order in (axes.joints, axes.joints[::-1])
    )
    held = Held(names, first, last[::-1], beside)
    free = [joint.name for joint in axes.joints if joint.name not in names]
    inside = [joint.name for joint in axes.joints if joint.name in names and joint not in (*first, *last)]
    if not free:
        return ("redundancy: all joints that move the tool are given, so that none is left to solve for",)
    ends = f"only {axes.joints[len(first)].name} or {axes.joints[-1 - len(last)].name} can be given"
    if first or last:
        ends += f" beside {_listed(joint.name for joint in (*first, *last))}"
    return tuple(f"redundancy: {name} is in the middle of the chain, {ends}" for name in inside) or held


def without_joints(axes: Axes, held: Held) -> Axes:
    """The chain without joints at its ends, which are at 0."""
    end = len(axes.joints) - len(held.last)
    return replace(axes, joints=axes.joints[len(held.first) : end])


def with_held(family: Family, held: Held, units: Sequence[tuple[str, str]]) -> Family | tuple[str, ...]:
    """The family of the whole arm.

    Args:
        family: That of the joints that are solved for.
        held: The others.
        units: Their names and units, in the order of their values.

    Returns:
        The family; or why it cannot be solved, one line each.
    """
    if family.aim is Aim.POSITION and held.last:
        names = ", ".join(joint.name for joint in held.last)
        return (f"redundancy: the arm before {names} is solved for a position, which does not decide where they start",)
    condition = f"redundancy is the value of {held.names[0]}, which must be within its limits"
    if len(held.names) > 1:
        values = _listed(f"{name} ({unit})" for name, unit in units)
        condition = f"redundancy has the values of {values}, in this order, which must be within their limits"
    name = f"{family.name}, {_listed(held.names)} given"
    conditions = (*family.conditions, condition)
    return replace(family, name=name, conditions=conditions, redundancy=",".join(held.names), held=held)


def _listed(names: Iterable[str]) -> str:
    *others, last = names
    return f"{', '.join(others)} and {last}" if others else last


def moved_back(steps: Steps, family: Family, target: Target, values: tuple[sp.Expr, ...]) -> Target:
    """The target of the joints that are solved for, in the direction in which their chain is solved.

    Args:
        steps: The tape.
        family: The arm.
        target: The pose of the tool.
        values: The values of the joints that are given.
    """
    moved, is_inverse = _moved_back(steps, family, target, values)
    return moved if is_inverse == family.is_reversed else moved.inverse(steps)


def tool_moved_back(steps: Steps, family: Family, target: Target, values: tuple[sp.Expr, ...]) -> Target:
    """The same, in the direction from the base to the tool; arguments as for `moved_back`."""
    moved, is_inverse = _moved_back(steps, family, target, values)
    return moved.inverse(steps) if is_inverse else moved


def _moved_back(steps: Steps, family: Family, target: Target, values: tuple[sp.Expr, ...]) -> tuple[Target, bool]:
    """The target of the joints that are solved for, and whether it is the pose of the base in the frame of the tool."""
    held, is_inverse = family.held, False
    if held is not None:
        value = dict(zip(held.names, values, strict=True))
        for joint in held.first:
            target = target.without_first(steps, joint, value[joint.name])
        if held.last:
            target, is_inverse = target.inverse(steps), True
        for joint in _from_tool(family, held):
            target = target.without_first(steps, joint, value[joint.name])
    return target, is_inverse


def _from_tool(family: Family, held: Held) -> tuple[JointAxis, ...]:
    """The last joints as the first ones of the reversed chain."""
    axes = family.axes.reversed() if family.is_reversed else family.axes
    return replace(axes, joints=held.last).reversed().joints


def given(steps: Steps, family: Family, values: tuple[sp.Expr, ...]) -> Given | None:
    """The joints that are given, with 1 where all values are within their limits, else 0."""
    held = family.held
    if held is None:
        return None
    value, valid = dict(zip(held.names, values, strict=True)), ONE
    for joint in held.joints:
        # Values of several joints need room for their own rounding alone. One that is given by itself keeps the room of
        # the joints that are solved for, which kernels have always had.
        room = steps.near.room(joint) if len(held.names) == 1 else _rounding(joint)
        valid = _within(steps, joint, value[joint.name], room, valid)
    for joint in held.beside:
        if joint.limits is None:
            # Nothing else would see an infinity or a NaN.
            valid = steps.select(steps.name(value[joint.name] ** 2), LARGEST, valid, ZERO)
    return Given({joint.number: value[joint.name] for joint in held.joints}, valid)


def _rounding(joint: JointAxis) -> sp.Expr:
    """How far a value that is exactly at a limit may be outside it by rounding."""
    largest = max((abs(float(end)) for end in joint.limits or ()), default=0.0) or 1.0
    return by_type(*(_UNITS * sp.Rational(f"{largest:.2e}") * unit for unit in ROUNDOFFS))


def _within(steps: Steps, joint: JointAxis, value: sp.Expr, room: sp.Expr, valid: sp.Expr) -> sp.Expr:
    if joint.limits is None:
        return valid
    valid = steps.select(joint.limits[0] - room, value, valid, ZERO)
    return steps.select(value, joint.limits[1] + room, valid, ZERO)
