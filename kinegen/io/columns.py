"""A table of numbers with a header, such as measurements -> columns of cells, and which of them hold joint values.

In: CSV with commas, semicolons or tabs; empty lines, rows of empty cells and lines that begin with # are left out. Out:
the header and the rows as text, with a point as decimal separator. Names of joints and units follow one rule for all
commands; what other columns mean is not decided here.
"""

from __future__ import annotations

import codecs
import csv
import io
import itertools
import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from pathlib import Path

from kinegen.errors import KinegenError, did_you_mean, quote, shown
from kinegen.io.messages import A_WORKBOOK, WORKBOOKS
from kinegen.model.expression_parser import MINUS
from kinegen.support.dataclass import dataclass

METRES = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "in": 0.0254}
RADIANS = {"rad": 1.0, "mrad": 1e-3, "deg": 0.017453292519943295}
"""The units that a title may state, in metres and in radians."""

_BRACKET = r"\s*[\[(](?P<bracket>[^\[\]()]*[^\[\]()\d\s,][^\[\]()]*)[\])]"
"""What is no index, as in `q[0]`."""

_UNIT = re.compile(rf"(?P<name>.*?)(?:{_BRACKET}|_(?P<suffix>mm|cm|um|m|in|deg|rad|mrad))")


def unit_of(title: str, names: Collection[str] = ()) -> tuple[str, str | None]:
    """Return the name in a title and the unit behind it, as in `A1[deg]` and `x_mm`; one of `names` stays whole."""
    match = _UNIT.fullmatch(title)
    if match is None or title.lower() in map(str.lower, names):
        return title, None
    unit = (match["bracket"] or match["suffix"]).strip()
    return match["name"], unit.replace("µm", "um").replace("°", "deg")


def unit_of_values(title: str, names: Collection[str]) -> str | None:
    """Return the unit that a title states which a user named for joint values, in brackets or behind one of `names`.

    Other words are not those of the robot: what ends as `u_in` states inches of no joint.
    """
    name, unit = unit_of(title, names)
    is_bracket = title[-1:] in ("]", ")")
    return unit if is_bracket or name.lower() in map(str.lower, names) else None


def check_units(stated: Mapping[str, str | None], own: str, option: str, *, is_asked: bool = False) -> None:
    """Refuse units of titles that an option contradicts, or beside which a title without one would mean another unit.

    Args:
        stated: The unit that each title of one quantity states, or None.
        own: The unit of titles that state none.
        option: The option that states it; empty where there is none.
        is_asked: Whether the option is given.

    Raises:
        KinegenError: At the first such title.
    """
    title, unit = next(((title, unit) for title, unit in stated.items() if unit not in (None, own)), ("", ""))
    bare = next((title for title, unit in stated.items() if unit is None), None)
    if unit and is_asked:
        raise KinegenError(f"column {quote(title)} is in {unit}, and {option} {own} is given; leave one of them out")
    if unit and bare is not None:
        other = f", or in none and with {option} {unit}" if option else ""
        raise KinegenError(
            f"column {quote(title)} has a unit, and column {quote(bare)} has none; state it in all titles, as in "
            f"{quote(f'{bare}[{unit}]')}{other}"
        )


def no_column(name: str, titles: Sequence[str]) -> str:
    """Return what is said of a name that is none of the titles, with the nearest one."""
    there = ", ".join(map(quote, titles)) or "none"
    return f"there is no column {quote(name)} (there are {there}{did_you_mean(name, titles)})"


def numbered(count: int) -> tuple[str, ...]:
    """Return what columns of joint values are called where they are not called as the joints: q1, q2, ..."""
    return tuple(f"q{number}" for number in range(1, count + 1))


def unknown_unit(title: str, unit: str, known: Iterable[str]) -> str:
    """Return what is said of a unit that a title states and its numbers cannot have."""
    return f"column {quote(title)} is in {quote(unit)} (expected {', '.join(known)})"


