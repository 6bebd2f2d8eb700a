"""The plain way, for comparison: link matrices multiplied from the base to the tips, skipping zeros and ones only."""

from __future__ import annotations

import sympy as sp

from kinegen.outputs import Quantity
from kinegen.robot.model import Robot
from kinegen.symbolic.chain import links_between
from kinegen.symbolic.expressions import Expressions, Tape
from kinegen.symbolic.fold import fold
from kinegen.symbolic.pose import UNITS, Plan, evaluate, pose_entries
from kinegen.symbolic.signatures import joint_array, joint_symbols, parameter_symbols, pose_array, signature
from kinegen.symbolic.transforms import Elementary, symbols

Rows = tuple[tuple[sp.Expr, ...], ...]


def derive_plain(robot: Robot) -> Expressions:
    """The pose of every tip as a product of link matrices, what one gets without folding.

    Args:
        robot: The robot.

    Returns:
        Twelve entries for each tip, with equal subexpressions shared.
    """
    values = symbols(robot, keep_parameters=False)
    tape = Tape()
    entries: list[sp.Expr] = []
    for tip in robot.tips:
        rows: Rows = tuple((*unit, sp.S.Zero) for unit in UNITS)
        for link in links_between(robot, robot.root, tip, values):
            rows = _times(rows, _link_matrix(link), tape)
        entries += [entry for row in rows for entry in row]
    return Expressions(
        signature=signature(robot, Quantity.POSE, (joint_array(robot),), pose_array(robot, Quantity.POSE)),
        variables=joint_symbols(robot, values),
        parameters=parameter_symbols(robot, values),
        definitions=tuple(tape.definitions),
        entries=tuple(entries),
    )


def _link_matrix(link: tuple[Elementary, ...]) -> Rows:
    folded = fold(link)
    columns, position = evaluate(folded, Plan((0, 1, 2)), _Inline())
    entries = pose_entries(columns, position, folded.attitude)
    return tuple(tuple(entries[4 * row : 4 * row + 4]) for row in range(3))


class _Inline(Tape):
    """A tape that names nothing, so that a link matrix is what a book prints."""

    def name(self, expression: sp.Expr) -> sp.Expr:
        return expression


def _times(left: Rows, right: Rows, tape: Tape) -> Rows:
    def entry(row: int, column: int) -> sp.Expr:
        inner = sum((left[row][k] * tape.name(right[k][column]) for k in range(3)), sp.S.Zero)
        return tape.name(inner + (left[row][3] if column == 3 else sp.S.Zero))

    return tuple(tuple(entry(row, column) for column in range(4)) for row in range(3))
