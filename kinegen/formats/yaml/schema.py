"""The JSON Schema of robot files, for editors that complete and check YAML while it is typed.

In: the key tables of `keys.py`, which the loader reads too. Out: a plain dictionary (draft 2020-12). The schema checks
the shape of a file; names, units and chains are checked by the loader alone.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from kinegen.formats.yaml import keys
from kinegen.robot.entries import ROW_ENTRIES
from kinegen.robot.model import Convention

Schema = dict[str, Any]

NAME_PATTERN = "^[A-Za-z](?:_?[A-Za-z0-9])*$"
"""No two underscores in a row and none at the end; reserved words are left to the loader."""


def schema() -> Schema:
    """Make the schema.

    Returns:
        A JSON Schema that `kinegen schema` prints and an editor reads.
    """
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "kinegen robot file",
        "description": "A Denavit-Hartenberg table, or elementary transforms, with units, parameters and frames.",
        **_object(_described(keys.TOP, _top_values()), tuple(keys.TOP_REQUIRED)),
        "$defs": {
            "expression": _expression(),
            "name": {"type": "string", "pattern": NAME_PATTERN, "maxLength": 40},
            "parameter": _parameter(),
            "row": _row(),
            "steps": _steps(),
            "transform": _transform(keys.TRANSFORM, ()),
            "frame": _transform(keys.FRAME, ("parent",)),
            "reading": _reading(),
            "drive": _drive(),
        },
    }


def _top_values() -> Mapping[str, Schema]:
    several: Schema = {"type": "array", "items": _ref("name"), "minItems": 1}
    return {
        "kinegen": {"const": int(keys.VERSION)},
        "name": _ref("name"),
        "description": {"type": "string", "minLength": 1, "maxLength": keys.MAX_DESCRIPTION},
        "version": {"type": "string", "pattern": keys.VERSION_PATTERN},
        "convention": _one_of(keys.TABLE_CONVENTIONS),
        "units": _units(),
        "parameters": _named("parameter", keys.MAX_PARAMETERS),
        "joints": {"type": "array", "items": _ref("row"), "maxItems": keys.MAX_ROWS},
        "base": _ref("transform"),
        "tool": _ref("transform"),
        "frames": _named("frame", keys.MAX_FRAMES),
        "actuators": _actuators(),
        "redundancy": {"anyOf": [_ref("name"), several | {"uniqueItems": True}]},
    }


def _units() -> Schema:
    values = {"length": _one_of(keys.LENGTH_UNITS), "angle": _one_of(keys.ANGLE_UNITS)}
    return _object(_described(keys.UNITS, values), tuple(keys.UNITS))


def _expression() -> Schema:
    return {
        "description": "An exact number, or an expression such as q - 90, pi/2, sqrt(2)*a2 or 0.5*elbow + 10.",
        "anyOf": [{"type": "number"}, {"type": "string", "minLength": 1, "maxLength": 500}],
    }


def _parameter() -> Schema:
    values = {
        "value": _ref("expression"),
        "runtime": {"type": "boolean"},
        "dimension": _one_of(keys.DIMENSIONS),
    }
    return {"anyOf": [_ref("expression"), _object(_described(keys.PARAMETER, values), ("value",))]}


def _row() -> Schema:
    """A row has the entries of one convention, or steps; which convention it is, only the loader can say."""
    values: dict[str, Schema] = {key: _ref("expression") for key in keys.ENTRIES}
    values |= {
        "name": _ref("name"),
        "ets": _ref("steps"),
        "parent": _ref("name"),
        "offset": _ref("expression"),
        "limits": {"type": "array", "items": _ref("expression"), "minItems": 2, "maxItems": 2},
        "type": _one_of(keys.JOINT_TYPES),
        "convention": _one_of(keys.TABLE_CONVENTIONS),
    }
    tables = [ROW_ENTRIES[convention] for convention in Convention if convention is not Convention.ETS]
    shapes = [_shape(entries) for entries in dict.fromkeys(tables)]
    return {**_object(_described(keys.ROW, values), ("name",)), "oneOf": [*shapes, _shape(("ets",), ("convention",))]}


def _shape(present: tuple[str, ...], without: tuple[str, ...] = ()) -> Schema:
    """These keys are there, and no other key that says where the row leads."""
    absent = [key for key in (*keys.ENTRIES, "ets") if key not in present] + list(without)
    return {"required": list(present), "not": {"anyOf": [{"required": [key]} for key in absent]}}


def _steps() -> Schema:
    letters = "".join(sorted({step[1] for step in keys.STEPS}))
    pattern = rf"^\s*[RT][{letters}]\s*\(.*\)\s*$"
    return {
        "type": "array",
        "items": {"type": "string", "pattern": pattern, "description": f"One of {', '.join(keys.STEPS)}, as Rz(q)."},
        "maxItems": keys.MAX_STEPS,
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
        "readings": _named("reading", keys.MAX_ROWS),
        "joints": {"type": "array", "items": _ref("drive"), "maxItems": keys.MAX_ROWS},
        "inverse": _named("expression", keys.MAX_ROWS),
    }
    return _object(_described(keys.ACTUATORS, values), ("readings", "joints"))


def _reading() -> Schema:
    pair = {"type": "array", "items": _ref("expression"), "minItems": 2, "maxItems": 2}
    values = {"dimension": _one_of(keys.DIMENSIONS), "limits": pair}
    return {"anyOf": [_one_of(keys.DIMENSIONS), _object(_described(keys.READING, values), ("dimension",))]}


def _drive() -> Schema:
    """An entry has the keys of one form, or a value; how many values its lists want, only the loader can say."""
    values: dict[str, Schema] = dict.fromkeys(keys.DRIVE, _ref("expression"))
    several: Schema = {"type": "array", "items": _ref("expression"), "minItems": 1}
    values |= {
        "joint": _ref("name"),
        "joints": {"type": "array", "items": _ref("name"), "minItems": 1},
        "form": _one_of(tuple(keys.FORMS)),
        "actuator": _ref("name"),
        "actuators": {"type": "array", "items": _ref("name"), "minItems": 1},
        "matrix": {"type": "array", "items": several, "minItems": 1},
        "offsets": several,
        "sides": several | {"minItems": 2, "maxItems": 2},
        "branch": _one_of(keys.BRANCHES),
        "sign": {"enum": [int(sign) for sign in keys.SIGNS]},
    }
    shapes = [_entry(("form", *needed), further, form) for form, (needed, further) in keys.FORMS.items()]
    return {**_object(_described(keys.DRIVE, values), ()), "oneOf": [*shapes, _entry(keys.FORMULA, (), None)]}


def _entry(needed: tuple[str, ...], further: tuple[str, ...], form: str | None) -> Schema:
    """These keys are there, and no others but the further ones."""
    allowed: dict[str, Any] = dict.fromkeys((*needed, *further), True)
    if form is not None:
        allowed["form"] = {"const": form}
    return {"properties": allowed, "required": list(needed), "additionalProperties": False}


def _named(definition: str, limit: int) -> Schema:
    return {
        "type": "object",
        "propertyNames": _ref("name"),
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
