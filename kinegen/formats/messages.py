"""Messages about robot files: how a defect is raised, how a stranger's words are quoted, what was probably meant."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import NoReturn

from kinegen.errors import MAX_QUOTE, KinegenError, RobotFileError
from kinegen.naming import check_name
from kinegen.robot.expressions import ExpressionError

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
    """Refuse a name that no output can use (see `kinegen.naming.check_name`)."""
    try:
        check_name(kind, name)
    except KinegenError as error:
        fail(error.message, line)


def expected(word: str, options: Iterable[str]) -> str:
    """`(expected a, b, c; did you mean b?)` for a word that is none of the options."""
    known = list(options)
    synonym = SYNONYMS.get(word.lower().removesuffix("s"), SYNONYMS.get(word.lower()))
    near = [synonym] if synonym in known else difflib.get_close_matches(word[:MAX_QUOTE], known, n=1)
    shown = known if len(known) <= 16 else [*known[:15], "..."]
    return f"(expected {', '.join(shown)}{f'; did you mean {near[0]}?' if near else ''})"
