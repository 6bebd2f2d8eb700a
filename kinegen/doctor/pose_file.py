"""A CSV file of observed poses -> lines of numbers, or one line that says what is wrong and where.

The header names the columns: joints by their names, `x, y, z` for the position, and for the orientation nothing,
`roll, pitch, yaw`, `rx, ry, rz` (a rotation vector) or `qw, qx, qy, qz` in any order. Lines that begin with # and empty
lines are left out; commas, semicolons and tabs separate.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from kinegen.doctor.poses import MOST_POSES, Line, number
from kinegen.errors import KinegenError, printable, quote
from kinegen.formats.columns import Cells, csv_cells, read_bytes
from kinegen.robot.model import Robot

_EXPECTED = "CSV with poses"
_ORIENTATIONS = {
    "rpy": ("roll", "pitch", "yaw"),
    "rotation_vector": ("rx", "ry", "rz"),
    "wxyz": ("qw", "qx", "qy", "qz"),
}
"""The columns of each form, in the order of its numbers."""

_POSITIONS = (("x", "y", "z"), ("px", "py", "pz"))


def read_poses(robot: Robot, path: Path) -> tuple[tuple[Line, ...], str]:
    """Read a CSV file.

    Args:
        robot: Names the joints.
        path: The file.

    Returns:
        The lines, and the form of their orientations, empty where there are none.

    Raises:
        KinegenError: If it cannot be read, or is not a table of poses.
    """
    cells = csv_cells(read_bytes(path, _EXPECTED), path, _EXPECTED, MOST_POSES)
    try:
        return _read(robot, cells)
    except KinegenError as error:
        raise KinegenError(printable(error.message), cells.path, error.line) from None


def _read(robot: Robot, cells: Cells) -> tuple[tuple[Line, ...], str]:
    columns, form = _columns(robot, cells.header_line, list(cells.header))
    if not cells.rows:
        raise KinegenError("there are no poses below the header", None, cells.header_line)
    found = (_line(robot, columns, form, row, at) for row, at in zip(cells.rows, cells.lines, strict=True))
    return tuple(found), form


def _columns(robot: Robot, at: int, head: list[str]) -> tuple[Mapping[str, int], str]:
    """The place of each column that is used, by its name."""
    joints = [variable.name for variable in robot.variables]
    twice = next((name for index, name in enumerate(head) if name in head[:index]), None)
    if twice is not None:
        raise KinegenError(f"column {quote(twice)} occurs twice", None, at)
    places = {name: index for index, name in enumerate(head)}
    missing = [name for name in joints if name not in places]
    if missing:
        raise KinegenError(f"column {quote(missing[0])} is missing (expected {', '.join(joints)}, x, y, z)", None, at)
    free = {name: index for name, index in places.items() if name not in joints}
    position = next((names for names in _POSITIONS if set(names) <= set(free)), None)
    if position is None:
        taken = " (a joint has such a name: write px, py, pz)" if {"x", "y", "z"} & set(joints) else ""
        raise KinegenError(f"columns x, y and z are missing{taken}", None, at)
    forms = [form for form, names in _ORIENTATIONS.items() if set(names) & set(free)]
    if len(forms) > 1:
        raise KinegenError("the header has two forms of orientation; keep one", None, at)
    wanted = {*position, *(_ORIENTATIONS[forms[0]] if forms else ())}
    lost = sorted(wanted - set(free))
    if lost:
        raise KinegenError(f"column {quote(lost[0])} is missing", None, at)
    unknown = next((name for name in free if name not in wanted), None)
    if unknown is not None:
        known = ", ".join(", ".join(names) for names in (("x", "y", "z"), *_ORIENTATIONS.values()))
        raise KinegenError(f"unknown column {quote(unknown)} (expected joint names, {known})", None, at)
    renamed = {name: free[column] for name, column in zip("xyz", position, strict=True)}
    return {**places, **{f"position {name}": place for name, place in renamed.items()}}, forms[0] if forms else ""


def _line(robot: Robot, columns: Mapping[str, int], form: str, cells: Sequence[str], at: int) -> Line:
    turned = _ORIENTATIONS[form] if form else ()
    empty = [not cells[columns[name]] for name in turned]
    if any(empty) and not all(empty):
        raise KinegenError(f"some of {', '.join(turned)} are empty; fill all or none", None, at)
    try:
        return Line(
            tuple(number(cells[columns[variable.name]], variable.name) for variable in robot.variables),
            tuple(number(cells[columns[f"position {name}"]], name) for name in "xyz"),
            () if any(empty) else tuple(number(cells[columns[name]], name) for name in turned),
            at,
        )
    except KinegenError as error:
        raise KinegenError(error.message, None, at) from None
