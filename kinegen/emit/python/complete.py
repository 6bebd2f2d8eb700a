"""The complete inverse in the public module: its constants as Python text."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import mpmath

from kinegen.emit.complete.choose import SHIFTS, complete_of
from kinegen.emit.complete.numbers import ACCEPTED, ASIDES, MERGED, NEARLY_REAL
from kinegen.emit.complete.tables import Elimination
from kinegen.emit.environment import environment
from kinegen.emit.kernels import Kernels, provenance

TABLES = "_eliminations.py"
"""The module of a package with the constants."""


def emit_tables(kernels: Kernels) -> dict[str, str]:
    """Print the constants of the eliminations of an arm, as a module."""
    complete = complete_of(kernels.robot)
    template = environment().get_template("python/_eliminations.py.jinja")
    text = template.render(
        name=kernels.robot.name,
        provenance=provenance(kernels.robot),
        tables=tuple(map(_fields, complete.eliminations, SHIFTS)),
        bounds=", ".join(map(repr, (ACCEPTED, MERGED, NEARLY_REAL, complete.scale, ASIDES))),
    )
    return {TABLES: text}


def _fields(elimination: Elimination, shift: float) -> dict[str, tuple[str, ...]]:
    """The fields of one elimination; each has one line or a line for each row."""
    with mpmath.workdps(30):
        turned = [mpmath.cos(shift), mpmath.sin(shift)]
    return {
        "order": (f"({', '.join(map(str, elimination.order))})",),
        "backwards": (str(elimination.backwards),),
        "closes_first": (str(elimination.closes_first),),
        "real": (str(elimination.real),),
        "shift": (_row(turned),),
        "left": (_motion(elimination.left),),
        "right": (_motion(elimination.right),),
        "fixed": (_motion(elimination.fixed),),
        "along": tuple(map(_row, elimination.along)),
        "across_x": tuple(_row(entry.real for entry in row) for row in elimination.across),
        "across_y": tuple(_row(entry.imag for entry in row) for row in elimination.across),
        "basis": tuple(_row(vector[row] for vector in elimination.basis) for row in range(12)),
    }


def _motion(matrix: Any) -> str:
    return _row(matrix[row, column] for row in range(3) for column in range(4))


def _row(numbers: Iterable[Any]) -> str:
    values = [float(number) for number in numbers]
    return f"({', '.join(repr(value if abs(value) > 1e-25 else 0.0) for value in values)})"