def named_so(wanted: Sequence[str], titles: Sequence[str], *, in_any_unit: bool = False) -> tuple[str, ...] | None:
    """Return the titles that are the wanted names, in their order, or None.

    Capitals and units may differ where that leaves one title for each name; a name that is there as written goes first.
    `in_any_unit` also takes titles with a unit that is not known, to say so; the unit of a rate has a `/`.
    """
    if found := _named_so(wanted, titles, titles):
        return found
    parts = [unit_of(title, wanted) for title in titles]
    # What has another unit is something else about a joint, such as its rate.
    bare = [
        name if unit in (METRES | RADIANS) or (in_any_unit and unit and "/" not in unit) else title
        for title, (name, unit) in zip(titles, parts, strict=True)
    ]
    is_clear = all(bare.count(name) == 1 for name in set(wanted) & set(bare))
    return _named_so(wanted, bare, titles) if is_clear else None


def _named_so(wanted: Sequence[str], names: Sequence[str], whole: Sequence[str]) -> tuple[str, ...] | None:
    """Return the same by what the titles are called."""
    places = dict(zip(names, whole, strict=True))
    if set(wanted) <= set(names):
        return tuple(places[name] for name in wanted)
    folded = [name.lower() for name in names]
    is_clear = len(set(folded)) == len(names) and len({*map(str.lower, wanted)}) == len(wanted)
    if not is_clear or any(name.lower() not in folded for name in wanted):
        return None
    return tuple(whole[folded.index(name.lower())] for name in wanted)


MAX_BYTES = 64 * 1024 * 1024
MAX_ROWS = 1_000_000
_DELIMITERS = ",;\t"
_DECIMAL_COMMA = re.compile(r"([+-]?\d*),(\d+(?:[eE][+-]?\d+)?)\Z")
"""A number as spreadsheets of many countries write it; with other separators it can be nothing else."""


@dataclass(frozen=True, slots=True)
class Cells:
    """The content of a table.

    Attributes:
        header_line: Line of the header; 0 in a file without lines.
        rows: For each row the cells; an empty text is a cell without a value.
        lines: For each row its line in the file, or its number from 1 in a file without lines.
    """

    path: str
    header: tuple[str, ...]
    header_line: int
    rows: tuple[tuple[str, ...], ...]
    lines: tuple[int, ...]

    def fail(self, message: str, line: int | None) -> KinegenError:
        """Return the error at a line; in a file without lines the number of the row is in the message."""
        if not line or self.header_line:
            return KinegenError(message, self.path, line or None)
        return KinegenError(f"row {line}: {message}", self.path)


def read_bytes(path: Path, expected: str) -> bytes:
    """Read a file of at most `MAX_BYTES`; `expected` says what it should be, such as `CSV`.

    Raises:
        KinegenError: If it cannot be read or is too large.
    """
    name = shown(path)
    try:
        if path.is_dir():
            raise KinegenError(f"this is a folder; expected {expected}", name)
        with path.open("rb") as file:
            data = file.read(MAX_BYTES + 1)
    except OSError as error:
        raise KinegenError(f"cannot be read: {(error.strerror or str(error)).lower()}", name) from None
    except ValueError:
        raise KinegenError("this is not a file name", name) from None
    if len(data) > MAX_BYTES:
        raise KinegenError(f"the file is larger than {MAX_BYTES >> 20} MiB", name)
    return data


