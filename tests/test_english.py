"""What users read is plain technical English: a short list of habits that slow a reader down is kept out.

Looked at are the pages and the examples, the help of every command, the messages, the text of the templates, and the
modules that are copied into packages. The list is short on purpose: an entry is wrong wherever it is found.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from docs.make_readme import ROOT
from kinegen import cli

CALQUES = {
    r"(?<!there )\b(is|are|was|were) no (?!(longer|more|fewer|less|other)\b)[a-z]+": "is not a, has no",
    r"\b(stands?|stood) (?!(for|out)\b)": "is, is in",
    r"\b(tells?|told)\b": "reports, prints, says",
    r"\bbesides\b": "also, in addition to",
    r"\bin place of\b": "instead of",
    r"\bwhoever\b": "users who",
    r"\bcomes? on top\b": "adds to",
    r"\bknows? no\b": "has no",
    r"\b(to|can) be had\b": "is available",
    r"\bin a circle\b": "in a cycle",
    r"\bthe same but for\b": "the same except for",
    r"\ball the same\b": "still",
    r"\bthe wrong way round\b": "exchanged",
}
"""Patterns of words, with what to write instead."""

PAGES = (
    *(ROOT / "docs").rglob("*.md"),
    *(ROOT / name for name in ("README.md", "CONTRIBUTING.md", "robots/README.md")),
)
EXAMPLES = (*(ROOT / "docs" / "examples").iterdir(), *(ROOT / "examples").glob("*.py"))
TEMPLATES = (path for path in (ROOT / "templates").rglob("*.jinja"))
WHOLE = sorted((*PAGES, *EXAMPLES, *TEMPLATES, ROOT / "tests" / "bad" / "expected.txt"))
"""Files of which every line is read by users."""

COPIED = sorted((ROOT / "kinegen" / "native" / "runtime").glob("*.py"))
"""Modules whose docstrings users see."""

MODULES = sorted((ROOT / "kinegen").rglob("*.py"))


def calques(text: str) -> Iterator[tuple[int, str]]:
    """The habits in a text, with their lines; words in code style are not read."""
    plain = re.sub(r"`[^`\n]*`", lambda code: "`" * len(code[0]), text)
    # A sentence goes on in the next line, behind the mark of a comment; lines are counted as before.
    plain = re.sub(r"\n[ \t]*[*#]* ?(?=\S)", "\n", plain)
    for pattern, better in CALQUES.items():
        for match in re.finditer(pattern, plain.replace("\n", " "), re.I):
            yield plain.count("\n", 0, match.start()) + 1, f"'{match[0]}' (write: {better})"


def found(path: Path, text: str, first: int = 1) -> list[str]:
    """What is to be mended, with file and line."""
    return [f"{path.relative_to(ROOT)}:{line + first - 1}: {what}" for line, what in calques(text)]


def strings(path: Path, *, docstrings: bool) -> Iterator[tuple[int, str]]:
    """The texts in a module, f-strings joined; with or without those that document something."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    skipped = set() if docstrings else {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    parts = {id(part) for node in ast.walk(tree) if isinstance(node, ast.JoinedStr) for part in node.values}
    for node in ast.walk(tree):
        if isinstance(node, ast.JoinedStr):
            yield (
                node.lineno,
                "".join(str(part.value) if isinstance(part, ast.Constant) else "`0`" for part in node.values),
            )
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in parts | skipped:
            yield node.lineno, node.value


@pytest.mark.parametrize("path", WHOLE, ids=lambda path: str(path.relative_to(ROOT)))
def test_pages_examples_and_templates_are_in_plain_english(path: Path) -> None:
    assert found(path, path.read_text(encoding="utf-8")) == []


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(ROOT)))
def test_messages_are_in_plain_english(path: Path) -> None:
    texts = strings(path, docstrings=path in COPIED)

    assert [line for number, text in texts for line in found(path, text, number)] == []


@pytest.mark.parametrize("name", ["", *cli.COMMANDS])
def test_help_is_in_plain_english(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main([*([name] if name else []), "--help"]) == 0

    assert list(calques(capsys.readouterr().out)) == []


@pytest.mark.parametrize(
    "text",
    [
        "An angle is no length.",
        "It stands in the row.",
        "The header tells why.",
        "Proved besides: the pair.",
        "A list in place of\n * a tuple.",
        "Wait states come on top.",
        "All branches are\nno solutions",
    ],
)
def test_a_calque_is_found(text: str) -> None:
    assert len(list(calques(text))) == 1


@pytest.mark.parametrize(
    "text",
    [
        "There is no inverse, and axes are no longer parallel.",
        "q1 stands for the first joint.",
        "Write `is no` only in code.",
        "The standard outstanding understanding.",
        "In place, of course.",
    ],
)
def test_plain_english_passes(text: str) -> None:
    assert list(calques(text)) == []
