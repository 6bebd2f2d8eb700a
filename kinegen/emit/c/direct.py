"""The way past the tile: full tiles go straight into the rows of a result, where neighbours lie next to each other."""

from __future__ import annotations

from dataclasses import dataclass

from kinegen.emit.c.arguments import computed, given
from kinegen.emit.printing import Printer
from kinegen.ir.program import Constant, Operator, Program

LONGEST_DIRECT = 200
"""Statements of a kernel that is printed twice, once for results in rows alone: longer ones take long to compile, and
have more to do than to store."""


@dataclass(frozen=True, slots=True)
class Direct:
    """How full tiles go straight into the rows of a result, where neighbours lie next to each other.

    Attributes:
        condition: When that can be.
        result: The result.
        values: What is passed to the function that evaluates a tile.
        constants: Assignments of the rows that hold the same number for every configuration.
    """

    condition: str
    result: str
    values: str
    constants: tuple[str, ...]


def direct_way(
    printer: Printer[Operator],
    body: tuple[str, ...],
    program: Program,
    size: str,
    constants: dict[int, Constant],
    *,
    reads_params: bool,
) -> Direct | None:
    """The way without the tile, for short kernels of one result.

    Args:
        printer: Prints assignments of numbers.
        body: The statements for one configuration.
        program: What the kernel computes.
        size: Constant that counts the configurations of a tile.
        constants: The rows that hold the same number for every configuration.
        reads_params: Whether rows of parameters are passed on.

    Returns:
        None for kernels that go through the tile alone.
    """
    read = tuple(array for array in given(program) if program.reads(array))
    results = computed(program)
    if not read or len(results) != 1 or len(body) > LONGEST_DIRECT:
        return None
    name = results[0].name
    neighbours = [f"({array.name}_pose == 1)" for array in read]
    values = [f"{array.name} + begin, 1, {array.name}_joint" for array in read] + ["given"] * reads_params
    return Direct(
        condition=" && ".join(["(layout == 2)", *neighbours, f"({name}_stride >= {size})"]),
        result=name,
        values=", ".join([*values, "to", f"{name}_stride"]),
        constants=tuple(printer.assignment(f"to[{row} * {name}_stride + i]", each) for row, each in constants.items()),
    )
