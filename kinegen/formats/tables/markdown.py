"""A table as Markdown."""

from __future__ import annotations

from kinegen.formats.tables.cells import COLUMNS, Cells, cells_of, sequence
from kinegen.robot.model import Robot

_SIGNS = {"alpha": "α", "theta": "θ"}


def write(robot: Robot) -> str:
    """Write a Markdown table with what lies before and behind it.

    Args:
        robot: A robot whose rows are all standard or all modified.

    Raises:
        KinegenError: If they are not.
    """
    cells = cells_of(robot, named=True)
    heads = ["i", *(["from"] * cells.parents), "joint", *_heads(cells)]
    limits = any(line.limits for line in cells.lines)
    rows = [[*heads, *(["limits"] * limits)], ["---"] * (len(heads) + limits)]
    for line in cells.lines:
        bounds = f"{line.limits[0]} to {line.limits[1]}" if line.limits else ""
        parent = [line.parent] * cells.parents
        entries = (entry.replace("*", r"\*") for entry in line.entries)
        rows.append([str(line.number), *parent, line.name, *entries, *([bounds.replace("*", r"\*")] * limits)])
    text = [f"{robot.name}: {cells.convention} Denavit-Hartenberg table", ""]
    text += [f"| {' | '.join(row)} |" for row in rows]
    if cells.fixed:
        text += ["", "| frame | from | transform |", "| --- | --- | --- |"]
        text += [
            f"| {name} | {parent} | {sequence(steps).replace('*', chr(92) + '*')} |"
            for name, parent, steps in cells.fixed
        ]
    if cells.parameters:
        text += ["", "| parameter | value |", "| --- | --- |"]
        text += [f"| {name} | {value.replace('*', chr(92) + '*')} |" for name, value in cells.parameters]
    return "\n".join(text) + "\n"


def _heads(cells: Cells) -> list[str]:
    units = {"alpha": cells.angle, "theta": cells.angle}
    return [f"{_SIGNS.get(column, column)} [{units.get(column, cells.length)}]" for column in COLUMNS]
