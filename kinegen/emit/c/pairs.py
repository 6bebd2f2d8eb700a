"""The sines and cosines of a long chain, taken in one loop instead of a call in each line.

In: the statements of a kernel. Out: the lines with the loop, and the statements that are left, which read its arrays.
The operations and their order stay, so the bits do. In batch kernels each call becomes a copy of the pair, and 240
copies took gcc three times as long as the rest of the chain.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

from kinegen.emit.c.arguments import given
from kinegen.emit.printing import Printer
from kinegen.emit.sections import PAIRS, Section
from kinegen.ir.program import Operand, Operator, Program, Statement, Temporary, Variable

MOST_CALLS = 24
"""Pairs that are called one by one: in an arm, or in a hand of 21 joints, each angle has its line and its names. The
copies in a batch kernel take gcc about 40 ms each, so with these it is a second for each number type."""

SINES, COSINES = "sines", "cosines"
"""The arrays of a kernel with a loop. Where the angles are not simply the joint values, each waits in the place of its
sine, so that the stack holds no third array."""

_SUMS = (Operator.ADD, Operator.SUB, Operator.MUL, Operator.NEG)


class Straight(Protocol):
    """A program, or a part of one."""

    @property
    def statements(self) -> tuple[Statement, ...]:
        """The code."""

    @property
    def outputs(self) -> tuple[Operand, ...]:
        """The numbers of the results."""


@dataclass(frozen=True, slots=True)
class Pairs:
    """The sines and cosines of a program that takes many.

    Attributes:
        angles: The angle of each.
        results: The names of each sine and cosine.
        sums: Statements that lead to the angles.
        shared: Those of them that other statements read as well.
        statements: All other statements.
        outputs: The numbers of the results.
        vector: The array whose first numbers are the angles, in their order; empty where they are others.
    """

    angles: tuple[Operand, ...]
    results: tuple[tuple[str, ...], ...]
    sums: tuple[Statement, ...]
    shared: tuple[Statement, ...]
    statements: tuple[Statement, ...]
    outputs: tuple[Operand, ...]
    vector: str

    def _reading(self, printer: Printer[Operator], index: str) -> Printer[Operator]:
        """A printer that reads sines and cosines from their arrays."""
        names = {
            name: f"{array}[{place}]{index}"
            for place, results in enumerate(self.results)
            for name, array in zip(results, (SINES, COSINES), strict=True)
        }
        return replace(printer, elsewhere=names)

    def _sections(self, parts: Sequence[Section]) -> tuple[Section, ...]:
        """The sections of the statements that are left."""
        kept = frozenset(self.statements)
        left = (replace(part, statements=tuple(each for each in part.statements if each in kept)) for part in parts)
        return tuple(part for part in left if part.statements)

    def scalar_body(
        self,
        printer: Printer[Operator],
        places: Sequence[str | None],
        parts: Sequence[Section],
        rows: Sequence[str],
    ) -> tuple[str, ...]:
        """What follows the loop of a kernel for one configuration; see `Printer.lines`."""
        return self._reading(printer, "").lines(self, places, self._sections(parts), rows)

    def tile_body(self, printer: Printer[Operator], places: Sequence[str | None]) -> tuple[str, ...]:
        """What follows the loops of a batch kernel, for configuration i of a tile."""
        return self._reading(printer, "[i]").lines(replace(self, statements=(*self.shared, *self.statements)), places)

    def scalar_lines(self, printer: Printer[Operator], real: str, pair: str) -> tuple[str, ...]:
        """The loop of a kernel for one configuration.

        Args:
            printer: Prints its statements.
            real: The number type.
            pair: Name of the sine-cosine function or macro.
        """
        count = len(self.angles)
        return (
            *printer.syntax.heading(PAIRS)[1:],
            *(f"{real} {array}[{count}];" for array in (SINES, COSINES)),
            *(() if self.vector else self._filled(printer, "")),
            f"/*@ loop unroll {count}; */",
            f"for (int k = 0; k < {count}; k++) {{",
            f"    const {real} angle = {self.vector or SINES}[k];",
            f"    {pair}(angle, &{SINES}[k], &{COSINES}[k]);",
            "}",
        )

    def tile_lines(self, printer: Printer[Operator], real: str, pair: str, size: str) -> tuple[str, ...]:
        """The loops of a batch kernel, with the configurations of a tile innermost.

        Args:
            printer: Prints its statements for configuration i of a tile.
            real: The number type.
            pair: Name of the sine-cosine function.
            size: Constant that counts the configurations of a tile.
        """
        count, loop = len(self.angles), f"for (ptrdiff_t i = 0; i < {size}; i++) {{"
        angle = f"{self.vector}[i * {self.vector}_pose + k * {self.vector}_joint]" if self.vector else f"{SINES}[k][i]"
        filled = (loop, *(f"    {line}" for line in self._filled(printer, "[i]")), "}")
        return (
            *(f"{real} {array}[{count}][{size}];" for array in (SINES, COSINES)),
            *(() if self.vector else filled),
            f"for (int k = 0; k < {count}; k++) {{",
            f"    {loop}",
            f"        const {real} angle = {angle};",
            f"        {pair}(angle, &{SINES}[k][i], &{COSINES}[k][i]);",
            "    }",
            "}",
        )

    def _filled(self, printer: Printer[Operator], index: str) -> tuple[str, ...]:
        """The sums, and the angles in the places of their sines."""
        lines = [line for each in self.sums for line in printer.statement(each, frozenset(each.results))]
        lines += [printer.assignment(f"{SINES}[{place}]{index}", each) for place, each in enumerate(self.angles)]
        return tuple(lines)


def many_pairs(program: Program, code: Straight, most_calls: int | None = None) -> Pairs | None:
    """The sines and cosines of inputs and of sums of them, in a program that has more than so many.

    Args:
        program: The program, for its inputs.
        code: Its statements, or the part of them that is printed.
        most_calls: As many are called one by one; `MOST_CALLS` where it is None.

    Returns:
        None where each is a call of its own.
    """
    early: list[Statement] = []
    known: dict[str, Statement] = {}
    for statement in code.statements:
        if all(not isinstance(each, Temporary) or each.name in known for each in statement.operands):
            if statement.operator is Operator.SINCOS:
                early.append(statement)
            elif statement.operator in _SUMS:
                known[statement.name] = statement
    if len(early) <= (MOST_CALLS if most_calls is None else most_calls):
        return None
    sums = _leading(known, (operand for each in early for operand in each.operands))
    taken = frozenset((*early, *sums))
    others = tuple(each for each in code.statements if each not in taken)
    read = (operand for each in others for operand in each.operands)
    return Pairs(
        angles=tuple(operand for each in early for operand in each.operands),
        results=tuple(each.results for each in early),
        sums=sums,
        shared=_leading({each.name: each for each in sums}, (*read, *code.outputs)),
        statements=others,
        outputs=code.outputs,
        vector=_vector(program, early),
    )


def _leading(known: Mapping[str, Statement], operands: Iterable[Operand]) -> tuple[Statement, ...]:
    """The statements that lead to some operands, in their order."""
    needed = {each.name for each in operands if isinstance(each, Temporary)}
    for name, statement in reversed([*known.items()]):
        if name in needed:
            needed.update(each.name for each in statement.operands if isinstance(each, Temporary))
    return tuple(statement for name, statement in known.items() if name in needed)


def _vector(program: Program, early: Sequence[Statement]) -> str:
    """The array that begins with the angles, if one does."""
    first = given(program)[:1]
    in_order = all(each.operands == (Variable(place),) for place, each in enumerate(early))
    return first[0].name if first and in_order and len(early) <= first[0].size else ""
