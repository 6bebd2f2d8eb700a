r"""LaTeX: fragments for amsmath that compile as they stand between `\begin{document}` and `\end{document}`."""

from __future__ import annotations

import re
from collections.abc import Iterable

from kinegen.backends.textbook import sheet_sentences as words
from kinegen.backends.textbook.closed_form import ClosedForm, Sum
from kinegen.backends.textbook.latex_lines import LINE, lines, width
from kinegen.backends.textbook.notation import NOTATIONS, TableLatex, entry_names, entry_texts
from kinegen.backends.textbook.sheet import Product, Sheet
from kinegen.backends.textbook.sheet_sentences import latex_loci, latex_parts
from kinegen.backends.textbook.table import TableStep

MOST_LINES = 20
"""Lines of one `align*`, which does not break between pages; a page has about 30."""

MOST_COLUMNS = 10
"""Columns of a `bmatrix`."""

_NUMBERS = TableLatex()
_MATRIX_EDGES = 25.0
_BETWEEN_PAIRS = 30.0
_TALL = 1.8
_BETWEEN_COLUMNS = 10.0
_SPECIAL = re.compile(r"[&%$#_{}~^\\]")
_ESCAPES = {"~": r"\textasciitilde{}", "^": r"\textasciicircum{}", "\\": r"\textbackslash{}"}


def latex_sheet(sheet: Sheet) -> str:
    """Lay out a sheet."""
    head = [
        words.title(sheet.robot),
        *words.conventions(sheet),
        words.units(sheet.robot),
        r"Needs \usepackage{amsmath}.",
    ]
    parts = ["".join(f"% {line}\n" for line in head), latex_table(sheet), latex_forms(sheet)]
    return "\n".join(part for part in parts if part).rstrip("\n")


def latex_forms(sheet: Sheet) -> str:
    """Return the closed forms, and what their names mean."""
    parts = [*map(_form, sheet.links), *(() if sheet.loci else map(_product, sheet.products))]
    parts += [latex_loci(form, _name, _text, _equation, _blocks) for form in sheet.loci]
    parts.append(_where(sheet))
    return "\n".join(part for part in parts if part).rstrip("\n")


def latex_table(sheet: Sheet) -> str:
    """Return the table; below it the rows that are sequences of transforms beside others, and the fixed transforms."""
    table, parents = sheet.table, words.has_parents(sheet.robot)
    body, below = [], []
    for row in table.rows:
        entries = ["" if entry is None else _number(entry) for entry in row.entries]
        if row.steps and entries:
            below.append((rf"\text{{row }} {row.number} \; {_text(row.name)}", _sequence(row.steps)))
        elif row.steps:
            entries = [_sequence(row.steps)]
        parent = [words.parent_number(row, sheet.robot)] * parents
        body.append((str(row.number), *parent, _text(row.name), *entries))
    for frame in table.frames:
        sequence = rf"{_text(frame.parent)} \; {_sequence(frame.steps)}"
        below.append((_text(frame.name), sequence if frame.steps else _text(words.same_as(frame.parent))))
    array = _array(sheet, body) if body else ""
    return array + _blocks([(rf"{name} &\colon {text}",) for name, text in below])


def _array(sheet: Sheet, body: list[tuple[str, ...]]) -> str:
    """The rows below their heads; the units stand in these where the page is wide enough, else below the table."""
    columns, parents, units = sheet.table.columns, words.has_parents(sheet.robot), sheet.robot.units
    first = ("i", *([r"\text{from}"] * parents), r"\text{joint}")
    heads = (*first, *(_head(column, sheet, with_unit=True) for column in columns))
    is_wide = _columns_width((heads, *(row for row in body if len(row) == len(heads)))) > LINE
    heads = (*first, *(_head(column, sheet, with_unit=not is_wide) for column in columns))
    rows = [_row(heads) + r" \hline", *map(_row, body)]
    layout = "c" * (len(first) - 1) + "l" + ("c" * len(columns) or "l")
    array = _environment("equation*", _environment("array", "\n".join(rows), f"{{{layout}}}"))
    note = rf"\text{{lengths in {units.length}, angles in {units.angle}}}"
    return array + (_environment("equation*", note) if is_wide else "")


def _columns_width(rows: tuple[tuple[str, ...], ...]) -> float:
    return sum(max(map(width, column)) + _BETWEEN_COLUMNS for column in zip(*rows, strict=True))


def _head(column: str, sheet: Sheet, *, with_unit: bool) -> str:
    symbol = rf"\{column}" if len(column) > 1 else column
    index = words.index(column, sheet)
    units = sheet.robot.units
    unit = rf" \; [\mathrm{{{units.angle if len(column) > 1 else units.length}}}]" if with_unit else ""
    return f"{symbol}{f'_{{{index}}}' if index else ''}{unit}"


def _row(cells: Iterable[str]) -> str:
    return " & ".join(cells) + r" \\"


def _sequence(steps: Iterable[TableStep]) -> str:
    return r" \, ".join(f"{s.kind[0]}_{{{s.kind[1]}}}({_number(s.value)})" for s in steps)


def _product(product: Product) -> str:
    if len(product.factors) == 1:
        return _form(product.factors[0])
    factors = r" \, ".join(_name(form.name) for form in product.factors)
    head = _environment("equation*", f"{_name(product.name)} = {factors}")
    return "\n".join([head, *(_form(form) for form in product.factors)])


