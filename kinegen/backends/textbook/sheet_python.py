"""A module of Python with the closed form, and the closed form as objects of sympy."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import sympy as sp

from kinegen.backends.textbook import sheet_sentences as words
from kinegen.backends.textbook.closed_form import (
    GENERAL,
    ClosedForm,
    Factor,
    Function,
    Pi,
    Power,
    Ratio,
    Root,
    Sum,
    Symbol,
    Term,
    printed_name,
)
from kinegen.backends.textbook.notation import NOTATIONS, entry_texts
from kinegen.backends.textbook.sheet import Product, Sheet
from kinegen.backends.textbook.sheet_sentences import python_parts
from kinegen.model.expression_parser import evaluate
from kinegen.model.expression_values import FLOAT64
from kinegen.model.robot import Robot
from kinegen.support.naming import docstring_text

if TYPE_CHECKING:
    from kinegen.backends.textbook.singularities import LociForm

_PYTHON = NOTATIONS["python"]
_WORD = re.compile(r"[A-Za-z_]\w*")

_KINDS = {
    "T": "Pose",
    "J": "Jacobian",
    "D": "Determinant, or the minors, of the Jacobian",
    "A": "Orientation",
}

_MULTIPLY = '''
def multiply(left, right):
    """The product of two matrices."""
    return [[sum(row[k] * right[k][column] for k in range(4)) for column in range(4)] for row in left]
'''


def python_sheet(sheet: Sheet) -> str:
    """Lay out a sheet."""
    robot = sheet.robot
    lines = [f'"""{docstring_text(words.title(robot))}', "", "Closed form, printed by `kinegen show`. Lengths in"]
    lines[-1] += f' {robot.units.length}, angles in rad; matrices are lists of four rows.\n"""'
    parts = ["\n".join(lines), "\nimport math\n"]
    # The general link matrix has no frames to be named by.
    parts += [_function(sheet, form) for form in sheet.links if form.name != GENERAL]
    if any(len(product.factors) > 1 for product in sheet.products):
        parts.append(_MULTIPLY)
    for product in sheet.products:
        parts += [_function(sheet, form) for form in product.factors]
        if len(product.factors) > 1:
            parts.append(_product(robot, product))
    return "\n".join(parts).rstrip("\n")


def _function(sheet: Sheet, form: ClosedForm) -> str:
    robot = sheet.robot
    lines = _head(robot, form.name, _parameters(robot, (form,)), _KINDS[form.kind])
    if form.joints:
        variables = ", ".join(words.joint_name(number, sheet) for number, _ in form.joints)
        values = ", ".join(f"q[{number - 1}]" for number, _ in form.joints)
        lines.append(f"    {variables} = {values}")
    for label, angle in form.angles:
        text = _PYTHON.entry(angle)
        lines.append(f"    c{label}, s{label} = math.cos({text}), math.sin({text})")
    lines += [*python_parts(form), "    return ["]
    for row in entry_texts(form, _PYTHON):
        lines += ["        [", *(f"            {text}," for text in row), "        ],"]
    lines += [*(["        [0, 0, 0, 1],"] if form.is_transform else []), "    ]", ""]
    return "\n".join(lines)


def _product(robot: Robot, product: Product) -> str:
    """Return a function that multiplies the parts."""
    calls = []
    for form in product.factors:
        given = "".join(f", {name}={name}" for name, _ in _parameters(robot, (form,)))
        calls.append(f"{_identifier(form.name)}(q{given})")
    lines = _head(robot, product.name, _parameters(robot, product.factors))
    lines.append(f"    product = {calls[0]}")
    lines += [f"    product = multiply(product, {call})" for call in calls[1:]]
    return "\n".join([*lines, "    return product", ""])


def _head(robot: Robot, name: str, parameters: tuple[tuple[str, str], ...], what: str = "Pose") -> list[str]:
    defaults = "".join(f", {parameter}={value}" for parameter, value in parameters)
    start, _, end = _frames(name)
    return [
        "",
        f"def {_identifier(name)}(q{', *' if parameters else ''}{defaults}):",
        f'    """{what} of {end} in {start}.',
        "",
        f"    {words.vector_words(robot)}",
        '    """',
    ]


