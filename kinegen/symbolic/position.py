"""The position of the tips alone, for those who need no orientation."""

from __future__ import annotations

import sympy as sp

from kinegen.outputs import Quantity
from kinegen.robot.model import BASE, Robot
from kinegen.symbolic.chain import transforms_between
from kinegen.symbolic.expressions import Expressions, Tape
from kinegen.symbolic.fold import fold
from kinegen.symbolic.pose import Plan, evaluate
from kinegen.symbolic.transforms import symbols


def derive_position(robot: Robot) -> Expressions:
    """The position of every tip in the base frame.

    Args:
        robot: The robot.

    Returns:
        Three entries for each tip.
    """
    values = symbols(robot, keep_parameters=False)
    tape = Tape()
    entries: list[sp.Expr] = []
    for tip in robot.tips:
        folded = fold(transforms_between(robot, BASE, tip, values))
        _, position = evaluate(folded, Plan((0, 1)), tape)
        entries += position
    return Expressions(
        quantity=Quantity.POSITION,
        frames=robot.tips,
        variables=tuple(values[variable.name] for variable in robot.variables),
        parameters=tuple(values[parameter.name] for parameter in robot.runtime_parameters),
        definitions=tuple(tape.definitions),
        entries=tuple(entries),
    )