def _form(form: ClosedForm) -> str:
    """Return a matrix where it fits a page, else the general matrix and one equation for each entry."""
    texts = entry_texts(form, NOTATIONS["latex"])
    if _matrix_width(form.name, texts) <= LINE and not form.is_orientation:
        return _environment("equation*", f"{_name(form.name)} = {_matrix(form, texts)}") + _parts_below(form)
    names = tuple(tuple(_entry_name(name, form) for name in row) for row in entry_names(form))
    places = [(row, column) for column in range(len(names[0])) for row in range(len(names))]
    equations = [_equation(names[row][column], texts[row][column]) for row, column in places]
    if _matrix_width(form.name, names) > LINE:
        return _blocks(equations) + _parts_below(form)
    general = _environment("equation*", f"{_name(form.name)} = {_matrix(form, names)}")
    return general + _blocks(equations) + _parts_below(form)


def _entry_name(name: str, form: ClosedForm) -> str:
    if form.is_orientation:
        return NOTATIONS["latex"].symbol(name, "parameter")
    return f"{name[0]}_{{{name[1:].replace('_', ',')}}}"


def _parts_below(form: ClosedForm) -> str:
    return latex_parts(form, _equation, _blocks)


def _matrix_width(name: str, rows: tuple[tuple[str, ...], ...]) -> float:
    return width(_name(name)) + _MATRIX_EDGES + _columns_width(rows)


def _matrix(form: ClosedForm, rows: tuple[tuple[str, ...], ...]) -> str:
    last = (("0", "0", "0", "1"),) if form.is_transform else ()
    body = " \\\\\n".join(" & ".join(row) for row in (*rows, *last))
    if len(rows[0]) > MOST_COLUMNS:
        return rf"\left[\begin{{array}}{{{'c' * len(rows[0])}}}{chr(10)}{body}{chr(10)}\end{{array}}\right]"
    return f"\\begin{{bmatrix}}\n{body}\n\\end{{bmatrix}}"


def _equation(name: str, entry: str) -> tuple[str, ...]:
    """Return one entry in lines of an `align*`."""
    first, *others = lines(entry, width(f"{name} ="))
    return (f"{name} &= {first}", *(f"  &{other}" for other in others))


def _blocks(equations: Iterable[tuple[str, ...]]) -> str:
    """Return equations as one `align*`, or several of them, between which a page can be broken."""
    blocks: list[list[str]] = []
    room = 0.0
    for equation in equations:
        needed = sum(map(_height, equation))
        for index, line in enumerate(equation):
            if room < (needed if index == 0 and needed <= MOST_LINES else _height(line)):
                blocks.append([])
                room = MOST_LINES
            blocks[-1].append(line)
            room -= _height(line)
    return "".join(_environment("align*", " \\\\\n".join(block)) for block in blocks)


def _height(line: str) -> float:
    """Return the height of a line to that of one without fractions."""
    return _TALL if r"\frac" in line else 1.0


def _where(sheet: Sheet) -> str:
    names = {number: words.joint_name(number, sheet) for number, _ in sheet.table.joints}
    symbols = {number: NOTATIONS["latex"].symbol(name, "joint") for number, name in names.items()}
    values = [(rf"{symbols[number]} &\colon {_text(name)}",) for number, name in sheet.table.joints]
    for parameter in sheet.table.parameters:
        unit = rf" \, \mathrm{{{parameter.unit}}}" if parameter.unit else ""
        name = NOTATIONS["latex"].symbol(parameter.name, "parameter")
        values.append((f"{name} &= {_number(parameter.value)}{unit}",))
    blocks = (_blocks(_angles(sheet)), _blocks(values))
    return "\n".join(block for block in blocks if block)


def _angles(sheet: Sheet) -> list[tuple[str, ...]]:
    """Return every cosine beside its sine; on lines of their own where one of the sums is long."""
    pairs = []
    for label, angle in sheet.angles:
        argument = rf"\left({_entry(angle)}\right)" if len(angle.terms) > 1 else rf" {_entry(angle)}"
        names = (NOTATIONS["latex"].symbol(label, kind) for kind in ("cosine", "sine"))
        pairs.append([(name, rf"\{function}{argument}") for name, function in zip(names, ("cos", "sin"), strict=True)])
    halves = (max((width(f"{name} = {value}") for name, value in half), default=0.0) for half in zip(*pairs))
    if sum(halves) + _BETWEEN_PAIRS <= LINE:
        return [(", & ".join(f"{name} &= {value}" for name, value in pair),) for pair in pairs]
    return [_equation(name, value) for pair in pairs for name, value in pair]


def _number(value: Sum) -> str:
    return _NUMBERS.entry(value)


def _entry(entry: Sum) -> str:
    return NOTATIONS["latex"].entry(entry)


def _name(name: str) -> str:
    """Return `3T6` and `base_T_tool` with their frames as indices before and behind."""
    start, letter, end = re.split("_([TJDA][vw]?)_|(?:T(?=[0-9]+$))", name, maxsplit=1)
    symbol = "T" if not letter else letter if len(letter) == 1 else f"{{{letter[0]}_{letter[1]}}}"
    return rf"{{}}^{{{_text(start)}}}{symbol}_{{{_text(end)}}}"


def _text(words_: str) -> str:
    if words_.isdecimal():
        return words_
    return rf"\text{{{_SPECIAL.sub(lambda match: _ESCAPES.get(match[0], chr(92) + match[0]), words_)}}}"


def _environment(name: str, body: str, layout: str = "") -> str:
    return f"\\begin{{{name}}}{layout}\n{body.rstrip()}\n\\end{{{name}}}\n"
