"""A table of numbers with a header, such as measurements -> columns of cells that remember their lines.

In: CSV with commas, semicolons or tabs; empty lines and lines that begin with # are left out. Out: the header and the
rows as text. What the columns mean is not decided here.
"""

from __future__ import annotations

import csv
import io
from dataclasses import dataclass
from pathlib import Path

from kinegen.errors import KinegenError, shown

MAX_BYTES = 64 * 1024 * 1024
MAX_ROWS = 1_000_000
_DELIMITERS = ",;\t"


@dataclass(frozen=True, slots=True)
class Cells:
    """The content of a table.

    Attributes:
        path: The file, as messages call it.
        header: Names of the columns, as written.
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
        """The error at a line; in a file without lines the number of the row is in the message."""
        if line is None or self.header_line:
            return KinegenError(message, self.path, line)
        return KinegenError(f"row {line}: {message}", self.path)


def read_bytes(path: Path, expected: str) -> bytes:
    """Read a file of bounded size.

    Args:
        path: The file.
        expected: What it should be, for messages, such as `CSV`.

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
    """Take CSV apart; every row must be as long as the header.

    Args:
        data: The content of the file.
        path: Its name, for messages.
        expected: What it should be, as for `read_bytes`.
        most: Rows that it may have.

    Raises:
        KinegenError: If it is not a table.
    """
    name = shown(path)
    text = _decoded(data, name, expected)
    kept = [(number, line) for number, line in enumerate(text.splitlines(), start=1) if _is_row(line)]
    if not kept:
        raise KinegenError("the file is empty (expected a header and a row for each measurement)", name)
    first, head = kept[0]
    delimiter = max(_DELIMITERS, key=head.count)
    header = _split(head, delimiter, name, first)
    if any(_is_number(cell) for cell in header):
        raise KinegenError("the first row must be a header with names of columns, but it has numbers", name, first)
    if len(kept) - 1 > most:
        raise KinegenError(f"the file has more than {most} rows", name)
    rows, lines = [], []
    for number, line in kept[1:]:
        cells = _split(line, delimiter, name, number)
        if len(cells) != len(header):
            hint = "; is the comma a decimal separator?" if delimiter == "," and len(cells) > len(header) else ""
            raise KinegenError(f"{len(cells)} cells, but the header has {len(header)}{hint}", name, number)
        rows.append(cells)
        lines.append(number)
    return Cells(name, header, first, tuple(rows), tuple(lines))


def _decoded(data: bytes, name: str, expected: str) -> str:
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


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
