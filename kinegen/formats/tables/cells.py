"""The cells of a table, as text in the units of the file."""

from __future__ import annotations

from dataclasses import dataclass

from kinegen.errors import KinegenError
from kinegen.formats.yaml.write import Entries, entries_of
from kinegen.robot.dimension import Dimension
from kinegen.robot.expressions import ZERO, Expression, substitute
from kinegen.robot.model import Convention, JointType, Robot, Step, frame_label

COLUMNS = ("a", "alpha", "d", "theta")
_ANGLES = frozenset({"alpha", "theta"})


@dataclass(frozen=True, slots=True)
class Line:
    """One row of a table: its number, name, parent, the four entries and its limits as text."""

    number: int
    name: str
    parent: str
    entries: tuple[str, str, str, str]
    limits: tuple[str, str] | None


@dataclass(frozen=True, slots=True)
class Cells:
    """A table.

    Attributes:
        convention: Standard or modified.
        length: Length unit.
        angle: Angle unit.
        lines: Its rows; parameters are in them by name, or by value.
        fixed: Base, tool and named frames with their parent and steps.
        parameters: Name and value of each parameter.
        parents: Whether a row does not follow the one above it.
    """

    convention: Convention
    length: str
    angle: str
    lines: tuple[Line, ...]
    fixed: tuple[tuple[str, str, tuple[tuple[str, str], ...]], ...]
    parameters: tuple[tuple[str, str], ...]
    parents: bool


def cells_of(robot: Robot, *, named: bool) -> Cells:
    """Write the cells of a table.

    Args:
        robot: A robot whose rows are all standard or all modified.
        named: Whether parameters stay names; otherwise their values are in the cells.

    Raises:
        KinegenError: If the rows are not of one of the two conventions.
    """
    kinds = {row.convention for row in robot.rows}
    if kinds not in ({Convention.STANDARD}, {Convention.MODIFIED}):
        raise KinegenError(
            f"robot {robot.name} has {' and '.join(sorted(kinds)) or 'no'} rows, and a table has standard or modified "
            "ones; convert it with --convention standard"
        )
    entries = entries_of(robot)
    values = {} if named else {parameter.name: parameter.value for parameter in robot.parameters}

    def text(expression: Expression | None, dimension: Dimension, own: str = "") -> str:
        return entries.text(substitute(expression or ZERO, values), dimension, own).strip('"')

    limits = {each.name: each for each in robot.variables}
    lines = []
    for row in robot.rows:
        found = [
            text(getattr(row, key), Dimension.ANGLE if key in _ANGLES else Dimension.LENGTH, row.name)
            for key in COLUMNS
        ]
        bounds = None
        if row.name in limits and (given := limits[row.name].limits):
            kind = Dimension.LENGTH if row.type is JointType.PRISMATIC else Dimension.ANGLE
            bounds = text(given[0], kind), text(given[1], kind)
        line = Line(row.number, row.name, frame_label(row.parent), (found[0], found[1], found[2], found[3]), bounds)
        lines.append(line)
    above = [robot.root, *(row.name for row in robot.rows)]
    return Cells(
        convention=next(iter(kinds)),
        length=robot.units.length,
        angle=entries.angle,
        lines=tuple(lines),
        fixed=tuple(_fixed(robot, entries)),
        parameters=tuple((each.name, text(each.value, each.dimension)) for each in robot.parameters) if named else (),
        parents=any(row.parent != before for row, before in zip(robot.rows, above, strict=False)),
    )


def sequence(steps: tuple[tuple[str, str], ...]) -> str:
    """Steps on one line."""
    return " ".join(f"{kind}({text})" for kind, text in steps) or "nothing"


def _fixed(robot: Robot, entries: Entries) -> list[tuple[str, str, tuple[tuple[str, str], ...]]]:
    """Base, tool and named frames: name, parent, steps."""

    def said(steps: tuple[Step, ...]) -> tuple[tuple[str, str], ...]:
        dimensions = (Dimension.ANGLE if step.kind.is_rotation else Dimension.LENGTH for step in steps)
        texts = (entries.text(step.value, each).strip('"') for step, each in zip(steps, dimensions, strict=True))
        return tuple(zip((str(step.kind) for step in steps), texts, strict=True))

    found = [("row 1", "base", said(robot.base))] if robot.base else []
    last = robot.rows[-1].name
    found += [("tool", last, said(robot.tool))] if robot.tool else []
    return [*found, *((frame.name, frame_label(frame.parent), said(frame.steps)) for frame in robot.frames)]
