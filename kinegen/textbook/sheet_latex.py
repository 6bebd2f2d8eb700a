r"""LaTeX: fragments for amsmath that compile as they stand between `\begin{document}` and `\end{document}`."""

from __future__ import annotations

import re
from collections.abc import Iterable

from kinegen.textbook import sheet_words as words
from kinegen.textbook.closed_form import ClosedForm, Sum
from kinegen.textbook.notation import NOTATIONS, entry_names, entry_texts
from kinegen.textbook.sheet import Product, Sheet
from kinegen.textbook.table import TableStep

LONGEST_LINE = 80
"""Characters, most of them indices, that fit on a line of a printed page."""

LONGEST_MATRIX_ROW = 70
_UNSEEN = re.compile(r"\\[a-z]*|[{}_^, ]")
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
    """The closed forms, and what their names mean."""
    parts = [*map(_form, sheet.links), *map(_product, sheet.products), _where(sheet)]
    return "\n".join(part for part in parts if part).rstrip("\n")


def latex_table(sheet: Sheet) -> str:
    """The table, with the fixed transforms below it."""
    table, parents = sheet.table, words.has_parents(sheet.robot)
    heads = [_head(column, sheet) for column in table.columns]
    layout = "c" * (1 + parents) + "l" + "c" * len(heads)
    lines = [_row(["i", *([r"\text{from}"] * parents), r"\text{joint}", *heads]) + r" \hline"]
    for row in table.rows:
        entries = ["" if entry is None else _entry(entry) for entry in row.entries]
        if row.steps:
            span = max(1, len(heads))
            entries = [rf"\multicolumn{{{span}}}{{l}}{{{_sequence(row.steps)}}}"]
        parent = [words.parent_number(row, sheet.robot)] * parents
        lines.append(_row([str(row.number), *parent, _text(row.name), *entries]))
    frames = [rf"{_text(f.name)} &\colon {_text(f.parent)} \; {_sequence(f.steps)}" for f in table.frames]
    layout += "" if heads else "l"
    array = _environment("equation*", _environment("array", "\n".join(lines), f"{{{layout}}}")) if table.rows else ""
    return array + (_environment("align*", " \\\\\n".join(frames)) if frames else "")


def _head(column: str, sheet: Sheet) -> str:
    symbol = rf"\{column}" if len(column) > 1 else column
    index = words.index(column, sheet)
    units = sheet.robot.units
    unit = units.angle if len(column) > 1 else units.length
    return rf"{symbol}{f'_{{{index}}}' if index else ''} \; [\mathrm{{{unit}}}]"


def _row(cells: Iterable[str]) -> str:
    return " & ".join(cells) + r" \\"


def _sequence(steps: Iterable[TableStep]) -> str:
    return r" \, ".join(f"{s.kind[0]}_{{{s.kind[1]}}}({_entry(s.value)})" for s in steps) or r"\text{nothing}"


def _product(product: Product) -> str:
    if len(product.factors) == 1:
        return _form(product.factors[0])
    factors = r" \, ".join(_name(form.name) for form in product.factors)
    head = _environment("equation*", f"{_name(product.name)} = {factors}")
    return "\n".join([head, *(_form(form) for form in product.factors)])


def _form(form: ClosedForm) -> str:
    """A matrix where it fits a page, else the general matrix and one equation for each entry."""
    plain = entry_texts(form, NOTATIONS["text"])
    texts = entry_texts(form, NOTATIONS["latex"])
    if sum(max(len(text) for text in column) for column in zip(*plain, strict=True)) <= LONGEST_MATRIX_ROW:
        return _environment("equation*", f"{_name(form.name)} = {_matrix(form, texts)}")
    names = tuple(tuple(f"{name[0]}_{{{name[1:].replace('_', ',')}}}" for name in row) for row in entry_names(form))
    places = [(row, column) for column in range(len(names[0])) for row in range(len(names))]
    equations = [_equation(names[row][column], form.entries[row][column]) for row, column in places]
    general = _environment("equation*", f"{_name(form.name)} = {_matrix(form, names)}")
    return general + _environment("align*", " \\\\\n".join(equations))


def _matrix(form: ClosedForm, rows: tuple[tuple[str, ...], ...]) -> str:
    last = (("0", "0", "0", "1"),) if form.is_transform else ()
    lines = " \\\\\n".join(" & ".join(row) for row in (*rows, *last))
    return f"\\begin{{bmatrix}}\n{lines}\n\\end{{bmatrix}}"


def _equation(name: str, entry: Sum) -> str:
    """One entry, broken before plus and minus signs where a line would be too long."""
    text, length = f"{name} &=", 0
    for part in _parts(_entry(entry)):
        size = len(_UNSEEN.sub("", part))
        if length and length + size > LONGEST_LINE:
            text, length = f"{text} \\\\\n  &\\quad {{}}", 0
        text, length = f"{text} {part}", length + size
    return text


def _parts(formula: str) -> list[str]:
    """A formula, cut before the signs that stand in no fraction, root or growing bracket."""
    parts = [""]
    for piece in re.split(r" (?=[+-] )", formula):
        inside = parts[-1].count("{") > parts[-1].count("}") or parts[-1].count(r"\left") > parts[-1].count(r"\right")
        if inside:
            parts[-1] += f" {piece}"
        else:
            parts.append(piece)
    return parts[1:]


def _where(sheet: Sheet) -> str:
    lines = []
    for label, angle in sheet.angles:
        cosine, sine = (NOTATIONS["latex"].symbol(label, kind) for kind in ("cosine", "sine"))
        argument = rf"\left({_entry(angle)}\right)" if len(angle.terms) > 1 else rf" {_entry(angle)}"
        lines.append(rf"{cosine} &= \cos{argument}, & {sine} &= \sin{argument}")
    blocks = [_environment("align*", " \\\\\n".join(lines))] if lines else []
    values = [rf"q_{{{number}}} &\colon {_text(name)}" for number, name in sheet.table.joints]
    for parameter in sheet.table.parameters:
        unit = rf" \, \mathrm{{{parameter.unit}}}" if parameter.unit else ""
        name = NOTATIONS["latex"].symbol(parameter.name, "parameter")
        values.append(f"{name} &= {_entry(parameter.value)}{unit}")
    blocks += [_environment("align*", " \\\\\n".join(values))] if values else []
    return "\n".join(blocks)


def _entry(entry: Sum) -> str:
    return NOTATIONS["latex"].entry(entry)


def _name(name: str) -> str:
    """`3T6` and `base_T_tool` with their frames as indices before and behind."""
    start, letter, end = re.split("_([TJ])_|(?:T(?=[0-9]+$))", name, maxsplit=1)
    return rf"{{}}^{{{_text(start)}}}{letter or 'T'}_{{{_text(end)}}}"


def _text(words_: str) -> str:
    if words_.isdecimal():
        return words_
    return rf"\text{{{_SPECIAL.sub(lambda match: _ESCAPES.get(match[0], chr(92) + match[0]), words_)}}}"


def _environment(name: str, body: str, layout: str = "") -> str:
    return f"\\begin{{{name}}}{layout}\n{body.rstrip()}\n\\end{{{name}}}\n"
