"""What the values computed so far cost, so that the cheapest of several ways to compute the next can be chosen."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

import sympy as sp

from kinegen.symbolic.expressions import Definition, Tape, cost
from kinegen.symbolic.fold import Vector


@dataclass(slots=True)
class Ledger:
    """A tape, and which of its definitions are paid for because a result needs them.

    Attributes:
        tape: Receives the intermediate values of every way that is tried, also of those that are not taken.
    """

    tape: Tape = field(default_factory=Tape)
    _read: int = 0
    _prices: dict[sp.Symbol, int] = field(default_factory=dict)
    _needs: dict[sp.Symbol, tuple[sp.Symbol, ...]] = field(default_factory=dict)
    _bought: set[sp.Symbol] = field(default_factory=set)
    _results: list[Vector] = field(default_factory=list)

    def price(self, named: Vector) -> int:
        """Multiplications and additions that a vector of named values costs beyond what is paid for."""
        return sum(self._prices[symbol] for symbol in self._missing(named))

    def cheapest(self, ways: Iterable[Vector]) -> Vector:
        """The cheapest of several ways to compute the same; the first of equals."""
        return min(ways, key=self.price)

    def choose(self, ways: Iterable[Vector], instead_of: Vector | None = None) -> Vector:
        """Take the cheapest of several ways to compute a result, and pay for it.

        Args:
            ways: The ways.
            instead_of: The way that was taken before other results were known; it is given back and tried again.

        Returns:
            The result.
        """
        if instead_of is not None:
            self.give_back(instead_of)
            ways = (instead_of, *ways)
        best = self.cheapest(ways)
        self._results.append(best)
        self._bought.update(self._missing(best))
        return best

    def give_back(self, result: Vector) -> None:
        """A vector is no result any more; what only it needs is no longer paid for."""
        self._results.remove(result)
        self._bought.clear()
        for other in self._results:
            self._bought.update(self._missing(other))

    def live(self, entries: Iterable[sp.Expr]) -> tuple[Definition, ...]:
        """The definitions that some entries need, in order."""
        self._bought.clear()
        needed = set(self._missing(tuple(entries)))
        return tuple(definition for definition in self.tape.definitions if definition[0] in needed)

    def _missing(self, expressions: tuple[sp.Expr, ...]) -> Iterator[sp.Symbol]:
        """The definitions that the expressions need and nobody has paid for, each once."""
        for symbol, expression in self.tape.definitions[self._read :]:
            self._prices[symbol] = cost((), (expression,))
            self._needs[symbol] = tuple(found for found in expression.free_symbols if found in self._prices)
        self._read = len(self.tape.definitions)
        pending = [symbol for expression in expressions for symbol in expression.free_symbols]
        seen: set[sp.Symbol] = set()
        while pending:
            symbol = pending.pop()
            if symbol in self._prices and symbol not in seen and symbol not in self._bought:
                seen.add(symbol)
                yield symbol
                pending += self._needs[symbol]
