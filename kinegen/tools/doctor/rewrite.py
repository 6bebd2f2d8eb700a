"""Makes changes of a robot in the text of its file, every other byte kept, as a person would write them.

The new text is read again and compared with what was evaluated; a change that the text does not take is reported, never
written wrongly.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from fractions import Fraction
from functools import partial

import numpy as np

from kinegen.io.robot_file.document import CannotRewriteError, Document
from kinegen.model.expression_values import METRES
from kinegen.model.robot import Convention
from kinegen.tools.doctor.edits import Edit, EditKind
from kinegen.tools.doctor.numeric_table import Change, Mount, Setting, Table, TableRow
from kinegen.tools.doctor.observed_poses import FloatArray, numbers_of

_NUMBER = r"\d+(?:\.\d+)?"
_PI = r"(?:\d+\*)?pi(?:/\d+)?"


def negated(text: str) -> str:
    """Return the opposite of a constant."""
    bare = text.strip()
    inner = bare.removeprefix("-").strip()
    if re.fullmatch(rf"{_NUMBER}(?:[eE][+-]?\d+)?|\w+|[\w.*/]+", inner):
        return inner if bare.startswith("-") else f"-{inner}"
    if match := re.fullmatch(r"-\s*\(([^()]*)\)", bare):
        return match[1]
    return f"-({bare})"


def mirrored(text: str, names: tuple[str, ...]) -> str:
    """Return the same expression of a joint variable that runs the other way."""
    name = "|".join(map(re.escape, names))
    moving = rf"(?:[\w./]+\*)?(?:{name})"
    if match := re.fullmatch(rf"\s*(-?)\s*({moving})(\s*[+-].*)?\s*", text):
        return f"{'' if match[1] else '-'}{match[2]}{match[3] or ''}"
    if match := re.fullmatch(rf"(.*\S)\s*([+-])\s*({moving})\s*", text):
        return f"{match[1]} {'-' if match[2] == '+' else '+'} {match[3]}"
    return re.sub(rf"\b({name})\b", r"(-\1)", text)


def mirrored_constant(text: str, names: tuple[str, ...]) -> str:
    """Return the same expression with the opposite constant."""
    name = "|".join(map(re.escape, names))
    if match := re.fullmatch(rf"(\s*-?\s*(?:[\w./]+\*)?(?:{name}))\s*([+-])\s*([\w./*]+|\w+\([^()]*\))\s*", text):
        return f"{match[1]} {'-' if match[2] == '+' else '+'} {match[3]}"
    inner = re.sub(rf"\b({name})\b", r"(-\1)", text)
    return f"-({inner})"


def with_constant(text: str, constant: str, names: tuple[str, ...], change: str = "") -> str:
    """Return an expression of a joint variable with another constant, or where that is not simple `change` added."""
    name = "|".join(map(re.escape, names))
    moving = rf"(-?\s*(?:[\w./]+\*)?(?:{name}))"
    added = _summand(constant)
    if match := re.fullmatch(rf"\s*{moving}(?:\s*[+-]\s*(?:[\w./*]+|\w+\([^()]*\)))?\s*", text):
        return f"{match[1]}{added}"
    if match := re.fullmatch(rf"\s*-?\s*(?:[\w./*]+|\w+\([^()]*\))\s*([+-])\s*{moving}\s*", text):
        return f"{'-' * (match[1] == '-')}{match[2]}{added}"
    return f"{text}{_summand(change)}"


def _summand(number: str) -> str:
    if number in ("0", ""):
        return ""
    return f" - {number[1:]}" if number.startswith("-") else f" + {number}"


def turned(text: str, quarters: int, unit: str) -> str:
    """Return an angle in `deg` or `rad` and -1, 1 or 2 quarter turns more."""
    bare = text.strip()
    written = _NUMBER if unit == "deg" else rf"{_PI}|0"
    # A number alone, behind a variable, or before one; anything else gets a summand.
    if match := re.fullmatch(rf"([+-]?)\s*({written})", bare):
        return _amount(_quarters(match[2], match[1], unit) + quarters, unit)
    if match := re.fullmatch(rf"(.*[\w)])\s*([+-])\s*({written})", bare):
        return f"{match[1]}{_summand(_amount(_quarters(match[3], match[2], unit) + quarters, unit))}"
    if match := re.fullmatch(rf"(-?)\s*({written})\s*([+-])\s*(.*)", bare):
        total = _amount(_quarters(match[2], match[1], unit) + quarters, unit)
        if total == "0":
            return f"{match[3].replace('+', '')}{match[4]}"
        return f"{total} {match[3]} {match[4]}"
    return f"{bare}{_summand(_amount(Fraction(quarters), unit))}"


def _quarters(number: str, sign: str, unit: str) -> Fraction:
    """Return a number of quarter turns, exactly."""
    if unit == "deg":
        value = Fraction(number) / 90
    elif number == "0":
        value = Fraction(0)
    else:
        factor, _, divisor = number.partition("pi")
        value = Fraction(int(factor.removesuffix("*") or 1), int(divisor.removeprefix("/") or 1)) * 2
    return -value if sign == "-" else value


def _amount(quarters: Fraction, unit: str) -> str:
    """Return a number of quarter turns within half a turn, as text."""
    quarters = (quarters + 2) % 4 - 2
    if quarters == -2:
        quarters = Fraction(2)
    if quarters == 0:
        return "0"
    if unit == "deg":
        return _decimal(quarters * 90)
    return _of_pi(quarters / 2)


def _decimal(value: Fraction) -> str:
    """Return a terminating decimal."""
    if value.denominator == 1:
        return str(value.numerator)
    digits = 0
    while (value * 10**digits).denominator != 1:
        digits += 1
    whole, rest = divmod(abs(value * 10**digits).numerator, 10**digits)
    return f"{'-' if value < 0 else ''}{whole}.{rest:0{digits}d}"


def number_text(value: float, unit: str) -> str:
    """Return a constant, in radians or a length, as it is written in a file; a length has no unit."""
    if unit == "rad":
        twelfths = value / (math.pi / 12)
        if abs(twelfths - round(twelfths)) < 1e-12 and round(twelfths):
            return _of_pi(Fraction(round(twelfths), 12))
    number = math.degrees(value) if unit == "deg" else value
    text = f"{round(number, 12):.12f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text


def _of_pi(half_turns: Fraction) -> str:
    """Return a multiple of pi as a file has it, such as `-3*pi/4`."""
    factor = {1: "", -1: "-"}.get(half_turns.numerator, f"{half_turns.numerator}*")
    return f"{factor}pi{'' if half_turns.denominator == 1 else f'/{half_turns.denominator}'}"


_STEP = re.compile(r"([RT][xyz])\s*\((.*)\)\s*\Z", re.DOTALL)
_PARAMETER = re.compile(r"(-?)\s*([A-Za-z_]\w*)")
_NAMES = {"base": "base", "tail": "tool"}


def with_unit(text: str, key: str, unit: str) -> str:
    """Return the text with another unit of its angles or lengths."""
    return Document(text).with_text(unit, "units", key).text


def rewrite(
    text: str, table: Table, changes: tuple[Change, ...], edits: tuple[Edit, ...], setting: Setting
) -> Document:
    """Make changes of the whole and of entries in the text of a file; what no entry can state is an error."""
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
    """Return the inverse of a transform, as elementary steps."""
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
    names = ("q", *(variable.name for variable in table.robot.variables))
    # Edits of several entries, then of one.
    if edit.kind in (EditKind.SWAP, EditKind.ROWS):
        return _taken(document, table, rows, edit, unit, names)
    if edit.kind is EditKind.SHIFT:
        return _shifted(document, edit)
    if edit.kind is EditKind.NUMBER and not edit.rows:
        return _in_mount(document, table, edit)
    row, at = rows[edit.rows[0]], edit.rows[0] - 1
    if edit.kind is EditKind.MOTION_SIGN:
        return _other_way(document, table, row, names)
    key = edit.entries[0]
    moves = bool(table.coefficients[row.slots[key]].any())
    # An offset has the constant of an entry that moves.
    if moves and document.node("joints", at, "offset") is not None:
        key, moves = "offset", False
    # A solved number takes the place of the constant alone.
    if edit.kind is EditKind.NUMBER:
        if not moves:
            return _valued(document, row, key, edit.text)
        change = float(edit.plus[edit.place] - table.constants[edit.place])
        added = number_text(change, unit if table.turns[edit.place] else "")
        return _changed(document, row, key, lambda text: with_constant(text, edit.text, names, added))
    if edit.kind is EditKind.QUARTER:
        return _changed(document, row, key, lambda text: turned(text, edit.amount, unit))
    return _changed(document, row, key, lambda text: mirrored_constant(text, names) if moves else negated(text))


def _valued(document: Document, row: TableRow, key: str, number: str) -> Document:
    """A number in an entry, or in the parameter that stands there and nowhere else: a file may have no unused one."""
    old = "" if row.convention is Convention.ETS and key != "offset" else document.words("joints", row.number - 1, key)
    match = _PARAMETER.fullmatch(old.strip())
    path: tuple[str, ...] = ("parameters", match[2]) if match else ()
    without_comments = re.sub(r"#.*", "", document.text)
    if match is None or document.node(*path) is None or len(re.findall(rf"\b{match[2]}\b", without_comments)) != 2:
        return _changed(document, row, key, lambda _: number)
    path = (*path, "value") if document.node(*path, "value") is not None else path
    return document.with_text(negated(number) if match[1] else number, *path)


def _changed(document: Document, row: TableRow, key: str, change: Callable[[str], str]) -> Document:
    """Return one entry of a row, or what is between the brackets of a step, after a function."""
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
    """Return what is added to an expression."""
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


def _taken(
    document: Document, table: Table, rows: dict[int, TableRow], edit: Edit, unit: str, names: tuple[str, ...]
) -> Document:
    """Entries with the constants of others: their texts where neither moves, else the numbers."""
    # Texts come from the file as it was, since entries change places.
    before = document
    owners = {place: (row, key) for row in rows.values() for key, place in row.slots.items()}
    for place in np.flatnonzero(edit.take != np.arange(len(edit.take))):
        (row, key), (other, source) = owners[int(place)], owners[int(edit.take[place])]
        moves, theirs = (bool(table.coefficients[each].any()) for each in (place, edit.take[place]))
        constant = number_text(float(table.constants[edit.take[place]]), unit if table.turns[place] else "")
        if not moves:
            text = constant if theirs else before.words("joints", other.number - 1, source)
            document = document.with_text(text, "joints", row.number - 1, key)
            continue
        if before.node("joints", row.number - 1, "offset") is not None:
            document = document.with_text(constant, "joints", row.number - 1, "offset")
            continue
        document = _changed(document, row, key, partial(with_constant, constant=constant, names=names))
    return document


def _in_mount(document: Document, table: Table, edit: Edit) -> Document:
    """Return a number of base or tool."""
    name = "base" if edit.place in table.base else "tool"
    slot = table.slots[edit.place]
    if document.node(name, "ets") is not None:
        match = _STEP.match(document.words(name, "ets", slot.step))
        if match is None or match[1] != slot.kind:
            raise CannotRewriteError(f"the transform '{name}' has no such step")
        return document.with_text(f"{match[1]}({edit.text})", name, "ets", slot.step)
    key = "rpy" if slot.kind.is_rotation else "xyz"
    return document.with_text(edit.text, name, key, "xyz".index(str(slot.kind)[1]))


def with_mount(document: Document, field: str, matrix: FloatArray, setting: Setting, step: float) -> Document:
    """Return the document with a solved base or tail, (4, 4) in the length unit of the poses, rounded to `step`."""
    factor = METRES[setting.pose_length] / METRES[setting.table_length]
    angles = numbers_of("rpy", matrix[None, :3, :3])[0]
    if setting.table_angle == "deg":
        angles = np.degrees(angles)
    lengths = [_short(value * factor, step * factor) for value in matrix[:3, 3]]
    turns = [_short(value, 1e-3 if setting.table_angle == "deg" else 1e-5) for value in angles]
    return document.with_mapping(_NAMES[field], f"{{xyz: [{', '.join(lengths)}], rpy: [{', '.join(turns)}]}}")


def _short(value: float, step: float) -> str:
    """Return a number rounded to a decimal of about this size, without trailing zeros."""
    decimals = max(0, int(np.ceil(-np.log10(step))))
    text = f"{value:.{decimals}f}"
    text = text.rstrip("0").rstrip(".") if "." in text else text
    return "0" if text in ("-0", "") else text
