"""The geometric Jacobian as textbooks print it: rows of linear velocity, then of angular velocity. It feeds no kernel.

Each column is written where it is shortest. In the axes of the base, the linear part is the derivative of the
printed position (Craig, Introduction to Robotics, section 5.7) and the angular part the axis of the joint as folding
leaves it. In the axes of the frame itself, both follow from the way back, from the frame to the joint.
"""

from __future__ import annotations

from collections.abc import Iterator

import sympy as sp

from kinegen.angles import AngleLabels
from kinegen.outputs import Reference
from kinegen.robot.model import Robot, frame_label
from kinegen.symbolic.chain import FrameName, transforms_between
from kinegen.symbolic.pose import product, transform
from kinegen.symbolic.transforms import Elementary, Turn, inverse, symbols
from kinegen.textbook.closed_form import ClosedForm, Reader, label_order


def jacobian_form(
    robot: Robot, start: FrameName, end: FrameName, reference: Reference, labels: AngleLabels | None = None
) -> ClosedForm:
    """Write a Jacobian as a textbook would.

    Args:
        robot: The robot; its parameters stay symbols.
        start: The frame that counts as being at rest, by name or row number; usually the base.
        end: The frame that moves.
        reference: The point and the axes of the velocities; see `kinegen.outputs.Reference`.
        labels: Names of angles, to be shared by forms that are printed together.

    Returns:
        Six rows, linear velocity and then angular, and one column for each joint variable of the robot.

    Raises:
        KinegenError: If a frame does not exist.
    """
    matrix = jacobian(robot, start, end, reference)
    reader = Reader(robot, labels)
    return ClosedForm(
        name=jacobian_name(start, end, reference),
        entries=tuple(tuple(reader.sum(entry) for entry in matrix.row(row)) for row in range(6)),
        angles=tuple(sorted(reader.angles.items(), key=lambda item: label_order(item[0]))),
        joints=tuple(sorted(reader.joints.items())),
    )


def jacobian(robot: Robot, start: FrameName, end: FrameName, reference: Reference) -> sp.Matrix:
    """The exact Jacobian, 6 x dof, nested as it arises, not expanded; arguments as for `jacobian_form`."""
    values = symbols(robot, keep_parameters=True)
    steps = transforms_between(robot, start, end, values)
    position = transform(robot, start, end)[:3, 3]
    columns = []
    for variable in robot.variables:
        symbol = values[variable.name]
        if reference is Reference.LOCAL_WORLD_ALIGNED:
            turning = sum((rate * axis for _, axis, rate in _turns(steps, symbol)), sp.zeros(3, 1))
            columns.append(sp.Matrix([*position.diff(symbol), *turning]))
        elif reference is Reference.WORLD:
            columns.append(_spatial(steps, symbol))
        else:
            back = tuple(inverse(step) for step in reversed(steps))
            columns.append(-_spatial(back, symbol))
    return sp.Matrix.hstack(sp.zeros(6, 0), *columns)


def jacobian_name(start: FrameName, end: FrameName, reference: Reference) -> str:
    """`base_J_tool`; the axes stand first, so it is `tool_J_tool` in the axes of the tool."""
    if reference is Reference.LOCAL:
        return f"{end}_J_{end}"
    name = f"{frame_label(start)}_J_{end}"
    return name if reference is Reference.LOCAL_WORLD_ALIGNED else f"{name}_world"


def _spatial(steps: tuple[Elementary, ...], symbol: sp.Symbol) -> sp.Matrix:
    """The twist of the end of a chain by one symbol, in the axes and at the origin of its start."""
    twist = sp.zeros(6, 1)
    for place, axis, rate in _turns(steps, symbol):
        twist += rate * sp.Matrix([*place.cross(axis), *axis])
    for index, step in enumerate(steps):
        if not isinstance(step, Turn) and step.length.has(symbol):
            axis = product(steps[:index])[:3, step.axis]
            twist += step.length.diff(symbol) * sp.Matrix([*axis, 0, 0, 0])
    return twist


def _turns(steps: tuple[Elementary, ...], symbol: sp.Symbol) -> Iterator[tuple[sp.Matrix, sp.Matrix, sp.Expr]]:
    """Where each turn by a symbol has its axis, which way that points, and how fast it turns."""
    for index, step in enumerate(steps):
        if isinstance(step, Turn) and step.angle.has(symbol):
            before = product(steps[:index])
            yield before[:3, 3], before[:3, step.axis], step.angle.diff(symbol)
