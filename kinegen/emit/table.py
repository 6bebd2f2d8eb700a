"""The table of the robot for the comment of a header, so that a reviewer finds the numbers of the code in it.

In: a robot. Out: lines of text in the units of the file, with the values of its parameters; runtime parameters stay
names.
"""

from __future__ import annotations

import math
import textwrap

from kinegen.emit.functions import LINE
from kinegen.emit.kernels import Kernels
from kinegen.naming import comment_text, macro
from kinegen.robot.dimension import Dimension
from kinegen.robot.entries import ANGLE_ENTRIES
from kinegen.robot.expressions import Expression, ExpressionError, evaluate, linear, names, substitute
from kinegen.robot.floats import FLOATS
from kinegen.robot.model import Convention, JointType, Robot, Row, Step, frame_label

_COLUMNS = ("alpha", "a", "d", "theta", "beta")


def table_lines(robot: Robot) -> tuple[str, ...]:
    """The table, one line for each row, with the fixed transforms below; empty for a robot without rows."""
    columns = tuple(key for key in _COLUMNS if any(getattr(row, key) is not None for row in robot.rows))
    head = ("row", *columns, "")
    rows = [head, *(_row(robot, row, columns) for row in robot.rows)] if robot.rows else []
    widths = [max(len(row[place]) for row in rows) for place in range(len(head))] if rows else []
    lines = [
        "  ".join([row[0].ljust(widths[0]), *(cell.rjust(width) for cell, width in zip(row[1:-1], widths[1:]))])
        + ("  " + row[-1] if row[-1] else "")
        for row in rows
    ]
    fixed = (("base", "", robot.base), ("tool", "", robot.tool))
    named = ((frame.name, f" on {frame_label(frame.parent)}", frame.steps) for frame in robot.frames)
    lines += [f"{name}{parent}: {_steps(robot, steps)}" for name, parent, steps in (*fixed, *named) if steps]
    return tuple(line.rstrip() for line in lines)


def table_title(robot: Robot) -> str:
    """What the lines are: convention and units."""
    used = dict.fromkeys(row.convention for row in robot.rows if row.convention is not Convention.ETS)
    what = f"{', '.join(used)} convention" if used else "elementary transforms"
    units = f"lengths in {robot.units.length}, angles in {robot.units.angle}"
    return f"Table of {comment_text(robot.source)}, {what}, {units}:"


def tip_lines(robot: Robot) -> tuple[str, ...]:
    """One line for each tip of a tree: its macro, its place in the results, and the row that it is on."""
    if not robot.is_tree:
        return ()
    links = robot.frame_links
    rows = [
        (macro(robot.name, f"TIP_{tip}"), f"{place}", tip, f"on {links[tip]}" if tip in links else "")
        for place, tip in enumerate(robot.tips)
    ]
    widths = [max(len(row[place]) for row in rows) for place in range(4)]
    return tuple("  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows)


def command_lines(kernels: Kernels, *more: str) -> tuple[str, ...]:
    """The command that makes the kernels of a header again, in lines of a comment; `more` are further options."""
    text = command_line(kernels, *more)
    return tuple(textwrap.wrap(text, LINE - 4, break_long_words=False, break_on_hyphens=False))


def command_line(kernels: Kernels, *more: str) -> str:
    """The same in one line."""
    outputs = [str(program.quantity) for program in kernels.programs]
    outputs += map(str, kernels.solvers)
    chosen = [parameter.name for parameter in kernels.robot.parameters if parameter.chosen]
    options = [f"--outputs {_listed(outputs)}", *([f"--wrt {_listed(chosen)}"] if chosen else [])]
    options += [f"--redundancy {kernels.robot.redundancy}"] * bool(kernels.robot.redundancy)
    options += more
    return " ".join([f"kinegen build {comment_text(kernels.robot.source)}", *options])


def _listed(words: list[str]) -> str:
    """A list for the command line, with spaces to be broken at where it is long."""
    plain = ",".join(words)
    return plain if len(plain) < LINE // 2 else f'"{", ".join(words)}"'


def _row(robot: Robot, row: Row, columns: tuple[str, ...]) -> tuple[str, ...]:
    cells = []
    for key in columns:
        entry = getattr(row, key)
        dimension = Dimension.ANGLE if key in ANGLE_ENTRIES else Dimension.LENGTH
        cells.append("" if entry is None else _value(robot, entry, dimension))
    above = robot.root if row.number == 1 else robot.rows[row.number - 2].name
    parent = "" if row.parent == above else f"on {frame_label(row.parent)}"
    sequence = _steps(robot, row.steps) if row.convention is Convention.ETS else ""
    return (row.name, *cells, "  ".join(part for part in (sequence, parent) if part))


def _steps(robot: Robot, steps: tuple[Step, ...]) -> str:
    def value(step: Step) -> str:
        return _value(robot, step.value, Dimension.ANGLE if step.kind.is_rotation else Dimension.LENGTH)

    return " ".join(f"{step.kind}({value(step)})" for step in steps)


def _value(robot: Robot, expression: Expression, dimension: Dimension) -> str:
    """One entry: joint variables as q[0], runtime parameters by name, the rest as one number."""
    runtime = {parameter.name: parameter for parameter in robot.runtime_parameters}
    values = {entry.name: entry.value for entry in robot.parameters if entry.name not in runtime}
    closed = substitute(expression, values)
    places = {variable.name: f"q[{variable.index}]" for variable in robot.variables}
    degrees = math.degrees(1) if robot.units.angle == "deg" and dimension is Dimension.ANGLE else 1.0
    try:
        factors, rest = linear(closed, frozenset(places) | frozenset(runtime))
    except ExpressionError:  # a runtime parameter in a product or under a root
        return f"f({', '.join(places.get(name, name) for name in names(closed))})"
    slides = {variable.name for variable in robot.variables if variable.type is JointType.PRISMATIC}
    lengths = slides | {name for name, entry in runtime.items() if entry.dimension is not Dimension.ANGLE}
    text = ""
    for name, factor in factors.items():
        size = float(evaluate(factor, {}, FLOATS)) * (degrees if name in lengths else 1.0)
        text = _joined(text, size, places.get(name, name))
    constant = float(evaluate(rest, {}, FLOATS)) * degrees
    return _joined(text, constant, "") if constant or not text else text


def _joined(text: str, size: float, name: str) -> str:
    """A term behind others."""
    number = f"{abs(size):.10g}"
    term = name if name and number == "1" else f"{number}*{name}" if name else number
    if not text:
        return f"-{term}" if size < 0 else term
    return f"{text} {'-' if size < 0 else '+'} {term}"
