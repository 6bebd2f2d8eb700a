"""What every notation says about a robot in the same words: conventions, parts of a form, singular places."""

from __future__ import annotations

from collections.abc import Callable
from textwrap import wrap
from typing import TYPE_CHECKING

from kinegen.backends.textbook.closed_form import ClosedForm, Sum
from kinegen.backends.textbook.notation import NOTATIONS
from kinegen.backends.textbook.printing import Notation
from kinegen.backends.textbook.sheet import Sheet
from kinegen.backends.textbook.table import TableRow
from kinegen.model.robot import Convention, JointType, Robot
from kinegen.model.row_transforms import ROW_TRANSFORMS
from kinegen.support.text_layout import broken

if TYPE_CHECKING:
    from kinegen.backends.textbook.singularities import LociForm, Place

ONE_ROW = {
    convention: " ".join(f"{kind}({entry})" for kind, entry in transforms)
    for convention, transforms in ROW_TRANSFORMS.items()
    if transforms
}
"""The product that a row of each table convention stands for."""

_BOOKS = {Convention.STANDARD: " (distal, Paul)", Convention.MODIFIED: " (proximal, Craig)"}


def title(robot: Robot) -> str:
    """Return name and description."""
    return f"{robot.name}: {robot.description}" if robot.description else robot.name


def conventions(sheet: Sheet) -> tuple[str, ...]:
    """Return one sentence for each convention of the table."""
    used = dict.fromkeys(row.convention for row in sheet.table.rows)
    tables = [convention for convention in used if convention is not Convention.ETS]
    sentences = [f"{name} convention{_BOOKS.get(name, '')}: one row is {ONE_ROW[name]}" for name in tables]
    sequences = "elementary transforms, from left to right" if Convention.ETS in used else ""
    return (*sentences, sequences) if sequences else tuple(sentences)


def units(robot: Robot) -> str:
    """Return the units of the table and of the closed form."""
    length, angle = robot.units.length, robot.units.angle
    if angle == "rad" or not robot.dof:
        return f"units: {length} and {angle}"
    return f"units: {length} and {angle} in the table, {length} and rad in the closed form"


def index(column: str, sheet: Sheet) -> str:
    """Return the index of an entry in the books: i, or i-1 for alpha and a after Craig; none where rows differ."""
    used = {row.convention for row in sheet.table.rows} - {Convention.ETS}
    if len(used) > 1:
        return ""
    return "i-1" if used == {Convention.MODIFIED} and column in ("alpha", "a") else "i"


def has_parents(robot: Robot) -> bool:
    """Return whether a row follows another one than that above it."""
    above = [robot.root, *(row.name for row in robot.rows)]
    return any(row.parent != name for row, name in zip(robot.rows, above, strict=False))


def parent_number(row: TableRow, robot: Robot) -> str:
    """Return the number of the row from which a row leads on; 0 for the base."""
    return next((str(other.number) for other in robot.rows if other.name == row.parent), "0")


def same_as(parent: str) -> str:
    """Return what a frame without a transform is."""
    return f"same as {parent}"


def joint_words(sheet: Sheet) -> tuple[str, ...]:
    """Return every joint variable that occurs with the name of its joint."""
    return tuple(f"{joint_name(number, sheet)} {name}" for number, name in sheet.table.joints)


def joint_name(number: int, sheet: Sheet) -> str:
    """Return what a joint variable is called."""
    return dict(sheet.variables).get(f"q{number}", f"q{number}")


def vector_words(robot: Robot) -> str:
    """Return the joint vector with its units, for docstrings."""
    if not robot.dof:
        return "No joint variables."
    entries = (f"{v.name} [{robot.units.length if v.type is JointType.PRISMATIC else 'rad'}]" for v in robot.variables)
    return f"q: {', '.join(entries)}."


_PART_INDENT = "  "


