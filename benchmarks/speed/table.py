"""Results as a table for a terminal."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from benchmarks.speed.rows import TIME, Results, Row

HEAD = ("robot", "what", "layout", "type", "thr", "N", "built", "rate", "+-", "ratio", "", "asked", "")
RIGHT = {"thr", "N", "rate", "+-", "ratio", "asked"}


def render(results: Results) -> Iterator[str]:
    """The lines of the table.

    Args:
        results: What was measured.

    Yields:
        The machine, the ways of compiling, and a line for each row; all rows were measured on this processor.
    """
    letters = _letters(results.rows)
    yield from (f"{name.replace('_', ' '):12} {text}" for name, text in results.machine.items())
    before, after = results.load
    share = f"{results.calm:.0%} of the turns had their core to themselves"
    yield f"load         {before:.2f} before, {after:.2f} after; {share}"
    for (compiler, flags), letter in letters.items():
        yield f"built {letter:6} {f'{compiler}: ' if compiler else ''}{flags}"
    yield "rates in million poses/s, times in us, medians; +- is the distance of the quartiles"
    yield ""
    yield from _aligned([HEAD, *(_cells(row, letters) for row in results.rows)])
    if results.instructions:
        yield ""
        yield "instructions of one pose (callgrind)"
        cells = [
            (each["robot"], each["what"], each["real"], f"{each['instructions']:.0f}", each["flags"])
            for each in results.instructions
        ]
        yield from _aligned([("robot", "what", "type", "N", "flags"), *cells])
    if results.absent:
        yield ""
        yield from (f"without {name} for {robot}: {reason}" for robot, name, reason in results.absent)


def _letters(rows: Sequence[Row]) -> dict[tuple[str, str], str]:
    kinds = dict.fromkeys((row.compiler, row.flags) for row in rows if row.flags)
    return {kind: chr(ord("a") + number) for number, kind in enumerate(kinds)}


def _cells(row: Row, letters: dict[tuple[str, str], str]) -> tuple[str, ...]:
    met = {None: "", True: "met", False: "NOT MET"}[row.met]
    asked = "" if row.asked is None else f"{'<' if row.unit == TIME else '>='} {row.asked:g}"
    return (
        row.robot,
        row.what,
        row.layout,
        row.real,
        str(row.threads),
        f"{row.poses:,}",
        letters.get((row.compiler, row.flags), ""),
        f"{row.value:.3g}" if row.value < 10 else f"{row.value:.1f}",
        f"{row.spread:.0%}",
        "" if row.ratio is None else f"{row.ratio:.2f}",
        row.against,
        asked,
        met,
    )


def _aligned(rows: list[tuple[str, ...]]) -> Iterator[str]:
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    right = [name in RIGHT for name in rows[0]]
    for row in rows:
        cells = (cell.rjust(width) if r else cell.ljust(width) for cell, width, r in zip(row, widths, right))
        yield "  ".join(cells).rstrip()
