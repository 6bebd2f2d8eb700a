"""Changes of a robot -> the text of its file with the same changes, every other byte kept.

In: the text, and a `Candidate`. Out: the new text, which is read again and compared with what was evaluated; a change
that the text does not take is reported, never written wrongly.
"""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np

from kinegen.doctor.edits import Edit, EditKind
from kinegen.doctor.phrases import mirrored, mirrored_constant, negated, turned
from kinegen.doctor.readings import numbers_of
from kinegen.doctor.settings import METRES, Change, Mount, Setting
from kinegen.doctor.table import FloatArray, Table, TableRow
from kinegen.formats.yaml.document import CannotRewriteError, Document
from kinegen.robot.model import Convention

_STEP = re.compile(r"([RT][xyz])\s*\((.*)\)\s*\Z", re.DOTALL)
_NAMES = {"base": "base", "tail": "tool"}


def with_unit(text: str, key: str, unit: str) -> str:
    """The text with another unit of its angles or lengths."""
    return Document(text).with_text(unit, "units", key).text


def rewrite(
    text: str, table: Table, changes: tuple[Change, ...], edits: tuple[Edit, ...], setting: Setting
) -> Document:
    """Make changes in the text of a file.

    Args:
        text: The file.
        table: Its rows.
        changes: Changes of the whole.
        edits: Changes of entries.
        setting: What the changes of the whole lead to.

    Raises:
        CannotRewriteError: If a change is more than replacing entries.
    """
    document = Document(text)
    for change in changes:
        for field, value in change.fields:
            document = _whole(document, field, value)
    rows = {row.number: row for row in table.rows}
    for edit in edits:
        document = _entry(document, table, rows, edit, setting.table_angle)
    return document


def _whole(document: Document, field: str, value: object) -> Document:
    match field:
        case "convention":
            return document.with_text(str(value), "convention")
        case "table_angle" | "table_length":
            return document.with_text(str(value), "units", field.removeprefix("table_"))
        case "base" | "tail" if value is Mount.DROPPED:
            return document.without(_NAMES[field])
        case "base" | "tail" if value is Mount.REVERSED:
            return document.with_mapping(_NAMES[field], _reversed(document, _NAMES[field]))
    return document  # only the poses are read in another way


def _reversed(document: Document, key: str) -> str:
    """The inverse of a transform, as elementary steps."""
    if (steps := document.node(key, "ets")) is not None:
        parts = [_STEP.match(str(step.value)) for step in steps.value]
        found = [(part[1], part[2]) for part in parts if part is not None]
    else:
        kinds = {"xyz": ("Tx", "Ty", "Tz"), "rpy": ("Rx", "Ry", "Rz")}
        found = []
        for name, names in kinds.items():
            node = document.node(key, name)
            values = [] if node is None else [str(entry.value) for entry in node.value]
            pairs = list(zip(names, values, strict=False))
            found += pairs if name == "xyz" else pairs[::-1]
    texts = [f"{kind}({negated(value)})" for kind, value in reversed(found) if value.strip() != "0"]
    return f"{{ets: [{', '.join(chr(34) + text + chr(34) if ',' in text else text for text in texts)}]}}"


def _entry(document: Document, table: Table, rows: dict[int, TableRow], edit: Edit, unit: str) -> Document:
    if edit.kind is EditKind.SHIFT:
        return _shifted(document, edit)
    row, at = rows[edit.rows[0]], edit.rows[0] - 1
    names = ("q", *(variable.name for variable in table.robot.variables))
    if edit.kind is EditKind.MOTION_SIGN:
        return _other_way(document, table, row, names)
    key = edit.entries[0]
    moves = bool(table.coefficients[row.slots[key]].any())
    if moves and document.node("joints", at, "offset") is not None:
        key, moves = "offset", False
    if edit.kind is EditKind.QUARTER:
        return _changed(document, row, key, lambda text: turned(text, edit.amount, unit))
    return _changed(document, row, key, lambda text: mirrored_constant(text, names) if moves else negated(text))


def _changed(document: Document, row: TableRow, key: str, change: Callable[[str], str]) -> Document:
    """One entry of a row, or what is between the brackets of a step, after a function."""
    at = row.number - 1
    if row.convention is not Convention.ETS or key == "offset":
        return document.with_scalar(change, "joints", at, key)
    place = list(row.slots).index(key)
    match = _STEP.match(document.words("joints", at, "ets", place))
    if match is None:
        raise CannotRewriteError(f"{row.label} has no step {place + 1}")
    return document.with_text(f"{match[1]}({change(match[2])})", "joints", at, "ets", place)


def _other_way(document: Document, table: Table, row: TableRow, names: tuple[str, ...]) -> Document:
    """The sign of the variable in every entry that it moves; an offset is written out, as only q alone has one."""
    at = row.number - 1
    offset = document.node("joints", at, "offset")
    added = ""
    if offset is not None:
        added = _as_summand(str(offset.value).strip())
        document = document.without_pair("offset", "joints", at)
    for key, place in row.slots.items():
        if not table.coefficients[place].any():
            continue
        document = _changed(document, row, key, lambda text: mirrored(text, names))
        if added:
            document = _changed(document, row, key, lambda text: f"{text}{added}")
    return document


def _as_summand(text: str) -> str:
    """What is added to an expression."""
    if plain := re.fullmatch(r"-\s*([\w.]+(?:[*/][\w.]+)*)", text):
        return f" - {plain[1]}"
    return f" + {text}" if re.fullmatch(r"[\w.*/]+", text) else f" + ({text})"


def _shifted(document: Document, edit: Edit) -> Document:
    places = [number - 1 for number in edit.rows]
    for column in edit.entries:
        texts = [document.words("joints", at, column) for at in places]
        for index, at in enumerate(places):
            new = texts[(index - edit.amount) % len(texts)]
            document = document.with_text(new, "joints", at, column)
    return document


def with_mount(document: Document, field: str, matrix: FloatArray, setting: Setting, step: float) -> Document:
    """The document with a base or tool that was solved for.

    Args:
        document: The file.
        field: `base` or `tail`.
        matrix: The transform, shape (4, 4), in the length unit of the poses.
        setting: Decides the units.
        step: What a length is rounded to, in the unit of the poses.
    """
    factor = METRES[setting.pose_length] / METRES[setting.table_length]
    angles = numbers_of("rpy", matrix[None, :3, :3])[0]
    if setting.table_angle == "deg":
        angles = np.degrees(angles)
    lengths = [_short(value * factor, step * factor) for value in matrix[:3, 3]]
    turns = [_short(value, 1e-3 if setting.table_angle == "deg" else 1e-5) for value in angles]
    return document.with_mapping(_NAMES[field], f"{{xyz: [{', '.join(lengths)}], rpy: [{', '.join(turns)}]}}")


def _short(value: float, step: float) -> str:
    """A number rounded to a decimal of about this size, without trailing zeros."""
    decimals = max(0, int(np.ceil(-np.log10(step))))
    text = f"{value:.{decimals}f}"
    text = text.rstrip("0").rstrip(".") if "." in text else text
    return "0" if text in ("-0", "") else text
