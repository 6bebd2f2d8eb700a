"""The robot as JSON: names, units, rows, joints, frames, parameters and actuators, as text and as numbers.

Numbers are in radians and the file's length unit. Texts of entries are those that `kinegen show` prints.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from kinegen import __version__
from kinegen.emit.actuators import actuator_units
from kinegen.emit.kernels import Kernels
from kinegen.emit.limits import joint_limits
from kinegen.emit.reals import Real
from kinegen.robot.actuators.extent import reading_ranges
from kinegen.robot.expressions import names
from kinegen.robot.extent import SMALLEST_REACH, joint_box, reach
from kinegen.robot.model import TOOL, WRIST, Convention, JointType, Robot, Row, Step, frame_label
from kinegen.textbook.notation import TableText
from kinegen.textbook.table import TableRow, TableStep, read_table
from kinegen.viewer.expressions import Trees

Json = Any

_TEXT = TableText()
_SEQUENCES: Mapping[Convention, tuple[tuple[str, str], ...]] = {
    Convention.STANDARD: (("Rz", "theta"), ("Tz", "d"), ("Tx", "a"), ("Rx", "alpha")),
    Convention.MODIFIED: (("Rx", "alpha"), ("Tx", "a"), ("Rz", "theta"), ("Tz", "d")),
    Convention.MODIFIED_PREV_D: (("Rx", "alpha"), ("Rz", "theta"), ("Tx", "a"), ("Tz", "d")),
    Convention.HAYATI: (("Rz", "theta"), ("Tx", "a"), ("Rx", "alpha"), ("Ry", "beta")),
    Convention.ETS: (),
}
"""The elementary transforms of a row, in their order, each with its entry (see `symbolic/transforms.py`)."""


def robot_data(kernels: Kernels) -> dict[str, Json]:
    """Everything that a page says of a robot.

    Args:
        kernels: The robot, and the values of its runtime parameters.

    Returns:
        An object of JSON; the page has it as `app.model`.
    """
    robot, trees = kernels.robot, Trees(kernels.robot)
    return {
        "kinegen": __version__,
        "name": robot.name,
        "description": robot.description,
        "source": robot.source,
        "digest": robot.digest,
        "units": {"length": robot.units.length, "angle": robot.units.angle},
        "convention": str(robot.convention),
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
    """How far the robot goes, in its length unit; 1 if it has no lengths."""
    found = reach(robot, (*robot.frame_names, *robot.tips))
    return found if found > SMALLEST_REACH else 1.0


def _rows(robot: Robot, trees: Trees) -> list[Json]:
    printed = read_table(robot)
    return [_row(robot, row, text, printed.columns, trees) for row, text in zip(robot.rows, printed.rows, strict=True)]


def _row(robot: Robot, row: Row, printed: TableRow, columns: tuple[str, ...], trees: Trees) -> Json:
    texts = {name: _TEXT.entry(entry) for name, entry in zip(columns, printed.entries, strict=True) if entry}
    sequence = _SEQUENCES[row.convention]
    entries = {name: {"text": texts[name], "value": trees.tree(getattr(row, name))} for name in texts}
    steps = [{"kind": kind, "entry": entry, **entries[entry]} for kind, entry in sequence]
    return {
        "name": row.name,
        "number": row.number,
        "parent": row.parent,
        "convention": str(row.convention),
        "type": str(row.type),
        "joint": None if row.variable is None else _index(robot, row.variable),
        "joints": [each.index for each in robot.variables if each.name in _row_names(row)],
        "entries": entries,
        "steps": steps or _steps(row.steps, trees, printed.steps),
    }


def _index(robot: Robot, name: str) -> int:
    """The place of a joint variable in q."""
    return next(each.index for each in robot.variables if each.name == name)


def _row_names(row: Row) -> set[str]:
    entries = (row.alpha, row.a, row.d, row.theta, row.beta, *(step.value for step in row.steps))
    return {name for entry in entries if entry is not None for name in names(entry)}


def _steps(steps: tuple[Step, ...], trees: Trees, printed: tuple[TableStep, ...] | None = None) -> list[Json]:
    found = [{"kind": str(step.kind), "entry": None, "text": None, "value": trees.tree(step.value)} for step in steps]
    for step, text in zip(found, printed or (), strict=False):
        step["text"] = _TEXT.entry(text.value)
    return found


def _joints(robot: Robot) -> list[Json]:
    limits = joint_limits(robot, Real.DOUBLE)
    found = []
    for variable, bounds, box in zip(robot.variables, limits, joint_box(robot), strict=True):
        slides = variable.type is JointType.PRISMATIC
        low, high = box
        home = min(max(0.0, low), high)
        followers = [row.name for row in robot.rows if row.variable is None and variable.name in _row_names(row)]
        found.append(
            {
                "name": variable.name,
                "type": str(variable.type),
                "angle": not slides,
                "unit": robot.units.length if slides else robot.units.angle,
                "limits": None if bounds is None else list(bounds),
                "range": [low, high],
                "home": home,
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


def _parameters(kernels: Kernels) -> list[Json]:
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
    ranges = reading_ranges(robot)
    return [
        {
            "name": reading.name,
            "dimension": str(reading.dimension),
            "unit": unit,
            "range": [bound if math.isfinite(bound) else None for bound in bounds],
        }
        for reading, unit, bounds in zip(robot.actuators.readings, actuator_units(robot), ranges, strict=True)
    ]
