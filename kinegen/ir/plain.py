"""The plain way, for comparison: link matrices multiplied from the base to the tips, skipping zeros and ones only."""

from __future__ import annotations

from fractions import Fraction

from kinegen.ir.lower import Lowering
from kinegen.ir.program import Count
from kinegen.ir.values import Value
from kinegen.robot.model import Robot
from kinegen.symbolic.plain import Rows, link_matrices
from kinegen.symbolic.signatures import joint_symbols, parameter_symbols
from kinegen.symbolic.transforms import symbols

Numbers = tuple[tuple[Value, ...], ...]


def plain_count(robot: Robot) -> Count:
    """The cost of the pose of every tip as a product of link matrices, what one gets without folding.

    Args:
        robot: The robot.

    Returns:
        The operations of a program with twelve outputs for each tip, in which equal operations are one.
    """
    names = symbols(robot, keep_parameters=False)
    lowering = Lowering.of(joint_symbols(robot, names), parameter_symbols(robot, names))
    zero, one = (lowering.values.constant(Fraction(number)) for number in (0, 1))
    outputs: list[Value] = []
    for tip in robot.tips:
        product: Numbers = ((one, zero, zero, zero), (zero, one, zero, zero), (zero, zero, one, zero))
        for rows in link_matrices(robot, tip, names):
            lowering.number_angles(entry for row in rows for entry in row)
            product = _times(lowering, product, rows)
        outputs += [entry for row in product for entry in row]
    return lowering.count(outputs)


def _times(lowering: Lowering, left: Numbers, rows: Rows) -> Numbers:
    """A product with the next link matrix; the lowest rows are (0, 0, 0, 1)."""
    right = [[lowering.value(entry) for entry in row] for row in rows]

    def entry(row: tuple[Value, ...], column: int) -> Value:
        products = [lowering.values.product([row[k], right[k][column]]) for k in range(3)]
        return lowering.values.total([*products, row[3]] if column == 3 else products)

    return tuple(tuple(entry(row, column) for column in range(4)) for row in left)
