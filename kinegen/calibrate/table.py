"""A file of measurements, CSV or Parquet -> columns of cells that remember their lines."""

from __future__ import annotations

import io
from pathlib import Path

from kinegen.errors import KinegenError, quote, shown
from kinegen.formats.columns import MAX_ROWS, Cells, csv_cells, read_bytes
from kinegen.workspace.optional import library

_PARQUET = b"PAR1"
_EXPECTED = "CSV or Parquet with measurements"


def read_cells(path: Path) -> Cells:
    """Read a file of measurements.

    Args:
        path: The file; its content decides whether it is CSV or Parquet.

    Raises:
        KinegenError: If it cannot be read, or is not a table.
    """
    data = read_bytes(path, _EXPECTED)
    return _read_parquet(data, shown(path)) if data.startswith(_PARQUET) else csv_cells(data, path, _EXPECTED)


def _read_parquet(data: bytes, name: str) -> Cells:
    """The same cells from Parquet; numbers go through text, which keeps every digit."""
    parquet = library("pyarrow.parquet", "reading Parquet")
    try:
        table = parquet.read_table(io.BytesIO(data))
    except (OSError, ValueError) as error:
        raise KinegenError(f"this Parquet file cannot be read: {quote(str(error))}", name) from None
    if table.num_rows > MAX_ROWS:
        raise KinegenError(f"the file has more than {MAX_ROWS} rows", name)
    columns = [["" if cell is None else str(cell) for cell in column.to_pylist()] for column in table.columns]
    rows = tuple(zip(*columns, strict=True)) if columns else ()
    return Cells(name, tuple(map(str, table.column_names)), 0, rows, tuple(range(1, len(rows) + 1)))
