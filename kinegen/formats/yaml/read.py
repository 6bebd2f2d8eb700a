"""The tree of a robot file -> `RawRobot`: every key known, every part read, no name looked up yet."""

from __future__ import annotations

import re
from dataclasses import dataclass

from kinegen.errors import quote
from kinegen.formats.messages import accept_name, fail, within
from kinegen.formats.yaml import keys
from kinegen.formats.yaml.actuators.read import RawActuators, read_actuators
from kinegen.formats.yaml.frames import read_fixed, read_frames
from kinegen.formats.yaml.nodes import choice, items, mapping, word
from kinegen.formats.yaml.parameters import RawParameter, read_parameters
from kinegen.formats.yaml.rows import read_rows
from kinegen.formats.yaml.slots import RawFrame, RawRow
from kinegen.formats.yaml.tree import Mapping, Node, Sequence
from kinegen.robot.model import BASE, TOOL, Convention, Units
from kinegen.robot.redundancy import joined


@dataclass(frozen=True, slots=True)
class RawRobot:
    """A robot file as written; the attributes are those of `Robot`."""

    name: str
    description: str
    version: str
    convention: Convention
    units: Units
    parameters: tuple[RawParameter, ...]
    rows: tuple[RawRow, ...]
    base: RawFrame
    tool: RawFrame
    frames: tuple[RawFrame, ...]
    actuators: RawActuators
    redundancy: RawRedundancy | None


@dataclass(frozen=True, slots=True)
class RawRedundancy:
    """What the inverse is given besides the pose, as written.

    Attributes:
        text: Joints with commas between them, or the arm angle.
        line: Line of the file.
    """

    text: str
    line: int


def read_robot(root: Mapping) -> RawRobot:
    """Read all parts of a robot file.

    Args:
        root: The mapping at the top.

    Raises:
        RobotFileError: At the first defect.
    """
    fields = mapping(root, keys.TOP, "a mapping")
    for key, example in keys.TOP_REQUIRED.items():
        if key not in fields:
            fail(f"key '{key}' is missing (as in {example})", root.line)
    if word(fields["kinegen"], "the format version, 1") != keys.VERSION:
        fail("unknown format version (this kinegen reads 'kinegen: 1')", fields["kinegen"].line)
    name = _name(fields["name"])
    description = _description(fields.get("description"))
    convention, units = _convention(fields["convention"]), _units(fields["units"])
    rows = read_rows(fields["joints"], convention)
    tree = _is_tree(rows)
    _check_row_names(rows)
    if tree and "tool" in fields:
        fail("a robot with several tips has no tool; add frames with tip: true instead", fields["tool"].line)
    return RawRobot(
        name=name,
        description=description,
        version=_version(fields.get("version")),
        convention=convention,
        units=units,
        parameters=read_parameters(fields.get("parameters"), {row.name: row.line for row in rows}),
        rows=rows,
        base=read_fixed(fields.get("base"), BASE),
        tool=read_fixed(fields.get("tool"), TOOL),
        frames=read_frames(fields.get("frames"), rows, tree=tree),
        actuators=read_actuators(fields.get("actuators")),
        redundancy=_redundancy(fields.get("redundancy")),
    )


def _redundancy(node: Node | None) -> RawRedundancy | None:
    if node is None:
        return None
    with within("redundancy", node.line):
        parts = items(node, "the name of a joint, or a list of joints") if isinstance(node, Sequence) else (node,)
        if not parts:
            fail("expected the name of a joint, arm_angle, or a list of joints, found an empty list")
        names = [word(part, "the name of a joint, or arm_angle") for part in parts]
        for name in names:
            if "," in name:
                fail(f"{quote(name)} is not a name; several joints are written as [track, table]")
        return RawRedundancy(joined(names), node.line)


def _name(node: Node) -> str:
    with within("name", node.line):
        name = word(node, "the name of the robot")
    accept_name("robot", name, node.line)
    return name


def _description(node: Node | None) -> str:
    """One line; YAML's folded and literal blocks are unfolded."""
    if node is None:
        return ""
    with within("description", node.line):
        text = " ".join(word(node, "a line of text").split())
        bad = next((character for character in text if not character.isprintable()), None)
        if bad is not None:
            fail(f"character {bad!r} cannot be printed")
        if len(text) > keys.MAX_DESCRIPTION:
            fail(f"it has {len(text)} characters (at most {keys.MAX_DESCRIPTION})")
    return text


def _version(node: Node | None) -> str:
    if node is None:
        return ""
    with within("version", node.line):
        text = word(node, "three numbers, such as 1.2.0")
        if re.match(keys.VERSION_PATTERN, text) is None:
            fail(f"{quote(text)} is not three numbers, such as 1.2.0")
    return text


def _convention(node: Node) -> Convention:
    return Convention(choice(node, "convention", keys.TABLE_CONVENTIONS))


def _units(node: Node) -> Units:
    with within("units", node.line):
        fields = mapping(node, keys.UNITS, "{length: m, angle: deg}")
        for key in keys.UNITS:
            if key not in fields:
                fail(f"key '{key}' is missing (as in {{length: m, angle: deg}})")
        length = choice(fields["length"], "length unit", keys.LENGTH_UNITS)
        return Units(length, choice(fields["angle"], "angle unit", keys.ANGLE_UNITS))


def _is_tree(rows: tuple[RawRow, ...]) -> bool:
    parents = {row.parent for row in rows}
    return sum(row.name not in parents for row in rows) > 1


def _check_row_names(rows: tuple[RawRow, ...]) -> None:
    """Rows are frames too, and frames become macros in upper case."""
    seen: dict[str, RawRow] = {}
    for row in rows:
        with within(row.where, row.line):
            other = seen.setdefault(row.name.upper(), row)
            if other is not row and other.name == row.name:
                fail(f"joint {other.number} has the same name (line {other.line})")
            if other is not row:
                fail(f"differs from joint '{other.name}' in upper and lower case only, which macros lose")
            if row.name.lower() == TOOL:
                fail(f"{quote(TOOL)} is a frame of every robot; choose another name")
