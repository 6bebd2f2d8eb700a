"""One joint of seven is given: the chain that is left to solve, and the pose that it has to reach.

In: the axes of seven joints. Out: those of the six others, whose inverse is a family like any other, and the target
moved back by the joint that is given. Only the first or the last joint leaves the others' axes where they are, so that
their geometry is constant.
"""

from __future__ import annotations

from dataclasses import replace

import sympy as sp

from kinegen.symbolic.inverse.axes import Axes, JointAxis
from kinegen.symbolic.inverse.family import Family
from kinegen.symbolic.inverse.solutions import Given
from kinegen.symbolic.inverse.steps import ONE, ZERO, Steps
from kinegen.symbolic.inverse.target import Target


def without_joint(axes: Axes, held: JointAxis) -> Axes:
    """The chain without its first or its last joint, which is at 0."""
    return replace(axes, joints=tuple(joint for joint in axes.joints if joint is not held))


def with_held(family: Family, held: JointAxis) -> Family:
    """The family of the whole arm, from that of the joints that are solved for."""
    condition = f"redundancy is the value of {held.name}, which must be within its limits"
    conditions = (*family.conditions, condition)
    name = f"{family.name}, {held.name} given"
    return replace(family, name=name, conditions=conditions, redundancy=held.name, held=held)


def moved_back(steps: Steps, family: Family, target: Target, value: sp.Expr) -> Target:
    """The target of the six joints, in the direction in which their chain is solved.

    Args:
        steps: The tape.
        family: The arm.
        target: The pose of the tool.
        value: The value of the joint that is given.
    """
    moved, is_inverse = _moved_back(steps, family, target, value)
    return moved if is_inverse == family.is_reversed else moved.inverse(steps)


def tool_moved_back(steps: Steps, family: Family, target: Target, value: sp.Expr) -> Target:
    """The same, in the direction from the base to the tool; arguments as for `moved_back`."""
    moved, is_inverse = _moved_back(steps, family, target, value)
    return moved.inverse(steps) if is_inverse else moved


def _moved_back(steps: Steps, family: Family, target: Target, value: sp.Expr) -> tuple[Target, bool]:
    """The target of the six joints, and whether it is the pose of the base in the frame of the tool."""
    held = family.held
    if held is None:
        return target, False
    if held.number < min(family.axes.numbers):
        return target.without_first(steps, held, value), False
    return target.inverse(steps).without_first(steps, _from_tool(family, held), value), True


def _from_tool(family: Family, held: JointAxis) -> JointAxis:
    """The last joint as the first one of the reversed chain."""
    axes = family.axes.reversed() if family.is_reversed else family.axes
    return replace(axes, joints=(*axes.joints, held)).reversed().joints[0]


def given(steps: Steps, family: Family, value: sp.Expr) -> Given | None:
    """The joint that is given, with 1 where its value is within its limits, else 0."""
    held = family.held
    if held is None:
        return None
    valid: sp.Expr = ONE
    if held.limits is not None:
        room = steps.near.room(held)
        valid = steps.select(held.limits[0] - room, value, ONE, ZERO)
        valid = steps.select(value, held.limits[1] + room, valid, ZERO)
    return Given(held.number, value, valid)
