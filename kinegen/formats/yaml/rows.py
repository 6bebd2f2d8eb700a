"""The `joints` list -> raw rows: known keys, the entries that the convention wants, parents that stand above."""

from __future__ import annotations

from kinegen.errors import quote
from kinegen.formats.messages import accept_name, expected, fail, within
from kinegen.formats.yaml import keys
from kinegen.formats.yaml.nodes import choice, items, mapping, word
from kinegen.formats.yaml.slots import RawRow, Slot, read_slot, read_steps
from kinegen.formats.yaml.tree import Mapping, Node, Scalar
from kinegen.robot.dimension import Dimension
from kinegen.robot.entries import ANGLE_ENTRIES, MOVING_ENTRIES, ROW_ENTRIES
from kinegen.robot.expressions import FUNCTIONS
from kinegen.robot.model import BASE, Convention, root_name


def read_rows(node: Node, convention: Convention) -> tuple[RawRow, ...]:
    """Read the table.

    Args:
        node: The value of `joints`.
        convention: The convention of the file.

    Returns:
        The rows in order; each parent is the root frame or an earlier row.

    Raises:
        RobotFileError: At the first defect.
    """
    with within("joints", node.line):
        parts = items(node, "a list of rows such as - {name: waist, ...}")
        if len(parts) > keys.MAX_ROWS:
            fail(f"{len(parts)} rows are too many (at most {keys.MAX_ROWS})")
    lines = _row_lines(parts)
    rows: list[RawRow] = []
    for part in parts:
        rows.append(_read_row(part, rows, lines, convention))
    return tuple(rows)


def _row_lines(parts: tuple[Node, ...]) -> dict[str, int]:
    """The line of every row that has a name, to explain a parent that stands too low."""
    found: dict[str, int] = {}
    for part in parts:
        if isinstance(part, Mapping):
            names = [value for key, value in part.entries if key.text == "name" and isinstance(value, Scalar)]
            found |= {name.text: part.line for name in names}
    return found


def _read_row(node: Node, above: list[RawRow], lines: dict[str, int], convention: Convention) -> RawRow:
    number = len(above) + 1
    with within(_where(node, number), node.line):
        fields = mapping(node, _row_keys(node, convention), "a row such as {name: waist, ...}")
        if "name" not in fields:
            fail("key 'name' is missing (as in name: elbow)")
        name = word(fields["name"], "a name")
        accept_name("joint", name, fields["name"].line)
        if name in FUNCTIONS:
            fail(f"{quote(name)} is a function; choose another name", fields["name"].line)
        own = _row_convention(fields, convention)
        steps = read_steps(fields["ets"], moving=True) if "ets" in fields else ()
        return RawRow(
            name=name,
            number=number,
            parent=_parent(fields.get("parent"), name, above, lines),
            convention=own,
            entries=_entries(fields, own),
            steps=steps,
            offset=_offset(fields.get("offset")),
            limits=_limits(fields.get("limits")),
            declared=choice(fields["type"], "type", keys.JOINT_TYPES) if "type" in fields else None,
            line=node.line,
        )


def _where(node: Node, number: int) -> str:
    """`joint 3 (elbow)`, or `joint 3` as long as the row has no name that can be shown."""
    if isinstance(node, Mapping):
        for key, value in node.entries:
            if key.text == "name" and isinstance(value, Scalar) and value.text.isidentifier() and len(value.text) <= 40:
                return f"joint {number} ({value.text})"
    return f"joint {number}"


def _row_keys(node: Node, convention: Convention) -> tuple[str, ...]:
    """The keys to accept and to name: entries of another convention get a message of their own, in `_entries`."""
    present = {key.text for key, _ in node.entries} if isinstance(node, Mapping) else set()
    entries = ROW_ENTRIES[convention]
    others = tuple(key for key in keys.ENTRIES if key in present and key not in entries)
    return entries + others + tuple(keys.ROW_COMMON)


def _row_convention(fields: dict[str, Node], convention: Convention) -> Convention:
    if "ets" in fields:
        if "convention" in fields:
            fail("a row with ets has no convention; leave the key out", fields["convention"].line)
        return Convention.ETS
    if "convention" in fields:
        return Convention(choice(fields["convention"], "convention", keys.TABLE_CONVENTIONS))
    return convention


def _entries(fields: dict[str, Node], convention: Convention) -> tuple[Slot, ...]:
    wanted = ROW_ENTRIES[convention]
    for key in keys.ENTRIES:
        if key in fields and key not in wanted:
            kind = "a row with ets" if convention is Convention.ETS else f"a {convention} row"
            takes = f" (it takes {', '.join(wanted)})" if wanted else ""
            fail(f"{kind} has no {key}{takes}", fields[key].line)
        if key not in fields and key in wanted:
            fail(f"key '{key}' is missing (a {convention} row needs {', '.join(wanted)})")
    return tuple(_entry(fields[key], key) for key in wanted)


def _entry(node: Node, key: str) -> Slot:
    dimension = Dimension.ANGLE if key in ANGLE_ENTRIES else Dimension.LENGTH
    return read_slot(node, key, dimension, 2 if key in MOVING_ENTRIES else None)


def _offset(node: Node | None) -> Slot | None:
    # The joint's type decides what it measures, as for limits.
    return None if node is None else read_slot(node, "offset", Dimension.LENGTH)


def _limits(node: Node | None) -> tuple[Slot, Slot] | None:
    if node is None:
        return None
    with within("limits", node.line):
        lower, upper = items(node, "two values, [lower, upper]", 2)
    # The joint's type decides what the limits measure; `motion.with_dimensions` replaces the dimension.
    return read_slot(lower, "limits", Dimension.LENGTH), read_slot(upper, "limits", Dimension.LENGTH)


def _parent(node: Node | None, name: str, above: list[RawRow], lines: dict[str, int]) -> str:
    if node is None:
        return above[-1].name if above else root_name(lines)
    with within("parent", node.line):
        parent = word(node, "the name of an earlier row, or base")
        if parent == name:
            fail("a row cannot be its own parent")
        names = [row.name for row in above]
        if parent == BASE and BASE in lines:
            fail(f"{quote(BASE)} is a joint here (line {lines[BASE]}) as well as the root frame; rename the joint")
        if parent not in (BASE, *names):
            if parent in lines:
                fail(f"{quote(parent)} is below (line {lines[parent]}); a parent must be above its children")
            fail(f"there is no row {quote(parent)} {expected(parent, [BASE, *names])}")
        return parent
