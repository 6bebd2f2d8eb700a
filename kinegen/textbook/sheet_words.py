"""What every notation says about a robot in the same words."""

from __future__ import annotations

from kinegen.robot.model import Convention, JointType, Robot
from kinegen.textbook.sheet import Sheet
from kinegen.textbook.table import TableRow

ONE_ROW = {
    Convention.STANDARD: "Rz(theta) Tz(d) Tx(a) Rx(alpha)",
    Convention.MODIFIED: "Rx(alpha) Tx(a) Rz(theta) Tz(d)",
    Convention.MODIFIED_PREV_D: "Rx(alpha) Rz(theta) Tx(a) Tz(d)",
    Convention.HAYATI: "Rz(theta) Tx(a) Rx(alpha) Ry(beta)",
}
"""The product that a row of each table convention stands for."""

_BOOKS = {Convention.STANDARD: " (distal, Paul)", Convention.MODIFIED: " (proximal, Craig)"}


def title(robot: Robot) -> str:
    """Name and description."""
    return f"{robot.name}: {robot.description}" if robot.description else robot.name


def conventions(sheet: Sheet) -> tuple[str, ...]:
    """One sentence for each convention of the table."""
    used = dict.fromkeys(row.convention for row in sheet.table.rows)
    tables = [convention for convention in used if convention is not Convention.ETS]
    sentences = [f"{name} convention{_BOOKS.get(name, '')}: one row is {ONE_ROW[name]}" for name in tables]
    sequences = "elementary transforms, from left to right" if Convention.ETS in used else ""
    return (*sentences, sequences) if sequences else tuple(sentences)


def units(robot: Robot) -> str:
    """The units of the table and of the closed form."""
    length, angle = robot.units.length, robot.units.angle
    if angle == "rad" or not robot.dof:
        return f"units: {length} and {angle}"
    return f"units: {length} and {angle} in the table, {length} and rad in the closed form"


def index(column: str, sheet: Sheet) -> str:
    """The index of an entry in the books: i, or i-1 for alpha and a after Craig; none where rows differ."""
    used = {row.convention for row in sheet.table.rows} - {Convention.ETS}
    if len(used) > 1:
        return ""
    return "i-1" if used == {Convention.MODIFIED} and column in ("alpha", "a") else "i"


def has_parents(robot: Robot) -> bool:
    """Whether a row follows another one than that above it."""
    above = [robot.root, *(row.name for row in robot.rows)]
    return any(row.parent != name for row, name in zip(robot.rows, above, strict=False))


def parent_number(row: TableRow, robot: Robot) -> str:
    """The number of the row from which a row leads on; 0 for the base."""
    return next((str(other.number) for other in robot.rows if other.name == row.parent), "0")


def joint_words(sheet: Sheet) -> tuple[str, ...]:
    """Every joint variable that occurs with the name of its joint."""
    return tuple(f"q{number} {name}" for number, name in sheet.table.joints)


def vector_words(robot: Robot) -> str:
    """The joint vector with its units, for docstrings."""
    if not robot.dof:
        return "No joint variables."
    entries = (f"{v.name} [{robot.units.length if v.type is JointType.PRISMATIC else 'rad'}]" for v in robot.variables)
    return f"q: {', '.join(entries)}."
