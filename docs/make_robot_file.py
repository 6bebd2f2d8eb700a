"""Writes the tables of docs/robot-file.md and the figures of docs/figures/ from what kinegen reads.

    python docs/make_robot_file.py           rewrites both
    python docs/make_robot_file.py --check   compares, and fails with a diff if something is not current

The page marks a table like this; what is between the two comments is replaced:

    <!-- table: top -->
    <!-- end -->
"""

from __future__ import annotations

import difflib
import math
import re
import sys
from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path
from typing import cast

from draw import Move, figure

from kinegen.io.load import load
from kinegen.io.robot_file import keys
from kinegen.io.robot_file import tree as yaml_tree
from kinegen.io.robot_file.keys import schema
from kinegen.model import expression_nodes, expression_parser, expression_values
from kinegen.model.robot import ROW_ENTRIES, Convention, JointType, Robot
from kinegen.support import naming

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "robot-file.md"
FIGURES = ROOT / "docs" / "figures"
BLOCK = re.compile(r"(?P<head><!-- table: (?P<name>[\w-]+) -->\n)(?P<body>.*?)(?P<tail>^<!-- end -->$)", re.M | re.S)
D = math.radians
MOVES = {
    "standard": (Move("Rz", D(50), "θ"), Move("Tz", 1.15, "d"), Move("Tx", 1.5, "a"), Move("Rx", D(-50), "α")),
    "modified": (Move("Rx", D(30), "α"), Move("Tx", 1.6, "a"), Move("Rz", D(50), "θ"), Move("Tz", 1.15, "d")),
    "modified_prev_d": (Move("Rx", D(30), "α"), Move("Rz", D(50), "θ"), Move("Tx", 1.5, "a"), Move("Tz", 1.15, "d")),
    "hayati": (Move("Rz", D(50), "θ"), Move("Tx", 1.6, "a"), Move("Rx", D(-48), "α"), Move("Ry", D(62), "β")),
    "ets": (Move("Rz", D(50), "q"), Move("Tx", 1.5, "l1"), Move("Ry", D(-60), "-60°")),
    "rpy": (
        *(Move("Tx", 1.3, "x"), Move("Ty", 1.0, "y"), Move("Tz", 0.9, "z")),
        *(Move("Rz", D(50), "yaw"), Move("Ry", D(52), "pitch"), Move("Rx", D(30), "roll")),
    ),
}
"""The transforms of each figure; angles and lengths are chosen so that nothing hides anything else."""

AXES = {
    "standard": ("joint i", "joint i+1"),
    "modified": ("joint i-1", "joint i"),
    "modified_prev_d": ("", "joint i"),
    "hayati": ("joint i", "joint i+1"),
}


def main(arguments: list[str]) -> int:
    """Rewrites or checks the page and the figures; returns the exit status."""
    before = PAGE.read_text(encoding="utf-8")
    files = {PAGE: BLOCK.sub(lambda block: block["head"] + TABLES[block["name"]]() + block["tail"], before)}
    files |= {FIGURES / f"{name}.svg": drawn(name) for name in MOVES}
    stale = False
    for path, after in files.items():
        before = path.read_text(encoding="utf-8") if path.exists() else ""
        if before == after:
            continue
        name = str(path.relative_to(ROOT))
        if arguments == ["--check"]:
            stale = True
            sys.stdout.writelines(difflib.unified_diff(before.splitlines(True), after.splitlines(True), name, "now"))
        else:
            path.parent.mkdir(exist_ok=True)
            path.write_text(after, encoding="utf-8", newline="\n")
            print(name)
    if stale:
        print("The page is not current: run 'make docs' and commit what it changes")
    return int(stale)


def drawn(name: str) -> str:
    """One figure."""
    title = (
        "xyz and rpy" if name == "rpy" else f"A row of convention {name}" if name != "ets" else "An elementary sequence"
    )
    indices = ("", "") if name == "rpy" else ("i-1", "i")
    return figure(title, MOVES[name], indices, AXES.get(name, ("", "")))


def table(head: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    """A table of Markdown."""
    lines = [head, tuple("---" for _ in head), *rows]
    return "".join(f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in line)} |\n" for line in lines)


def meanings(found: dict[str, str], required: Iterable[str], part: dict[str, object]) -> str:
    """Keys with what they take and mean; `part` is what the schema says of the mapping."""
    needed = tuple(required)
    properties = cast("dict[str, dict[str, object]]", part["properties"])
    return table(
        ("key", "value", "meaning"),
        (
            (f"`{key}`" + (" (required)" if key in needed else ""), taken(properties[key]), text)
            for key, text in found.items()
        ),
    )


def taken(value: dict[str, object]) -> str:
    """What a key takes, in words, read from the schema."""
    reference = value.get("$ref")
    if isinstance(reference, str):
        return {"expression": "a number or an expression", "transform": "a transform", "steps": "a list of steps"}.get(
            reference.rpartition("/")[2], f"a {reference.rpartition('/')[2]}"
        )
    words = value.get("enum")
    if isinstance(words, list):
        return ", ".join(f"`{word}`" for word in words)
    if "const" in value:
        return f"`{value['const']}`"
    choices = value.get("anyOf")
    if isinstance(choices, list):
        return ", or ".join(map(taken, choices))
    kind = value.get("type")
    counts: dict[object, str] = {2: "two values", 3: "three values"}
    if kind == "array":
        return counts.get(value.get("minItems"), "a list")
    if isinstance(kind, list):
        return "text"  # a number or a truth value is text there
    return {"string": "text", "boolean": "`true` or `false`", "object": "entries"}[str(kind)]


