"""Plain text: the table and the closed forms as one reads them in a terminal or prints them in Python."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

from kinegen.backends.textbook import sheet_sentences as words
from kinegen.backends.textbook.closed_form import ClosedForm
from kinegen.backends.textbook.notation import NOTATIONS, TableText, entry_names, entry_texts
from kinegen.backends.textbook.sheet import Product, Sheet
from kinegen.backends.textbook.sheet_sentences import text_loci, text_parts
from kinegen.backends.textbook.table import Table, TableStep
from kinegen.support.text_layout import broken, columns, filled

_NUMBERS = TableText()
_LAST_ROW = ("0", "0", "0", "1")
_INDENT = "  "


WIDTH = 100
"""Characters of a line where no terminal has another width."""

Heading = Callable[[str], str]
"""How a heading is set off; as it is where nothing else is possible."""


def text_sheet(sheet: Sheet, width: int = WIDTH, heading: Heading = str) -> str:
    """Lay out a sheet: the table, then the closed forms.

    `heading`: sets off titles and names of transforms.
    """
    return "\n".join([text_table(sheet, heading), "", text_forms(sheet, width, heading)]).strip("\n")


def text_table(sheet: Sheet, heading: Heading = str) -> str:
    """Return the title, the conventions and the table."""
    lines = [heading(words.title(sheet.robot)), *words.conventions(sheet), words.units(sheet.robot)]
    lines += ["", *_table(sheet)] if sheet.table.rows else []
    lines += ["", *_frames(sheet.table)] if sheet.table.frames else []
    return "\n".join(lines)


def text_forms(sheet: Sheet, width: int = WIDTH, heading: Heading = str) -> str:
    """Return the closed forms, and what their names mean."""
    lines = []
    for link in sheet.links:
        lines += [*_form(link, width, heading), ""]
    for product in () if sheet.loci else sheet.products:
        lines += [*_product(product, width, heading), ""]
    for form in sheet.loci:
        lines += [*text_loci(form, width, heading), ""]
    lines += _where(sheet, width)
    return "\n".join(lines).rstrip("\n")


def _table(sheet: Sheet) -> list[str]:
    table, parents = sheet.table, words.has_parents(sheet.robot)
    heads = [_head(column, words.index(column, sheet)) for column in table.columns]
    mixed = len({row.convention for row in table.rows if not row.steps}) > 1
    rows = [["i", *(["from"] * parents), "joint", *(["convention"] * mixed), *heads]]
    sequences = {}
    for row in table.rows:
        parent = [words.parent_number(row, sheet.robot)] * parents
        entries = ["" if entry is None else _NUMBERS.entry(entry) for entry in row.entries]
        rows.append([str(row.number), *parent, row.name, *([row.convention] * mixed), *entries])
        if row.steps:
            rows[-1] = rows[-1][: len(rows[-1]) - len(entries)] + [""] * len(entries)
            sequences[len(rows) - 1] = _sequence(row.steps)
    name = 1 + parents
    lines = columns(rows, left=frozenset({name, *([name + 1] * mixed)}))
    size = max(len(row[name]) for row in rows) + lines[0].index("joint") + 2
    lines = [f"{line:<{size}}{sequences[index]}" if index in sequences else line for index, line in enumerate(lines)]
    return [_INDENT + line for line in lines]


def _head(column: str, index: str) -> str:
    return f"{column}_{{{index}}}" if len(index) > 1 else f"{column}_{index}" if index else column


def _sequence(steps: Iterable[TableStep]) -> str:
    return " ".join(f"{step.kind}({_NUMBERS.entry(step.value)})" for step in steps)


def _frames(table: Table) -> list[str]:
    rows = [("frame", "on", "")]
    for frame in table.frames:
        sequence = _sequence(frame.steps) if frame.steps else words.same_as(frame.parent)
        rows.append((frame.name, frame.parent, sequence))
    return [_INDENT + line for line in columns(rows, left=frozenset({0, 1, 2}))]


def _product(product: Product, width: int, heading: Heading) -> list[str]:
    if len(product.factors) == 1:
        return _form(product.factors[0], width, heading)
    names = " * ".join(form.name for form in product.factors)
    lines = [
        heading(f"{product.name} = {names}"),
        "too long to be multiplied out; select a part with --from and --to",
        "",
    ]
    for form in product.factors:
        lines += [*_form(form, width, heading), ""]
    return lines[:-1]


def _form(form: ClosedForm, width: int, heading: Heading) -> list[str]:
    """Return a matrix where it fits, else one line an entry."""
    texts = entry_texts(form, NOTATIONS["text"])
    matrix = columns([*texts, _LAST_ROW] if form.is_transform else texts)
    head = f"{form.name} = "
    size = max(len(line) for line in matrix)
    if len(head) + size + 4 <= width and not form.is_orientation:
        heads = ["", head, *[""] * (len(matrix) - 2)]
        rows = zip(heads, matrix, strict=True)
        lines = [f"{heading(left.ljust(len(head)))}[ {line:<{size}} ]" for left, line in rows]
        return [*lines, *text_parts(form, width)]
    entries = zip(_in_columns(entry_names(form)), _in_columns(texts), strict=True)
    return [
        heading(form.name),
        *(line for name, text in entries for line in broken(f"{_INDENT}{name} = ", text, width)),
        *text_parts(form, width),
    ]


def _in_columns(rows: tuple[tuple[str, ...], ...]) -> Iterator[str]:
    """Yield entries column by column, so that the position comes last and together."""
    for column in zip(*rows, strict=True):
        yield from column


def _where(sheet: Sheet, width: int) -> list[str]:
    notation = NOTATIONS["text"]
    angles = [(label, notation.entry(angle)) for label, angle in sheet.angles]
    waves = (("cosine", "cos"), ("sine", "sin"))
    pairs = [f"{notation.symbol(label, kind)} = {name}({text})" for label, text in angles for kind, name in waves]
    values = []
    for parameter in sheet.table.parameters:
        unit = f" {parameter.unit}" if parameter.unit else ""
        runtime = " (at run time)" if parameter.runtime else ""
        values.append(f"{parameter.name} = {_NUMBERS.entry(parameter.value)}{unit}{runtime}")
    lists = (pairs, words.joint_words(sheet), values)
    lines = [line for each in lists for line in filled(each, _INDENT, width)]
    return ["where", *lines] if lines else []
