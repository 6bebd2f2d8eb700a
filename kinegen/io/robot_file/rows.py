"""`joints`, `base`, `tool` and `frames` -> raw rows and frames, with every parent known and no circle."""

from __future__ import annotations

from kinegen.errors import quote
from kinegen.io.messages import accept_name, expected, fail, refuse_twin, within
from kinegen.io.robot_file import keys
from kinegen.io.robot_file.expression_fields import ExpressionField, RawFrame, RawRow, RawStep, read_slot, read_steps
from kinegen.io.robot_file.tree import Mapping, Node, Scalar, choice, items, mapping, named, word
from kinegen.model.expression_parser import FUNCTIONS, ZERO, Expression
from kinegen.model.expression_values import Dimension
from kinegen.model.robot import (
    ANGLE_ENTRIES,
    BASE,
    MOVING_ENTRIES,
    ROW_ENTRIES,
    TOOL,
    WRIST,
    Convention,
    StepKind,
    root_name,
)


def read_rows(node: Node, convention: Convention) -> tuple[RawRow, ...]:
    """Read the table in order; each parent is the root frame or an earlier row."""
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
    """Return the line of every row that has a name, to explain a parent that stands too low."""
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
        # A row may differ from the convention of the file.
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
    """Return `joint 3 (elbow)`, or `joint 3` as long as the row has no name that can be shown."""
    if isinstance(node, Mapping):
        for key, value in node.entries:
            if key.text == "name" and isinstance(value, Scalar) and value.text.isidentifier() and len(value.text) <= 40:
                return f"joint {number} ({value.text})"
    return f"joint {number}"


def _row_keys(node: Node, convention: Convention) -> tuple[str, ...]:
    """Return the keys to accept; entries of another convention get a message of their own, in `_entries`."""
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


def _entries(fields: dict[str, Node], convention: Convention) -> tuple[ExpressionField, ...]:
    wanted = ROW_ENTRIES[convention]
    for key in keys.ENTRIES:
        if key in fields and key not in wanted:
            kind = "a row with ets" if convention is Convention.ETS else f"a {convention} row"
            takes = f" (it takes {', '.join(wanted)})" if wanted else ""
            fail(f"{kind} has no {key}{takes}", fields[key].line)
        if key not in fields and key in wanted:
            fail(f"key '{key}' is missing (a {convention} row needs {', '.join(wanted)})")
    return tuple(_entry(fields[key], key) for key in wanted)


def _entry(node: Node, key: str) -> ExpressionField:
    dimension = Dimension.ANGLE if key in ANGLE_ENTRIES else Dimension.LENGTH
    return read_slot(node, key, dimension, 2 if key in MOVING_ENTRIES else None)


def _offset(node: Node | None) -> ExpressionField | None:
    # The joint's type decides what it measures, as for limits.
    return None if node is None else read_slot(node, "offset", Dimension.LENGTH)


def _limits(node: Node | None) -> tuple[ExpressionField, ExpressionField] | None:
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


_TRANSFORM_EXAMPLE = "entries such as {xyz: [0, 0, 0.1], rpy: [0, 0, 90]}"


def read_fixed(node: Node | None, name: str) -> RawFrame:
    """Read `base` or `tool`; without it nothing lies between the two frames."""
    if node is None:
        return RawFrame(name, name, "", (), 0)
    with within(name, node.line):
        fields = mapping(node, keys.TRANSFORM, _TRANSFORM_EXAMPLE)
        return RawFrame(name, name, "", _transform(fields), node.line)


def read_frames(node: Node | None, rows: tuple[RawRow, ...], *, tree: bool) -> tuple[RawFrame, ...]:
    """Read the named frames, a parent before its children, otherwise in the order of the file.

    A `tree` has more than one tip, so that tool and wrist mean nothing in it.
    """
    if node is None:
        return ()
    with within("frames", node.line):
        entries = named(node, "entries such as station: {parent: base, xyz: [1, 0, 0]}", keys.MAX_FRAMES)
    frames: dict[str, RawFrame] = {}
    for key, value in entries:
        accept_name("frame", key.text, key.line)
        with within(f"frame {quote(key.text)}", key.line):
            _refuse_clash(key.text, rows, frames)
            fields = mapping(value, keys.FRAME, "entries such as {parent: base, xyz: [1, 0, 0]}")
            if "parent" not in fields:
                fail("key 'parent' is missing (a row, base, tool, wrist or another frame)", value.line)
            parent = word(fields["parent"], "the name of a frame")
            line, tip = fields["parent"].line, _is_tip(key.text, parent, fields.get("tip"), tree=tree)
            frames[key.text] = RawFrame(f"frame '{key.text}'", key.text, parent, _transform(fields), line, tip)
    # Parents may stand below their children, so they are looked up when all frames are known.
    for frame in frames.values():
        with within(frame.where, frame.line):
            _check_parent(frame, rows, frames, tree=tree)
    ordered = _parents_first(frames)
    _check_tips(ordered)
    return ordered


