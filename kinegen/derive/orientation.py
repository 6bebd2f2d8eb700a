"""The orientation of the tips in coordinates, and the derivative of these coordinates by the joint variables.

Shifts turn nothing: they are left out of the chain before anything is folded or derived.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import sympy as sp

from kinegen.derive import coordinates
from kinegen.derive.coordinates import Coordinates, Rows
from kinegen.derive.derivative import derivative
from kinegen.derive.expressions import (
    Expressions,
    LetBindings,
    by_joints,
    chains_of,
    cost,
    decimal,
    frame_array,
    joint_symbols,
)
from kinegen.derive.folding import NULL, FoldedChain, fold
from kinegen.derive.pose import Plan, evaluate, pose_entries
from kinegen.derive.transforms import Turn, Values, symbols
from kinegen.model.outputs import Kind, Quantity
from kinegen.model.robot import Robot

Form = Callable[[Rows, LetBindings], Coordinates]

FORMS: dict[Kind, Form] = {
    Kind.QUATERNION_WXYZ: coordinates.quaternion_wxyz,
    Kind.QUATERNION_XYZW: coordinates.quaternion_xyzw,
    Kind.RPY_ZYX: coordinates.rpy_zyx,
    Kind.RPY_XYZ: coordinates.rpy_xyz,
    Kind.EULER_ZYZ: coordinates.euler_zyz,
    Kind.AXIS_ANGLE: coordinates.axis_angle,
}

JACOBIANS: dict[Kind, Form] = {Kind(f"{kind.value}_jacobian"): form for kind, form in FORMS.items()}

_PLANS = tuple(Plan(carried) for carried in ((0, 1, 2), (0, 1), (0, 2), (1, 2)))


def derive_orientation(robot: Robot, quantity: Quantity) -> Expressions:
    """Return the orientation of every tip, or of one frame, relative to the base.

    Returns three angles or numbers, or the four of a quaternion, for each frame.
    """
    values = symbols(robot, keep_parameters=False)
    form = FORMS[quantity.kind]
    bindings = LetBindings()
    blocks = []
    for turns in _turns(robot, quantity, values):
        folded = fold(turns)
        blocks.append(form(_rotation(folded, _cheapest(folded, form), bindings), bindings).values)
    result = frame_array(robot, quantity, quantity.kind.value, (len(blocks[0]),))
    way = bindings.way(entry for block in blocks for entry in block)
    return by_joints(robot, quantity, values, (way,), result)


def derive_orientation_jacobian(robot: Robot, quantity: Quantity) -> Expressions:
    """Return the derivative of these coordinates by the joint variables.

    Returns for each frame a matrix with a row for each coordinate and a column for each joint variable, row by row.
    """
    values = symbols(robot, keep_parameters=False)
    joints = joint_symbols(robot, values)
    turning = derivative(_turns(robot, quantity, values), joints, with_poses=True)
    bindings = LetBindings(list(turning.definitions))
    entries: list[sp.Expr] = []
    rows = 0
    for pose, motions in zip(turning.poses, turning.motions, strict=True):
        found = JACOBIANS[quantity.kind](_rows(pose), bindings)
        rates = [found.rates(motion.angular) for motion in motions]
        rows = len(found.values)
        entries += [rate[row] for row in range(rows) for rate in rates]
    result = frame_array(robot, quantity, "jacobian", (rows, robot.dof))
    return by_joints(robot, quantity, values, (bindings.way(entries),), result)


def _turns(robot: Robot, quantity: Quantity, values: Values) -> list[tuple[Turn, ...]]:
    chains = chains_of(robot, quantity, values)
    return [tuple(step for step in chain if isinstance(step, Turn)) for chain in chains]


def _rows(entries: Sequence[sp.Expr]) -> Rows:
    """Return the rotation in the twelve entries of a pose; constants as numbers, which sympy does not analyse."""
    entries = [decimal(entry) if entry.is_number else entry for entry in entries]
    rows = [(entries[first], entries[first + 1], entries[first + 2]) for first in (0, 4, 8)]
    return rows[0], rows[1], rows[2]


def _rotation(folded: FoldedChain, plan: Plan, bindings: LetBindings) -> Rows:
    columns, _ = evaluate(folded, plan, bindings)
    return _rows(pose_entries(columns, NULL, folded.attitude))


def _cheapest(folded: FoldedChain, form: Form) -> Plan:
    """Count the ways to the entries that these coordinates take, and keep the cheapest; the first of equals wins."""

    def operations(plan: Plan) -> int:
        bindings = LetBindings()
        values = form(_rotation(folded, plan, bindings), bindings).values
        return cost(tuple(bindings.definitions), values)

    return min(_PLANS, key=operations)
