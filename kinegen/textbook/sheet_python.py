"""Python: a module with one function for each transform, which needs nothing but the standard library."""

from __future__ import annotations

import re

from kinegen.naming import docstring_text
from kinegen.robot.expressions import evaluate
from kinegen.robot.floats import FLOATS
from kinegen.robot.model import Robot
from kinegen.textbook import sheet_words as words
from kinegen.textbook.closed_form import ClosedForm, printed_name
from kinegen.textbook.notation import NOTATIONS, entry_texts
from kinegen.textbook.sheet import Product, Sheet

_PYTHON = NOTATIONS["python"]
_WORD = re.compile(r"[A-Za-z_]\w*")

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
    parts += [_function(robot, form) for form in sheet.links]
    if any(len(product.factors) > 1 for product in sheet.products):
        parts.append(_MULTIPLY)
    for product in sheet.products:
        parts += [_function(robot, form) for form in product.factors]
        if len(product.factors) > 1:
            parts.append(_product(robot, product))
    return "\n".join(parts).rstrip("\n")


def _function(robot: Robot, form: ClosedForm) -> str:
    lines = _head(robot, form.name, _parameters(robot, (form,)), "Pose" if form.is_transform else "Jacobian")
    if form.joints:
        variables = ", ".join(f"q{number}" for number, _ in form.joints)
        values = ", ".join(f"q[{number - 1}]" for number, _ in form.joints)
        lines.append(f"    {variables} = {values}")
    for label, angle in form.angles:
        text = _PYTHON.entry(angle)
        lines.append(f"    c{label}, s{label} = math.cos({text}), math.sin({text})")
    lines.append("    return [")
    for row in entry_texts(form, _PYTHON):
        lines += ["        [", *(f"            {text}," for text in row), "        ],"]
    lines += [*(["        [0, 0, 0, 1],"] if form.is_transform else []), "    ]", ""]
    return "\n".join(lines)


def _product(robot: Robot, product: Product) -> str:
    """A function that multiplies the parts."""
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
    """The parameters that occur, with the values of the file, in the units of the closed form."""
    texts = [text for form in forms for row in entry_texts(form, _PYTHON) for text in row]
    texts += [_PYTHON.entry(angle) for form in forms for _, angle in form.angles]
    used = {word for text in texts for word in _WORD.findall(text)}
    found = []
    for parameter in robot.parameters:
        name = _PYTHON.symbol(printed_name(parameter.name), "parameter")
        if name in used:
            found.append((name, repr(evaluate(parameter.value, {}, FLOATS))))
    return tuple(found)


def _frames(name: str) -> tuple[str, str, str]:
    """The frame of reference, the letter of the quantity and the frame that is reached."""
    start, letter, end = re.split("_([TJ])_|(?:T(?=[0-9]+$))", name, maxsplit=1)
    return start, letter or "T", end


def _identifier(name: str) -> str:
    start, letter, end = (f"frame{part}" if part.isdecimal() else part for part in _frames(name))
    return f"{start}_{letter}_{end}"
