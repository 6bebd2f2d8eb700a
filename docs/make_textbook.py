"""Writes docs/textbook.md: what textbooks print and what kinegen prints, system by system, and the misprints.

    python docs/make_textbook.py           rewrites the page
    python docs/make_textbook.py --check   compares, and fails with a diff if the page is not current

The printed forms come from tests/textbook/, where tests prove each of them equal to ours; ours are those of
`kinegen show`.
"""

from __future__ import annotations

import difflib
import re
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))  # The published entries are part of the tests and in no package.

from kinegen.backends.textbook.closed_form import closed_form  # noqa: E402
from kinegen.backends.textbook.notation import NOTATIONS, entry_texts  # noqa: E402
from kinegen.model.robot import Robot  # noqa: E402
from tests.textbook.catalog import (  # noqa: E402
    NAMED_PLACES,
    Form,
    Misprint,
    Place,
    Product,
    System,
    misprints,
    products,
    robot,
    systems,
)

PAGE = ROOT / "docs" / "textbook.md"
WIDEST_MATRIX = 110
WORDS = re.compile(r"\b(?!sin\b|cos\b|a(sin|cos|tan)2?\b|alpha|beta|gamma|phi|psi|theta)[a-z]{3,}\b")
PRODUCTS = """\
The tests compute these too, and compare every entry with the print:

| name | product | in print |
| --- | --- | --- |
"""

WORDING = ("wording", "scan")
"""Kinds of misprints that change no formula; the page leaves them out."""

STATUS = {
    "printed": "as printed",
    "corrected": "in print with errors, corrected here (see the list of misprints)",
}
HEAD = """\
# What textbooks print

<!-- Written by docs/make_textbook.py; change tests/textbook/ and run `make docs`. -->

For every system, this page names the command that prints the closed form. Where kinegen has other factors or another
order than the book, or the book has an error, the page shows the printed form, with its errors corrected.
`tests/textbook/` proves that both are exactly equal, entry by entry, and does the same for forms that are derived from
the table and not in print.

`c1` is the cosine of the first joint variable, and `s23` the sine of the sum of the second and third; an offset in the
table is not part of them. `q1` is the first joint variable outside of sines and cosines. Entries of a
transform are `r11` to `r33` and `px`, `py`, `pz`; the last row, 0 0 0 1, is left out.

Five sets of lecture notes without a publisher are called A to E:

| notes | content |
| --- | --- |
| A | manipulator kinematics after Craig: frames, planar, polar and spatial arms, PUMA 560, Motoman L-3, actuators |
| B | forward kinematics and roll, pitch, yaw |
| C | manipulator geometry: rigid displacements, classes of arms, a modified table with its offsets in the row before |
| D | forward and inverse kinematics of the Lynxmotion AL5D |
| E | robot manipulators: transforms, standard tables, PUMA 560, thumb, body |
"""


def main(arguments: list[str]) -> int:
    """Rewrites or checks the page; returns the exit status."""
    before = PAGE.read_text(encoding="utf-8") if PAGE.exists() else ""
    after = page()
    if before == after:
        return 0
    if arguments == ["--check"]:
        name = str(PAGE.relative_to(ROOT))
        sys.stdout.writelines(difflib.unified_diff(before.splitlines(True), after.splitlines(True), name, "now"))
        print("The page is not current: run 'make docs' and commit what it changes")
        return 1
    PAGE.write_text(after, encoding="utf-8", newline="\n")
    print(PAGE.relative_to(ROOT))
    return 0


def page() -> str:
    """The whole page."""
    printed = [product for product in products() if product.status != "derived"]
    in_print = [system for system in systems() if any(form.status != "derived" for form in system.forms)]
    parts = [HEAD, "## Systems\n", *map(system_part, in_print)]
    parts += ["## Products of elementary transforms\n", PRODUCTS + "\n".join(map(product_part, printed)) + "\n"]
    parts += ["## Misprints\n", misprint_part(misprints())]
    return "\n".join(parts)


