"""What users read is plain technical English: habits that slow a reader down, and words of our own, are kept out.

Looked at are the pages and the examples, the help of every command, the messages, the text of the templates, and the
modules that are copied into packages. The lists are short on purpose: an entry is wrong wherever it is found. The words
of the field are not looked for in the blocks of a page, which show what the files and messages themselves say.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from docs.make_readme import ROOT
from kinegen.ui import cli

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

_TOOLS = "matplotlib|pyarrow|scipy|numpy|clang|gcc|cupy|rustc|node|dask|cffi"

FIELD = {
    r"\b(turning|sliding|shifting) joints?\b|\bjoints? that (turn|shift|slide)s?\b": "revolute, prismatic joint",
    r"\bbeyond (the |its |their |a |all )?(joint )?limits?\b": "outside joint limits",
    r"\bthere and back\b": "round trip",
    r"\b(is|are) in line\b|\bin line with axis\b": "coincide, aligned",
    r"\bwhat the (tip|tool) reaches\b": "reachable workspace",
    r"\bnearly of (a|its|the) family\b|\bfamil(y|ies) of (arms|closed forms)\b": "class",
    r"\bsolutions (are )?led to\b": "refined to",
    r"\bhalf axes\b": "semi-axes",
    r"\baccepted (errors?|differences?|ones?|distances?)\b|\bis accepted of\b": "tolerance",
    r"\bgreatest (distance|difference|turn)\b": "largest",
    r"\bnearly special\b": "close to a special value",
    r"\b(are|is) weighed\b": "weighted",
    r"\bzeros? (that (is|are) )?elsewhere\b": "different zero position",
    r"\ba little (skew|off|beside)\b": "slightly misaligned, slightly off",
    r"\btruth values?\b": "Booleans",
    r"\bwhole numbers?\b": "integers",
    r"\bmoving arm\b": "viewer, 3D model",
    r"\bpictures? for papers\b": "figures for papers",
    r"\bslips? of the pen\b": "typos",
    r"\bmend(s|ed)?\b": "fix",
    r"\bin bulk\b": "in batches",
    r"\bclock ticks?\b": "cycles",
    r"\bprocessor time\b": "CPU time",
    r"\btensors? of the processor\b": "CPU tensors",
    r"\bGPUs? of NVIDIA\b": "NVIDIA GPUs",
    r"\bat hand\b": "installed, available",
    r"\bof yours\b": "your own",
    rf"\btakes? (`?({_TOOLS})\b|(python|rust) \d|a (C )?compiler)": "needs",
}
"""Patterns of words that the field has other words for, with these."""

PROOFS = r"(?<!# )(?<!\| )(?<!kinegen )\bprov(e|es|en|ed|ing)\b|\bproofs?\b"
PROVEN = r"bound|interval|errors?\b|Frama-C|exact|alarm|overflow|finite|rounded|run-time|same pose|by proof|is no proof"
"""What is proven: bounds by intervals, what Frama-C analyses, exact identities. A comparison with samples verifies."""

_ANY = re.compile("|".join(f"(?:{pattern})" for pattern in (*FIELD, PROOFS)), re.I)

OF_PROOFS = ("docs/proof.md", "docs/textbook.md", "kinegen/verify/frama_c/eva.py", "kinegen/ui/cli/firmware.py")
"""Files about proofs."""

_WAYS = ("beyond limits", "there and back")
NAMES = ("prove", "prove-", "proof", "proved before", "Proven", *_WAYS, *(f"`0`, {way}" for way in _WAYS))
"""Texts that are names of a command, a stage, a key or a comparison, and words that others are put behind."""

UNCLEAN = ("docs/api.md",)
"""Files in which such words are left; a file is taken out of this list with the last of them."""

PAGES = (
    *(ROOT / "docs").rglob("*.md"),
    *(ROOT / name for name in ("README.md", "CONTRIBUTING.md", "robots/README.md")),
)
EXAMPLES = (*(ROOT / "docs" / "examples").iterdir(), *(ROOT / "examples").glob("*.py"))
TEMPLATES = (path for path in (ROOT / "templates").rglob("*.jinja"))
WHOLE = sorted((*PAGES, *EXAMPLES, *TEMPLATES, ROOT / "tests" / "bad" / "expected.txt"))
"""Files of which every line is read by users."""

COPIED = sorted((ROOT / "kinegen" / "runtime" / "vendored").glob("*.py"))
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


def plain(text: str) -> str:
    """A text without words in code style and without the marks of comments, in lines as before."""
    bare = re.sub(r"`[^`\n]*`", lambda code: "`" * len(code[0]), text)
    return re.sub(r"\n[ \t]*[*#/%]* ?(?=\S)", "\n", bare)


def field(path: Path, text: str) -> Iterator[tuple[int, str]]:
    """The words in a text that the field has other words for, with their lines."""
    if text in NAMES:
        return
    if path.suffix == ".md":
        text = re.sub(r"^ *```.*?^ *```$", lambda block: "\n" * block[0].count("\n"), text, flags=re.M | re.S)
        text = re.sub("^#+ prove$", "", text, flags=re.M)
    if path.suffix == ".jinja":
        text = re.sub(r"\{#.*?#\}", lambda remark: "\n" * remark[0].count("\n"), text, flags=re.S)
    lines = plain(text)
    line = lines.replace("\n", " ")
    if not _ANY.search(line):
        return
    for pattern, better in FIELD.items():
        for match in re.finditer(pattern, line, re.I):
            yield lines.count("\n", 0, match.start()) + 1, f"'{match[0]}' (write: {better})"
    if str(path.relative_to(ROOT)) in OF_PROOFS:
        return
    for match in re.finditer(PROOFS, line, re.I):
        if not re.search(PROVEN, line[max(match.start() - 120, 0) : match.end() + 120], re.I):
            yield lines.count("\n", 0, match.start()) + 1, f"'{match[0]}' (write: verify, check, unless it is one)"


def unusual(path: Path, text: str, first: int = 1) -> list[str]:
    """Words to be replaced by those of the field, with file and line."""
    return [f"{path.relative_to(ROOT)}:{line + first - 1}: {what}" for line, what in field(path, text)]


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


def _unusual(path: Path) -> list[str]:
    """The words to be replaced in a file: in its text, or in the texts of a module."""
    if path.suffix != ".py" or path in WHOLE:
        return unusual(path, path.read_text(encoding="utf-8"))
    texts = strings(path, docstrings=path in COPIED)
    return [line for number, text in texts for line in unusual(path, text, number)]


@pytest.mark.parametrize("path", [*WHOLE, *MODULES], ids=lambda path: str(path.relative_to(ROOT)))
def test_what_users_read_has_the_words_of_the_field(path: Path) -> None:
    found = _unusual(path)

    if str(path.relative_to(ROOT)) in UNCLEAN:
        assert found, "this file has the words of the field now: take it out of UNCLEAN"
    else:
        assert found == []


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(ROOT)))
def test_messages_are_in_plain_english(path: Path) -> None:
    texts = strings(path, docstrings=path in COPIED)

    assert [line for number, text in texts for line in found(path, text, number)] == []


BLANKS = re.compile(r"[A-Za-z][,;.:)']? {2,}(?=[\w'(]|$)")
"""Two blanks behind a word; columns and indents have theirs behind numbers or at the begin."""


def test_no_message_has_two_blanks_in_a_row() -> None:
    paths = (ROOT / "kinegen").rglob("*.py")
    texts = ((path, line, text) for path in paths for line, text in strings(path, docstrings=False))
    wrong = [f"{path}:{line}: {text}" for path, line, text in texts if BLANKS.search(text)]

    assert not wrong
    assert BLANKS.search("add base to --fit;  ")
    assert BLANKS.search("the  pose")


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


@pytest.mark.parametrize(
    "text",
    [
        "Joints that turn have limits.",
        "The six turning joints of\n * an arm.",
        "A target beyond the limits is refused.",
        "Axes 4 and 6 are in line.",
        "Each has an accepted difference of its own.",
        "It takes matplotlib.",
        "What the tip reaches is drawn.",
        "The build proves every kernel.",
        "The proof holds.",
    ],
)
def test_a_word_that_the_field_does_not_use_is_found(text: str) -> None:
    assert len(list(field(ROOT / "page.c", text))) == 1


@pytest.mark.parametrize(
    "text",
    [
        "The proven error bound of each function.",
        "`kinegen prove` lets Frama-C prove that there is no overflow.",
        "An angle beyond 1e5 rad gives NaN.",
        "In line 4 of the file.",
        "It takes joint vectors and half a minute.",
        "The reach of the end effector.",
    ],
)
def test_words_of_the_field_pass(text: str) -> None:
    assert list(field(ROOT / "page.c", text)) == []
