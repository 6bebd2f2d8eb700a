"""Reads a file of measurements, CSV or Parquet: what each column holds, in which unit, and its cells."""

from __future__ import annotations

import io
from collections.abc import Iterable
from pathlib import Path

from kinegen.errors import KinegenError, did_you_mean, quote, shown
from kinegen.io.columns import (
    MAX_ROWS,
    METRES,
    RADIANS,
    Cells,
    check_units,
    csv_cells,
    no_column,
    read_bytes,
    unit_of,
    unknown_unit,
)
from kinegen.model.robot import JointType, Robot
from kinegen.support.compat import library
from kinegen.support.dataclass import dataclass
from kinegen.tools.calibrate.options import Settings

POSITION = ("x", "y", "z")
QUATERNION = ("qw", "qx", "qy", "qz")
ROLL_PITCH_YAW = ("roll", "pitch", "yaw")
ROTATION_VECTOR = ("rx", "ry", "rz")
ORIENTATIONS = (QUATERNION, ROLL_PITCH_YAW, ROTATION_VECTOR)
KUKA = ("A", "B", "C")
"""What KUKA calls yaw, pitch and roll."""

TO = "to_"
TEXTS = ("anchor", "plane", "sphere")
LENGTHS = (*POSITION, "distance", "radius", "sigma")
ANGLES = (*ROLL_PITCH_YAW, *ROTATION_VECTOR, "sigma_angle")
WORDS = (*LENGTHS, *ANGLES, *QUATERNION, *TEXTS)


@dataclass(frozen=True, slots=True)
class Column:
    """A column of a file of measurements.

    Attributes:
        role: A word of `WORDS`, or a joint by number (`q1`, `to_q1`).
        scale: What its numbers are multiplied by, for radians and the length unit of the robot file.
        stated: Whether its unit is in the header or in an option.
        unit: That unit, or that of the robot file; empty where it has none.
    """

    place: int
    role: str
    scale: float
    stated: bool
    unit: str = ""


def read_header(cells: Cells, robot: Robot, settings: Settings) -> dict[str, Column]:
    """Find the role and the unit of every column; refuse one that is not known, occurs twice or is missing."""
    roles = _roles(robot)
    # Where two names differ in capitals alone, the first of the table has the small letters.
    folded = {name.lower(): role for name, role in reversed(roles.items()) if name not in KUKA} | roles
    unknown = next((name for name in settings.ignore if name not in cells.header), None)
    if unknown is not None:
        raise cells.fail(f"--ignore: {no_column(unknown, cells.header)}", cells.header_line)
    found: dict[str, Column] = {}
    units: dict[str, str | None] = {}
    for place, title in enumerate(cells.header):
        if title in settings.ignore:
            continue
        name, unit = unit_of(title, roles)
        role = roles.get(name) or folded.get(name.lower())
        if role is None:
            raise cells.fail(f"unknown column {quote(title)} {_expected(name, roles)}", cells.header_line)
        if role in found:
            raise cells.fail(f"column {quote(title)} occurs twice", cells.header_line)
        found[role] = _column(cells, place, role, unit, robot, settings)
        units[role] = unit
    _check_units(cells, found, units, robot, settings)
    _check_joints(cells, found, robot)
    _check_groups(cells, found)
    return found


def _roles(robot: Robot) -> dict[str, str]:
    """The role of every name that a column may have; a joint that is called as another role goes by its number."""
    roles = {word: word for word in WORDS}
    for number, variable in enumerate(robot.variables, start=1):
        for name in (f"q{number}", variable.name):
            roles.setdefault(name, f"q{number}")
            roles.setdefault(TO + name, f"{TO}q{number}")
    joints = {variable.name.lower() for variable in robot.variables}
    roles |= {
        name: role for name, role in zip(KUKA, ("yaw", "pitch", "roll"), strict=True) if name.lower() not in joints
    }
    return roles


def _expected(name: str, roles: dict[str, str]) -> str:
    hint = did_you_mean(name.lower(), roles)
    known = ", ".join(dict.fromkeys(("q1 ... or names of joints", *POSITION, "qw qx qy qz", "distance", "plane")))
    return f"(expected {known}, ...{hint}; --ignore leaves a column out)"


def _column(cells: Cells, place: int, role: str, unit: str | None, robot: Robot, settings: Settings) -> Column:
    """Return one column with its scale; a unit that does not fit what it measures is refused."""
    units = _units(role, robot)
    title = quote(cells.header[place])
    if not units:
        if unit is not None:
            raise cells.fail(f"column {title} has no unit", cells.header_line)
        return Column(place, role, 1.0, stated=True)
    own, default = (robot.units.length, settings.length) if units is METRES else (robot.units.angle, settings.angle)
    if unit is not None and unit not in units:
        raise cells.fail(unknown_unit(cells.header[place], unit, units), cells.header_line)
    taken = unit or default or own
    size = units[taken]
    kernel = METRES[robot.units.length] if units is METRES else 1.0
    # Equal units have a scale of 1 exactly.
    scale = 1.0 if size == kernel else size / kernel
    return Column(place, role, scale, stated=(unit or default) is not None, unit=taken)


