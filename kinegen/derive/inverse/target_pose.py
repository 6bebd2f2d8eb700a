"""The pose that the tool is to have, and what remains of it for the other joints once some are given.

The inverse of the other joints is a family like any other, for the target moved back by the joints that are given. Only
joints at the beginning and at the end of the chain leave the axes of the others where they are, so that their geometry
is constant; joints beside the chain do not move it at all.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from dataclasses import replace

import sympy as sp

from kinegen.derive.expressions import by_type
from kinegen.derive.folding import Vector
from kinegen.derive.inverse.axes import Axes, JointAxis
from kinegen.derive.inverse.exact_geometry import Rotation, combined, dot, minus, transposed, turned
from kinegen.derive.inverse.family import Aim, Family, Held
from kinegen.derive.inverse.geometry import flat_frame
from kinegen.derive.inverse.joint_wrapping import Given, inside
from kinegen.derive.inverse.straight_line_operations import ONE, ZERO, OperationBuilder
from kinegen.derive.inverse.tolerances import ROUNDOFFS
from kinegen.support.dataclass import dataclass


@dataclass(frozen=True, slots=True)
class Target:
    """The pose that the tool is to have, as symbols: the rotation by rows, and the position in the base frame."""

    rotation: Rotation
    position: Vector

    def inverse(self, steps: OperationBuilder) -> Target:
        """Return the pose of the base in the frame of the tool."""
        back = transposed(self.rotation)
        x, y, z = (steps.name(-entry) for entry in steps.turned(back, self.position))
        return Target(back, (x, y, z))

    def point(self, steps: OperationBuilder, axes: Axes, point: Vector) -> Vector:
        """Return where a point fixed to the tool has to be, from where it is at q = 0."""
        return self.carried(steps, turned(transposed(axes.rotation), minus(point, axes.position)))

    def carried(self, steps: OperationBuilder, offset: Vector) -> Vector:
        """Return where a point has to be whose coordinates in this pose are constant."""
        x, y, z = (
            steps.name(place + sp.Add(*(a * b for a, b in zip(row, offset, strict=True))))
            for place, row in zip(self.position, self.rotation, strict=True)
        )
        return x, y, z

    def columns(self, steps: OperationBuilder, axes: Axes, frame: Rotation) -> Rotation:
        """Return where the columns of a frame fixed to the tool have to point, from where they point at q = 0."""
        first, second, third = (
            steps.turned(self.rotation, turned(transposed(axes.rotation), column)) for column in frame
        )
        return first, second, third

    def without_first(self, steps: OperationBuilder, joint: JointAxis, value: sp.Expr) -> Target:
        """Move this pose back by the first joint, whose variable is given, for the joints after it.

        It is NaN in every rotation or position where the variable is.
        """
        if not joint.turns:
            shift = combined((joint.rate, joint.direction))
            x, y, z = (steps.name(a - b * value) for a, b in zip(self.position, shift, strict=True))
            return Target(self.rotation, (x, y, z))
        # The turn about the axis is one about z in a frame along it.
        rows = transposed(flat_frame(joint))
        angle = joint.rate * value
        cosine, sine = sp.cos(angle), sp.sin(angle)

        def turned_back(vector: Vector) -> Vector:
            x, y, z = steps.turned(flat_frame(joint), vector)
            ahead = steps.dot((cosine, sine), (x, y))
            beside = steps.name(steps.name(cosine * y) - steps.name(sine * x))
            return steps.turned(rows, (ahead, beside, z))

        first, second, third = (turned_back(column) for column in transposed(self.rotation))
        axis = combined((1, joint.point), (-dot(joint.point, joint.direction), joint.direction))
        apart = turned_back(steps.minus(self.position, axis))
        return Target(transposed((first, second, third)), steps.plus(apart, axis))


_UNITS = 4
"""Units of the last digit of the larger limit by which rounding moves a limit, and a value that is exactly there."""


def held_joints(axes: Axes, names: tuple[str, ...], beside: tuple[JointAxis, ...]) -> Held | tuple[str, ...]:
    """Return where the joints are that are given, or why their values cannot be given, one line each.

    `names` has the order in which the values are given; the joints `beside` are not on the chain.
    """
    # Only joints at the ends leave the geometry of the others constant.
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
    """Return the chain without joints at its ends, which are at 0."""
    end = len(axes.joints) - len(held.last)
    return replace(axes, joints=axes.joints[len(held.first) : end])


def with_held(family: Family, held: Held, units: Sequence[tuple[str, str]]) -> Family | tuple[str, ...]:
    """Return the family of the whole arm, or why it cannot be solved, one line each.

    `family` is that of the joints that are solved for; `units` has names and units of the values in their order.
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


def moved_back(steps: OperationBuilder, family: Family, target: Target, values: tuple[sp.Expr, ...]) -> Target:
    """Return the target of the joints that are solved for, in the direction in which their chain is solved."""
    moved, is_inverse = _moved_back(steps, family, target, values)
    return moved if is_inverse == family.is_reversed else moved.inverse(steps)


def tool_moved_back(steps: OperationBuilder, family: Family, target: Target, values: tuple[sp.Expr, ...]) -> Target:
    """Return the same in the direction from the base to the tool."""
    moved, is_inverse = _moved_back(steps, family, target, values)
    return moved.inverse(steps) if is_inverse else moved


def _moved_back(
    steps: OperationBuilder, family: Family, target: Target, values: tuple[sp.Expr, ...]
) -> tuple[Target, bool]:
    """Return the target of the joints that are solved for, and whether it is the base in the frame of the tool."""
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
    """Return the last joints as the first ones of the reversed chain."""
    axes = family.axes.reversed() if family.is_reversed else family.axes
    return replace(axes, joints=held.last).reversed().joints


def given(steps: OperationBuilder, family: Family, values: tuple[sp.Expr, ...]) -> Given | None:
    """Return the joints that are given, with 1 where all values are within their limits, else 0; or None."""
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
            valid = steps.finite((value[joint.name],), valid)
    return Given({joint.number: value[joint.name] for joint in held.joints}, valid)


def _rounding(joint: JointAxis) -> sp.Expr:
    """Return how far a value that is exactly at a limit may be outside it by rounding."""
    if joint.strict:
        return ZERO
    largest = max((abs(float(end)) for end in joint.limits or ()), default=0.0) or 1.0
    return by_type(*(_UNITS * sp.Rational(f"{largest:.2e}") * unit for unit in ROUNDOFFS))


def _within(steps: OperationBuilder, joint: JointAxis, value: sp.Expr, room: sp.Expr, valid: sp.Expr) -> sp.Expr:
    return valid if joint.limits is None else inside(steps, joint.limits, room, value, valid)