def system_part(system: System) -> str:
    """Heading, sources and the printed forms of one system."""
    head = f"### {system.title}\n\nRobot file: {files(system)}. In print: {system.source}.\n"
    symbols = {name: f"q{index}" for index, name in enumerate(system.variables, start=1)}
    if symbols:
        counted = f"; the shorthand counts them from {system.first}" if system.first > 1 else ""
        head += f"Joint variables in print: {', '.join(f'`{name}`' for name in system.variables)}{counted}.\n"
    arm = robot(system.robots[0])
    printed = [form for form in system.forms if form.status != "derived"]
    same = [form for form in printed if is_same(arm, form, symbols)]
    forms = [form_part(arm, form) for form in printed if form not in same]
    if same:
        first = f"`kinegen show robots/{arm.name}.yaml --from {same[0].start} --to {same[0].end}`"
        more = ", and likewise " + ", ".join(form.name for form in same[1:]) if len(same) > 1 else ""
        forms.insert(0, f"{first} prints {same[0].name} as the book does{more}.\n")
    also = [f"Derived from the table, and not in print: {derived(system)}.\n"] if derived(system) else []
    return "\n".join([head, *forms, *also])


def files(system: System) -> str:
    """Links to the robot files of a system."""
    return ", ".join(f"[{name}.yaml](../robots/{name}.yaml)" for name in system.robots)


def derived(system: System) -> str:
    """The names of the forms that are not in print."""
    return ", ".join(form.name for form in system.forms if form.status == "derived")


def is_same(arm: Robot, form: Form, symbols: Mapping[str, str]) -> bool:
    """Whether kinegen prints the very text of the book."""
    texts = entry_texts(closed_form(arm, form.start, form.end), NOTATIONS["text"])
    return all(texts[i][j] == renamed(text, symbols) for (i, j), text in form.entries.items())


def form_part(arm: Robot, form: Form) -> str:
    """One form as it stands in print, and the command that prints ours."""
    command = f"`kinegen show robots/{arm.name}.yaml --from {form.start} --to {form.end}`"
    return f"**{form.name}**, {STATUS[form.status]}; {command} prints an equal form:\n\n{fenced(form.entries)}\n"


def product_part(product: Product) -> str:
    """One product: its name, what is multiplied, and where it is printed."""
    way = f"one row of convention `{product.row}`" if product.row else f"`{' '.join(product.steps)}`"
    inverse = "the inverse of " if product.inverse else ""
    return f"| {product.name} | {inverse}{way} | {product.source} |"


def misprint_part(entries: Iterable[Misprint]) -> str:
    """The table of misprints."""
    rows = [
        "Errors of formulas in the notes and in other works, and passages that are easily misread. If the last column",
        "has a yes, tests prove that the printed entry differs from pose or Jacobian and the correct one does not.\n",
        "| work | place | printed | correct | kind | proved |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    for entry in entries:
        if entry.kind in WORDING:
            continue
        printed, correct = (text.replace("|", "\\|") for text in (code(entry.printed), code(entry.correct)))
        proved = "yes" if entry.entry else ""
        rows.append(f"| {entry.notes} | {entry.place} | {printed} | {correct} | {entry.kind} | {proved} |")
    return "\n".join(rows) + "\n"


def code(text: str) -> str:
    """A formula in code style; words stay words."""
    if WORDS.search(text) or not re.search(r"[*=_({]", text):
        return re.sub(r"([*_])", r"\\\1", text)
    return f"`{text}`"


def renamed(text: str, symbols: Mapping[str, str]) -> str:
    """Printed text with our symbols for the joint variables."""
    return re.sub(r"[A-Za-z_]\w*", lambda word: symbols.get(word[0], word[0]), text)


def fenced(entries: Mapping[Place, str]) -> str:
    """The entries as a matrix where that is narrow enough, else one a line."""
    if len(entries) == 12:
        widths = [max(len(entries[i, j]) for i in range(3)) for j in range(4)]
        if sum(widths) <= WIDEST_MATRIX:
            lines = ("  ".join(entries[i, j].rjust(widths[j]) for j in range(4)) for i in range(3))
            return "```text\n" + "\n".join(lines) + "\n```"
    return listed(entries)


def listed(entries: Mapping[Place, str]) -> str:
    """The entries with their names, one a line."""
    names = {place: name for name, place in NAMED_PLACES.items()}
    return "```text\n" + "\n".join(f"{names[place]} = {text}" for place, text in entries.items()) + "\n```"


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
