"""`actuators` -> raw readings and drives: every key known, every expression read, no name looked up yet."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NoReturn

from kinegen.errors import quote
from kinegen.io.messages import accept_name, fail, refuse_twin, within
from kinegen.io.robot_file import keys
from kinegen.io.robot_file.expression_fields import ExpressionField, read_slot
from kinegen.io.robot_file.tree import Mapping as MappingNode
from kinegen.io.robot_file.tree import Node, Scalar, choice, items, mapping, named, word
from kinegen.model.expression_parser import ACTUATOR_FUNCTIONS, FUNCTIONS
from kinegen.model.expression_values import Dimension
from kinegen.support.dataclass import dataclass

_LENGTHS = frozenset({"sides", "length", *keys.BARS})


@dataclass(frozen=True, slots=True)
class RawReading:
    """A reading as written."""

    name: str
    dimension: Dimension
    limits: tuple[ExpressionField, ExpressionField] | None
    line: int

    @property
    def where(self) -> str:
        """Return how messages name it."""
        return f"actuators: actuator '{self.name}'"


@dataclass(frozen=True, slots=True)
class RawDrive:
    """One entry of `joints` as written.

    Attributes:
        form: One of `keys.FORMS`; empty for a free expression.
        actuators: The readings that its form names.
        slots: Its expressions by key; those of a matrix row by row.
    """

    form: str
    joints: tuple[str, ...]
    actuators: tuple[str, ...]
    slots: Mapping[str, tuple[ExpressionField, ...]]
    crossed: bool
    sign: int
    line: int

    @property
    def where(self) -> str:
        """Return how messages name it."""
        plural = "s" if len(self.joints) > 1 else ""
        return f"actuators: joint{plural} {', '.join(quote(name) for name in self.joints)}"

    def slot(self, key: str) -> ExpressionField | None:
        """Return the one expression of a key, if the entry has it."""
        return self.slots[key][0] if key in self.slots else None


@dataclass(frozen=True, slots=True)
class RawActuators:
    """`actuators` as written."""

    readings: tuple[RawReading, ...]
    drives: tuple[RawDrive, ...]
    inverse: tuple[tuple[str, ExpressionField], ...]
    line: int


def read_actuators(node: Node) -> RawActuators:
    """Read `actuators`."""
    with within("actuators", node.line):
        fields = mapping(node, keys.ACTUATORS, "entries readings and joints")
        for key, example in (("readings", "{m1: angle, ...}"), ("joints", "[{joint: waist, ...}, ...]")):
            if key not in fields:
                fail(f"key '{key}' is missing (as in {key}: {example})")
        readings = _readings(fields["readings"])
        with within("joints", fields["joints"].line):
            parts = items(fields["joints"], "a list such as - {joint: waist, form: gear, actuator: m1, ratio: 100}")
            if len(parts) > keys.MAX_ROWS:
                fail(f"{len(parts)} entries are too many (at most {keys.MAX_ROWS})")
        drives = tuple(_drive(part, number) for number, part in enumerate(parts, start=1))
        return RawActuators(readings, drives, _inverse(fields.get("inverse")), node.line)


def _readings(node: Node) -> tuple[RawReading, ...]:
    with within("readings", node.line):
        entries = named(node, "entries such as m1: angle", keys.MAX_ROWS)
    read: dict[str, RawReading] = {}
    for key, value in entries:
        accept_name("actuator", key.text, key.line)
        with within(f"actuator {quote(key.text)}", key.line):
            if key.text in ACTUATOR_FUNCTIONS:
                fail("this is a function; choose another name")
            refuse_twin(key.text, "actuator", read)
            read[key.text] = _reading(key.text, value, key.line)
    return tuple(read.values())


def _reading(name: str, node: Node, line: int) -> RawReading:
    if isinstance(node, Scalar):
        return RawReading(name, Dimension(choice(node, "dimension", keys.DIMENSIONS)), None, line)
    fields = mapping(node, keys.READING, "angle, length, number or an entry such as {dimension: angle}")
    if "dimension" not in fields:
        fail(f"key 'dimension' is missing ({', '.join(keys.DIMENSIONS)})")
    dimension = Dimension(choice(fields["dimension"], "dimension", keys.DIMENSIONS))
    limits = None
    if "limits" in fields:
        with within("limits", fields["limits"].line):
            lower, upper = items(fields["limits"], "two values, [lower, upper]", 2)
        limits = read_slot(lower, "limits", dimension), read_slot(upper, "limits", dimension)
    return RawReading(name, dimension, limits, line)


def _drive(node: Node, number: int) -> RawDrive:
    with within(_where(node, number), node.line):
        fields = mapping(node, _keys(node), "an entry such as {joint: waist, form: gear, actuator: m1, ratio: 100}")
        form = _form(fields)
        needed, further = keys.FORMS[form] if form else (keys.FORMULA, ())
        for key in fields:
            if key not in (*needed, *further, "form"):
                _refuse_key(form, key, needed + further, fields[key].line)
        for key in needed:
            if key not in fields:
                fail(f"key '{key}' is missing ({_kind(form)} needs {', '.join(needed)})")
        joints = _names(fields, "joint")
        actuators = _names(fields, "actuator") if form else ()
        branch = choice(fields["branch"], "branch", keys.BRANCHES) if "branch" in fields else "open"
        sign = choice(fields["sign"], "sign", keys.SIGNS) if "sign" in fields else "1"
        slots = _slots(fields, len(joints), len(actuators))
        return RawDrive(form, joints, actuators, slots, branch == "crossed", int(sign), node.line)


def _where(node: Node, number: int) -> str:
    """Return `joint 'elbow'`, or `entry 3` as long as it has no joint that can be shown."""
    if isinstance(node, MappingNode):
        for key, value in node.entries:
            if key.text == "joint" and isinstance(value, Scalar) and value.text:
                return f"joint {quote(value.text)}"
    return f"entry {number}"


def _keys(node: Node) -> tuple[str, ...]:
    """Return the keys to accept and to name: those of another form get a message of their own, in `_refuse_key`."""
    entries = node.entries if isinstance(node, MappingNode) else ()
    forms = [value.text for key, value in entries if key.text == "form" and isinstance(value, Scalar)]
    if not forms or forms[0] not in keys.FORMS:
        return tuple(keys.DRIVE)
    needed, further = keys.FORMS[forms[0]]
    own = (*needed, *further, "form")
    return own + tuple(key.text for key, _ in entries if key.text in keys.DRIVE and key.text not in own)


def _form(fields: Mapping[str, Node]) -> str:
    if "form" not in fields:
        if "value" not in fields:
            fail(f"key 'form' is missing ({', '.join(keys.FORMS)}; or value for a free expression)")
        return ""
    if "value" in fields:
        fail("form and value exclude each other", fields["value"].line)
    return choice(fields["form"], "form", keys.FORMS)


def _refuse_key(form: str, key: str, known: tuple[str, ...], line: int) -> NoReturn:
    hint = f"it takes {', '.join(known)}" if form else "it takes joint, value"
    fail(f"{_kind(form)} has no {key} ({hint})", line)


def _kind(form: str) -> str:
    return f"a {form}" if form else "a free expression"


def _names(fields: Mapping[str, Node], key: str) -> tuple[str, ...]:
    """Return the names under `joint` or `joints`, `actuator` or `actuators`."""
    if key in fields:
        return (word(fields[key], f"the name of one {key}"),)
    many = f"{key}s"
    with within(many, fields[many].line):
        parts = items(fields[many], f"a list of {many} such as [a, b]")
        found = tuple(word(part, f"the name of one {key}") for part in parts)
        if not found:
            fail("the list is empty")
        for name in found:
            if found.count(name) > 1:
                fail(f"{quote(name)} occurs twice")
    return found


def _slots(fields: Mapping[str, Node], rows: int, columns: int) -> dict[str, tuple[ExpressionField, ...]]:
    """Return the expressions of an entry; offset and value get their dimension when the joint's type is known."""
    found: dict[str, tuple[ExpressionField, ...]] = {}
    for key in ("ratio", "length", "angle", "offset", "value", *keys.BARS):
        if key in fields:
            found[key] = (_slot(fields[key], key),)
    if "sides" in fields:
        found["sides"] = _list(fields["sides"], "sides", "two lengths, such as [0.3, 0.5]", 2)
    if "matrix" in fields:
        with within("matrix", fields["matrix"].line):
            wanted = f"{rows} row{'s' if rows > 1 else ''}, one for each joint"
            lines = items(fields["matrix"], wanted, rows)
        wanted = f"a row of {columns} value{'s' if columns > 1 else ''}, one for each actuator"
        found["matrix"] = tuple(slot for line in lines for slot in _list(line, "matrix", wanted, columns))
    if "offsets" in fields:
        wanted = f"{rows} value{'s' if rows > 1 else ''}, one for each joint"
        found["offsets"] = _list(fields["offsets"], "offsets", wanted, rows)
    return found


def _list(node: Node, key: str, wanted: str, count: int) -> tuple[ExpressionField, ...]:
    with within(key, node.line):
        parts = items(node, wanted, count)
    return tuple(_slot(part, key) for part in parts)


def _slot(node: Node, key: str) -> ExpressionField:
    dimension = Dimension.LENGTH if key in _LENGTHS else Dimension.ANGLE if key == "angle" else Dimension.NUMBER
    free = key in ("offset", "offsets", "value")
    return read_slot(node, key, dimension, functions=ACTUATOR_FUNCTIONS if free else FUNCTIONS)


def _inverse(node: Node | None) -> tuple[tuple[str, ExpressionField], ...]:
    if node is None:
        return ()
    with within("inverse", node.line):
        entries = named(node, "entries such as m1: 100*waist", keys.MAX_ROWS)
        return tuple((key.text, _reading_of_joints(key.text, value)) for key, value in entries)


def _reading_of_joints(name: str, node: Node) -> ExpressionField:
    """Read an expression, whose dimension is known with the name."""
    return read_slot(node, name, Dimension.NUMBER, functions=ACTUATOR_FUNCTIONS)
