"""Everything that `kinegen show --format latex` prints about a robot, apart: formulas, rows and cells."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from kinegen.backends.textbook import OUTPUTS
from kinegen.backends.textbook.latex_lines import width
from kinegen.backends.textbook.sheet import make_sheet
from kinegen.backends.textbook.sheet_latex import latex_sheet
from kinegen.io.load import load
from kinegen.model.outputs import Reference

FILES = sorted((Path(__file__).resolve().parent.parent.parent / "robots").glob("*.yaml"))

NO_JACOBIAN = ("general_6r", "human_body")
"""Robots whose Jacobian is too long to be printed."""

_FORMULA = re.compile(r"\\begin\{(equation\*|align\*)\}\n(.*?)\n\\end\{\1\}", re.S)
_MATRIX = re.compile(r"(.*?)\\begin\{(bmatrix|array)\}(?:\{\w+\})?\n(.*?)\n?\\end\{\2\}", re.S)
_OUTPUT = {reference: output for output, reference in OUTPUTS.items() if reference}
_BRACKETS = 12.0
_GAP = 10.0


def latex_sheets(path: Path) -> Iterator[str]:
    """The sheet of the pose with all steps, and that of each Jacobian."""
    robot = load(path)
    yield latex_sheet(make_sheet(robot, None, None, steps=True))
    for reference in () if path.stem in NO_JACOBIAN else Reference:
        yield latex_sheet(make_sheet(robot, None, None, output=_OUTPUT[reference]))


def formulas(text: str) -> Iterator[tuple[str, str]]:
    """The displays of a sheet, each as its environment and its body."""
    for found in _FORMULA.finditer(text):
        yield found[1], found[2]


def display_width(body: str) -> float:
    """Points that a display needs: the sum of its columns, or its longest line."""
    matrix = _MATRIX.match(body)
    if matrix is None:
        return max(width(row.replace("&", "")) + _GAP * max(0, row.count("&") - 1) for row in body.split("\\\\\n"))
    rows = [row.replace(r"\\", "").replace(r"\hline", "").split("&") for row in matrix[3].split("\n")]
    widths = [width(cell) for cell in rows[0]]
    for row in rows[1:]:
        widths[: len(row)] = map(max, widths, map(width, row))
    edges = _BRACKETS * (matrix[2] == "bmatrix" or "left" in matrix[1])
    return width(matrix[1].replace(r"\left[", "")) + edges + sum(widths) + _GAP * len(widths)