def text_parts(form: ClosedForm, width: int) -> list[str]:
    """Return lines below the matrix."""
    lines = [_PART_INDENT + form.words] if form.words else []
    for name, value in form.definitions:
        lines += broken(f"{_PART_INDENT}{name} = ", NOTATIONS["text"].entry(value), width)
    return lines


def latex_parts(
    form: ClosedForm,
    equation: Callable[[str, str], tuple[str, ...]],
    blocks: Callable[[list[tuple[str, ...]]], str],
) -> str:
    """Return displays below the matrix."""
    words = [(rf"&\text{{{form.words}}}",)] if form.words else []
    return blocks(
        [*words, *(equation(_subscripted(name), NOTATIONS["latex"].entry(value)) for name, value in form.definitions)]
    )


def mathml_parts(form: ClosedForm) -> list[str]:
    """Return cells below the matrix."""
    notation = NOTATIONS["mathml"]
    cells = [f"<mtext>{form.words}</mtext>"] if form.words else []
    for name, value in form.definitions:
        cells.append(f"{notation.symbol(name, 'parameter')}<mo>=</mo>{notation.entry(value)}")
    return cells


def python_parts(form: ClosedForm) -> list[str]:
    """Return assignments before the matrix."""
    return [f"    {name} = {NOTATIONS['python'].entry(value)}" for name, value in form.definitions]


def _subscripted(name: str) -> str:
    letter, index = name[0], name[1:].lstrip("_")
    return f"{letter}_{{{index}}}"


_INDENT = "  "
Displayed = list[tuple[str, ...]]
"""Equations of LaTeX, each as its lines."""

_LONGEST_LINE = 70
"""Characters of plain text that fit on a line of a printed page."""

THESE_ROWS = "These rows are singular where"


def text_loci(form: LociForm, width: int, heading: Callable[[str], str] = str) -> list[str]:
    """Return the lines of one form.

    `heading`: sets off the name.
    """
    notation = NOTATIONS["text"]
    rows = f" of {form.rows}" if form.rows else ""
    if form.minors or form.unlisted:
        lines = [heading(minors_words(form)), *([f"{_INDENT}({form.rows})"] if form.rows else [])]
        size = max((len(left) for left, _ in form.minors), default=0)
        for left, rest in form.minors:
            lines += broken(f"{_INDENT}without {left:<{size}}: ", notation.entry(rest), width)
    elif form.determinant is None:
        lines = [heading(f"det {form.name}{rows}")]
    else:
        lines = broken(f"{heading(f'det {form.name}{rows}')} = ", notation.entry(form.determinant), width)
    for name, value in form.long:
        lines += broken(f"{_INDENT}{name} = ", notation.entry(value), width)
    return [*lines, *place_lines(form, width)]


def minors_words(form: LociForm, notation: Notation = NOTATIONS["text"]) -> str:
    """Return what the minors of a form have in common."""
    common = f", each {shared} times" if (shared := shared_text(form, notation)) else ""
    return f"minors of {form.name}{common}"


def shared_text(form: LociForm, notation: Notation) -> str:
    """Return what all minors share; empty if that is 1."""
    if form.determinant is None or not form.determinant.terms[0].factors:
        return ""
    return notation.entry(form.determinant)


def equations(place: Place, notation: Notation, equals: str) -> list[str]:
    """Return what vanishes at a place, one equation each."""
    return [f"{notation.entry(zero)}{equals}{notation.entry(Sum(()))}" for zero in place.zeros]


def place_lines(form: LociForm, width: int, head: str = "") -> list[str]:
    """Return where a Jacobian is singular, and in words what happens there.

    `head`: the line above; it names the Jacobian, or its rows, if left out.
    """
    lines = [head or (THESE_ROWS if form.partial else f"{form.name} is singular where")] if form.places else []
    cells = [(", ".join(equations(place, NOTATIONS["text"], " = ")), place.words) for place in form.places]
    size = max((len(left) for left, _ in cells), default=0) + len(_INDENT)
    for left, words in cells:
        if size + len(_INDENT) + len(words) <= width:
            lines.append(f"{_INDENT}{left:<{size}}{words}".rstrip())
        else:
            lines += [_INDENT + left, *(_INDENT * 3 + line for line in wrap(words, width - 3 * len(_INDENT)))]
    return [*lines, *wrap(form.closing, width)]