def csv_cells(data: bytes, path: Path, expected: str, most: int = MAX_ROWS) -> Cells:
    """Take CSV apart into at most `most` rows, each as long as the header; raise if it is not a table."""
    name = shown(path)
    lines = decoded(data, name, expected).splitlines()
    layout = layout_of(lines, name)
    if any(is_number(cell) for cell in layout.header):
        reason = "the first row must be a header with names of columns, but it has numbers"
        raise KinegenError(reason, name, layout.line)
    below = enumerate(lines[layout.line :], start=layout.line + 1)
    found = list(itertools.islice(rows_of(below, layout, name), most + 1))
    if len(found) > most:
        raise KinegenError(f"the file has more than {most} rows", name)
    numbers, rows = tuple(number for number, _ in found), [cells for _, cells in found]
    # Columns without a name behind the last one that has one are what a spreadsheet leaves there, if they are empty.
    header = layout.header
    named = len(header) - next((place for place, cell in enumerate(reversed(header)) if cell), 0)
    if not any(any(row[named:]) for row in rows):
        header, rows = header[:named], [row[:named] for row in rows]
    return Cells(name, header, layout.line, tuple(rows), numbers)


@dataclass(frozen=True, slots=True)
class Layout:
    """The separator of the columns of a text file, its header, and the line of that from 1."""

    delimiter: str
    header: tuple[str, ...]
    line: int


def layout_of(lines: Sequence[str], name: str) -> Layout:
    """Find the header, below empty lines and comments, and the separator of its columns."""
    first = next((number for number, line in enumerate(lines, start=1) if _is_row(line)), 0)
    if not first:
        raise KinegenError("the file is empty (expected a header and a row for each measurement)", name)
    head = lines[first - 1]
    delimiter = max(_DELIMITERS, key=head.count)
    return Layout(delimiter, _split(head, delimiter, name, first), first)


def rows_of(
    lines: Iterable[tuple[int, str]], layout: Layout, name: str, *, as_written: bool = False
) -> Iterator[tuple[int, tuple[str, ...]]]:
    """Yield the line and the cells of each row below a header, with a point as decimal separator.

    `as_written` says whether numbers keep their decimal commas, and empty cells beyond the header are refused.
    """
    delimiter, size = layout.delimiter, len(layout.header)
    for number, line in lines:
        cells = _split(line, delimiter, name, number) if _is_row(line) else ()
        if not any(cells):
            continue
        is_empty = not any(cells[size:])
        if is_empty and not as_written:
            cells = cells[:size]
        if len(cells) != size:
            hint = "; is the comma a decimal separator?" if delimiter == "," and not is_empty else ""
            raise KinegenError(f"{len(cells)} cells, but the header has {size}{hint}", name, number)
        yield number, cells if as_written else tuple(_plain(cell, delimiter) for cell in cells)


def decoded(data: bytes, name: str, expected: str) -> str:
    """Decode the beginning or all of a file from UTF-8, with or without a byte order mark."""
    if data.startswith(WORKBOOKS):
        raise KinegenError(A_WORKBOOK, name)
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        raise KinegenError("this is UTF-16 text; save the file as UTF-8", name)
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise KinegenError(f"this is not UTF-8 text; expected {expected}", name, line) from None
    if "\0" in text:
        raise KinegenError(f"this is a binary file; expected {expected}", name)
    return text


def _is_row(line: str) -> bool:
    return bool(line.strip()) and not line.lstrip().startswith("#")


def _split(line: str, delimiter: str, name: str, number: int) -> tuple[str, ...]:
    try:
        (cells,) = csv.reader(io.StringIO(line), delimiter=delimiter, strict=True)
    except (csv.Error, ValueError) as error:
        raise KinegenError(f"this row cannot be read: {error}", name, number) from None
    return tuple(cell.strip() for cell in cells)


def _plain(cell: str, delimiter: str) -> str:
    """Return a cell with the minus of the keyboard, and a point in a number that has a comma."""
    text = cell.replace(MINUS, "-")
    if delimiter != "," and (match := _DECIMAL_COMMA.fullmatch(text)):
        return f"{match[1]}.{match[2]}"
    return text if is_number(text) else cell


def is_number(text: str) -> bool:
    """Tell whether a cell holds a number, which has the digits 0 to 9 and nothing between them."""
    try:
        float(text)
    except ValueError:
        return False
    return text.isascii() and "_" not in text
