"""Writes the robot as JSON: its parts as text and numbers, and exact expressions, which the page evaluates, as lists.

A number is itself; `["q", 2]` is the third joint variable, `["p", 0]` the first runtime parameter. The other operations
are `+`, `*`, `^` with a whole exponent, and the functions of the file by name. Numbers are in radians and the file's
length unit. Texts of entries are those that `kinegen show` prints.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from kinegen import __version__
from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.limits import actuator_units, joint_limits
from kinegen.backends.scalar_types import ScalarType
from kinegen.backends.textbook.notation import TableText
from kinegen.backends.textbook.table import TableRow, TableStep, read_table
from kinegen.model.actuator_limits import reading_ranges
from kinegen.model.expression_parser import (
    Atan2,
    Call,
    Expression,
    Name,
    Number,
    Pi,
    Power,
    Product,
    Sum,
    evaluate,
    names,
)
from kinegen.model.expression_values import FLOAT64
from kinegen.model.joint_bounds import SMALLEST_REACH, reach
from kinegen.model.robot import TOOL, WRIST, JointType, Robot, Row, Step, frame_label
from kinegen.model.row_transforms import ROW_TRANSFORMS
from kinegen.tools.pictures.postures import home, home_readings, joint_ranges

Tree = Any
"""A number, or a list with an operation and its operands."""


class Trees:
    """Turns the expressions of a robot into JSON, with its constants as numbers."""

    def __init__(self, robot: Robot) -> None:
        runtime = robot.runtime_parameters
        self._places: dict[str, Tree] = {each.name: ["q", each.index] for each in robot.variables}
        self._places |= {each.name: ["p", index] for index, each in enumerate(runtime)}
        self._values: Mapping[str, float] = {
            each.name: float(evaluate(each.value, {}, FLOAT64)) for each in robot.parameters if not each.runtime
        }

    def tree(self, expression: Expression | None) -> Tree:
        """Return one expression; what has a value that never changes becomes that number."""
        if expression is None:
            return None
        # What no joint and no runtime parameter changes is computed once, here.
        if not any(name in self._places for name in names(expression)):
            return float(evaluate(expression, self._values, FLOAT64))
        match expression:
            case Name(name):
                return self._places[name]
            case Sum(parts):
                return ["+", *map(self.tree, parts)]
            case Product(parts):
                return ["*", *map(self.tree, parts)]
            case Power(base, exponent):
                return ["^", self.tree(base), exponent]
            case Call(function, argument):
                return [function, self.tree(argument)]
            case Atan2(y, x):
                return ["atan2", self.tree(y), self.tree(x)]
            case Number(value):
                return float(value)
            case Pi():
                return math.pi


Json = Any

_TEXT = TableText()


def robot_data(kernels: RobotPrograms) -> dict[str, Json]:
    """Return all that a page says of a robot, with the values of its runtime parameters: its `app.model`."""
    robot, trees = kernels.robot, Trees(kernels.robot)
    return {
        "kinegen": __version__,
        "name": robot.name,
        "description": robot.description,
        "source": robot.source,
        "digest": robot.digest,
        "units": {"length": robot.units.length, "angle": robot.units.angle},
        "conventions": [str(each) for each in robot.row_conventions],
        "links": bool(robot.links),
        "size": _size(robot),
        "root": robot.root,
        "rootLabel": frame_label(robot.root),
        "tree": robot.is_tree,
        "rows": _rows(robot, trees),
        "base": _steps(robot.base, trees),
        "joints": _joints(robot),
        "frames": _frames(robot, trees),
        "tips": list(robot.tips),
        "parameters": _parameters(kernels),
        "actuators": _actuators(robot),
        "kernels": [program.quantity.function for program in kernels.programs],
    }


def _size(robot: Robot) -> float:
    """Return how far the robot goes, in its length unit; 1 if it has no lengths."""
    found = reach(robot, (*robot.frame_names, *robot.tips))
    return found if found > SMALLEST_REACH else 1.0


def _rows(robot: Robot, trees: Trees) -> list[Json]:
    printed = read_table(robot)
    return [_row(robot, row, text, printed.columns, trees) for row, text in zip(robot.rows, printed.rows, strict=True)]


def _row(robot: Robot, row: Row, printed: TableRow, columns: tuple[str, ...], trees: Trees) -> Json:
    texts = {name: _TEXT.entry(entry) for name, entry in zip(columns, printed.entries, strict=True) if entry}
    # The page shows texts and computes with values.
    entries = {name: {"text": texts[name], "value": trees.tree(getattr(row, name))} for name in texts}
    steps = [{"kind": str(kind), "entry": entry, **entries[entry]} for kind, entry in ROW_TRANSFORMS[row.convention]]
    return {
        "name": row.name,
        "number": row.number,
        "parent": row.parent,
        "convention": str(row.convention),
        "type": str(row.type),
        "joint": None
        if row.variable is None
        else next(each.index for each in robot.variables if each.name == row.variable),
        "joints": [each.index for each in robot.variables if each.name in _row_names(row)],
        "entries": entries,
        "steps": steps or _steps(row.steps, trees, printed.steps),
    }


def _row_names(row: Row) -> set[str]:
    entries = (row.alpha, row.a, row.d, row.theta, row.beta, *(step.value for step in row.steps))
    return {name for entry in entries if entry is not None for name in names(entry)}


def _steps(steps: tuple[Step, ...], trees: Trees, printed: tuple[TableStep, ...] | None = None) -> list[Json]:
    found = [{"kind": str(step.kind), "entry": None, "text": None, "value": trees.tree(step.value)} for step in steps]
    for step, text in zip(found, printed or (), strict=False):
        step["text"] = _TEXT.entry(text.value)
    return found


def _joints(robot: Robot) -> list[Json]:
    limits = joint_limits(robot, ScalarType.DOUBLE)
    found = []
    for variable, bounds, ends, start in zip(
        robot.variables, limits, joint_ranges(robot), home(robot).tolist(), strict=True
    ):
        # A joint that others follow moves them too, and the page lights them.
        slides = variable.type is JointType.PRISMATIC
        followers = [row.name for row in robot.rows if row.variable is None and variable.name in _row_names(row)]
        found.append(
            {
                "name": variable.name,
                "type": str(variable.type),
                "angle": not slides,
                "unit": robot.units.length if slides else robot.units.angle,
                "limits": None if bounds is None else list(bounds),
                "range": list(ends),
                "home": start,
                "followers": followers,
            }
        )
    return found


def _frames(robot: Robot, trees: Trees) -> list[Json]:
    """In the order of the kernel `frames`: rows, the tool of a chain, named frames; each with the frame it is on."""
    last = robot.rows[-1].name if robot.rows else robot.root
    found: list[Json] = [{"name": row.name, "kind": "row", "parent": row.parent} for row in robot.rows]
    if not robot.is_tree:
        found.append({"name": TOOL, "kind": "tool", "parent": last, "steps": _steps(robot.tool, trees)})
    wrist = {} if WRIST in robot.frame_names else {WRIST: last}
    for frame in robot.frames:
        parent = wrist.get(frame.parent, frame.parent)
        found.append({"name": frame.name, "kind": "named", "parent": parent, "steps": _steps(frame.steps, trees)})
    return found


def _parameters(kernels: RobotPrograms) -> list[Json]:
    units = {"length": kernels.robot.units.length, "angle": kernels.robot.units.angle, "number": ""}
    return [
        {
            "name": each.name,
            "value": float(value),
            "dimension": str(each.dimension),
            "unit": units[each.dimension],
        }
        for each, value in zip(kernels.robot.runtime_parameters, kernels.defaults, strict=True)
    ]


def _actuators(robot: Robot) -> list[Json]:
    if not robot.actuators.readings:
        return []
    starts = home_readings(robot).tolist()
    return [
        {
            "name": reading.name,
            "dimension": str(reading.dimension),
            "unit": unit,
            "range": [bound if math.isfinite(bound) else None for bound in bounds],
            "home": start,
        }
        for reading, unit, bounds, start in zip(
            robot.actuators.readings, actuator_units(robot), reading_ranges(robot), starts, strict=True
        )
    ]
