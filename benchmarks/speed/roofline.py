"""The roofline as an SVG picture: how close the kernels come to what arithmetic and memory allow.

In: results. Out: text. Operations per second are over operations per byte (arithmetic intensity), both on logarithmic
axes, one panel for each number type. The roofs are measured too: the level one is FMA in registers, the slanting ones
are a loop that reads joint values and writes matrices without computing, for each size of a batch.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from benchmarks.speed.rows import Results, Row

ROBOT, JOINTS = "puma560", 6
_KERNEL, _FLOOR = "batch kernel, from C", "sines and cosines alone"
WIDTH, HEIGHT = 940, 470
TOP, BOTTOM, LEFT, GAP = 64, 400, 62, 46

SHADES = ("#1b6ca8", "#2a9d5c", "#d1711f", "#8a4fa3")
"""One colour for each size, the smallest batch first."""

MARKS = {"4x4": "square", "joint-major": "circle", "sum": "triangle"}
WORDS = {"4x4": "4x4", "joint-major": "joint-major", "sum": "sincos only"}


@dataclass(frozen=True, slots=True)
class Panel:
    """One panel and its scales.

    Attributes:
        left: Its left edge in the picture.
        width: Its width.
        x: Smallest and largest arithmetic intensity, in FLOP/byte.
        y: Smallest and largest performance, in GFLOP/s.
    """

    left: float
    width: float
    x: tuple[float, float]
    y: tuple[float, float]

    def at(self, x: float, y: float) -> tuple[float, float]:
        """Where a point lies in the picture."""
        across = math.log(x / self.x[0]) / math.log(self.x[1] / self.x[0])
        up = math.log(y / self.y[0]) / math.log(self.y[1] / self.y[0])
        return self.left + across * self.width, BOTTOM - up * (BOTTOM - TOP)


def draw(results: Results) -> str:
    """Draw the picture.

    Args:
        results: What was measured, sizes included.

    Returns:
        SVG text; without measured sizes, a picture that says so.
    """
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" font-family="sans-serif" '
        f'font-size="12" fill="#222">\n<rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>'
    )
    if not results.peak:
        return f"{head}\n{_text(20, 40, 'The sizes were not measured.')}\n</svg>\n"
    lines = [head, _text(LEFT, 24, "Roofline, PUMA 560, one thread", size=15)]
    width = (WIDTH - LEFT - GAP - 20) / 2
    highest = max(results.peak.values()) * 1.6
    for number, real in enumerate(("double", "float")):
        panel = Panel(LEFT + number * (width + GAP), width, (0.5, 24), (highest / 20, highest))
        lines += _panel(results, real, panel)
    lines += _legend(results)
    return "\n".join([*lines, "</svg>"]) + "\n"


def _panel(results: Results, real: str, panel: Panel) -> Iterator[str]:
    yield from _axes(panel, real)
    peak = results.peak[real]
    yield _line(panel, (panel.x[0], peak), (panel.x[1], peak), "#222", 1.5)
    x, y = panel.at(panel.x[0], peak)
    yield _text(x + 6, y - 6, f"FMA peak: {peak:.0f} GFLOP/s")
    for row in _rows(results, real):
        shade = SHADES[_counts(results).index(row.poses) % len(SHADES)]
        if row.layout == "4x4" and row.what.startswith("reading"):
            speed = row.value * 1e-3 * _bytes("4x4", real)
            end = min(peak / speed, panel.x[1])
            start = max(panel.x[0], panel.y[0] / speed)
            yield _line(panel, (start, start * speed), (end, end * speed), shade, 1.2, dashed=True)
        elif row.layout in MARKS and row.what in (_KERNEL, _FLOOR):
            form = "floor" if row.layout == "sum" else "kernel"
            operations = results.operations[ROBOT][f"{real} {form}"]
            place = panel.at(operations / _bytes(row.layout, real), row.value * operations * 1e-3)
            yield _mark(MARKS[row.layout], *place, shade)


def _axes(panel: Panel, real: str) -> Iterator[str]:
    for tick in (0.5, 1, 2, 4, 8, 16):
        x, _ = panel.at(tick, panel.y[0])
        yield f'<path d="M{x:.1f} {TOP} V{BOTTOM}" stroke="#e4e4e4"/>'
        yield _text(x, BOTTOM + 18, f"{tick:g}", anchor="middle")
    for tick in (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000):
        if panel.y[0] <= tick <= panel.y[1]:
            _, y = panel.at(panel.x[0], tick)
            yield f'<path d="M{panel.left:.1f} {y:.1f} h{panel.width:.1f}" stroke="#e4e4e4"/>'
            yield _text(panel.left - 6, y + 4, f"{tick:g}", anchor="end")
    yield f'<path d="M{panel.left:.1f} {TOP} V{BOTTOM} h{panel.width:.1f}" stroke="#222" fill="none"/>'
    yield _text(panel.left + panel.width / 2, TOP - 10, real, anchor="middle", size=13)
    yield _text(panel.left + panel.width / 2, BOTTOM + 36, "arithmetic intensity [FLOP/byte]", anchor="middle")
    if panel.left == LEFT:
        middle = (TOP + BOTTOM) / 2
        yield (
            f'<text x="18" y="{middle}" text-anchor="middle" transform="rotate(-90 18 {middle})">'
            "performance [GFLOP/s]</text>"
        )


def _legend(results: Results) -> Iterator[str]:
    y, x = HEIGHT - 12.0, float(LEFT)
    for layout, mark in MARKS.items():
        yield _mark(mark, x + 5, y - 4, "#666")
        yield _text(x + 15, y, WORDS[layout])
        x += 32 + 6.2 * len(WORDS[layout])
    x += 14
    for shade, count in zip(SHADES, _counts(results), strict=False):
        yield f'<path d="M{x:.1f} {y - 4:.1f} h20" stroke="{shade}" stroke-width="3"/>'
        yield _text(x + 25, y, f"{count:,} poses")
        x += 48 + 6.2 * len(f"{count:,} poses")
    yield _text(x, y, "dashed: memory alone")


def _rows(results: Results, real: str) -> list[Row]:
    """The rows of the group of sizes; where a size was measured twice, the later row."""
    found = {}
    for row in results.rows:
        if row.robot == ROBOT and row.real == real and row.poses in _counts(results) and row.threads == 1:
            found[row.what, row.layout, row.poses] = row
    return list(found.values())


def _counts(results: Results) -> list[int]:
    """The sizes that bare memory was measured at."""
    rows = (row for row in results.rows if row.robot == ROBOT and row.what.startswith("reading"))
    return sorted({row.poses for row in rows})


def _bytes(layout: str, real: str) -> int:
    """Bytes of one pose, joint values and result together."""
    numbers = {"4x4": 16, "joint-major": 12, "sum": 1}[layout] + JOINTS
    return numbers * (8 if real == "double" else 4)


def _line(
    panel: Panel, start: tuple[float, float], end: tuple[float, float], shade: str, width: float, dashed: bool = False
) -> str:
    (x1, y1), (x2, y2) = panel.at(*start), panel.at(*end)
    dash = ' stroke-dasharray="6 4"' if dashed else ""
    return f'<path d="M{x1:.1f} {y1:.1f} L{x2:.1f} {y2:.1f}" stroke="{shade}" stroke-width="{width}"{dash}/>'


def _mark(kind: str, x: float, y: float, shade: str) -> str:
    if kind == "circle":
        return f'<circle cx="{x:.1f}" cy="{y:.1f}" r="5" fill="{shade}"/>'
    if kind == "square":
        return f'<rect x="{x - 4.5:.1f}" y="{y - 4.5:.1f}" width="9" height="9" fill="{shade}"/>'
    return f'<path d="M{x:.1f} {y - 6:.1f} l6 10 h-12 z" fill="{shade}"/>'


def _text(x: float, y: float, text: str, anchor: str = "start", size: int = 12) -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" font-size="{size}">{text}</text>'
