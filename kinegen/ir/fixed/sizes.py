"""How large the exact values of a program get, before anything is known of scales."""

from __future__ import annotations

import math
from fractions import Fraction

from kinegen.ir.fixed.extents import Extents
from kinegen.ir.fixed.rounding import above
from kinegen.ir.fixed.values import Copy, Extent, Given, Product, Sum, Trigonometric, Value
from kinegen.ir.program import Constant, Operand, Operator, Program, Temporary

_UNKNOWN = 2.0**100


def exact_sizes(program: Program, angles: frozenset[str]) -> dict[str, float]:
    """Bound the exact values of a program whose inputs are angles or unknown.

    Args:
        program: The program.
        angles: Its temporaries that are angles; they are left out.

    Returns:
        For each other temporary a bound on its magnitude, huge where a length is given at run time.
    """
    values: list[Value] = []
    places: dict[Operand, int] = {}

    def place(operand: Operand, is_factor: bool) -> int:
        if isinstance(operand, Constant):
            operand = Constant(abs(operand.value)) if is_factor else operand
            given = Given(Extent(above(abs(operand.value)), 0.0), float(operand.value))
        else:
            given = Given(Extent(_UNKNOWN, 0.0))
        if operand not in places:
            places[operand] = len(values)
            values.append(given)
        return places[operand]

    for statement in program.statements:
        if not angles.isdisjoint(statement.results):
            continue
        if statement.operator is Operator.SINCOS:
            value: Value = Trigonometric(statement.operands[0], 0.0, 0.0)
        else:
            is_factor = statement.operator is Operator.MUL
            operands = [place(operand, is_factor) for operand in statement.operands]
            value = _value(statement.operator, operands, statement.operands)
        for name in statement.results:
            places[Temporary(name)] = len(values)
            values.append(value)
    extents = Extents(values)
    return {name.name: extents.extent(number).size for name, number in places.items() if isinstance(name, Temporary)}


def _value(operator: Operator, places: list[int], operands: tuple[Operand, ...]) -> Value:
    match operator:
        case Operator.ADD | Operator.SUB:
            return Sum(places[0], places[1], 0.0, 1 if operator is Operator.ADD else -1)
        case Operator.MUL:
            product = math.prod(operand.value for operand in operands if isinstance(operand, Constant))
            return Product(places[0], places[1], 0.0, -1 if Fraction(product) < 0 else 1)
        case _:
            return Copy(places[0], 0.0)
