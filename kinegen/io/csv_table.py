"""A table of Denavit-Hartenberg parameters as CSV -> `Robot`.

The first line names the columns. Convention and units come from the user, or from a comment above that line, such as
`# standard,mm,deg`: they are never guessed. Cells are
exact expressions, as in kinegen's own robot file, whose reader takes over from the rows on.
"""

from __future__ import annotations

import csv
import re
from pathlib import Path

from kinegen.errors import printable, quote
from kinegen.io.format import Imported, ReadOptions, Report
from kinegen.io.link_tree.structure import Identifiers
from kinegen.io.messages import expected, fail
from kinegen.io.robot_file import keys
from kinegen.io.robot_file.read import read_robot, resolve
from kinegen.io.robot_file.tree import NODE_SIZE, Mapping, Node, Scalar, Sequence, decode

_COLUMNS = {
    "name": ("name", "joint", "link", "i", "j", "#", "no", "row"),
    "type": ("type", "kind"),
    "theta": ("theta", "θ", "th", "q"),
    "d": ("d",),
    "a": ("a", "r"),
    "alpha": ("alpha", "α", "al"),
    "beta": ("beta", "β"),
    "offset": ("offset",),
    "lower": ("lower", "min", "qmin", "q_min", "lo"),
    "upper": ("upper", "max", "qmax", "q_max", "hi"),
}
_KNOWN = {word: key for key, words in _COLUMNS.items() for word in words}
_TYPES = {
    "r": "revolute",
    "revolute": "revolute",
    "p": "prismatic",
    "prismatic": "prismatic",
    "f": "fixed",
    "fixed": "fixed",
}
_HEADER = re.compile(r"([^\[\](]+?)(?:_?i)?\s*(?:[\[(]\s*([^\])]*?)\s*[\])])?\Z")
_SAME_UNITS = {
    "degree": "deg",
    "degrees": "deg",
    "°": "deg",
    "radians": "rad",
    "radian": "rad",
    "meter": "m",
    "metre": "m",
}
_LENGTHS = ("a", "d")
_TURNS = ("alpha", "theta", "beta")
_STATED = re.compile(r"#\s*([a-z_]+,[a-z]+,[a-z]+)\s*\Z")
"""A first line that says what the table means, as our own tables have it."""

_EXAMPLE = "--table standard,mm,deg"


def read(data: bytes, path: Path, options: ReadOptions) -> Imported:
    """Read a CSV table, whose convention, length unit and angle unit are in `options.table`."""
    lines = decode(data).splitlines()
    stated = _STATED.match(lines[0]) if lines else None
    convention, length, angle = _meaning(options.table or (stated[1] if stated else ""))
    # A spreadsheet writes the separators of rows that are empty.
    numbers = [i for i, line in enumerate(lines) if line.strip(" ,;\t") and not line.lstrip().startswith("#")]
    if len(numbers) < 2:
        fail("expected a line with the names of the columns, and a line for each joint")
    head, *body = numbers
    # A header with semicolons or tabs has commas in numbers alone.
    separator = next((each for each in ";\t" if each in lines[head]), ",")
    columns = _columns(_cells(lines[head], separator), head + 1, {"length": length, "angle": angle})
    # From here on the rows are those of a robot file, whose reader checks them.
    names = Identifiers()
    own = names.give("robot", path.stem, "robot")
    rows: list[Node] = []
    for count, place in enumerate(body, start=1):
        cells = _cells(lines[place], separator)
        if len(cells) != len(columns):
            fail(f"the line has {len(cells)} columns, the first one {len(columns)}", place + 1)
        rows.append(_row(dict(zip(columns, cells, strict=True)), count, place + 1, names))
    top: dict[str, Node] = {
        "kinegen": Scalar("1", 0),
        "name": Scalar(own, 0),
        "convention": Scalar(convention, 0),
        "units": _mapping({"length": Scalar(length, 0), "angle": Scalar(angle, 0)}, 0),
        "joints": Sequence(tuple(rows), head + 1, NODE_SIZE),
    }
    robot = resolve(read_robot(_mapping(top, 0)), printable(path.name))
    # Comments may hold what a table has no column for, so they are reported.
    comments = [
        f"line {i + 1} is not read: {line[:80]}" for i, line in enumerate(lines) if line.lstrip().startswith("#")
    ]
    return Imported(robot, Report(renamed=tuple(names.renamed), notes=tuple(comments[bool(stated) :])))