def _is_tip(name: str, parent: str, node: Node | None, *, tree: bool) -> bool:
    """Tell whether a frame is marked as a tip, which means something in a tree alone."""
    if node is None:
        return False
    with within("tip", node.line):
        is_tip = choice(node, "value", keys.BOOLEANS) == "true"
        if is_tip and not tree and parent == BASE:
            fail(f"a chain has one tip, its tool; leave tip out here, and build outputs such as pose@tool/{name}")
        if is_tip and not tree:
            fail(f"a chain has one tip, its tool; move the tool, or build the output pose@{name}")
    return is_tip


def _check_tips(frames: tuple[RawFrame, ...]) -> None:
    """Refuse a tip that nothing moves, and the same tip under two names."""
    links: dict[str, str] = {}
    places: dict[tuple[str, tuple[tuple[StepKind, Expression], ...]], RawFrame] = {}
    for frame in frames:
        links[frame.name] = links.get(frame.parent, frame.parent)
        if not frame.tip:
            continue
        with within(frame.where, frame.line):
            if links[frame.name] == BASE:
                fail("tip: the frame is on base, where no joint moves it; a tip is on a row")
            steps = tuple((step.kind, step.slot.expression) for step in frame.steps)
            other = places.setdefault((frame.parent, steps), frame)
            if other is not frame:
                fail(f"tip: it is the same tip as frame '{other.name}' (line {other.line})")


def _refuse_clash(name: str, rows: tuple[RawRow, ...], frames: dict[str, RawFrame]) -> None:
    if name.lower() in (BASE, TOOL, WRIST):
        fail(f"{quote(name.lower())} is a frame of every robot; choose another name")
    for row in rows:
        if row.name == name:
            fail(f"a joint has this name too (line {row.line})")
    refuse_twin(name, "joint", (row.name for row in rows))
    refuse_twin(name, "frame", frames)


def _transform(fields: dict[str, Node]) -> tuple[RawStep, ...]:
    """Read the steps from parent to frame: `T(xyz) Rz(yaw) Ry(pitch) Rx(roll)`, or those of `ets`."""
    if "ets" in fields:
        for key in ("xyz", "rpy"):
            if key in fields:
                fail(f"{key} and ets exclude each other", fields[key].line)
        return read_steps(fields["ets"], moving=False)
    shift = _triple(fields.get("xyz"), "xyz", Dimension.LENGTH)
    roll, pitch, yaw = _triple(fields.get("rpy"), "rpy", Dimension.ANGLE) or (None, None, None)
    return tuple(step for step in (*shift, yaw, pitch, roll) if step is not None and step.slot.expression != ZERO)


def _triple(node: Node | None, key: str, dimension: Dimension) -> tuple[RawStep, ...]:
    """Return three steps, about or along x, y and z."""
    if node is None:
        return ()
    with within(key, node.line):
        parts = items(node, "three values", 3)
    letter = "R" if dimension is Dimension.ANGLE else "T"
    slots = [read_slot(part, f"{key}[{i}]", dimension) for i, part in enumerate(parts)]
    return tuple(RawStep(StepKind(letter + axis), slot) for axis, slot in zip("xyz", slots, strict=True))


def _check_parent(frame: RawFrame, rows: tuple[RawRow, ...], frames: dict[str, RawFrame], *, tree: bool) -> None:
    names = [row.name for row in rows]
    if frame.parent == frame.name:
        fail("a frame cannot be its own parent")
    _refuse_two_meanings(frame.parent, rows, tree=tree)
    if frame.parent == BASE or frame.parent in names or frame.parent in frames:
        return
    if frame.parent in (TOOL, WRIST):
        if tree:
            fail(f"a robot with several tips has no {frame.parent}; name a row")
        if frame.parent == WRIST and not rows:
            fail("there is no wrist, as the table has no rows")
        return
    known = [BASE, *(() if tree else (TOOL, WRIST)), *names, *(name for name in frames if name != frame.name)]
    fail(f"there is no frame {quote(frame.parent)} {expected(frame.parent, known)}")


def _refuse_two_meanings(parent: str, rows: tuple[RawRow, ...], *, tree: bool) -> None:
    """Refuse a parent that is the name of a joint and of another frame of the robot."""
    row = next((row for row in rows if row.name == parent), None)
    if row is None:
        return
    joint = f"{quote(parent)} is a joint here (line {row.line})"
    if parent == BASE:
        fail(f"{joint} as well as the root frame; rename the joint")
    if parent == WRIST and (tree or row is not rows[-1]):
        fail(f"{joint}, and elsewhere the last link of a chain; rename the joint")


def _parents_first(frames: dict[str, RawFrame]) -> tuple[RawFrame, ...]:
    done: dict[str, RawFrame] = {}
    waiting = dict(frames)
    while waiting:
        ready = [frame for frame in waiting.values() if frame.parent not in waiting]
        if not ready:
            first = next(iter(waiting.values()))
            circle = ", ".join(quote(name) for name in _circle(first.name, waiting))
            fail(f"frames {circle} form a cycle", first.line)
        for frame in ready:
            done[frame.name] = frame
            del waiting[frame.name]
    return tuple(done.values())


def _circle(name: str, frames: dict[str, RawFrame]) -> list[str]:
    """Return the frames of the circle that the parents of one frame lead into."""
    path: list[str] = []
    while name not in path:
        path.append(name)
        name = frames[name].parent
    return path[path.index(name) :]
