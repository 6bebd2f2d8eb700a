"""Text files of columns (CSV): how their columns are separated, and the types that hold the values of all rows.

pyarrow takes the types from the first block of a file. A robot that stands still for a while has whole numbers there
and others later, so the inputs of kernels are read as floating-point numbers, and for other columns files that are
longer than a block are read once more, before anything is computed.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from kinegen.errors import KinegenError, quote, shown
from kinegen.io.columns import decoded, is_number, layout_of, rows_of
from kinegen.support.compat import library

PURPOSE = "a data set"
_EXPECTED = "CSV with a header"

_FIRST = 1000
"""Lines among which the header is looked for."""

_BLOCK = 1 << 20
"""Bytes of the first block, from which types are taken."""

_NUMBERS = {
    delimiter: {
        mark: re.compile(
            rb'(?:^|%b)"? *[+-]?\d*[%b]\d+(?:[eE][+-]?\d+)? *"?(?=%b|\r?$)'
            % (delimiter.encode(), mark.encode(), delimiter.encode()),
            re.MULTILINE,
        )
        for mark in (",", ".")
    }
    for delimiter in (";", "\t")
}
"""A number with a decimal separator, by what separates the columns and by that separator."""

_NAMES = {",": "comma", ".": "point"}

_MINUS = "\u2212".encode()
_PRINTED = re.compile(_MINUS + rb"(?=[\d.,])")
"""The minus of text that was set for print, before a number."""

_COMMENT = re.compile(rb"^(?:[ \t]*#.*| +\r?)(?:\n|\Z)", re.MULTILINE)
"""A comment, or a line of blanks."""

_LONE = re.compile(rb"\r(?!\n|\Z)")
"""The end of a line where that is CR alone, as programs of the first Macintosh write it."""

_COLUMN = re.compile(r"In CSV column #(\d+)")
"""How pyarrow names the column whose type does not hold a value."""


def opened(path: str, types: Mapping[str, Any]) -> Any:
    """Return a reader of a text file, also a packed one (.gz, .bz2, .zst); the first block decides other types."""
    csv, pyarrow = library("pyarrow.csv", PURPOSE, "fleet"), library("pyarrow", PURPOSE, "fleet")
    plain = _first_lines(path)
    layout = layout_of(decoded(plain, shown(path), _EXPECTED).splitlines(), shown(path))
    return csv.open_csv(
        pyarrow.TransformInputStream(pyarrow.input_stream(path), PlainLines()),
        # Blanks around names, which pyarrow keeps, are not part of them.
        read_options=csv.ReadOptions(block_size=_BLOCK, column_names=layout.header, skip_rows=layout.line),
        parse_options=csv.ParseOptions(delimiter=layout.delimiter),
        convert_options=csv.ConvertOptions(
            column_types=dict(types), decimal_point=_decimal(path, layout.delimiter, plain)
        ),
    )


def _decimal(path: str, delimiter: str, head: bytes) -> str:
    """The decimal separator; where the first lines have whole numbers alone, that of the first number with one."""
    numbers = _NUMBERS.get(delimiter, {})
    for lines in itertools.chain([head], _chunks(path)) if numbers else ():
        found = next((mark for mark, number in numbers.items() if number.search(lines)), "")
        if found:
            return found
    return "."


def _chunks(path: str) -> Iterator[bytes]:
    """Yield the lines of a file as `PlainLines` gives them, a block at a time."""
    plain = PlainLines()
    with library("pyarrow", PURPOSE, "fleet").input_stream(path) as stream:
        while chunk := stream.read(_BLOCK):
            yield plain(chunk)
    yield plain(b"")


def _first_lines(path: str) -> bytes:
    """Return the whole lines of the first block, as `PlainLines` gives them."""
    plain = PlainLines()
    with library("pyarrow", PURPOSE, "fleet").input_stream(path) as stream:
        head = bytes(stream.read(_BLOCK))
    return plain(head) if len(head) == _BLOCK else plain(head) + plain(b"")


class _LineEnds:
    """Turns the ends of lines into LF where a file has CR alone, chunk by chunk."""

    def __init__(self) -> None:
        self._alone: bool | None = None

    def __call__(self, data: bytes) -> bytes:
        """Return data that begins a line with other ends; the first end in a file decides."""
        if self._alone is None and (b"\n" in data or _LONE.search(data)):
            self._alone = b"\n" not in data
        return data.replace(b"\r", b"\n") if self._alone else data


class PlainLines:
    """Lines with the minus of the keyboard and without comments, chunk by chunk; the rest of a line waits."""

    def __init__(self) -> None:
        self._kept, self._ends = b"", _LineEnds()

    def __call__(self, chunk: Any) -> bytes:
        """Return the lines that are whole; an empty chunk is the end."""
        data = self._ends(self._kept + bytes(chunk))
        end = data.rfind(b"\n") + 1 if chunk else len(data)
        data, self._kept = data[:end], data[end:]
        return _plain_lines(data)


def _plain_lines(data: bytes) -> bytes:
    """Whole lines without comments and blank ones, and with the minus of the keyboard; most files have neither."""
    if _MINUS in data:
        data = _PRINTED.sub(b"-", data)
    return _COMMENT.sub(b"", data) if b"#" in data or b"\n " in data or data[:1] == b" " else data


@contextmanager
def located(path: str, columns: Iterable[str] = ()) -> Iterator[None]:
    """Report errors of pyarrow about columns of numbers with the line, where `require_numbers` finds it."""
    try:
        yield
    except library("pyarrow", PURPOSE, "fleet").ArrowInvalid:
        require_numbers(path, columns)
        raise


def require_numbers(path: str, columns: Iterable[str]) -> None:
    """Look for the first cell that is not a number, or row of another length, which pyarrow does not place."""
    name = shown(path)
    with library("pyarrow", PURPOSE, "fleet").input_stream(path) as stream:
        lines = _lines(stream)
        first = list(itertools.islice(lines, _FIRST))
        layout = layout_of([line for _, line in first], name)
        # Read as pyarrow reads, line by line: slow, and only after an error.
        mark = _decimal(path, layout.delimiter, b"")
        nulls = {*library("pyarrow.csv", PURPOSE, "fleet").ConvertOptions().null_values}
        wanted = [(place, title) for place, title in enumerate(layout.header) if title in set(columns)]
        below = itertools.chain(first[layout.line :], lines)
        for number, cells in rows_of(below, layout, name, as_written=True):
            for place, title in wanted:
                if cells[place] not in nulls and (reason := _defect(cells[place], mark)):
                    raise KinegenError(f"{quote(cells[place])} in column {quote(title)} {reason}", name, number)


def _defect(cell: str, mark: str) -> str:
    """Return what keeps a cell from being a number with this decimal separator; nothing where it is one."""
    text, other = cell.replace(_MINUS.decode(), "-"), ",."[mark == ","]
    if other not in text:
        return "" if is_number(text.replace(mark, ".")) else "is not a number"
    if mark in text or not is_number(text.replace(other, ".")):
        return "is not a number"
    return f"has a decimal {_NAMES[other]}; the other numbers of this file have a decimal {_NAMES[mark]}"


def _lines(stream: Any) -> Iterator[tuple[int, str]]:
    """Yield the lines of a file with their numbers, a block at a time."""
    kept, number, ends = b"", 0, _LineEnds()
    while chunk := stream.read(_BLOCK):
        *whole, kept = ends(kept + bytes(chunk)).split(b"\n")
        for line in whole:
            yield (number := number + 1), line.decode("utf-8-sig" if number == 1 else "utf-8", "replace")
    if kept:
        yield number + 1, kept.decode(errors="replace")


def wider(schemas: Sequence[Any]) -> Any:
    """Return a `pyarrow.Schema` that holds the values of several, which have the same names."""
    pyarrow = library("pyarrow", PURPOSE, "fleet")
    columns = zip(*(schema.types for schema in schemas), strict=True)
    return pyarrow.schema(list(zip(schemas[0].names, map(_widest, columns), strict=True)))


def settled(path: str, schema: Any, columns: Sequence[str]) -> Any:
    """Return the schema with types that hold all values of a file: numbers instead of whole numbers, or else text."""
    pyarrow = library("pyarrow", PURPOSE, "fleet")
    # Columns that do not matter are read as text, which holds everything.
    types = dict.fromkeys(schema.names, pyarrow.string()) | {name: schema.field(name).type for name in columns}
    is_packed = not path.lower().endswith(".csv")
    while (is_packed or Path(path).stat().st_size > _BLOCK) and set(types.values()) != {pyarrow.string()}:
        place = _refused(path, types)
        if place < 0:
            break
        types[schema.names[place]] = _next(types[schema.names[place]])
    wanted = set(columns)
    fields = [each.with_type(types[each.name]) if each.name in wanted else each for each in schema]
    return pyarrow.schema(fields)


def _refused(path: str, types: Mapping[str, Any]) -> int:
    """Return the place of a column whose type does not hold a value of a file; -1 where there is none."""
    pyarrow = library("pyarrow", PURPOSE, "fleet")
    try:
        with opened(path, types) as reader:
            for _ in reader:
                pass
    except pyarrow.ArrowInvalid as error:
        # pyarrow names the column alone in its message.
        found = _COLUMN.search(str(error))
        if found is None:
            require_numbers(path, ())
            raise
        return int(found[1])
    return -1


def _next(kind: Any) -> Any:
    """Return the type that is tried after another."""
    pyarrow = library("pyarrow", PURPOSE, "fleet")
    types = library("pyarrow.types", PURPOSE, "fleet")
    if types.is_null(kind):
        return pyarrow.int64()
    return pyarrow.float64() if types.is_integer(kind) else pyarrow.string()


def _widest(kinds: tuple[Any, ...]) -> Any:
    """Return a type for the values of several."""
    pyarrow = library("pyarrow", PURPOSE, "fleet")
    types = library("pyarrow.types", PURPOSE, "fleet")
    there = [kind for kind in kinds if not types.is_null(kind)] or [pyarrow.null()]
    if all(kind == there[0] for kind in there):
        return there[0]
    if all(types.is_integer(kind) or types.is_floating(kind) for kind in there):
        return pyarrow.float64()
    return pyarrow.string()
