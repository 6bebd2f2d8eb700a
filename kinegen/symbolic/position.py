"""The position of the tips alone, for those who need no orientation."""

from __future__ import annotations

import sympy as sp

from kinegen.outputs import Quantity
from kinegen.robot.model import Robot
from kinegen.symbolic.chain import transforms_between
from kinegen.symbolic.expressions import Expressions, Tape
from kinegen.symbolic.fold import fold
from kinegen.symbolic.pose import Plan, evaluate
from kinegen.symbolic.signatures import (
    frames_of,
    joint_array,
    joint_symbols,
    parameter_symbols,
    point_array,
    signature,
    start_of,
)
from kinegen.symbolic.transforms import symbols


def derive_position(robot: Robot, quantity: Quantity = Quantity.POSITION) -> Expressions:
    """The position of every tip, or of one frame, in the base frame.

    Args:
        robot: The robot.
        quantity: The position, and of which frame.

    Returns:
        Three entries for each frame.

    Raises:
        KinegenError: If there is no such frame.
    """
    values = symbols(robot, keep_parameters=False)
    tape = Tape()
    entries: list[sp.Expr] = []
    for frame in frames_of(robot, quantity):
        folded = fold(transforms_between(robot, start_of(robot, quantity), frame, values))
        _, position = evaluate(folded, Plan((0, 1)), tape)
        entries += position
    return Expressions(
        signature=signature(robot, quantity, (joint_array(robot),), point_array(robot, quantity)),
        variables=joint_symbols(robot, values),
        parameters=parameter_symbols(robot, values),
        definitions=tuple(tape.definitions),
        entries=tuple(entries),
    )
