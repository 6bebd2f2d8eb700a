"""The closed form for the page: as `kinegen show` prints it, with a tree for everything that has a value.

In: a robot. Out: JSON. The page evaluates the trees at the present joints and lights the joints that a term holds.
"""

from __future__ import annotations

from typing import Any

from kinegen.errors import KinegenError
from kinegen.robot.expressions import evaluate
from kinegen.robot.floats import FLOATS
from kinegen.robot.model import Robot
from kinegen.textbook.closed_form import ClosedForm, Sum, Symbol, printed_name
from kinegen.textbook.notation import entry_names
from kinegen.textbook.sheet import Product, Sheet, make_sheet
from kinegen.textbook.sheet_mathml import name_markup
from kinegen.viewer.expressions import Tree
from kinegen.viewer.mathml import MARKED, math_list, pieces
from kinegen.viewer.printed import printed_tree

MOST_ROWS = 40
"""The closed form of a longer table would fill the page and help nobody."""


def formula_model(robot: Robot) -> dict[str, Any]:
    """The closed form of the pose of every tip.

    Args:
        robot: The robot.

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
    """One transform; the terms of an entry are apart, so that a line can be broken between them."""
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
    """The joint variables of a tree, from 0."""
    if not isinstance(tree, list):
        return set()
    return {tree[1]} if tree[0] == "q" else {joint for part in tree[1:] for joint in _joints(part)}


def _parameters(sheet: Sheet) -> list[dict[str, Any]]:
    """Those that occur in the closed form or the table, by the names under which they are printed."""
    used = {each.name for each in sheet.table.parameters}
    units = {each.name: each.unit for each in sheet.table.parameters}
    return [
        {
            "name": parameter.name,
            "printed": printed_name(parameter.name),
            "text": math_list(MARKED.factor(Symbol(printed_name(parameter.name), "parameter"), in_product=False)),
            "value": float(evaluate(parameter.value, {}, FLOATS)),
            "unit": units[printed_name(parameter.name)],
            "dimension": str(parameter.dimension),
            "runtime": parameter.runtime,
        }
        for parameter in sheet.robot.parameters
        if printed_name(parameter.name) in used
    ]
