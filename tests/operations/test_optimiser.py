"""An independent search finds no shorter program than the compiler for 142 tables."""

from __future__ import annotations

import pytest

from kinegen.ir.lower import program_of
from kinegen.ir.program import count
from kinegen.model.outputs import Kind, Quantity
from tests.operations import plain
from tests.operations.chain import folded
from tests.operations.field import Number, number
from tests.operations.optimiser import PAIR, Account, pose_cost, position_cost
from tests.operations.tables import TABLES, Table
from tests.operations.velocities import Work, jacobian_cost, joints, twist_cost, twists, ways

each_table = pytest.mark.parametrize("table", TABLES, ids=lambda table: table.name)


def ours(table: Table, quantity: Quantity) -> int:
    found = count(program_of(table.robot(), quantity))
    return found.multiplications + found.additions + PAIR * found.sine_cosines


def values(vectors: tuple[tuple[Number, ...], ...]) -> list[list[int]]:
    return [[entry.value for entry in vector] for vector in vectors]


@each_table
def test_no_position_takes_more_operations_than_an_independent_search_finds(table: Table) -> None:
    assert ours(table, Quantity.POSITION) <= position_cost(folded(table))


@each_table
def test_no_pose_takes_more_operations_than_an_independent_search_finds(table: Table) -> None:
    assert ours(table, Quantity.POSE) <= pose_cost(folded(table))


@each_table
def test_no_jacobian_takes_more_operations_than_an_independent_search_finds(table: Table) -> None:
    assert ours(table, Quantity(Kind.JACOBIAN)) <= jacobian_cost(folded(table))


@each_table
def test_no_twist_takes_more_operations_than_an_independent_search_finds(table: Table) -> None:
    assert ours(table, Quantity(Kind.TWIST)) <= twist_cost(folded(table))


@each_table
def test_every_way_of_the_independent_search_gives_the_jacobian_of_the_definition(table: Table) -> None:
    columns, work = plain.jacobian(table), Work(Account(), folded(table))

    for way in ways(work.folded):
        for joint in joints(work.folded):
            assert values(way(work, joint)) == values(columns[joint.mark.joint])


@each_table
def test_every_way_of_the_independent_search_gives_the_twist_of_the_definition(table: Table) -> None:
    work = Work(Account(), folded(table))
    linear, angular = (
        [
            sum((part[axis] * number(f"qd{joint}") for joint, part in enumerate(parts)), Number(0)).value
            for axis in range(3)
        ]
        for parts in zip(*plain.jacobian(table), strict=True)
    )

    for twist in twists(work.folded):
        assert values(twist(work)) == [linear, angular]
