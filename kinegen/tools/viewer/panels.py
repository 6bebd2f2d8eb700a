"""Collects the data of the panels: tables, the closed form, the inverse, singular places.

Each row of a table has its elementary transforms with values as trees, in the order of its convention, so that the page
computes frames between the transforms by itself. The page evaluates trees at the present joints, lights the joints that
a term holds, and names singular places that are near.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.inverse import branches_of
from kinegen.backends.textbook.closed_form import ClosedForm, Sum, Symbol, printed_name
from kinegen.backends.textbook.notation import entry_names
from kinegen.backends.textbook.sheet import Product, Sheet, make_sheet
from kinegen.backends.textbook.sheet_mathml import name_markup
from kinegen.backends.textbook.sheet_sentences import ONE_ROW
from kinegen.backends.textbook.singularities import LociForm, loci_form
from kinegen.backends.textbook.table import TableRow, TableStep, read_table
from kinegen.errors import KinegenError
from kinegen.model.dh_conversion import to_convention
from kinegen.model.expression_parser import evaluate
from kinegen.model.expression_values import FLOAT64
from kinegen.model.joint_bounds import joint_box, reach
from kinegen.model.robot import Convention, JointType, Robot, Row, Step, StepKind, frame_label
from kinegen.model.row_transforms import ROW_TRANSFORMS
from kinegen.tools.viewer.closed_form_json import MARKED, TABLE, Math, math_list, pieces, printed_tree
from kinegen.tools.viewer.data import Tree, Trees

MOST_TABLE_ROWS = 64
"""Longer tables are shown in their own convention alone."""

_TITLES = {
    Convention.STANDARD: "standard DH",
    Convention.MODIFIED: "modified DH",
    Convention.MODIFIED_PREV_D: "modified DH, offsets in the row before",
    Convention.HAYATI: "Hayati",
    Convention.ETS: "elementary transforms",
}


def rows_model(robot: Robot) -> dict[str, Any]:
    """Return every table of a robot that the page shows.

    Returns:
        `tables`, that of the file first, and `missing`, a sentence for each convention without one. Values are in
        radians and the file's length unit; texts in the units of the file.
    """
    tables = [_table(robot, own=True)]
    missing = []
    for convention in (Convention.STANDARD, Convention.MODIFIED) if robot.dof else ():
        if all(row.convention is convention for row in robot.rows):
            continue
        # The other conventions of a long table take long, and nobody reads them on a page.
        if len(robot.rows) > MOST_TABLE_ROWS:
            missing.append(f"the {convention} table is left out: the robot has more than {MOST_TABLE_ROWS} rows")
            continue
        try:
            converted = to_convention(robot, convention)
        except KinegenError as error:
            missing.append(error.message)
            continue
        tables.append(_table(converted.robot, own=False) | {"notes": [*converted.free, *converted.rounded]})
    return {"tables": tables, "missing": missing}


def _table(robot: Robot, *, own: bool) -> dict[str, Any]:
    table, trees = read_table(robot), Trees(robot)
    rows = [_row(robot, row, shown, trees) for row, shown in zip(robot.rows, table.rows, strict=True)]
    # A table of several conventions has no product that holds for all rows.
    kinds = robot.row_conventions
    mixed = len(kinds) > 1
    convention = robot.convention if mixed else kinds[0]
    printed = {frame.name: frame.steps for frame in table.frames}
    return {
        "convention": str(convention),
        "title": _TITLES[convention],
        "product": ""
        if mixed
        else f"one row is {ONE_ROW[convention]}"
        if convention in ONE_ROW
        else "from left to right",
        "own": own,
        "mixed": mixed,
        "columns": [[column, _index(column, convention, mixed=mixed)] for column in table.columns],
        "base": _steps(robot.base, printed.get("0", ()), trees),
        "rows": rows,
        "tool": _steps(robot.tool, printed.get("tool", ()), trees),
        "notes": [],
    }


def _index(column: str, convention: Convention, *, mixed: bool) -> str:
    """Return the index of a column in the books: i, or i-1 for alpha and a after Craig."""
    return "" if mixed else "i\u22121" if convention is Convention.MODIFIED and column in ("alpha", "a") else "i"


def _row(robot: Robot, row: Row, shown: TableRow, trees: Trees) -> dict[str, Any]:
    """Return one row; `parent` counts rows from 0 and is -1 for the frame after the base transform."""
    order = {each.name: place for place, each in enumerate(robot.rows)}
    # Entries of a table have columns of their own; steps of a sequence have texts.
    if row.convention is Convention.ETS:
        steps = _steps(row.steps, shown.steps, trees)
    else:
        steps = [
            {"kind": str(kind), "column": column, "value": trees.tree(getattr(row, column))}
            for kind, column in ROW_TRANSFORMS[row.convention]
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
    """Return an elementary sequence, each step with its value as people read it."""
    texts: list[Math | None] = [math_list(TABLE.entry(each.value)) for each in shown]
    texts += [None] * (len(steps) - len(texts))
    return [
        {"kind": str(StepKind(step.kind)), "value": trees.tree(step.value), "text": text}
        for step, text in zip(steps, texts, strict=True)
    ]


MOST_ROWS = 40
"""The closed form of a longer table would fill the page and help nobody."""


def formula_model(robot: Robot) -> dict[str, Any]:
    """Return the closed form of the pose of every tip.

    Returns:
        `products`, one for each tip: `name`, `factors` (each with `name` and `entries`, three rows of four);
        `angles`, label, tree, text and joints (from 0) of each; `parameters`, as printed with value, name in the file
        and unit. Values are in radians and the file's length unit. With a sentence as `missing` instead where the
        form is too long.
    """
    if len(robot.rows) > MOST_ROWS:
        return {"missing": f"the closed form of {len(robot.rows)} rows is too long to be shown beside the arm"}
    try:
        sheet = make_sheet(robot, None, None)
    except KinegenError as error:
        return {"missing": error.message}
    return {
        "products": [_product(product) for product in sheet.products],
        "angles": [_angle(label, angle) for label, angle in sheet.angles],
        "parameters": _parameters(sheet),
    }


def _product(product: Product) -> dict[str, Any]:
    return {"name": math_list(name_markup(product.name)), "factors": [_form(form) for form in product.factors]}


def _form(form: ClosedForm) -> dict[str, Any]:
    """Return one transform; the terms of an entry are apart, so that a line can be broken between them."""
    names = entry_names(form)
    return {
        "name": math_list(name_markup(form.name)),
        "entries": [
            [
                {"name": name, "terms": pieces(entry), "value": printed_tree(entry)}
                for name, entry in zip(*row, strict=True)
            ]
            for row in zip(names, form.entries, strict=True)
        ],
    }


def _angle(label: str, angle: Sum) -> dict[str, Any]:
    tree = printed_tree(angle)
    return {"label": label, "value": tree, "text": math_list(MARKED.entry(angle)), "joints": sorted(_joints(tree))}


def _joints(tree: Tree) -> set[int]:
    """Return the joint variables of a tree, from 0."""
    if not isinstance(tree, list):
        return set()
    return {tree[1]} if tree[0] == "q" else {joint for part in tree[1:] for joint in _joints(part)}


def _parameters(sheet: Sheet) -> list[dict[str, Any]]:
    """Return those that occur in the closed form or the table, by the names under which they are printed."""
    used = {each.name for each in sheet.table.parameters}
    units = {each.name: each.unit for each in sheet.table.parameters}
    return [
        {
            "name": parameter.name,
            "printed": printed_name(parameter.name),
            "text": math_list(MARKED.factor(Symbol(printed_name(parameter.name), "parameter"), in_product=False)),
            "value": float(evaluate(parameter.value, {}, FLOAT64)),
            "unit": units[printed_name(parameter.name)],
            "dimension": str(parameter.dimension),
            "runtime": parameter.runtime,
        }
        for parameter in sheet.robot.parameters
        if printed_name(parameter.name) in used
    ]


MOST_JOINTS = 7
"""The factors of more joints take seconds, and are hardly read beside the arm."""


def singular_model(robot: Robot) -> list[Any]:
    """Return the singular places of every tip.

    Returns:
        For each tip a list of places: `words`, and `zeros`, the trees of what vanishes there, as `valueOf` of the page
        reads them. Empty for a tip whose factors are not known.
    """
    return [_places(robot, tip) for tip in robot.tips]


def _places(robot: Robot, tip: str) -> list[Any]:
    if robot.dof > MOST_JOINTS:
        return []
    # No determinant is known of some arms, and the page then says nothing.
    try:
        form = loci_form(robot, robot.root, tip)
    except KinegenError:
        return []
    known = _Known(robot, form)
    return [
        {"words": place.words, "zeros": [known.tree(printed_tree(zero)) for zero in place.zeros]}
        for place in form.places
        if place.words
    ]


class _Known:
    """Puts what names stand for into trees."""

    def __init__(self, robot: Robot, form: LociForm) -> None:
        places = {each.name: index for index, each in enumerate(robot.runtime_parameters)}
        self.names: dict[str, Tree] = {
            printed_name(each.name): ["p", places[each.name]]
            if each.name in places
            else float(evaluate(each.value, {}, FLOAT64))
            for each in robot.parameters
        }
        angles = form.angles
        self.angles: Mapping[str, Tree] = {label: self.tree(printed_tree(angle)) for label, angle in angles}
        self.names |= {name: self.tree(printed_tree(value)) for name, value in form.long}

    def tree(self, tree: Tree) -> Tree:
        match tree:
            case ["n", name]:
                return self.names[name]
            case ["c", label]:
                return ["cos", self.angles[label]]
            case ["s", label]:
                return ["sin", self.angles[label]]
            case [operation, *parts] if operation not in ("q", "p"):
                return [operation, *map(self.tree, parts)]
        return tree


def inverse_model(kernels: RobotPrograms) -> dict[str, Any]:
    """Return what the panels of the inverse and of the Jacobian take from Python.

    Returns:
        `reach` of the tips in the file's length unit; `units`, 1 for each joint that turns and the reach for each that
        shifts; `box`, the ends of each joint variable; `periods`, what a whole turn of a joint is in its variable,
        null where it must not be turned; `family`, `meanings`, `conditions` and `readsAttitude` of the closed form.
    """
    robot, size = kernels.robot, reach(kernels.robot)
    branches = branches_of(kernels)
    # Without a closed form the page searches, and turns joints by whole turns.
    turns = [2 * math.pi if each.type is JointType.REVOLUTE else math.inf for each in robot.variables]
    return {
        "reach": size,
        "units": [size if each.type is JointType.PRISMATIC else 1.0 for each in robot.variables],
        "box": [list(ends) for ends in joint_box(robot)],
        "periods": [each if math.isfinite(each) else None for each in (branches.turns if branches else turns)],
        "family": branches.family if branches else None,
        "branches": list(branches.names) if branches else [],
        "meanings": list(branches.meanings) if branches else [],
        "conditions": list(branches.conditions) if branches else [],
        "readsAttitude": branches.reads_attitude if branches else True,
    }


PANEL_SCRIPTS = (
    "algebra.js",
    "story.js",
    "solve.js",
    "spectrum.js",
    "cloud.js",
    "shapes.js",
    "subject.js",
    "table.js",
    "formula.js",
    "inverse.js",
    "motion.js",
)
"""The scripts of the panels in the order in which they run, behind those of the core; the first five need no page."""


def panel_data(kernels: RobotPrograms) -> dict[str, Any]:
    """Return the data of the panels as JSON: `tables`, `formula`, `inverse` and `singularities`."""
    robot = kernels.robot
    return {
        "tables": rows_model(robot),
        "formula": formula_model(robot),
        "inverse": inverse_model(kernels),
        "singular": singular_model(robot),
    }
