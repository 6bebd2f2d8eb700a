"""MathML: one complete `<math>` element for each transform, to be put into a web page."""

from __future__ import annotations

import re
from collections.abc import Iterable
from html import escape

from kinegen.backends.textbook import sheet_sentences as words
from kinegen.backends.textbook.closed_form import ClosedForm, Sum
from kinegen.backends.textbook.notation import NOTATIONS, entry_names, entry_texts
from kinegen.backends.textbook.sheet import Sheet
from kinegen.backends.textbook.sheet_sentences import mathml_loci, mathml_parts

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
    """Return the closed forms, one `<math>` element each."""
    lines = [_math(_form(link)) for link in sheet.links]
    for loci in sheet.loci:
        rows = [_cells(*row) for row in mathml_loci(loci, name_markup(loci.name), _words)]
        lines.append(_math([*rows, *_angles(sheet.angles)]))
    for product in () if sheet.loci else sheet.products:
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
    """Return the rows of one form: a matrix where it is narrow, else its entries; then what its names mean."""
    plain = entry_texts(form, NOTATIONS["text"])
    texts = entry_texts(form, _NOTATION)
    name = name_markup(form.name)
    last = (_LAST_ROW,) if form.is_transform else ()
    if (
        sum(max(len(text) for text in column) for column in zip(*plain, strict=True)) <= LONGEST_MATRIX_ROW
        and not form.is_orientation
    ):
        rows = [_cells(f"{name}{_EQUALS}{_matrix((*texts, *last))}")]
    else:
        general = tuple(tuple(_entry_name(entry, form) for entry in row) for row in entry_names(form))
        rows = [_cells(f"{name}{_EQUALS}{_matrix((*general, *last))}")]
        for column in range(len(general[0])):
            rows += [
                _cells(f"{names[column]}{_EQUALS}{row[column]}") for names, row in zip(general, texts, strict=True)
            ]
    return [*rows, *map(_cells, mathml_parts(form)), *_angles(form.angles)]


def _angles(angles: Iterable[tuple[str, Sum]]) -> list[str]:
    """Return what sines and cosines stand for."""
    rows = []
    for label, angle in angles:
        argument = _NOTATION.brackets(_NOTATION.entry(angle))
        both = (
            f"{_NOTATION.symbol(label, kind)}{_EQUALS}<mi>{function}</mi><mo>\u2061</mo>{argument}"
            for kind, function in (("cosine", "cos"), ("sine", "sin"))
        )
        rows.append(_cells('<mo separator="true">,</mo><mspace width="1em"/>'.join(both)))
    return rows


def _words(text: str) -> str:
    return f"<mtext>{escape(text, quote=False)}</mtext>" if text else ""


def _cells(*cells: str) -> str:
    return f"<mtr>{''.join(f'<mtd><mrow>{cell}</mrow></mtd>' for cell in cells)}</mtr>"


def _matrix(rows: tuple[tuple[str, ...], ...]) -> str:
    return f"<mrow><mo>[</mo><mtable>{''.join(_cells(*row) for row in rows)}</mtable><mo>]</mo></mrow>"


def _entry_name(name: str, form: ClosedForm) -> str:
    if form.is_orientation:
        return _NOTATION.symbol(name, "parameter")
    index = f"<mn>{name[1:]}</mn>" if name[1:].isdecimal() else f"<mi>{name[1:]}</mi>"
    return f"<msub><mi>{name[0]}</mi>{index}</msub>"


def name_markup(name: str) -> str:
    """Return the name of a transform or Jacobian, such as `base_T_tool`, as one element."""
    first, letter, last = re.split("_([TJDA][vw]?)_|(?:T(?=[0-9]+$))", name, maxsplit=1)
    start, end = (
        f"<mn>{part}</mn>" if part.isdecimal() else f"<mtext>{escape(part)}</mtext>" for part in (first, last)
    )
    return f"<mmultiscripts><mi>{letter or 'T'}</mi>{end}<none/><mprescripts/><none/>{start}</mmultiscripts>"
