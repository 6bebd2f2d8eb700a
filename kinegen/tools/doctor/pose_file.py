"""Reads a CSV file of observed poses into lines of numbers, or one line that says what is wrong and where.

The header names the columns: joints by their names, `x, y, z` for the position, and for the orientation nothing, `roll,
pitch, yaw` (or `A, B, C`: yaw, pitch, roll), `rx, ry, rz` (a rotation vector) or `qw, qx, qy, qz` in any order. Joints
may be called `q1, q2, ...` too, and capitals do not matter. Lines that begin with # and empty lines are left out;
commas, semicolons and tabs separate. A title may state its unit, as in `A1[deg]` and `x (mm)`.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from decimal import Decimal
from pathlib import Path

from kinegen.errors import KinegenError, printable, quote
from kinegen.io.columns import METRES, RADIANS, Cells, check_units, csv_cells, read_bytes, unit_of, unknown_unit
from kinegen.model.robot import JointType, Robot
from kinegen.tools.doctor.observed_poses import ANGLES, LENGTHS, MOST_POSES, Line, Said, number

_EXPECTED = "CSV with poses"
_ORIENTATIONS = {
    "rpy": ("roll", "pitch", "yaw"),
    "rotation_vector": ("rx", "ry", "rz"),
    "wxyz": ("qw", "qx", "qy", "qz"),
}
"""The columns of each form, in the order of its numbers."""

_ABC = {"A": "yaw", "B": "pitch", "C": "roll"}
"""The names of KUKA: turns about z, the new y, and the new x."""

_POWERS = {"m": 0, "cm": -2, "mm": -3, "um": -6}
_SAME = {unit: {other: power - _POWERS[other] for other in _POWERS} for unit, power in _POWERS.items()}
_SAME |= {"rad": {"rad": 0}, "mrad": {"rad": -3}}
"""Units that differ by a power of ten: what numbers in one are multiplied by to be in another."""

_POSITIONS = (("x", "y", "z"), ("px", "py", "pz"))


def read_poses(robot: Robot, path: Path, said: Said) -> tuple[tuple[Line, ...], str, Said]:
    """Read a CSV file: lines, the form of their orientations or an empty text, and the units of options and header."""
    cells = csv_cells(read_bytes(path, _EXPECTED), path, _EXPECTED, MOST_POSES)
    try:
        return _read(robot, cells, said)
    except KinegenError as error:
        raise KinegenError(printable(error.message), cells.path, error.line or cells.header_line) from None


def _read(robot: Robot, cells: Cells, said: Said) -> tuple[tuple[Line, ...], str, Said]:
    joints = {variable.name for variable in robot.variables}
    titles = [unit_of(each, joints) for each in cells.header]
    columns, form = _columns(robot, cells.header_line, [name for name, _ in titles])
    if not cells.rows:
        raise KinegenError("there are no poses below the header", None, cells.header_line)
    said, tens = _agreed(robot, columns, form, [unit for _, unit in titles], cells, said)
    found = (_line(robot, columns, form, tens, row, at) for row, at in zip(cells.rows, cells.lines, strict=True))
    return tuple(found), form, said


def _agreed(
    robot: Robot, columns: Mapping[str, int], form: str, units: Sequence[str | None], cells: Cells, said: Said
) -> tuple[Said, dict[int, int]]:
    """Return what options and titles state together, and the powers of ten by which numbers of columns are multiplied.

    There is one unit of angles and one of lengths.
    """
    slides = {each.name for each in robot.variables if each.type is JointType.PRISMATIC}
    turns = {each.name for each in robot.variables} - slides
    turns |= {*_ORIENTATIONS[form]} if form == "rpy" else set()
    places = {*slides, *(f"position {name}" for name in "xyz")}
    tens: dict[int, int] = {}

    # Each group of columns has one unit, whatever else the table holds.
    def of(names: Iterable[str], known: Collection[str], own: str, option: str, asked: str | None) -> str | None:
        used = sorted({columns[name] for name in names})
        stated = {cells.header[place]: units[place] for place in used}
        unit = _unit(stated, known)
        is_option = {*stated.values()} <= {None, *ANGLES, *LENGTHS}
        check_units(stated, asked or own, option if is_option else "", is_asked=asked is not None)
        tens.update({place: _SAME.get(units[place] or "", {}).get(unit or "", 0) for place in used})
        return asked or unit

    if form in ("rotation_vector", "wxyz"):
        unit = of(_ORIENTATIONS[form], RADIANS if form == "rotation_vector" else (), "rad", "", None)
        if unit == "deg":
            raise KinegenError("rotation vectors in deg are not read; write them in rad, or roll, pitch, yaw in deg")
    angle = of(turns, RADIANS, robot.units.angle, "--angle", said.angle)
    return replace(said, angle=angle, length=of(places, METRES, robot.units.length, "--length", said.length)), tens


def _unit(stated: dict[str, str | None], known: Collection[str]) -> str | None:
    """Return the unit that the numbers of some columns get; None where no title states one."""
    titles = {unit: title for title, unit in reversed(stated.items()) if unit is not None}
    wrong = next((unit for unit in titles if unit not in known), None)
    if wrong is not None and not known:
        raise KinegenError(f"column {quote(titles[wrong])} has no unit")
    if wrong is not None:
        raise KinegenError(unknown_unit(titles[wrong], wrong, known))
    # Powers of ten keep the digits, which say how exact a number is; other factors would not.
    shared = [unit for unit in (*ANGLES, *LENGTHS) if all(unit in _SAME.get(each, {each: 0}) for each in titles)]
    if titles and not shared:
        two = " and ".join(map(quote, sorted(titles.values())))
        raise KinegenError(f"columns {two} have different units; give them in one")
    return next((unit for unit in shared if unit in titles), shared[0]) if titles else None


def _columns(robot: Robot, at: int, head: list[str]) -> tuple[Mapping[str, int], str]:
    """Return the place of each column that is used, by its name."""
    joints = [variable.name for variable in robot.variables]
    head = [_canonical(title, robot) for title in head]
    twice = next((name for index, name in enumerate(head) if name in head[:index]), None)
    if twice is not None:
        raise KinegenError(f"column {quote(twice)} occurs twice", None, at)
    # Joints first, since a joint may be called x.
    places = {name: index for index, name in enumerate(head)}
    missing = [name for name in joints if name not in places]
    if missing:
        names = f"{', '.join(joints)}, or q1 to q{len(joints)}, and x, y, z"
        raise KinegenError(f"column {quote(missing[0])} is missing (expected {names})", None, at)
    free = {name: index for name, index in places.items() if name not in joints}
    position = next((names for names in _POSITIONS if set(names) <= set(free)), None)
    if position is None:
        taken = " (a joint has such a name: write px, py, pz)" if {"x", "y", "z"} & set(joints) else ""
        raise KinegenError(f"columns x, y and z are missing{taken}", None, at)
    forms = [form for form, names in _ORIENTATIONS.items() if set(names) & set(free)]
    if len(forms) > 1:
        raise KinegenError("the header has two forms of orientation; keep one", None, at)
    # Whatever is left over is a slip or a column of something else.
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


def _canonical(title: str, robot: Robot) -> str:
    """Return the name of a column: of a joint (also q1, q2, ...), or a word of the tables above, in capitals too."""
    names = [variable.name for variable in robot.variables]
    numbered = {f"q{number}": name for number, name in enumerate(names, start=1)}
    words = {word: word for group in (*_POSITIONS, *_ORIENTATIONS.values()) for word in group}
    folded = {name.lower(): name for name in names}
    if title in names:
        return title
    for known, key in ((numbered, title), (words, title), (_ABC, title), (folded, title.lower())):
        if key in known:
            return known[key]
    return {**words, **numbered}.get(title.lower(), title)


def _line(
    robot: Robot, columns: Mapping[str, int], form: str, tens: Mapping[int, int], cells: Sequence[str], at: int
) -> Line:
    def read(column: str, name: str) -> Decimal:
        place = columns[column]
        found = number(cells[place], name)
        return found.scaleb(tens[place]) if tens.get(place) else found

    turned = _ORIENTATIONS[form] if form else ()
    empty = [not cells[columns[name]] for name in turned]
    if any(empty) and not all(empty):
        raise KinegenError(f"some of {', '.join(turned)} are empty; fill all or none", None, at)
    # Numbers are read without a place, which only this line knows.
    try:
        return Line(
            tuple(read(variable.name, variable.name) for variable in robot.variables),
            tuple(read(f"position {name}", name) for name in "xyz"),
            () if any(empty) else tuple(read(name, name) for name in turned),
            at,
        )
    except KinegenError as error:
        raise KinegenError(error.message, None, at) from None