def _check_units(
    cells: Cells, found: dict[str, Column], units: dict[str, str | None], robot: Robot, settings: Settings
) -> None:
    """Refuse units that options contradict, or that titles beside them leave open; a sigma has one of its own."""
    joints = [role for role in found if role.removeprefix(TO) not in WORDS]
    slides = [role for role in joints if _units(role, robot) is METRES]
    turns = [role for role in joints if role not in slides]
    # The angles of a rotation vector are of no joint, and many controllers have them in radians alone.
    for roles, own, option, asked in (
        ((*turns, *ROLL_PITCH_YAW), robot.units.angle, "--angle", settings.angle),
        (ROTATION_VECTOR, settings.angle or robot.units.angle, "--angle", None),
        ((*slides, *POSITION), robot.units.length, "--length", settings.length),
    ):
        stated = {cells.header[found[role].place]: units[role] for role in roles if role in found}
        try:
            check_units(stated, asked or own, option, is_asked=asked is not None)
        except KinegenError as error:
            raise cells.fail(error.message, cells.header_line) from None


def _units(role: str, robot: Robot) -> dict[str, float] | None:
    """Return the units that a column may have; None if it has none."""
    joint = role.removeprefix(TO)
    if joint not in WORDS:
        variable = robot.variables[int(joint[1:]) - 1]
        return METRES if variable.type is JointType.PRISMATIC else RADIANS
    return METRES if role in LENGTHS else RADIANS if role in ANGLES else None


def _check_joints(cells: Cells, found: Iterable[str], robot: Robot) -> None:
    """Every joint needs a column; the second configuration of a distance needs all or none."""
    for prefix in ("", TO):
        roles = [f"{prefix}q{number}" for number in range(1, robot.dof + 1)]
        missing = [f"{prefix}{variable.name}" for role, variable in zip(roles, robot.variables) if role not in found]
        if missing and (not prefix or len(missing) < robot.dof):
            several = len(missing) > 1
            what = "the columns of joints {} are missing" if several else "the column of joint {} is missing"
            raise cells.fail(what.format(", ".join(missing)), cells.header_line)


def _check_groups(cells: Cells, found: Iterable[str]) -> None:
    """Positions and orientations are complete, there is one form of orientation, and something is measured."""
    present = set(found)
    for group in (POSITION, *ORIENTATIONS):
        missing = [name for name in group if name not in present]
        if 0 < len(missing) < len(group):
            raise cells.fail(f"column {', '.join(missing)} is missing beside {', '.join(group)}", cells.header_line)
    # An orientation is measured together with the position of the same frame.
    forms = [group for group in ORIENTATIONS if group[0] in present]
    if len(forms) > 1:
        raise cells.fail("the orientation is given in two forms; leave one out with --ignore", cells.header_line)
    if forms and "x" not in present:
        raise cells.fail("there is an orientation but no position (columns x, y, z)", cells.header_line)
    # A distance has two ends, and each row measures something.
    if "distance" in present and not present & {"anchor", f"{TO}q1"}:
        raise cells.fail(
            "column 'distance' needs the other end: to_q1 ... for a second configuration, or anchor for a fixed point",
            cells.header_line,
        )
    if not present & {"x", "distance", "plane", "sphere"}:
        raise cells.fail(
            "no column says what was measured (expected x, y, z, or distance, plane or sphere)", cells.header_line
        )


_PARQUET = b"PAR1"
_EXPECTED = "CSV or Parquet with measurements"


def read_cells(path: Path) -> Cells:
    """Read a file of measurements; its content decides whether it is CSV or Parquet."""
    data = read_bytes(path, _EXPECTED)
    return _read_parquet(data, shown(path)) if data.startswith(_PARQUET) else csv_cells(data, path, _EXPECTED)


def _read_parquet(data: bytes, name: str) -> Cells:
    """Return the same cells from Parquet; numbers go through text, which keeps every digit."""
    parquet = library("pyarrow.parquet", "reading Parquet")
    try:
        table = parquet.read_table(io.BytesIO(data))
    except (OSError, ValueError) as error:
        raise KinegenError(f"this Parquet file cannot be read: {quote(str(error))}", name) from None
    if table.num_rows > MAX_ROWS:
        raise KinegenError(f"the file has more than {MAX_ROWS} rows", name)
    columns = [["" if cell is None else str(cell) for cell in column.to_pylist()] for column in table.columns]
    rows = tuple(zip(*columns, strict=True)) if columns else ()
    return Cells(name, tuple(map(str, table.column_names)), 0, rows, tuple(range(1, len(rows) + 1)))