def latex_loci(
    form: LociForm,
    name: Callable[[str], str],
    text: Callable[[str], str],
    equation: Callable[[str, str], tuple[str, ...]],
    blocks: Callable[[Displayed], str],
) -> str:
    r"""Return one form as displays of amsmath.

    `name`: typesets the name of a Jacobian. `text`: typesets words. `equation`: the lines of an equation, given its
    left side and its value. `blocks`: puts lines of equations into displays.
    """
    notation = NOTATIONS["latex"]
    label = name(form.name)
    words = _latex_words(form.rows, text)
    shown: Displayed = []
    if form.minors or form.unlisted:
        shared = shared_text(form, notation)
        each = rf"{text(', each')} \; {shared} \; {text('times')}" if shared else ""
        words = [(rf"&{text('minors of')} \; {label}{each}",), *words]
        shown = [equation(_without(left, text), notation.entry(rest)) for left, rest in form.minors]
    elif form.determinant is not None:
        shown = [equation(rf"\det {label}", notation.entry(form.determinant))]
    else:
        words = [(rf"&\det {label}",), *words]
    shown += [equation(_indexed(symbol), notation.entry(value)) for symbol, value in form.long]
    singular = text(THESE_ROWS) if form.partial else rf"{label} \; {text('is singular where')}"
    lines: Displayed = [(rf"&{singular}",)] if form.places else []
    for place in form.places:
        zeros = r", \; ".join(equations(place, notation, " = "))
        lines += [(rf"&\quad {zeros}",), *_latex_words(place.words, text)]
    lines += _latex_words(form.closing, text)
    return "".join(map(blocks, (words, shown, lines)))


def _latex_words(words: str, text: Callable[[str], str]) -> Displayed:
    """Return words on lines of their own."""
    return [(rf"&\qquad {text(line)}",) for line in wrap(words, _LONGEST_LINE)]


def _without(left: str, text: Callable[[str], str]) -> str:
    names = [_indexed(name) if name[1:].isdecimal() else f"{name[0]}_{{{name[1:]}}}" for name in left.split(", ")]
    return rf"{text('without')} \; {', '.join(names)}"


def _indexed(name: str) -> str:
    return f"{name[0]}_{{{name[1:].rstrip('_')}}}"


def mathml_loci(form: LociForm, name: str, words: Callable[[str], str]) -> list[list[str]]:
    """Return the cells of one form, row by row.

    `name`: markup of the name of the Jacobian. `words`: markup of words.
    """
    notation = NOTATIONS["mathml"]
    equals = "<mo>=</mo>"
    rows = words(f" ({form.rows})") if form.rows else ""
    determinant = f"<mi>det</mi><mo>\u2061</mo>{name}"
    cells = []
    if form.minors or form.unlisted:
        shared = shared_text(form, notation)
        each = f"{words(', each ')}{shared}{words(' times')}" if shared else ""
        cells.append([f"{words('minors of ')}{name}{rows}{each}"])
        cells += [[f"{words(f'without {left}: ')}{notation.entry(rest)}"] for left, rest in form.minors]
    elif form.determinant is None:
        cells.append([f"{determinant}{rows}"])
    else:
        cells.append([f"{determinant}{equals}{notation.entry(form.determinant)}{rows}"])
    cells += [[f"{notation.symbol(symbol, 'parameter')}{equals}{notation.entry(value)}"] for symbol, value in form.long]
    comma = '<mo separator="true">,</mo><mspace width="0.5em"/>'
    for place in form.places:
        cells.append(
            [f"{comma.join(equations(place, notation, equals))}{words(f': {place.words}' if place.words else '')}"]
        )
    return [*cells, *([[words(form.closing)]] if form.closing else [])]
