"""Which rows go to which file: decided by the input alone, so that it does not matter who computes them, or when."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from kinegen.fleet.sources import Source, Span

PART_ROWS = 1 << 21
"""Rows of a file of a folder, unless a block of the input has more: a quarter of a gigabyte of poses."""


@dataclass(frozen=True, slots=True)
class Part:
    """One file of the output.

    Attributes:
        name: Its name.
        spans: The rows that it is computed from.
    """

    name: str
    spans: tuple[Span, ...]

    @property
    def rows(self) -> int:
        """Number of rows; -1 where nobody knows before they are read."""
        return -1 if any(span.rows < 0 for span in self.spans) else sum(span.rows for span in self.spans)


def parts_of(sources: Sequence[Source], ending: str, rows: int) -> tuple[Part, ...]:
    """The files of a folder: of each input file consecutive blocks, as many as reach a number of rows.

    Args:
        sources: The input.
        ending: Ending of the files.
        rows: The number of rows.
    """
    spans = [span for source in sources for span in spans_of(source, rows)]
    digits = max(5, len(str(len(spans) - 1)))
    return tuple(Part(f"part-{place:0{digits}d}{ending}", (span,)) for place, span in enumerate(spans))


def one_part(sources: Sequence[Source], name: str) -> tuple[Part, ...]:
    """One file with all rows."""
    return (Part(name, tuple(span for source in sources for span in spans_of(source, PART_ROWS))),)


def spans_of(source: Source, rows: int) -> Iterator[Span]:
    """The spans of a file, each of at least a number of rows but for the last."""
    path, kind, keys = source.path, source.kind, source.keys
    if kind in ("npy", "zarr"):
        for first in range(0, source.rows[0], rows):
            count = min(rows, source.rows[0] - first)
            yield Span(path, kind, first, count, count, keys)
        return
    if kind in ("csv", "npz"):
        yield Span(path, kind, 0, 1, source.rows[0], keys)
        return
    first, gathered = 0, 0
    for place, count in enumerate(source.rows):
        gathered += count
        if gathered >= rows or place == len(source.rows) - 1:
            yield Span(path, kind, first, place + 1 - first, gathered, keys)
            first, gathered = place + 1, 0
