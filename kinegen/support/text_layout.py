"""Plain text in lines of a width: lists, formulas and tables, for terminals and for printouts alike."""

from __future__ import annotations

import re
from collections.abc import Iterable


def filled(items: Iterable[str], indent: str, width: int) -> list[str]:
    """Return items one after the other with commas between, in lines of a width."""
    lines: list[str] = []
    for item in items:
        if lines and len(lines[-1]) + len(item) + len(", ,") <= width:
            lines[-1] += f", {item}"
        else:
            lines.append(indent + item)
    return [f"{line}," for line in lines[:-1]] + lines[-1:]


def broken(head: str, formula: str, width: int) -> list[str]:
    """Return a formula behind its head, in lines of a width, broken before plus and minus signs."""
    lines = [head]
    for part in re.split(r" (?=[+-] )", formula):
        space = "" if lines[-1] == head else " "
        if len(lines[-1]) > len(head) and len(lines[-1]) + len(part) + 1 > width:
            lines.append(" " * len(head) + part)
        else:
            lines[-1] += space + part
    return lines


def columns(rows: Iterable[Iterable[str]], left: frozenset[int] = frozenset(), gap: str = "  ") -> list[str]:
    """Return rows of a table, right-justified but for some columns, without trailing blanks."""
    table = [tuple(row) for row in rows]
    widths = [max(len(cell) for cell in column) for column in zip(*table, strict=True)]
    return [
        gap.join(
            cell.ljust(size) if index in left else cell.rjust(size)
            for index, (cell, size) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in table
    ]
