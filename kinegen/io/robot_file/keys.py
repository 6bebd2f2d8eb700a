"""The words of the robot file: every key with its meaning and its shape, and which keys go together.

The loader and the JSON Schema (draft 2020-12, for editors that check YAML while it is typed) both read these tables, so
that neither can know a key that the other does not. The schema checks the shape of a file; names, units and chains are
checked by the loader alone.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from kinegen.model.expression_values import Dimension
from kinegen.model.robot import ROW_ENTRIES, Convention, JointType
from kinegen.support.naming import FORMAT_WORDS

VERSION = "1"
MAX_ROWS = 256
MAX_PARAMETERS = 200
MAX_FRAMES = 200
MAX_LINKS = 5000
MAX_STEPS = 64
MAX_DESCRIPTION = 500

VERSION_PATTERN = r"^(0|[1-9][0-9]{0,5})(\.(0|[1-9][0-9]{0,5})){2}$"
"""Three numbers, which CMake and every registry take."""

LENGTH_UNITS = ("m", "cm", "mm", "in")
ANGLE_UNITS = ("deg", "rad")
BOOLEANS = ("true", "false")
DIMENSIONS = tuple(str(dimension) for dimension in Dimension)
JOINT_TYPES = tuple(str(kind) for kind in JointType)
TABLE_CONVENTIONS = tuple(str(convention) for convention in Convention if convention is not Convention.ETS)

TOP = {
    "kinegen": "Version of this format; always 1.",
    "name": "Name of the robot: a C identifier that prefixes everything public.",
    "description": "One line about the robot; it is repeated in headers and docstrings.",
    "version": "Version of the robot in packages, such as 1.2.0; by default one made from the digest of the model.",
    "convention": "How a row of the table becomes a transform; never guessed.",
    "units": "Length and angle units of this file; never guessed.",
    "parameters": "Named constants that the entries below may use.",
    "joints": "The table, one row for each joint, from the base to the end effector.",
    "base": "Fixed transform from the root frame to the frame before the first row.",
    "tool": "Fixed transform from the last row to the tool frame.",
    "frames": "Additional named frames, each fixed to another one.",
    "actuators": "The actuator coordinates, and how the joints follow from them.",
    "redundancy": "Input of the inverse in addition to the pose: a joint, a list of joints, or arm_angle.",
    "links": "Names of links in the source file, each with the frame that it moves with.",
}
TOP_REQUIRED = {
    "kinegen": "kinegen: 1",
    "name": "name: my_arm",
    "convention": "convention: standard",
    "units": "units: {length: m, angle: deg}",
    "joints": "joints: [{name: waist, ...}]",
}
"""Each required key with an example to show when it is missing."""

UNITS = {
    "length": "Unit of a, d, translations and prismatic joints.",
    "angle": "Unit of theta, alpha, beta, rotations and revolute limits.",
}

PARAMETER = {
    "value": "An exact number or expression; it may use the parameters above.",
    "runtime": "Whether the value stays an argument of the kernels.",
    "dimension": "Its dimension; needed only if its use does not determine it.",
}

ENTRIES = {
    "a": "Link length, along x.",
    "alpha": "Twist, about x.",
    "d": "Offset, along z; q goes here for a prismatic joint.",
    "theta": "Angle, about z; q goes here for a revolute joint.",
    "beta": "Second twist, about y, of nearly parallel axes (hayati rows only).",
}
ROW_COMMON = {
    "name": "Name of the joint and of the frame that the row reaches.",
    "ets": "Elementary transforms in order, such as [Rz(q), Tx(l1), Ry(-90)], instead of a table row.",
    "parent": "Name of an earlier row, or base; without it the row follows the one above.",
    "offset": "Constant that is added to q: theta or d becomes q + offset.",
    "limits": "Lower and upper bound of the joint's own variable q, without the offset.",
    "type": "Optional; checked against the type of the row.",
    "convention": "Convention of this row, where it differs from the file's.",
}
ROW = ENTRIES | ROW_COMMON

TRANSFORM = {
    "xyz": "Translation along x, y and z.",
    "rpy": "Roll, pitch and yaw about the fixed axes x, y and z, turned in this order.",
    "ets": "Elementary transforms in order, instead of xyz and rpy.",
}
FRAME = (
    {"parent": "A row, base, tool, wrist or another frame."}
    | TRANSFORM
    | {"tip": "Whether the frame is a tip of a tree; the row that it is on is then not one itself."}
)

ACTUATORS = {
    "readings": "The actuator coordinates, in the order of the actuator vector: angle, length or number.",
    "joints": "How each joint variable follows, in order; the later ones may use the earlier joints.",
    "inverse": "Readings as expressions of the joints, where only free expressions use them.",
}
READING = {
    "dimension": "What it measures; an angle is in the unit of the file, a number has none.",
    "limits": "Lower and upper bound of the reading.",
}

FORMS: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "gear": (("joint", "actuator", "ratio"), ("sign", "offset")),
    "coupling": (("joints", "actuators", "matrix"), ("offsets",)),
    "linear_actuator": (("joint", "actuator", "sides"), ("length", "sign", "offset")),
    "four_bar": (
        ("joint", "actuator", "ground", "crank", "coupler", "rocker"),
        ("angle", "branch", "sign", "offset"),
    ),
}
"""The keys that each form must have, and those that it may have."""

FORMULA = ("joint", "value")
"""The keys of an entry without a form."""

BRANCHES = ("open", "crossed")
SIGNS = ("1", "-1")
BARS = ("ground", "crank", "coupler", "rocker")

DRIVE = {
    "joint": "The joint that the entry drives.",
    "joints": "The joints that a coupling drives.",
    "form": "A named form: joint = sign*(value of the form) + offset.",
    "value": "The joint as a free expression of readings, earlier joints and parameters.",
    "actuator": "The actuator whose reading is the input of the form.",
    "actuators": "The readings of a coupling, one for each column of its matrix.",
    "ratio": "How far the actuator moves for one unit of the joint, such as 100 turns for one turn.",
    "matrix": "One row for each joint: joints = matrix*readings + offsets.",
    "offsets": "One value for each joint of a coupling; it may use earlier joints.",
    "sides": "The two fixed sides of the triangle that a linear actuator closes.",
    "length": "Length of a linear actuator, linear in its reading; the reading itself if left out.",
    "ground": "Distance between the pivots of crank and rocker.",
    "crank": "Length of the bar that the motor turns.",
    "coupler": "Length of the bar between crank and rocker.",
    "rocker": "Length of the bar that turns with the joint.",
    "angle": "Angle of the crank from the ground line, linear in its reading; the reading itself if left out.",
    "branch": "Assembly with the crank between 0 and 180 degrees: open, as in a parallelogram, or crossed.",
    "sign": "1, or -1 where the joint moves in the other direction.",
    "offset": "Added to the joint; it may use earlier joints, as in 90 - shoulder.",
}

STEPS = ("Rx", "Ry", "Rz", "Tx", "Ty", "Tz")


Schema = dict[str, Any]

NAME_PATTERN = "^[A-Za-z](?:_?[A-Za-z0-9])*$"
"""No two underscores in a row and none at the end; words of languages are left to the loader."""

_TEXT: Schema = {"type": ["string", "number", "boolean"], "minLength": 1}
"""A line of text, which the loader takes as it is written: 3 and true are text as well."""


def schema() -> Schema:
    """Make the JSON Schema that `kinegen schema` prints and an editor reads."""
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "kinegen robot file",
        "description": "A Denavit-Hartenberg table, or elementary transforms, with units, parameters and frames.",
        **_object(_described(TOP, _top_values()), tuple(TOP_REQUIRED)),
        "$defs": {
            "expression": _expression(),
            "name": {"type": "string", "pattern": NAME_PATTERN, "maxLength": 40},
            "parameter": _parameter(),
            "row": _row(),
            "steps": _steps(),
            "transform": _transform(TRANSFORM, ()),
            "frame": _transform(FRAME, ("parent",)),
            "reading": _reading(),
            "drive": _drive(),
        },
    }


def _top_values() -> Mapping[str, Schema]:
    several: Schema = {"type": "array", "items": _ref("name"), "minItems": 1}
    return {
        "kinegen": {"const": int(VERSION)},
        "name": _new_name(),
        "description": _TEXT | {"maxLength": MAX_DESCRIPTION},
        "version": {"type": "string", "pattern": VERSION_PATTERN},
        "convention": _one_of(TABLE_CONVENTIONS),
        "units": _units(),
        "parameters": _named("parameter", MAX_PARAMETERS),
        "joints": {"type": "array", "items": _ref("row"), "maxItems": MAX_ROWS},
        "base": _ref("transform"),
        "tool": _ref("transform"),
        "frames": _named("frame", MAX_FRAMES),
        "actuators": _actuators(),
        "redundancy": {"anyOf": [_ref("name"), several | {"uniqueItems": True}]},
        "links": {
            "type": "object",
            "maxProperties": MAX_LINKS,
            "additionalProperties": _TEXT,
        },
    }


def _new_name(*allowed: str) -> Schema:
    """Return the name of something that the file defines, which may not be a word of the file itself."""
    return _ref("name") | {"not": {"enum": sorted(FORMAT_WORDS.difference(allowed))}}


def _units() -> Schema:
    values = {"length": _one_of(LENGTH_UNITS), "angle": _one_of(ANGLE_UNITS)}
    return _object(_described(UNITS, values), tuple(UNITS))


def _expression() -> Schema:
    return {
        "description": "An exact number, or an expression such as q - 90, pi/2, sqrt(2)*a2 or 0.5*elbow + 10.",
        "anyOf": [{"type": "number"}, {"type": "string", "minLength": 1, "maxLength": 500}],
    }


def _parameter() -> Schema:
    values = {
        "value": _ref("expression"),
        "runtime": {"type": "boolean"},
        "dimension": _one_of(DIMENSIONS),
    }
    return {"anyOf": [_ref("expression"), _object(_described(PARAMETER, values), ("value",))]}


def _row() -> Schema:
    """Describe a row: the entries of one convention, or steps; which convention it is, only the loader can say."""
    values: dict[str, Schema] = {key: _ref("expression") for key in ENTRIES}
    values |= {
        "name": _new_name("base"),
        "ets": _ref("steps"),
        "parent": _ref("name"),
        "offset": _ref("expression"),
        "limits": {"type": "array", "items": _ref("expression"), "minItems": 2, "maxItems": 2},
        "type": _one_of(JOINT_TYPES),
        "convention": _one_of(TABLE_CONVENTIONS),
    }
    tables = [ROW_ENTRIES[convention] for convention in Convention if convention is not Convention.ETS]
    shapes = [_shape(entries) for entries in dict.fromkeys(tables)]
    return {**_object(_described(ROW, values), ("name",)), "oneOf": [*shapes, _shape(("ets",), ("convention",))]}


def _shape(present: tuple[str, ...], without: tuple[str, ...] = ()) -> Schema:
    """Require some keys, and no other key that says where the row leads."""
    absent = [key for key in (*ENTRIES, "ets") if key not in present] + list(without)
    return {"required": list(present), "not": {"anyOf": [{"required": [key]} for key in absent]}}


def _steps() -> Schema:
    letters = "".join(sorted({step[1] for step in STEPS}))
    pattern = rf"^\s*[RT][{letters}]\s*\(.*\)\s*$"
    return {
        "type": "array",
        "items": {"type": "string", "pattern": pattern, "description": f"One of {', '.join(STEPS)}, as Rz(q)."},
        "maxItems": MAX_STEPS,
    }


def _transform(meanings: Mapping[str, str], required: tuple[str, ...]) -> Schema:
    triple = {"type": "array", "items": _ref("expression"), "minItems": 3, "maxItems": 3}
    values = {"xyz": triple, "rpy": triple, "ets": _ref("steps")}
    if "parent" in meanings:
        values["parent"] = _ref("name")
    if "tip" in meanings:
        values["tip"] = {"type": "boolean"}
    other = [{"required": ["xyz"]}, {"required": ["rpy"]}]
    excluded = {"if": {"required": ["ets"]}, "then": {"not": {"anyOf": other}}}
    return {**_object(_described(meanings, values), required), **excluded}


def _actuators() -> Schema:
    values = {
        "readings": _named("reading", MAX_ROWS),
        "joints": {"type": "array", "items": _ref("drive"), "maxItems": MAX_ROWS},
        "inverse": _named("expression", MAX_ROWS),
    }
    return _object(_described(ACTUATORS, values), ("readings", "joints"))


def _reading() -> Schema:
    pair = {"type": "array", "items": _ref("expression"), "minItems": 2, "maxItems": 2}
    values = {"dimension": _one_of(DIMENSIONS), "limits": pair}
    return {"anyOf": [_one_of(DIMENSIONS), _object(_described(READING, values), ("dimension",))]}


def _drive() -> Schema:
    """Describe a drive: the keys of one form, or a value; how many values its lists want, only the loader can say."""
    values: dict[str, Schema] = dict.fromkeys(DRIVE, _ref("expression"))
    several: Schema = {"type": "array", "items": _ref("expression"), "minItems": 1}
    values |= {
        "joint": _ref("name"),
        "joints": {"type": "array", "items": _ref("name"), "minItems": 1},
        "form": _one_of(tuple(FORMS)),
        "actuator": _ref("name"),
        "actuators": {"type": "array", "items": _ref("name"), "minItems": 1},
        "matrix": {"type": "array", "items": several, "minItems": 1},
        "offsets": several,
        "sides": several | {"minItems": 2, "maxItems": 2},
        "branch": _one_of(BRANCHES),
        "sign": {"enum": [int(sign) for sign in SIGNS]},
    }
    shapes = [_entry(("form", *needed), further, form) for form, (needed, further) in FORMS.items()]
    return {**_object(_described(DRIVE, values), ()), "oneOf": [*shapes, _entry(FORMULA, (), None)]}


def _entry(needed: tuple[str, ...], further: tuple[str, ...], form: str | None) -> Schema:
    """Require some keys, and no others but the further ones."""
    allowed: dict[str, Any] = dict.fromkeys((*needed, *further), True)
    if form is not None:
        allowed["form"] = {"const": form}
    return {"properties": allowed, "required": list(needed), "additionalProperties": False}


def _named(definition: str, limit: int) -> Schema:
    return {
        "type": "object",
        "propertyNames": _new_name(),
        "additionalProperties": _ref(definition),
        "maxProperties": limit,
    }


def _described(meanings: Mapping[str, str], values: Mapping[str, Schema]) -> dict[str, Schema]:
    """Pair every key of a table with its values; a key without values is a mistake here and raises."""
    return {key: {"description": meaning, **values[key]} for key, meaning in meanings.items()}


def _object(properties: Mapping[str, Schema], required: tuple[str, ...]) -> Schema:
    found: Schema = {"type": "object", "properties": properties, "additionalProperties": False}
    return found | ({"required": list(required)} if required else {})


def _one_of(words: tuple[str, ...]) -> Schema:
    return {"enum": list(words)}


def _ref(definition: str) -> Schema:
    return {"$ref": f"#/$defs/{definition}"}
