"""Loops inside a kernel: over the angles whose sine and cosine are taken, and over pieces of a long one.

Many sines and cosines are taken in one loop instead of a call in each line: in batch kernels each call becomes a copy
of the pair, and 240 copies took gcc three times as long as the rest of the chain. The operations and their order stay,
so the bits do.

Compilers give up vector code where one loop has very many statements. A piece takes from rows of the tile what earlier
ones have left there; rows are used again as soon as nothing needs them any more.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import field, replace
from typing import Protocol

from kinegen.backends.c.arguments import given
from kinegen.backends.c.tiles import Part
from kinegen.backends.printing import Printer
from kinegen.backends.sections import PAIRS, Section
from kinegen.ir.program import Operand, Operator, Program, Statement, Temporary, Variable
from kinegen.support.dataclass import dataclass

MOST_CALLS = 24
"""Pairs that are called one by one: in an arm, or in a hand of 21 joints, each angle has its line and its names. The
copies in a batch kernel take gcc about 40 ms each, so with these it is a second for each number type."""

SINES, COSINES = "sines", "cosines"
"""The arrays of a kernel with a loop. Where the angles are not simply the joint values, each waits in the place of its
sine, so that the stack holds no third array."""

_SUMS = (Operator.ADD, Operator.SUB, Operator.MUL, Operator.NEG)


class Straight(Protocol):
    """Holds a program, or a part of one."""

    @property
    def statements(self) -> tuple[Statement, ...]:
        """The code."""

    @property
    def outputs(self) -> tuple[Operand, ...]:
        """The numbers of the results."""


@dataclass(frozen=True, slots=True)
class Pairs:
    """Holds the sines and cosines of a program that takes many.

    Attributes:
        angles: The angle of each.
        results: The names of each sine and cosine.
        sums: Statements that lead to the angles.
        shared: Those of them that other statements read as well.
        statements: All other statements.
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
        """Returns a printer that reads sines and cosines from their arrays."""
        names = {
            name: f"{array}[{place}]{index}"
            for place, results in enumerate(self.results)
            for name, array in zip(results, (SINES, COSINES), strict=True)
        }
        return replace(printer, elsewhere=names)

    def _sections(self, parts: Sequence[Section]) -> tuple[Section, ...]:
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
        """Returns what follows the loop of a kernel for one configuration; see `Printer.lines`."""
        return self._reading(printer, "").lines(self, places, self._sections(parts), rows)

    def tile_body(self, printer: Printer[Operator], places: Sequence[str | None]) -> tuple[str, ...]:
        """Returns what follows the loops of a batch kernel, for configuration i of a tile."""
        return self._reading(printer, "[i]").lines(replace(self, statements=(*self.shared, *self.statements)), places)

    def scalar_lines(self, printer: Printer[Operator], real: str, pair: str) -> tuple[str, ...]:
        """Prints the loop of a kernel for one configuration; `pair` names the sine-cosine function or macro."""
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
        """Prints the loops of a batch kernel, the configurations of a tile innermost.

        `size` is the constant that counts these.
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
        """Returns the sums, and the angles in the places of their sines."""
        lines = [line for each in self.sums for line in printer.statement(each, frozenset(each.results))]
        lines += [printer.assignment(f"{SINES}[{place}]{index}", each) for place, each in enumerate(self.angles)]
        return tuple(lines)


def batched_sincos(program: Program, code: Straight, most_calls: int | None = None) -> Pairs | None:
    """Finds the sines and cosines of inputs and of sums of them, if they are more than `most_calls`.

    With up to so many, `MOST_CALLS` where it is None, each is a call of its own.
    """
    early: list[Statement] = []
    known: dict[str, Statement] = {}
    # Only angles that follow from inputs by sums are known before the first call.
    for statement in code.statements:
        if all(not isinstance(each, Temporary) or each.name in known for each in statement.operands):
            if statement.operator is Operator.SINCOS:
                early.append(statement)
            elif statement.operator in _SUMS:
                known[statement.name] = statement
    if len(early) <= (MOST_CALLS if most_calls is None else most_calls):
        return None
    # Sums that other statements read as well are computed once more in the loop over a tile.
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
    """Returns the statements that lead to some operands, in their order."""
    needed = {each.name for each in operands if isinstance(each, Temporary)}
    for name, statement in reversed([*known.items()]):
        if name in needed:
            needed.update(each.name for each in statement.operands if isinstance(each, Temporary))
    return tuple(statement for name, statement in known.items() if name in needed)


def _vector(program: Program, early: Sequence[Statement]) -> str:
    """Returns the array that begins with the angles, if one does."""
    first = given(program)[:1]
    in_order = all(each.operands == (Variable(place),) for place, each in enumerate(early))
    return first[0].name if first and in_order and len(early) <= first[0].size else ""


LONGEST = 5000
"""Statements of a kernel from which on it has several loops."""

_PIECE = 300
"""Statements of each loop."""


@dataclass(frozen=True, slots=True)
class Pieces:
    """Holds the statements of each loop, and the number of rows of a tile for what goes to later loops."""

    rows: int
    bodies: tuple[tuple[str, ...], ...]


def pieces(printer: Printer[Operator], part: Part, places: Sequence[str | None], real: str) -> Pieces | None:
    """Divides a kernel if it is long; a place that is None leaves an output out."""
    if len(part.statements) < LONGEST:
        return None
    loops = [part.statements[first : first + _PIECE] for first in range(0, len(part.statements), _PIECE)]
    # What a loop computes, and where each temporary is read for the last time.
    home = {name: index for index, each in enumerate(loops) for statement in each for name in statement.results}
    last = dict(home)
    for index, each in enumerate(loops):
        last.update(dict.fromkeys(_read(each), index))
    rows = _Rows()
    stores = list(zip(part.outputs, places, strict=True))
    bodies = []
    for index, each in enumerate(loops):
        # Results are stored by the loop that computes them.
        own = [(operand, place) for operand, place in stores if place and _home(operand, home) == index]
        taken = [name for name in _read(each) if home[name] < index]
        lines = [f"const {real} {name} = w[{rows.place[name]}][i];" for name in taken]
        kept = [name for statement in each for name in statement.results if last[name] > index]
        # Rows that nothing reads any more are free before new ones are asked for.
        rows.free([name for name in rows.place if last[name] < index])
        rows.keep(kept)
        # What a later loop reads is stored in a row, as if it were a result.
        own += [(Temporary(name), f"w[{rows.place[name]}][i]") for name in kept]
        lines += printer.lines(Part(each, tuple(operand for operand, _ in own)), [place for _, place in own])
        bodies.append(tuple(lines))
    return Pieces(rows.count, tuple(bodies))


@dataclass(slots=True)
class _Rows:
    """Finds the row of each temporary that a later loop reads; `place` keeps those that nothing reads any more."""

    place: dict[str, int] = field(default_factory=dict)
    count: int = 0
    _free: list[int] = field(default_factory=list)

    def free(self, names: Sequence[str]) -> None:
        """Give up the rows of temporaries that nothing reads any more."""
        self._free += [self.place.pop(name) for name in names]

    def keep(self, names: Sequence[str]) -> None:
        """Find rows for temporaries."""
        for name in names:
            # A new row only where no old one is free.
            if not self._free:
                self._free.append(self.count)
                self.count += 1
            self.place[name] = self._free.pop()


def _read(statements: Sequence[Statement]) -> list[str]:
    """Returns the temporaries that statements read, each once, in order."""
    operands = (operand for statement in statements for operand in statement.operands)
    return list(dict.fromkeys(operand.name for operand in operands if isinstance(operand, Temporary)))


def _home(operand: Operand, home: dict[str, int]) -> int:
    """Returns the loop that computes a result; the first one for a number or an input."""
    return home[operand.name] if isinstance(operand, Temporary) else 0
