"""Messages about robot files: how a defect is raised, how a stranger's words are quoted, what was probably meant."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import NoReturn

from kinegen.errors import MAX_QUOTE, KinegenError, RobotFileError, did_you_mean
from kinegen.model.expression_parser import ExpressionError
from kinegen.support.naming import accept_printed

SYNONYMS = {
    "craig": "modified",
    "proximal": "modified",
    "mdh": "modified",
    "paul": "standard",
    "distal": "standard",
    "dh": "standard",
    "meter": "m",
    "metre": "m",
    "millimeter": "mm",
    "centimeter": "cm",
    "inch": "in",
    "degrees": "deg",
    "radians": "rad",
    "rotary": "revolute",
    "linear": "prismatic",
    "sliding": "prismatic",
    "helical": "screw",
    "mimic": "follower",
    "rotation": "rpy",
    "translation": "xyz",
    "links": "joints",
    "theta_offset": "offset",
    "joint_offset": "offset",
    "q_offset": "offset",
    "home": "offset",
    "qlim": "limits",
    "yes": "true",
    "no": "false",
    "on": "true",
    "off": "false",
}
"""Words that other tools and books use, for the hint in a message; no reader accepts them."""

WORKBOOKS = (b"PK\x03\x04", bytes.fromhex("d0cf11e0a1b11ae1"))
"""How files of spreadsheets begin: .xlsx and .ods, which are zip archives, and .xls."""

WORKBOOK_ENDINGS = (".xlsx", ".xlsm", ".xls", ".ods")
A_WORKBOOK = "this is a workbook of a spreadsheet, or an archive; save the sheet with the table as CSV and give that"


def fail(message: str, line: int | None = None) -> NoReturn:
    """Raise a defect; the file is filled in as the error rises."""
    raise RobotFileError(message, None, line)


@contextmanager
def within(where: str, line: int) -> Iterator[None]:
    """Put `where` in front of the message of every defect raised inside, and a line on those that have none."""
    try:
        yield
    except KinegenError as error:
        raise RobotFileError(f"{where}: {error.message}", None, error.line or line) from None
    except ExpressionError as error:
        raise RobotFileError(f"{where}: {error}", None, line) from None


def accept_name(kind: str, name: str, line: int) -> None:
    """Refuse a name that no output can use (see `kinegen.support.naming.accept_printed`)."""
    try:
        accept_printed(kind, name)
    except KinegenError as error:
        fail(error.message, line)


def refuse_twin(name: str, kind: str, others: Iterable[str]) -> None:
    """Refuse a name that differs from one of the others in case alone."""
    for other in others:
        if other.upper() == name.upper():
            fail(f"differs from {kind} '{other}' in upper and lower case only, which macros lose")


def expected(word: str, options: Iterable[str]) -> str:
    """`(expected a, b, c; did you mean b?)` for a word that is none of the options."""
    known = list(options)
    synonym = SYNONYMS.get(word.lower().removesuffix("s"), SYNONYMS.get(word.lower()))
    hint = f"; did you mean {synonym}?" if synonym in known else did_you_mean(word[:MAX_QUOTE], known)
    shown = known if len(known) <= 16 else [*known[:15], "..."]
    return f"(expected {', '.join(shown)}{hint})"
