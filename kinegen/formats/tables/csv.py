"""A table as CSV, which reads back with the convention and the units that its first line says."""

from __future__ import annotations

import csv
import io

from kinegen.errors import KinegenError
from kinegen.formats.tables.cells import COLUMNS, cells_of, sequence
from kinegen.robot.model import Robot


def write(robot: Robot) -> str:
    """Write a CSV table: a name, four entries and two limits a row, with the values of the parameters.

    Args:
        robot: A chain whose rows are all standard or all modified.

    Raises:
        KinegenError: If they are not, or the robot is a tree, for whose forks a CSV table has no column.
    """
    cells = cells_of(robot, named=False)
    if cells.parents:
        raise KinegenError(f"robot {robot.name} has forks, for which a CSV table has no column; write YAML or URDF")
    limits = any(line.limits for line in cells.lines)
    out = io.StringIO()
    out.write(f"# {cells.convention},{cells.length},{cells.angle}\n")
    for name, parent, steps in cells.fixed:
        out.write(f"# {name} from {parent}: {sequence(steps)}\n")
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(["name", *COLUMNS, *(["lower", "upper"] * limits)])
    for line in cells.lines:
        writer.writerow([line.name, *line.entries, *((line.limits or ("", "")) * limits)])
    return out.getvalue()
