"""Lines of YAML: entries between braces, and rows whose entries stand below each other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

Cells = dict[str, str]
"""Keys with their texts, in order."""


def quoted(text: str) -> str:
    """A text for a place between braces: a comma would end it."""
    return f'"{text}"' if "," in text else text


def flow(cells: Mapping[str, str]) -> str:
    """An entry between braces."""
    return f"{{{', '.join(f'{key}: {text}' for key, text in cells.items())}}}"


def aligned(rows: Sequence[Cells], comments: Sequence[str]) -> list[str]:
    """Rows of a list; those with the same keys in the same order have columns.

    Args:
        rows: The entries of each row.
        comments: A comment for each row, possibly empty.
    """
    widths: dict[tuple[str, ...], list[int]] = {}
    for row in rows:
        found = widths.setdefault(_shape(row), [0] * len(_shape(row)))
        for place, key in enumerate(_shape(row)):
            found[place] = max(found[place], len(row[key]))
    lines = []
    for row, comment in zip(rows, comments, strict=True):
        known = dict(zip(_shape(row), widths[_shape(row)], strict=True))
        parts = [f"{key}: {text}" for key, text in row.items()]
        ends = [*[", "] * (len(parts) - 1), "}"]
        padded = [
            (part + end).ljust(len(key) + 2 + known.get(key, 0) + 2) if end == ", " else part + end
            for key, part, end in zip(row, parts, ends, strict=True)
        ]
        lines.append(f"  - {{{''.join(padded)}" + (f"  # {comment}" if comment else ""))
    return lines


def _shape(row: Cells) -> tuple[str, ...]:
    """The keys of a row that make columns: limits and steps are last and of any length."""
    return tuple(key for key in row if key not in ("limits", "ets"))
