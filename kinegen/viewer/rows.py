"""The tables of a robot for the page: its own, and the standard and modified ones of the same arm.

In: a robot. Out: JSON. Each row has its entries as text for people and its elementary transforms with values as trees,
in the order of its convention, so that the page computes frames between the transforms by itself.
"""

from __future__ import annotations

from typing import Any

from kinegen.errors import KinegenError
from kinegen.robot.model import Convention, Robot, Row, Step, StepKind, frame_label
from kinegen.tables import to_convention
from kinegen.textbook.sheet_words import ONE_ROW
from kinegen.textbook.table import TableRow, TableStep, read_table
from kinegen.viewer.expressions import Trees
from kinegen.viewer.mathml import TABLE, Math, math_list

MOST_ROWS = 64
"""Longer tables are shown in their own convention alone."""

_ORDER = {
    Convention.STANDARD: (("Rz", "theta"), ("Tz", "d"), ("Tx", "a"), ("Rx", "alpha")),
    Convention.MODIFIED: (("Rx", "alpha"), ("Tx", "a"), ("Rz", "theta"), ("Tz", "d")),
    Convention.MODIFIED_PREV_D: (("Rx", "alpha"), ("Rz", "theta"), ("Tx", "a"), ("Tz", "d")),
    Convention.HAYATI: (("Rz", "theta"), ("Tx", "a"), ("Rx", "alpha"), ("Ry", "beta")),
}
"""The elementary transforms of a row with the columns that their values are in; `ONE_ROW` says the same in words."""

_TITLES = {
    Convention.STANDARD: "standard",
    Convention.MODIFIED: "modified",
    Convention.MODIFIED_PREV_D: "modified, offsets in the row before",
    Convention.HAYATI: "Hayati",
    Convention.ETS: "elementary transforms",
}


def rows_model(robot: Robot) -> dict[str, Any]:
    """Every table of a robot that the page shows.

    Args:
        robot: The robot.

    Returns:
        `tables`, that of the file first, and `missing`, a sentence for each convention without one. Values are in
        radians and the file's length unit; texts in the units of the file.
    """
    tables = [_table(robot, robot.convention, own=True)]
    missing = []
    for convention in (Convention.STANDARD, Convention.MODIFIED) if robot.dof else ():
        if all(row.convention is convention for row in robot.rows):
            continue
        if len(robot.rows) > MOST_ROWS:
            missing.append(f"the {convention} table is left out: the robot has more than {MOST_ROWS} rows")
            continue
        try:
            converted = to_convention(robot, convention)
        except KinegenError as error:
            missing.append(error.message)
            continue
        tables.append(_table(converted.robot, convention, own=False) | {"notes": [*converted.free, *converted.rounded]})
    return {"tables": tables, "missing": missing}


def _table(robot: Robot, convention: Convention, *, own: bool) -> dict[str, Any]:
    table, trees = read_table(robot), Trees(robot)
    rows = [_row(robot, row, shown, trees) for row, shown in zip(robot.rows, table.rows, strict=True)]
    mixed = len({row.convention for row in robot.rows}) > 1
    printed = {frame.name: frame.steps for frame in table.frames}
    return {
        "convention": str(convention),
        "title": _TITLES[convention],
        "product": "" if mixed else ONE_ROW.get(convention, "elementary transforms, from left to right"),
        "own": own,
        "mixed": mixed,
        "columns": [[column, _index(column, convention, mixed=mixed)] for column in table.columns],
        "base": _steps(robot.base, printed.get("0", ()), trees),
        "rows": rows,
        "tool": _steps(robot.tool, printed.get("tool", ()), trees),
        "notes": [],
    }


def _index(column: str, convention: Convention, *, mixed: bool) -> str:
    """The index of a column in the books: i, or i-1 for alpha and a after Craig."""
    return "" if mixed else "i\u22121" if convention is Convention.MODIFIED and column in ("alpha", "a") else "i"


def _row(robot: Robot, row: Row, shown: TableRow, trees: Trees) -> dict[str, Any]:
    """One row; `parent` counts rows from 0 and is -1 for the frame after the base transform."""
    order = {each.name: place for place, each in enumerate(robot.rows)}
    if row.convention is Convention.ETS:
        steps = _steps(row.steps, shown.steps, trees)
    else:
        steps = [
            {"kind": kind, "column": column, "value": trees.tree(getattr(row, column))}
            for kind, column in _ORDER[row.convention]
        ]
    return {
        "number": row.number,
        "name": row.name,
        "parent": order.get(row.parent, -1),
        "parentName": frame_label(row.parent),
        "convention": _TITLES[row.convention],
        "joint": next((each.index for each in robot.variables if each.name == row.variable), -1),
        "cells": [None if entry is None else math_list(TABLE.entry(entry)) for entry in shown.entries],
        "steps": steps,
    }


def _steps(steps: tuple[Step, ...], shown: tuple[TableStep, ...], trees: Trees) -> list[dict[str, Any]]:
    """An elementary sequence, each step with its value as people read it."""
    texts: list[Math | None] = [math_list(TABLE.entry(each.value)) for each in shown]
    texts += [None] * (len(steps) - len(texts))
    return [
        {"kind": str(StepKind(step.kind)), "value": trees.tree(step.value), "text": text}
        for step, text in zip(steps, texts, strict=True)
    ]
