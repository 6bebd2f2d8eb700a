"""Operations stand where few results wait for their use."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pytest

from kinegen.derive.dispatch import derive
from kinegen.io.load import load
from kinegen.ir.finalize import minimize_live_ranges
from kinegen.ir.lower import lower
from kinegen.ir.program import Operator, Program, Temporary
from kinegen.ir.value_numbering import ValueTable
from kinegen.model.outputs import Quantity

ROBOTS = Path(__file__).parents[2] / "robots"


def sum_of_products(values: ValueTable, count: int) -> tuple[list[int], list[int]]:
    """Products of pairs of variables, all defined first, then added up one after the other."""
    products = [values.apply(Operator.MUL, values.variable(2 * i), values.variable(2 * i + 1)) for i in range(count)]
    totals = [products[0]]
    for product in products[1:]:
        totals.append(values.apply(Operator.ADD, totals[-1], product))
    return products, totals[1:]


def most_waiting(program: Program, order: Sequence[str]) -> int:
    """The most temporaries that wait for a use at one time, sines and cosines left out."""
    users = {
        name: {operand.name for operand in statement.operands if isinstance(operand, Temporary)}
        for statement in program.statements
        for name in statement.results
    }
    place = {name: number for number, name in enumerate(order)}
    last = {name: max((place[user] for user in order if name in users[user]), default=place[name]) for name in order}
    return max(sum(place[name] <= now < last[name] for name in order) for now in range(len(order)))


def test_a_product_is_made_when_its_sum_needs_it() -> None:
    values = ValueTable()
    products, totals = sum_of_products(values, 4)
    order = minimize_live_ranges(values, products + totals)

    assert order == [products[0], products[1], totals[0], products[2], totals[1], products[3], totals[2]]


def test_of_equals_the_one_defined_first_comes_first() -> None:
    values = ValueTable()
    products, _ = sum_of_products(values, 4)

    assert minimize_live_ranges(values, products) == products


def test_a_result_for_an_output_alone_need_not_wait() -> None:
    values = ValueTable()
    first = values.apply(Operator.MUL, values.variable(0), values.variable(1))
    second = values.apply(Operator.MUL, values.variable(2), values.variable(3))
    output = values.apply(Operator.NEG, first)
    values.apply(Operator.ADD, first, second)

    assert minimize_live_ranges(values, [first, second, output]) == [second, first, output]


def test_no_operations_are_in_order() -> None:
    assert minimize_live_ranges(ValueTable(), []) == []


@pytest.mark.parametrize(("name", "most"), [("puma560", 13), ("ur5", 12), ("panda", 14), ("hand", 16)])
def test_the_frames_of_an_arm_leave_few_results_waiting(name: str, most: int) -> None:
    """Registers are few. As defined, the frames of the hand would keep 36 results at a time."""
    program = lower(derive(load(ROBOTS / f"{name}.yaml"), Quantity.FRAMES))
    order = [statement.name for statement in program.statements if statement.operator is not Operator.SINCOS]

    assert most_waiting(program, order) <= most
