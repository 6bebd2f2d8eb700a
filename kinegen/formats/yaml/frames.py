"""`base`, `tool` and `frames` -> raw frames: fixed transforms, with every parent known and no circle."""

from __future__ import annotations

from kinegen.errors import quote
from kinegen.formats.messages import accept_name, expected, fail, within
from kinegen.formats.yaml import keys
from kinegen.formats.yaml.nodes import choice, items, mapping, named, word
from kinegen.formats.yaml.slots import RawFrame, RawRow, RawStep, read_slot, read_steps
from kinegen.formats.yaml.tree import Node
from kinegen.robot.dimension import Dimension
from kinegen.robot.expressions import ZERO, Expression
from kinegen.robot.model import BASE, TOOL, WRIST, StepKind

_ENTRIES = "entries such as {xyz: [0, 0, 0.1], rpy: [0, 0, 90]}"


def read_fixed(node: Node | None, name: str) -> RawFrame:
    """Read `base` or `tool`; without it nothing lies between the two frames.

    Args:
        node: The value, if the file has one.
        name: `BASE` or `TOOL`.
    """
    if node is None:
        return RawFrame(name, name, "", (), 0)
    with within(name, node.line):
        fields = mapping(node, keys.TRANSFORM, _ENTRIES)
        return RawFrame(name, name, "", _transform(fields), node.line)


def read_frames(node: Node | None, rows: tuple[RawRow, ...], *, tree: bool) -> tuple[RawFrame, ...]:
    """Read the named frames.

    Args:
        node: The value of `frames`, if the file has one.
        rows: The table, whose names are frames too.
        tree: Whether the robot has more than one tip, so that tool and wrist mean nothing.

    Returns:
        The frames, a parent before its children, otherwise in the order of the file.
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
            line, tip = fields["parent"].line, _is_tip(key.text, fields.get("tip"), tree=tree)
            frames[key.text] = RawFrame(f"frame '{key.text}'", key.text, parent, _transform(fields), line, tip)
    for frame in frames.values():
        with within(frame.where, frame.line):
            _check_parent(frame, rows, frames, tree=tree)
    ordered = _parents_first(frames)
    _check_tips(ordered)
    return ordered


def _is_tip(name: str, node: Node | None, *, tree: bool) -> bool:
    """Whether a frame is marked as a tip, which means something in a tree alone."""
    if node is None:
        return False
    with within("tip", node.line):
        is_tip = choice(node, "value", keys.BOOLEANS) == "true"
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
        if row.name.upper() == name.upper():
            fail(f"differs from joint '{row.name}' in upper and lower case only, which macros lose")
    for frame in frames.values():
        if frame.name.upper() == name.upper():
            fail(f"differs from frame '{frame.name}' in upper and lower case only, which macros lose")


def _transform(fields: dict[str, Node]) -> tuple[RawStep, ...]:
    """From the parent to the frame: `T(xyz) Rz(yaw) Ry(pitch) Rx(roll)`, or the steps as written."""
    if "ets" in fields:
        for key in ("xyz", "rpy"):
            if key in fields:
                fail(f"{key} and ets exclude each other", fields[key].line)
        return read_steps(fields["ets"], moving=False)
    shift = _triple(fields.get("xyz"), "xyz", Dimension.LENGTH)
    roll, pitch, yaw = _triple(fields.get("rpy"), "rpy", Dimension.ANGLE) or (None, None, None)
    return tuple(step for step in (*shift, yaw, pitch, roll) if step is not None and step.slot.expression != ZERO)


def _triple(node: Node | None, key: str, dimension: Dimension) -> tuple[RawStep, ...]:
    """Three steps, about or along x, y and z."""
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
    """The frames of the circle that the parents of one frame lead into."""
    path: list[str] = []
    while name not in path:
        path.append(name)
        name = frames[name].parent
    return path[path.index(name) :]