def keys_of(name: str) -> str:
    """The keys of one mapping of the file."""
    whole = schema()
    definitions = whole["$defs"]
    match name:
        case "top":
            return meanings(keys.TOP, keys.TOP_REQUIRED, whole)
        case "units":
            return meanings(keys.UNITS, keys.UNITS, whole["properties"]["units"])
        case "row":
            return meanings(keys.ROW, ("name",), definitions["row"])
        case "parameter":
            return meanings(keys.PARAMETER, ("value",), definitions["parameter"]["anyOf"][1])
        case "frame":
            return meanings(keys.FRAME, ("parent",), definitions["frame"])
        case "actuators":
            return meanings(keys.ACTUATORS, ("readings", "joints"), whole["properties"]["actuators"])
        case _:
            return meanings(keys.DRIVE, (), definitions["drive"])


def entries() -> str:
    """Which entries a row of each convention has."""
    rows = ((f"`{name}`", ", ".join(f"`{key}`" for key in found) or "`ets`") for name, found in ROW_ENTRIES.items())
    return table(("convention", "entries of a row, all required"), rows)


def reserved() -> str:
    """The words that names may not be, by reason; those of languages and systems are known and are not listed."""
    kinds = (
        ("words of the file itself", naming.FORMAT_WORDS, "all, but a joint may be called `base`"),
        ("functions", frozenset(expression_parser.FUNCTIONS), "parameters, joints, readings"),
    )
    rows = [(kind, of, ", ".join(f"`{word}`" for word in sorted(words))) for kind, words, of in kinds]
    macros, modules, devices = (
        ", ".join(f"`{word}`" for word in sorted(words)[:4]) + " and others"
        for words in (naming.C_MACROS, naming.MODULE_NAMES, naming.DEVICE_NAMES)
    )
    rows += [
        ("keywords of C and C++", "all", "of every edition of both languages"),
        ("macros of C", "all", macros),
        ("modules that a package would hide", "robots", f"Python's keywords and modules; {modules}"),
        ("device names of Windows", "robots", devices),
    ]
    return table(("words", "names that may not be one", "which"), rows)


def limits() -> str:
    """The limits of size."""
    rows = (
        ("the file", f"{yaml_tree.MAX_BYTES // 1024} KiB, {yaml_tree.MAX_DEPTH} levels of nesting"),
        ("rows of `joints`", f"{keys.MAX_ROWS}"),
        ("`parameters`", f"{keys.MAX_PARAMETERS}"),
        ("`frames`", f"{keys.MAX_FRAMES}"),
        ("steps of one `ets`", f"{keys.MAX_STEPS}"),
        ("a name", f"{naming.MAX_NAME} characters"),
        ("`description`", f"{keys.MAX_DESCRIPTION} characters"),
        ("an expression", f"{expression_parser.MAX_LENGTH} characters, {expression_parser.MAX_DEPTH} levels"),
        ("a number", f"{expression_parser.MAX_DIGITS} digits, exponents up to {expression_nodes.MAX_EXPONENT}"),
        ("a value", f"{expression_values.MAX_VALUE:.0e} in size, in radians or the length unit"),
    )
    return table(("what", "at most"), rows)


def _has_type(kind: JointType) -> Callable[[Robot, str], bool]:
    return lambda robot, _: any(row.type is kind for row in robot.rows)


def _writes(pattern: str) -> Callable[[Robot, str], bool]:
    return lambda _, text: re.search(pattern, text, re.M) is not None


def _has_convention(convention: Convention) -> Callable[[Robot, str], bool]:
    return lambda robot, _: any(row.convention is convention for row in robot.rows)


FEATURES: tuple[tuple[str, Callable[[Robot, str], bool]], ...] = (
    *((f"convention `{convention}`", _has_convention(convention)) for convention in Convention),
    ("a convention for one row", lambda robot, _: len({row.convention for row in robot.rows} - {Convention.ETS}) > 1),
    *((f"a {kind} row", _has_type(kind)) for kind in JointType),
    ("a tree, with `parent`", lambda robot, _: robot.is_tree),
    ("named tips", lambda robot, _: any(frame.tip for frame in robot.frames)),
    ("`offset`", _writes(r"^ *- .*\b(theta|d): q,.*\boffset:")),
    ("`limits`", lambda robot, _: any(variable.limits for variable in robot.variables)),
    ("`base`", lambda robot, _: bool(robot.base)),
    ("`tool`", lambda robot, _: bool(robot.tool)),
    ("`frames`", lambda robot, _: bool(robot.frames)),
    ("`rpy`", _writes(r"\brpy:")),
    ("`runtime` parameters", lambda robot, _: bool(robot.runtime_parameters)),
    ("`dimension`", _writes(r"value:.*dimension:")),
    ("expressions with `sqrt`", _writes(r"^[^#]*\bsqrt\(")),
    ("expressions with `atan2`", _writes(r"^[^#]*\batan2?\(")),
    ("`actuators`", lambda robot, _: bool(robot.actuators.readings)),
    ("angles in radians", lambda robot, _: robot.units.angle == "rad"),
    ("lengths in mm", lambda robot, _: robot.units.length == "mm"),
)


def features() -> str:
    """Which files show what."""
    files = {path: path.read_text(encoding="utf-8") for path in sorted((ROOT / "robots").glob("*.yaml"))}
    robots = {path: load(path) for path in files}
    rows = []
    for what, shows in FEATURES:
        found = next((path.name for path, text in files.items() if shows(robots[path], text)), "")
        rows += [(what, f"[{found}](../robots/{found})")] if found else []
    return table(("what", "shown in"), rows)


TABLES: dict[str, Callable[[], str]] = {
    **{name: partial(keys_of, name) for name in ("top", "units", "row", "parameter", "frame", "actuators", "drive")},
    "entries": entries,
    "reserved": reserved,
    "limits": limits,
    "features": features,
}


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
