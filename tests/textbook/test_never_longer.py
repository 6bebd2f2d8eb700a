"""No entry that `kinegen show` prints takes more operations than the same entry in print, to which it is equal."""

from __future__ import annotations

import ast
from collections.abc import Mapping
from typing import Any

import mpmath
import pytest
import sympy as sp

from kinegen.backends.textbook.closed_form import ClosedForm, closed_form
from kinegen.backends.textbook.jacobian import jacobian_form
from kinegen.backends.textbook.notation import NOTATIONS
from kinegen.model.outputs import Reference
from tests.textbook.books import BOOKS, reading, table
from tests.textbook.catalog import NAMED_PLACES, Place, System, robot, systems
from tests.textbook.notation import read
from tests.textbook.prove import NotDecidableError, is_zero

TEXT = NOTATIONS["text"]
JACOBIANS = [book for book in BOOKS if "jacobian" in book]
POSES = [book for book in BOOKS if "entries" in book]


def name_of(book: dict[str, Any]) -> str:
    return str(book["name"]).replace(" ", "_")


def operations(text: str, *, signs: bool = False) -> int:
    """Multiplications, divisions and additions of an entry as it is written, but for those inside of angles."""
    return _operations(ast.parse(text.strip(), mode="eval").body, signs)


def _operations(node: ast.expr, signs: bool) -> int:
    match node:
        case ast.BinOp(left, ast.Pow(), right):
            return int(ast.literal_eval(right)) - 1 + _operations(left, signs)
        case ast.BinOp(left, _, right):
            return 1 + _operations(left, signs) + _operations(right, signs)
        case ast.UnaryOp(_, operand):
            return signs + _operations(operand, signs)
    return 0


def are_equal(left: sp.Expr, right: sp.Expr) -> bool:
    """Exactly, or to 40 digits at two points where an angle of the table is neither a part of pi nor a symbol."""
    try:
        return is_zero(left - right)
    except NotDecidableError:
        symbols = sorted((left - right).free_symbols, key=str)
        points = [[sp.Rational(number + point, 7 + point) for number in range(len(symbols))] for point in (1, 2)]
        values = [(left - right).subs(dict(zip(symbols, point, strict=True))).evalf(50) for point in points]
        return all(abs(mpmath.mpf(value)) < mpmath.mpf(10) ** -40 for value in values)


def compare(book: dict[str, Any], ours: ClosedForm, printed: Mapping[Place, str]) -> tuple[list[str], list[str]]:
    """What is not equal to the entries of a book, and what is longer than they are."""
    names, symbols = reading(table(book))
    own = dict(names)
    for label, text in ours.angles:
        angle = read(TEXT.entry(text), names, [])
        own |= {f"c{label}": sp.cos(angle), f"s{label}": sp.sin(angle)}
    wrong, longer = [], []
    for (row, column), text in printed.items():
        found = TEXT.entry(ours.entries[row][column])
        note = f"{row + 1}{column + 1}: {found}, in print {text}"
        wrong += [] if are_equal(read(found, own, []), read(text, names, symbols)) else [note]
        signs = book.get("signs", False)
        longer += [note] if operations(found, signs=signs) > operations(text, signs=signs) else []
    return wrong, longer


@pytest.mark.parametrize("book", POSES, ids=name_of)
def test_no_entry_is_longer_than_in_print(book: dict[str, Any]) -> None:
    printed = {NAMED_PLACES[name]: str(text) for name, text in book["entries"].items()}

    assert compare(book, closed_form(table(book), "base", "tool"), printed) == ([], [])


@pytest.mark.parametrize("book", JACOBIANS, ids=name_of)
def test_no_entry_of_a_jacobian_is_longer_than_in_print(book: dict[str, Any]) -> None:
    ours = jacobian_form(table(book), "base", "tool", Reference.LOCAL_WORLD_ALIGNED)
    printed = {(i, j): str(text) for i, row in enumerate(book["jacobian"]) for j, text in enumerate(row)}

    assert compare(book, ours, printed) == ([], [])


@pytest.mark.parametrize("system", systems(), ids=lambda system: system.key)
def test_no_published_form_is_shorter(system: System) -> None:
    """The forms of the catalogue that stand in print, which are proved to be ours elsewhere."""
    arm = robot(system.robots[0])
    longer = []
    for form in system.forms:
        if form.at_zero or form.status == "derived":
            continue
        ours = closed_form(arm, form.start, form.end)
        found = {place: TEXT.entry(ours.entries[place[0]][place[1]]) for place in form.entries}
        longer += [
            (form.name, place, found[place], text)
            for place, text in form.entries.items()
            if operations(found[place]) > operations(str(text))
        ]

    assert longer == []
