"""The table of a robot for people: text, HTML, LaTeX, Markdown, CSV, and rows to compute with."""

from __future__ import annotations

from functools import cached_property
from html import escape

from kinegen.robot.model import Robot
from kinegen.textbook import sheet_words as words
from kinegen.textbook.notation import TableText
from kinegen.textbook.sheet import Sheet
from kinegen.textbook.sheet_latex import latex_table
from kinegen.textbook.sheet_text import text_table
from kinegen.textbook.table import TableRow, read_table

_NUMBERS = TableText()


class Table:
    """The table of a robot, in the units of its file; `robot.table()` makes it.

    Args:
        robot: The robot.

    Example:
        >>> import kinegen
        >>> table = kinegen.load("robots/scara.yaml").table()
        >>> table.rows[0]["joint"], table.rows[0]["theta"]
        ('shoulder', 'q1')
    """

    def __init__(self, robot: Robot) -> None:
        self.robot = robot

    @cached_property
    def _sheet(self) -> Sheet:
        return Sheet(self.robot, read_table(self.robot), (), (), ())

    @property
    def rows(self) -> tuple[dict[str, str], ...]:
        """One mapping for each row: `joint`, the columns of the convention, or `transforms` for a sequence.

        Entries are text, exact as in the file: `q1 - 90`, `pi/7`, `0.4318`. `pandas.DataFrame(table.rows)` takes them.
        """
        return tuple(self._row(row) for row in self._sheet.table.rows)

    def latex(self) -> str:
        """A fragment for amsmath."""
        return latex_table(self._sheet).rstrip("\n")

    def markdown(self) -> str:
        """A table for pages in Markdown.

        Raises:
            KinegenError: If a table cannot hold the robot, such as a tree with elementary sequences.
        """
        from kinegen.formats.tables.markdown import write

        return write(self.robot)

    def csv(self) -> str:
        """Comma-separated values, which `kinegen.load` reads again.

        Raises:
            KinegenError: If a table cannot hold the robot.
        """
        from kinegen.formats.tables.csv import write

        return write(self.robot)

    def __str__(self) -> str:
        return text_table(self._sheet)

    def __repr__(self) -> str:
        return f"<kinegen.Table of {self.robot.name}: {len(self._sheet.table.rows)} rows>"

    def _repr_html_(self) -> str:
        sheet = self._sheet
        rows = self.rows
        heads = list(dict.fromkeys(name for row in rows for name in row))
        lines = [f"<p><b>{escape(words.title(sheet.robot))}</b><br>", f"{escape('; '.join(self._facts))}</p>"]
        lines += ["<table><thead><tr>", *(f"<th>{escape(self._head(name))}</th>" for name in heads), "</tr></thead>"]
        for row in rows:
            lines += ["<tr>", *(f"<td>{escape(row.get(name, ''))}</td>" for name in heads), "</tr>"]
        lines.append("</table>")
        fixed = [f"{each.name} on {each.parent}: {_sequence(each.steps)}" for each in sheet.table.frames]
        return "".join([*lines, *(f"<div>{escape(line)}</div>" for line in fixed)])

    @property
    def _facts(self) -> tuple[str, ...]:
        return (*words.conventions(self._sheet), words.units(self.robot))

    def _head(self, name: str) -> str:
        units = self.robot.units
        unit = {"a": units.length, "d": units.length, "alpha": units.angle, "theta": units.angle, "beta": units.angle}
        return f"{name} [{unit[name]}]" if name in unit else name

    def _row(self, row: TableRow) -> dict[str, str]:
        parents = words.has_parents(self.robot)
        found = {"i": str(row.number), **({"from": words.parent_number(row, self.robot)} if parents else {})}
        found["joint"] = row.name
        entries = zip(self._sheet.table.columns, row.entries, strict=True)
        found |= {name: _NUMBERS.entry(entry) for name, entry in entries if entry is not None}
        return found | ({"transforms": _sequence(row.steps)} if row.steps else {})


def _sequence(steps: object) -> str:
    return " ".join(f"{step.kind}({_NUMBERS.entry(step.value)})" for step in steps)  # type: ignore[attr-defined]
