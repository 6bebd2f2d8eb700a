"""The NumPy form of a long program gives arrays back as soon as nothing reads them any more."""

from __future__ import annotations

import ast
from collections.abc import Iterator

import pytest

from benchmarks.rows import arm
from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.python.formula import emit_formula
from kinegen.derive.dispatch import derive
from kinegen.io.load import loads
from kinegen.ir.lower import lower
from kinegen.model.outputs import Quantity
from tests.emit.emitted import robot


def formula(kernels: RobotPrograms) -> list[ast.stmt]:
    """The statements of the only formula."""
    tree = ast.parse(emit_formula(kernels)["_numpy.py"])
    (found,) = (node for node in tree.body if isinstance(node, ast.FunctionDef) and node.name == "fk")
    return found.body


def names(statement: ast.stmt, kind: type[ast.expr_context]) -> Iterator[str]:
    return (node.id for node in ast.walk(statement) if isinstance(node, ast.Name) and isinstance(node.ctx, kind))


@pytest.mark.parametrize("rows", [24, 64])
def test_a_long_chain_holds_few_arrays_besides_its_sines_and_cosines(rows: int) -> None:
    long = loads(arm(rows), "long.yaml")
    held, most = set[str](), 0
    for statement in formula(RobotPrograms(long, (lower(derive(long, Quantity.POSE)),), ())):
        assert held >= {name for name in names(statement, ast.Load) if name.startswith("t")}
        held -= set(names(statement, ast.Del))
        held |= set(names(statement, ast.Store))
        most = max(most, len(held))

    assert most < 2 * rows + 64


def test_a_short_program_reads_as_before() -> None:
    short = robot("scara")
    statements = formula(RobotPrograms(short, (lower(derive(short, Quantity.POSE)),), ()))

    assert not any(isinstance(statement, ast.Delete) for statement in statements)
