"""The header of a file of measurements -> what each column holds, and in which unit."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable
from dataclasses import dataclass

from kinegen.calibrate.options import METRES, RADIANS, Settings
from kinegen.errors import quote
from kinegen.formats.columns import Cells
from kinegen.robot.model import JointType, Robot

POSITION = ("x", "y", "z")
QUATERNION = ("qw", "qx", "qy", "qz")
ROLL_PITCH_YAW = ("roll", "pitch", "yaw")
ROTATION_VECTOR = ("rx", "ry", "rz")
ORIENTATIONS = (QUATERNION, ROLL_PITCH_YAW, ROTATION_VECTOR)
TO = "to_"
TEXTS = ("anchor", "plane", "sphere")
LENGTHS = (*POSITION, "distance", "radius", "sigma")
ANGLES = (*ROLL_PITCH_YAW, *ROTATION_VECTOR, "sigma_angle")
WORDS = (*LENGTHS, *ANGLES, *QUATERNION, *TEXTS)

_UNIT = re.compile(r"(?P<name>.*?)(?:\s*[\[(]\s*(?P<bracket>[a-zµ]+)\s*[\])]|_(?P<suffix>mm|cm|um|m|in|deg|rad|mrad))")


@dataclass(frozen=True, slots=True)
class Column:
    """One column.

    Attributes:
        place: Its place in the row, from 0.
        role: A word of `WORDS`, or a joint by number (`q1`, `to_q1`).
        scale: What its numbers are multiplied by, for radians and the length unit of the robot file.
        stated: Whether its unit is in the header or in an option.
    """

    place: int
    role: str
    scale: float
    stated: bool


def read_header(cells: Cells, robot: Robot, settings: Settings) -> dict[str, Column]:
    """Find the role and the unit of every column.

    Args:
        cells: The table.
        robot: The robot, whose joints columns are named after.
        settings: Units where the header has none, and columns to leave out.

    Returns:
        Columns by role.

    Raises:
        KinegenError: If a column is not known, occurs twice, or is missing.
    """
    roles = _roles(robot)
    found: dict[str, Column] = {}
    for place, title in enumerate(cells.header):
        if title in settings.ignore:
            continue
        name, unit = _unit_of(title, roles)
        role = roles.get(name) or roles.get(name.lower())
        if role is None:
            raise cells.fail(f"unknown column {quote(title)} {_expected(name, roles)}", cells.header_line)
        if role in found:
            raise cells.fail(f"column {quote(title)} occurs twice", cells.header_line)
        found[role] = _column(cells, place, role, unit, robot, settings)
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
    return roles


def _unit_of(title: str, roles: dict[str, str]) -> tuple[str, str | None]:
    """The name in a title, and the unit behind it, if there is one."""
    match = None if title in roles else _UNIT.fullmatch(title)
    if match is None:
        return title, None
    unit = match["bracket"] or match["suffix"]
    return match["name"], unit.replace("µm", "um")


def _expected(name: str, roles: dict[str, str]) -> str:
    near = difflib.get_close_matches(name.lower(), roles, n=1)
    hint = f"; did you mean {near[0]}?" if near else ""
    known = ", ".join(dict.fromkeys(("q1 ... or names of joints", *POSITION, "qw qx qy qz", "distance", "plane")))
    return f"(expected {known}, ...{hint}; --ignore leaves a column out)"


def _column(cells: Cells, place: int, role: str, unit: str | None, robot: Robot, settings: Settings) -> Column:
    """One column with its scale; a unit that does not fit what it measures is refused."""
    units = _units(role, robot)
    title = quote(cells.header[place])
    if not units:
        if unit is not None:
            raise cells.fail(f"column {title} has no unit", cells.header_line)
        return Column(place, role, 1.0, stated=True)
    own, default = (robot.units.length, settings.length) if units is METRES else (robot.units.angle, settings.angle)
    if unit is not None and unit not in units:
        raise cells.fail(f"column {title} is in {unit!r} (expected {', '.join(units)})", cells.header_line)
    size = units[unit or default or own]
    kernel = METRES[robot.units.length] if units is METRES else 1.0
    # Equal units have a scale of 1 exactly.
    return Column(place, role, 1.0 if size == kernel else size / kernel, stated=(unit or default) is not None)


def _units(role: str, robot: Robot) -> dict[str, float] | None:
    """The units that a column may have; None if it has none."""
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
    forms = [group for group in ORIENTATIONS if group[0] in present]
    if len(forms) > 1:
        raise cells.fail("the orientation is given in two forms; leave one out with --ignore", cells.header_line)
    if forms and "x" not in present:
        raise cells.fail("there is an orientation but no position (columns x, y, z)", cells.header_line)
    if "distance" in present and not present & {"anchor", f"{TO}q1"}:
        raise cells.fail(
            "column 'distance' needs the other end: to_q1 ... for a second configuration, or anchor for a fixed point",
            cells.header_line,
        )
    if not present & {"x", "distance", "plane", "sphere"}:
        raise cells.fail(
            "no column says what was measured (expected x, y, z, or distance, plane or sphere)", cells.header_line
        )