def _parameters(robot: Robot, forms: tuple[ClosedForm, ...]) -> tuple[tuple[str, str], ...]:
    """Return the parameters that occur, with the values of the file, in the units of the closed form."""
    texts = [text for form in forms for row in entry_texts(form, _PYTHON) for text in row]
    texts += [_PYTHON.entry(value) for form in forms for _, value in form.definitions]
    texts += [_PYTHON.entry(angle) for form in forms for _, angle in form.angles]
    used = {word for text in texts for word in _WORD.findall(text)}
    found = []
    for parameter in robot.parameters:
        name = _PYTHON.symbol(printed_name(parameter.name), "parameter")
        if name in used:
            found.append((name, repr(evaluate(parameter.value, {}, FLOAT64))))
    return tuple(found)


def _frames(name: str) -> tuple[str, str, str]:
    """Return the frame of reference, the letter of the quantity and the frame that is reached."""
    start, letter, end = re.split("_([TJDA][vw]?)_|(?:T(?=[0-9]+$))", name, maxsplit=1)
    return start, letter or "T", end


def _identifier(name: str) -> str:
    start, letter, end = (f"frame{part}" if part.isdecimal() else part for part in _frames(name))
    return f"{start}_{letter}_{end}"


_FUNCTIONS = {"abs": sp.Abs, **{name: getattr(sp, name) for name in "sin cos tan asin acos atan atan2 sqrt".split()}}


def sympy_product(product: Product) -> sp.MatrixBase | sp.MatMul:
    """Return a product as a matrix, or as a product of matrices that is left as it is where it is printed in parts."""
    matrices = [sympy_matrix(form) for form in product.factors]
    return matrices[0] if len(matrices) == 1 else sp.MatMul(*matrices, evaluate=False)


def sympy_matrix(form: ClosedForm) -> sp.ImmutableMatrix:
    """Return a closed form as a matrix: 4x4 with the row 0 0 0 1, or 6 rows for a Jacobian."""
    reader = _Trees(dict(form.angles))
    rows = [[reader.written_out(entry, form) for entry in row] for row in form.entries]
    if form.is_transform:
        rows.append([sp.S.Zero, sp.S.Zero, sp.S.Zero, sp.S.One])
    return sp.ImmutableMatrix(len(rows), len(rows[0]), [entry for row in rows for entry in row])


def sympy_places(form: LociForm, angles: Sequence[tuple[str, Sum]]) -> tuple[tuple[tuple[sp.Expr, ...], str], ...]:
    """Return what vanishes at each singular place, with the words for it; brackets with names are written out."""
    reader = _Trees(dict(angles))
    long = {sp.Symbol(name): reader.sum(value) for name, value in form.long}
    return tuple((tuple(reader.sum(zero).subs(long) for zero in place.zeros), place.words) for place in form.places)


class _Trees:
    """Turns ordered trees back into expressions."""

    def __init__(self, angles: Mapping[str, Sum]) -> None:
        self.angles = {label: self.sum(angle) for label, angle in angles.items()}

    def written_out(self, tree: Sum, form: ClosedForm) -> sp.Expr:
        """Return an entry without the names of its form."""
        found = self.sum(tree)
        for name, value in reversed(form.definitions):
            found = found.xreplace({sp.Symbol(name): self.sum(value)}) if found.has(sp.Symbol(name)) else found
        return found

    def sum(self, tree: Sum) -> sp.Expr:
        return sp.Add(*map(self.term, tree.terms))

    def term(self, tree: Term) -> sp.Expr:
        return sp.Mul(sp.Integer(tree.sign), *map(self.factor, tree.factors))

    def factor(self, tree: Factor) -> sp.Expr:
        match tree:
            case Symbol(label, "sine"):
                return sp.sin(self.angles[label])
            case Symbol(label, "cosine"):
                return sp.cos(self.angles[label])
            case Symbol(name):
                return sp.Symbol(name)
            case Ratio(value):
                return sp.Rational(value.numerator, value.denominator)
            case Pi():
                return sp.pi
            case Root(inside):
                return sp.sqrt(self.sum(inside))
            case Power(base, exponent):
                return self.factor(base) ** exponent
            case Function(name, arguments):
                return _FUNCTIONS[name](*map(self.sum, arguments))
            case Sum():
                return self.sum(tree)
