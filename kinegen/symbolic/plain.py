"""The plain way, for comparison: the link matrices of a robot as a book prints them."""

from __future__ import annotations

import sympy as sp

from kinegen.robot.model import Robot
from kinegen.symbolic.chain import links_between
from kinegen.symbolic.expressions import Tape
from kinegen.symbolic.fold import fold
from kinegen.symbolic.pose import Plan, evaluate, pose_entries
from kinegen.symbolic.transforms import Elementary, Values

Rows = tuple[tuple[sp.Expr, ...], ...]


def link_matrices(robot: Robot, frame: str, values: Values) -> tuple[Rows, ...]:
    """The matrices whose product is the pose of a frame.

    Args:
        robot: The robot.
        frame: Its name.
        values: What the names of the file stand for.

    Returns:
        The upper three rows of each, from the base to the frame.
    """
    return tuple(map(_link_matrix, links_between(robot, robot.root, frame, values)))


def _link_matrix(link: tuple[Elementary, ...]) -> Rows:
    folded = fold(link)
    columns, position = evaluate(folded, Plan((0, 1, 2)), _Inline())
    entries = pose_entries(columns, position, folded.attitude)
    return tuple(tuple(entries[4 * row : 4 * row + 4]) for row in range(3))


class _Inline(Tape):
    """A tape that names nothing, so that a link matrix is what a book prints."""

    def name(self, expression: sp.Expr) -> sp.Expr:
        return expression
