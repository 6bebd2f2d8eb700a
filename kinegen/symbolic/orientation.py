"""The orientation of the tips in coordinates, and the derivative of these coordinates by the joint variables.

Shifts turn nothing: they are left out of the chain before anything is folded or derived.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import sympy as sp

from kinegen.outputs import Kind, Quantity
from kinegen.robot.model import Robot
from kinegen.symbolic import coordinates
from kinegen.symbolic.chain import transforms_between
from kinegen.symbolic.coordinates import Coordinates, Rows
from kinegen.symbolic.derivative import derivative
from kinegen.symbolic.expressions import Expressions, Tape, cost
from kinegen.symbolic.fold import NULL, Folded, fold
from kinegen.symbolic.pose import Plan, evaluate, pose_entries
from kinegen.symbolic.signatures import (
    frame_array,
    frames_of,
    joint_array,
    joint_symbols,
    parameter_symbols,
    signature,
    start_of,
)
from kinegen.symbolic.transforms import Turn, Values, symbols

Form = Callable[[Rows, Tape], Coordinates]

FORMS: dict[Kind, Form] = {
    Kind.QUATERNION_WXYZ: coordinates.quaternion_wxyz,
    Kind.QUATERNION_XYZW: coordinates.quaternion_xyzw,
    Kind.RPY_ZYX: coordinates.rpy_zyx,
    Kind.RPY_XYZ: coordinates.rpy_xyz,
    Kind.EULER_ZYZ: coordinates.euler_zyz,
    Kind.AXIS_ANGLE: coordinates.axis_angle,
}

JACOBIANS: dict[Kind, Form] = {
    Kind.QUATERNION_WXYZ_JACOBIAN: coordinates.quaternion_wxyz,
    Kind.QUATERNION_XYZW_JACOBIAN: coordinates.quaternion_xyzw,
    Kind.RPY_ZYX_JACOBIAN: coordinates.rpy_zyx,
    Kind.RPY_XYZ_JACOBIAN: coordinates.rpy_xyz,
    Kind.EULER_ZYZ_JACOBIAN: coordinates.euler_zyz,
    Kind.AXIS_ANGLE_JACOBIAN: coordinates.axis_angle,
}

_PLANS = tuple(Plan(carried) for carried in ((0, 1, 2), (0, 1), (0, 2), (1, 2)))


def derive_orientation(robot: Robot, quantity: Quantity) -> Expressions:
    """The orientation of every tip, or of one frame, relative to the base.

    Args:
        robot: The robot; parameters that are not runtime parameters become exact numbers.
        quantity: Which coordinates (a key of `FORMS`), and of which frame.

    Returns:
        Three angles or numbers, or the four of a quaternion, for each frame.

    Raises:
        KinegenError: If there is no such frame.
    """
    values = symbols(robot, keep_parameters=False)
    form = FORMS[quantity.kind]
    tape = Tape()
    blocks = []
    for turns in _turns(robot, quantity, values):
        folded = fold(turns)
        blocks.append(form(_rotation(folded, _cheapest(folded, form), tape), tape).values)
    result = frame_array(robot, quantity, quantity.kind.value, (len(blocks[0]),))
    return Expressions(
        signature=signature(robot, quantity, (joint_array(robot),), result),
        variables=joint_symbols(robot, values),
        parameters=parameter_symbols(robot, values),
        definitions=tuple(tape.definitions),
        entries=tuple(entry for block in blocks for entry in block),
    )


def derive_orientation_jacobian(robot: Robot, quantity: Quantity) -> Expressions:
    """The derivative of these coordinates by the joint variables.

    Args:
        robot: The robot; parameters that are not runtime parameters become exact numbers.
        quantity: Which coordinates (a key of `JACOBIANS`), and of which frame.

    Returns:
        For each frame a matrix with a row for each coordinate and a column for each joint variable, row by row.

    Raises:
        KinegenError: If there is no such frame.
    """
    values = symbols(robot, keep_parameters=False)
    joints = joint_symbols(robot, values)
    turning = derivative(_turns(robot, quantity, values), joints, with_poses=True)
    tape = Tape()
    entries: list[sp.Expr] = []
    rows = 0
    for pose, motions in zip(turning.poses, turning.motions, strict=True):
        found = JACOBIANS[quantity.kind](_rows(pose), tape)
        rates = [found.rates(motion.angular) for motion in motions]
        rows = len(found.values)
        entries += [rate[row] for row in range(rows) for rate in rates]
    result = frame_array(robot, quantity, "jacobian", (rows, robot.dof))
    return Expressions(
        signature=signature(robot, quantity, (joint_array(robot),), result),
        variables=joints,
        parameters=parameter_symbols(robot, values),
        definitions=(*turning.definitions, *tape.definitions),
        entries=tuple(entries),
    )


def _turns(robot: Robot, quantity: Quantity, values: Values) -> list[tuple[Turn, ...]]:
    """The turns on the way from the base to each frame."""
    return [
        tuple(
            step
            for step in transforms_between(robot, start_of(robot, quantity), frame, values)
            if isinstance(step, Turn)
        )
        for frame in frames_of(robot, quantity)
    ]


def _rows(entries: Sequence[sp.Expr]) -> Rows:
    """The rotation in the twelve entries of a pose."""
    rows = [(entries[first], entries[first + 1], entries[first + 2]) for first in (0, 4, 8)]
    return rows[0], rows[1], rows[2]


def _rotation(folded: Folded, plan: Plan, tape: Tape) -> Rows:
    """The rotation of a folded chain."""
    columns, _ = evaluate(folded, plan, tape)
    return _rows(pose_entries(columns, NULL, folded.attitude))


def _cheapest(folded: Folded, form: Form) -> Plan:
    """Count the ways to the entries that these coordinates take, and keep the cheapest; the first of equals wins."""

    def operations(plan: Plan) -> int:
        tape = Tape()
        values = form(_rotation(folded, plan, tape), tape).values
        return cost(tuple(tape.definitions), values)

    return min(_PLANS, key=operations)
