"""Where each temporary of straight-line code is read last, and can go."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

from kinegen.ir.program import Temporary


class _Statement(Protocol):
    @property
    def operands(self) -> Sequence[Any]:
        """What it reads."""


class _Code(Protocol):
    @property
    def statements(self) -> Sequence[_Statement]:
        """The code."""

    @property
    def outputs(self) -> Sequence[Any]:
        """The numbers of the results."""


def last_reads(code: _Code) -> dict[str, int]:
    """The place of the statement that reads a temporary last.

    Args:
        code: A program, or a routine.

    Returns:
        By name, in the order in which the temporaries are read first; without those that are results.
    """
    last = {
        operand.name: place
        for place, statement in enumerate(code.statements)
        for operand in statement.operands
        if isinstance(operand, Temporary)
    }
    kept = {operand.name for operand in code.outputs if isinstance(operand, Temporary)}
    return {name: place for name, place in last.items() if name not in kept}
