"""A long kernel as several loops over a tile: compilers give up vector code where one loop has very many statements.

In: the statements of one configuration. Out: pieces of them, each with what it takes from a row of the tile that an
earlier piece has left there. Rows are used again as soon as nothing needs them any more.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from kinegen.emit.c.parts import Part
from kinegen.emit.printing import Printer
from kinegen.ir.program import Operand, Operator, Statement, Temporary

LONGEST = 5000
"""Statements of a kernel from which on it has several loops."""

_PIECE = 300
"""Statements of each loop."""


@dataclass(frozen=True, slots=True)
class Pieces:
    """The loops of a long kernel.

    Attributes:
        rows: Rows of a tile for what goes from one loop to a later one.
        bodies: The statements of each loop.
    """

    rows: int
    bodies: tuple[tuple[str, ...], ...]


def pieces(printer: Printer[Operator], part: Part, places: Sequence[str | None], real: str) -> Pieces | None:
    """Divide a kernel, if it is long.

    Args:
        printer: Prints statements.
        part: The kernel.
        places: Where each of its outputs belongs; None leaves one out.
        real: The number type.
    """
    if len(part.statements) < LONGEST:
        return None
    loops = [part.statements[first : first + _PIECE] for first in range(0, len(part.statements), _PIECE)]
    home = {name: index for index, each in enumerate(loops) for statement in each for name in statement.results}
    last = dict(home)
    for index, each in enumerate(loops):
        last.update(dict.fromkeys(_read(each), index))
    rows = _Rows()
    stores = list(zip(part.outputs, places, strict=True))
    bodies = []
    for index, each in enumerate(loops):
        own = [(operand, place) for operand, place in stores if place and _home(operand, home) == index]
        taken = [name for name in _read(each) if home[name] < index]
        lines = [f"const {real} {name} = w[{rows.place[name]}][i];" for name in taken]
        kept = [name for statement in each for name in statement.results if last[name] > index]
        rows.free([name for name in rows.place if last[name] < index])
        rows.keep(kept)
        own += [(Temporary(name), f"w[{rows.place[name]}][i]") for name in kept]
        lines += printer.lines(Part(each, tuple(operand for operand, _ in own)), [place for _, place in own])
        bodies.append(tuple(lines))
    return Pieces(rows.count, tuple(bodies))


@dataclass(slots=True)
class _Rows:
    """Which row each temporary has that a later loop reads.

    Attributes:
        place: By its name, also of those that nothing reads any more.
        count: How many rows there are.
    """

    place: dict[str, int] = field(default_factory=dict)
    count: int = 0
    _free: list[int] = field(default_factory=list)

    def free(self, names: Sequence[str]) -> None:
        """Give up the rows of temporaries that nothing reads any more."""
        self._free += [self.place.pop(name) for name in names]

    def keep(self, names: Sequence[str]) -> None:
        """Find rows for temporaries."""
        for name in names:
            if not self._free:
                self._free.append(self.count)
                self.count += 1
            self.place[name] = self._free.pop()


def _read(statements: Sequence[Statement]) -> list[str]:
    """The temporaries that statements read, each once, in order."""
    operands = (operand for statement in statements for operand in statement.operands)
    return list(dict.fromkeys(operand.name for operand in operands if isinstance(operand, Temporary)))


def _home(operand: Operand, home: dict[str, int]) -> int:
    """The loop that computes a result; the first one for a number or an input."""
    return home[operand.name] if isinstance(operand, Temporary) else 0
