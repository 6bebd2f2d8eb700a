"""MathML: one complete `<math>` element for each transform, to be put into a web page."""

from __future__ import annotations

import re
from collections.abc import Iterable
from html import escape

from kinegen.textbook import sheet_words as words
from kinegen.textbook.closed_form import ClosedForm
from kinegen.textbook.notation import NOTATIONS, entry_names, entry_texts
from kinegen.textbook.sheet import Sheet

LONGEST_MATRIX_ROW = 110
_LAST_ROW = ("<mn>0</mn>", "<mn>0</mn>", "<mn>0</mn>", "<mn>1</mn>")
_EQUALS = "<mo>=</mo>"
_NOTATION = NOTATIONS["mathml"]


def mathml_sheet(sheet: Sheet) -> str:
    """Lay out a sheet; the names of the robot and its joints stand in comments."""
    lines = [_comment(words.title(sheet.robot)), _comment(words.units(sheet.robot))]
    lines += [_comment(", ".join(words.joint_words(sheet)))] if sheet.table.joints else []
    return "\n".join([*lines, mathml_forms(sheet)])


def mathml_forms(sheet: Sheet) -> str:
    """The closed forms, one `<math>` element each."""
    lines = [_math(_form(link)) for link in sheet.links]
    for product in sheet.products:
        if len(product.factors) > 1:
            factors = "<mo>\u2062</mo>".join(name_markup(form.name) for form in product.factors)
            lines.append(_math([_cells(f"{name_markup(product.name)}{_EQUALS}{factors}")]))
        lines += [_math(_form(form)) for form in product.factors]
    return "\n".join(lines)


def _comment(text: str) -> str:
    # Two hyphens would end the comment.
    return f"<!-- {escape(re.sub('-(?=-|$)', '- ', text), quote=False)} -->"


def _math(rows: Iterable[str]) -> str:
    body = "\n".join(rows)
    space = "http://www.w3.org/1998/Math/MathML"
    return f'<math xmlns="{space}" display="block">\n<mtable columnalign="left">\n{body}\n</mtable>\n</math>'


def _form(form: ClosedForm) -> list[str]:
    """The rows of one form: a matrix where it is narrow, else its entries; then what its names mean."""
    plain = entry_texts(form, NOTATIONS["text"])
    texts = entry_texts(form, _NOTATION)
    name = name_markup(form.name)
    last = (_LAST_ROW,) if form.is_transform else ()
    if sum(max(len(text) for text in column) for column in zip(*plain, strict=True)) <= LONGEST_MATRIX_ROW:
        rows = [_cells(f"{name}{_EQUALS}{_matrix((*texts, *last))}")]
    else:
        general = tuple(tuple(_entry_name(entry) for entry in row) for row in entry_names(form))
        rows = [_cells(f"{name}{_EQUALS}{_matrix((*general, *last))}")]
        for column in range(len(general[0])):
            rows += [
                _cells(f"{names[column]}{_EQUALS}{row[column]}") for names, row in zip(general, texts, strict=True)
            ]
    for label, angle in form.angles:
        argument = _NOTATION.brackets(_NOTATION.entry(angle))
        both = (
            f"{_NOTATION.symbol(label, kind)}{_EQUALS}<mi>{function}</mi><mo>\u2061</mo>{argument}"
            for kind, function in (("cosine", "cos"), ("sine", "sin"))
        )
        rows.append(_cells('<mo separator="true">,</mo><mspace width="1em"/>'.join(both)))
    return rows


def _cells(*cells: str) -> str:
    return f"<mtr>{''.join(f'<mtd><mrow>{cell}</mrow></mtd>' for cell in cells)}</mtr>"


def _matrix(rows: tuple[tuple[str, ...], ...]) -> str:
    return f"<mrow><mo>[</mo><mtable>{''.join(_cells(*row) for row in rows)}</mtable><mo>]</mo></mrow>"


def _entry_name(name: str) -> str:
    index = f"<mn>{name[1:]}</mn>" if name[1:].isdecimal() else f"<mi>{name[1:]}</mi>"
    return f"<msub><mi>{name[0]}</mi>{index}</msub>"


def name_markup(name: str) -> str:
    """The name of a transform or Jacobian, such as `base_T_tool`, as one element."""
    first, letter, last = re.split("_([TJ])_|(?:T(?=[0-9]+$))", name, maxsplit=1)
    start, end = (
        f"<mn>{part}</mn>" if part.isdecimal() else f"<mtext>{escape(part)}</mtext>" for part in (first, last)
    )
    return f"<mmultiscripts><mi>{letter or 'T'}</mi>{end}<none/><mprescripts/><none/>{start}</mmultiscripts>"