def _meaning(table: str) -> tuple[str, str, str]:
    """Read convention and units, which are never guessed."""
    words = [word.strip() for word in table.split(",")]
    if table and len(words) != 3:
        fail(f"--table {quote(table)}: expected a convention, a length and an angle, as in {_EXAMPLE}")
    if len(words) != 3:
        fail(f"a CSV table does not say its convention and units; say them, as in {_EXAMPLE}")
    choices = (keys.TABLE_CONVENTIONS, keys.LENGTH_UNITS, keys.ANGLE_UNITS)
    for word, known in zip(words, choices, strict=True):
        if word not in known:
            fail(f"--table: unknown word {quote(word)} {expected(word, known)}")
    return words[0], words[1], words[2]


def _cells(line: str, separator: str) -> list[str]:
    return [cell.strip() for cell in next(csv.reader([line], delimiter=separator, skipinitialspace=True))]


def _columns(cells: list[str], line: int, units: dict[str, str]) -> list[str]:
    """Return what each column holds."""
    found: list[str] = []
    for cell in cells:
        # A title is a name, perhaps with an index i, and a unit in brackets.
        match = _HEADER.match(cell.lower())
        key = _KNOWN.get(match[1].strip()) if match else None
        if match is None or key is None:
            fail(f"unknown column {quote(cell)} {expected(cell.lower(), _COLUMNS)}", line)
        if key in found:
            fail(f"two columns hold {key}", line)
        # A unit that contradicts --table would scale the robot.
        wanted = units["length"] if key in _LENGTHS else units["angle"] if key in _TURNS else ""
        unit = _SAME_UNITS.get(match[2] or "", match[2] or "")
        if unit and wanted and unit != wanted:
            fail(f"column {quote(cell)} is in {quote(unit)}, but --table says {wanted}", line)
        found.append(key)
    # Hayati rows have beta in place of d.
    for key in ("theta", "d", "a", "alpha"):
        if key not in found and not (key == "d" and "beta" in found):
            fail(f"there is no column {key}", line)
    return found


def _row(cells: dict[str, str], number: int, line: int, names: Identifiers) -> Node:
    # A spreadsheet numbers its rows; a number is no identifier.
    given = cells.get("name", "")
    name = names.give("joint", f"joint_{given or number}" if given.isdigit() or not given else given, "joint")
    fields: dict[str, Node] = {"name": Scalar(name, line)}
    kind = cells.get("type", "").lower()
    if kind and kind not in _TYPES:
        fail(f"unknown type {quote(kind)} (expected R, P or F)", line)
    # Printed tables number the variable of a row: q3, theta_3.
    for key in ("theta", "d", "a", "alpha", "beta"):
        if key in cells:
            text = re.sub(rf"(?<![A-Za-z0-9_])(q|theta|θ|th|d)_?{number}\*?(?![A-Za-z0-9_])", "q", cells[key]) or "0"
            fields[key] = Scalar(text, line)
    # With a type, the entry that moves may hold its offset alone.
    moving = {"revolute": "theta", "prismatic": "d"}.get(_TYPES.get(kind, ""))
    has_variable = any(re.search(r"(?<![A-Za-z0-9_])q(?![A-Za-z0-9_])", _text(node)) for node in fields.values())
    if moving and moving in fields and not has_variable:
        text = _text(fields[moving])
        fields[moving] = Scalar("q" if text == "0" else f"q + ({text})", line)
    elif not kind and not has_variable:
        fail("nothing moves here: write q in theta or d, or add a column type with R, P or F", line)
    if kind:
        fields["type"] = Scalar(_TYPES[kind], line)
    if cells.get("offset", "") not in ("", "0"):
        fields["offset"] = Scalar(cells["offset"], line)
    bounds = [cells.get(key, "") for key in ("lower", "upper")]
    if any(bounds):
        if not all(bounds):
            fail("lower and upper belong together", line)
        fields["limits"] = Sequence(tuple(Scalar(bound, line) for bound in bounds), line, NODE_SIZE)
    return _mapping(fields, line)


def _text(node: Node) -> str:
    return node.text if isinstance(node, Scalar) else ""


def _mapping(fields: dict[str, Node], line: int) -> Mapping:
    return Mapping(tuple((Scalar(key, line), value) for key, value in fields.items()), line, NODE_SIZE)
