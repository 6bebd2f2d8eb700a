"""The orientation of the tips in coordinates, and the derivative of these coordinates by the joint variables."""

from __future__ import annotations

from collections.abc import Callable

import sympy as sp

from kinegen.outputs import Kind, Quantity
from kinegen.robot.model import BASE, Robot
from kinegen.symbolic import coordinates
from kinegen.symbolic.chain import transforms_between
from kinegen.symbolic.coordinates import Coordinates, Rows
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
)
from kinegen.symbolic.transforms import symbols

Form = Callable[[Rows, Tape], Coordinates]

FORMS: dict[Kind, Form] = {
    Kind.QUATERNION_WXYZ: coordinates.quaternion_wxyz,
    Kind.QUATERNION_XYZW: coordinates.quaternion_xyzw,
    Kind.RPY_ZYX: coordinates.rpy_zyx,
    Kind.RPY_XYZ: coordinates.rpy_xyz,
    Kind.EULER_ZYZ: coordinates.euler_zyz,
    Kind.AXIS_ANGLE: coordinates.axis_angle,
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
    entries: list[sp.Expr] = []
    frames = frames_of(robot, quantity)
    for frame in frames:
        folded = fold(transforms_between(robot, BASE, frame, values))
        entries += form(rotation(folded, _cheapest(folded, form), tape), tape).values
    count = len(entries) // len(frames)
    result = frame_array(robot, quantity, quantity.kind.value, (count,))
    return Expressions(
        signature=signature(robot, quantity, (joint_array(robot),), result),
        variables=joint_symbols(robot, values),
        parameters=parameter_symbols(robot, values),
        definitions=tuple(tape.definitions),
        entries=tuple(entries),
    )


def rotation(folded: Folded, plan: Plan, tape: Tape) -> Rows:
    """The rows of the rotation of a folded chain."""
    columns, _ = evaluate(folded, plan, tape)
    entries = pose_entries(columns, NULL, folded.attitude)
    rows = [(entries[4 * row], entries[4 * row + 1], entries[4 * row + 2]) for row in range(3)]
    return rows[0], rows[1], rows[2]


def _cheapest(folded: Folded, form: Form) -> Plan:
    """Count the ways to the entries that these coordinates take, and keep the cheapest; the first of equals wins."""

    def operations(plan: Plan) -> int:
        tape = Tape()
        values = form(rotation(folded, plan, tape), tape).values
        return cost(tuple(tape.definitions), values)

    return min(_PLANS, key=operations)
