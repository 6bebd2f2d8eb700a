"""The tree of a robot file -> `RawRobot`, with every key known -> `Robot`, with every name looked up."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from kinegen.errors import RobotFileError, printable, quote
from kinegen.io.format import Imported, ReadOptions
from kinegen.io.messages import accept_name, expected, fail, refuse_twin, within
from kinegen.io.robot_file import keys
from kinegen.io.robot_file.convert import Converter, check_names, joint_types, with_dimensions
from kinegen.io.robot_file.expression_fields import ExpressionField, RawFrame, RawRow, all_slots
from kinegen.io.robot_file.parameters import RawParameter, close_parameters, find_dimensions, read_parameters
from kinegen.io.robot_file.rows import read_fixed, read_frames, read_rows
from kinegen.io.robot_file.tree import Mapping, Node, Sequence, choice, decode, items, mapping, named, parse_tree, word
from kinegen.model.actuators import NO_ACTUATORS, Actuators
from kinegen.model.expression_values import checked_value
from kinegen.model.robot import BASE, TOOL, Convention, JointType, Robot, Units
from kinegen.model.variants import check_redundancy, joined
from kinegen.support.dataclass import dataclass

if TYPE_CHECKING:
    from kinegen.io.robot_file.actuators.read import RawActuators


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
    actuators: RawActuators | None
    redundancy: RawRedundancy | None
    links: tuple[RawLink, ...]


@dataclass(frozen=True, slots=True)
class RawRedundancy:
    """The key `redundancy` as written: joints with commas between them, or the arm angle."""

    text: str
    line: int


@dataclass(frozen=True, slots=True)
class RawLink:
    """The name of a link as written, and the frame that it moves with."""

    name: str
    frame: str
    line: int


def read_robot(root: Mapping) -> RawRobot:
    """Read all parts of a robot file."""
    fields = mapping(root, keys.TOP, "a mapping")
    for key, example in keys.TOP_REQUIRED.items():
        if key not in fields:
            fail(f"key '{key}' is missing (as in {example})", root.line)
    if word(fields["kinegen"], "the format version, 1") != keys.VERSION:
        fail("unknown format version (this kinegen reads 'kinegen: 1')", fields["kinegen"].line)
    # Rows need the convention, and all that follows needs the rows.
    name = _name(fields["name"])
    description = _description(fields.get("description"))
    convention, units = _convention(fields["convention"]), _units(fields["units"])
    rows = read_rows(fields["joints"], convention)
    # A tree has no tool, since it would not be clear on which tip.
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
        actuators=_actuators(fields.get("actuators")),
        redundancy=_redundancy(fields.get("redundancy")),
        links=_links(fields.get("links")),
    )


def _actuators(node: Node | None) -> RawActuators | None:
    """Read `actuators`, with modules that are imported for robots that have some."""
    if node is None:
        return None
    from kinegen.io.robot_file.actuators.read import read_actuators

    return read_actuators(node)


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


def _links(node: Node | None) -> tuple[RawLink, ...]:
    if node is None:
        return ()
    with within("links", node.line):
        found = []
        for key, value in named(node, "entries such as forearm_link: elbow", keys.MAX_LINKS):
            if not key.text.strip() or not key.text.isprintable():
                fail(f"{quote(key.text)} is not the name of a link", key.line)
            found.append(RawLink(key.text.strip(), word(value, "the name of a frame"), value.line))
        return tuple(found)


def _name(node: Node) -> str:
    with within("name", node.line):
        name = word(node, "the name of the robot")
    accept_name("robot", name, node.line)
    return name


def _description(node: Node | None) -> str:
    """Read one line; YAML's folded and literal blocks are unfolded."""
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
    """Refuse names that differ in case alone: rows are frames too, and frames become macros in upper case."""
    seen: dict[str, RawRow] = {}
    for row in rows:
        with within(row.where, row.line):
            other = seen.setdefault(row.name.upper(), row)
            if other is not row and other.name == row.name:
                fail(f"joint {other.number} has the same name (line {other.line})")
            if other is not row:
                refuse_twin(row.name, "joint", [other.name])
            if row.name.lower() == TOOL:
                fail(f"{quote(TOOL)} is a frame of every robot; choose another name")


def resolve(raw: RawRobot, source: str) -> Robot:
    """Make the model, but for its digest, of what a file with this base name says."""
    degrees = raw.units.angle == "deg"
    # Types decide what offsets and limits measure; then every name can be looked up.
    types = joint_types(raw.rows)
    rows = with_dimensions(raw.rows, types)
    slots = tuple(all_slots(rows, (raw.base, raw.tool, *raw.frames)))
    known = [parameter.name for parameter in raw.parameters]
    for where, slot in slots:
        with within(where, slot.line):
            check_names(slot, known, types)
    # What parameters measure follows from all of their uses; then values can be converted.
    actuators, formulas = _named_actuators(raw, types)
    dimensions = find_dimensions(raw.parameters, slots, frozenset(types), formulas)
    parameters = close_parameters(raw.parameters, dimensions, degrees=degrees)
    values = {parameter.name: checked_value(parameter.value, {}) for parameter in parameters}
    converter = Converter(types, {parameter.name: parameter for parameter in parameters}, values, degrees)
    robot = Robot(
        name=raw.name,
        description=raw.description,
        convention=raw.convention,
        units=raw.units,
        parameters=parameters,
        variables=converter.variables(rows),
        rows=tuple(converter.row(row) for row in rows),
        base=converter.steps(raw.base),
        tool=converter.steps(raw.tool),
        frames=tuple(converter.frame(frame) for frame in raw.frames),
        source=source,
        digest="",
        actuators=_resolved_actuators(actuators, converter),
        version=raw.version,
        redundancy=raw.redundancy.text if raw.redundancy else "",
    )
    if raw.redundancy:
        try:
            check_redundancy(robot, raw.redundancy.text)
        except RobotFileError as error:
            fail(error.message, raw.redundancy.line)
    return replace(robot, links=_frames_of_links(raw, robot))


def _named_actuators(
    raw: RawRobot, types: dict[str, JointType]
) -> tuple[RawActuators | None, Iterable[tuple[str, ExpressionField]]]:
    """Look the names in `actuators` up, and return its expressions too."""
    if raw.actuators is None:
        return None, ()
    from kinegen.io.robot_file.actuators.names import formula_slots, with_names

    found = with_names(raw.actuators, raw.parameters, types)
    return found, formula_slots(found)


def _resolved_actuators(raw: RawActuators | None, converter: Converter) -> Actuators:
    if raw is None:
        return NO_ACTUATORS
    from kinegen.io.robot_file.actuators.resolve import resolve_actuators

    return resolve_actuators(raw, converter)


def _frames_of_links(raw: RawRobot, robot: Robot) -> tuple[tuple[str, str], ...]:
    """Return each link with its frame, and refuse one without."""
    frames = {name: name for name in (robot.root, *robot.frame_names)}
    frames.setdefault(BASE, robot.root)
    for link in raw.links:
        if link.frame not in frames:
            with within("links", link.line):
                fail(f"link {quote(link.name)}: there is no frame {quote(link.frame)} {expected(link.frame, frames)}")
    return tuple((link.name, frames[link.frame]) for link in raw.links)


def read(data: bytes, path: Path, options: ReadOptions) -> Imported:  # noqa: ARG001 - the file says it all
    """Read a robot file; options for other formats mean nothing here."""
    return Imported(resolve(read_robot(parse_tree(decode(data))), printable(path.name)))
