"""What a terminal gets: colours where it has them, lines as wide as it is. Elsewhere all is plain text."""

from __future__ import annotations

import os
import re
import shutil
import sys
from collections.abc import Iterable
from contextlib import suppress
from typing import TextIO

import click

from kinegen import lines
from kinegen.errors import OutputError, shown

_CONTROL = re.compile("\x1b\\[[0-9;]*m|[^\\S\n\t ]|[\x00-\x08\x0b-\x1f\x7f-\x9f\u200e\u200f\u202a-\u202e\u2066-\u2069]")
"""Colours, and everything else that a terminal would not print but heed."""

WIDEST = 120
NARROWEST = 60


def say(text: str = "") -> None:
    """Print lines on stdout; colours are left out unless a terminal shows them, other control characters escaped.

    Raises:
        OutputError: If stdout takes no more, as on a full disk.
    """
    safe = _CONTROL.sub(lambda found: found[0] if found[0].startswith("\x1b[") else shown(found[0]), text)
    try:
        click.echo(safe, color=_has_colours(sys.stdout))
    except BrokenPipeError:
        raise
    except OSError as error:
        raise OutputError(f"cannot print: {error.strerror or error}") from error


def complain(text: str) -> None:
    """Print one line on stderr; whatever would make it more than a line is escaped."""
    with suppress(OSError):  # there is nowhere left to say so
        click.echo(shown(text), err=True)


def _has_colours(stream: TextIO) -> bool:
    # https://no-color.org: any value but the empty one.
    return stream.isatty() and not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb"


class Passing:
    """A line that says what is being done, and is gone when that is done; where no person looks on, nothing.

    Args:
        wanted: Whether there is anything to say at all.
    """

    def __init__(self, *, wanted: bool = True) -> None:
        seen = sys.stdout.isatty() and sys.stderr.isatty() and os.environ.get("TERM") != "dumb"
        self._shows = wanted and seen
        self._is_there = False

    def show(self, text: str) -> None:
        """Put a line in place of the last one."""
        if self._shows:
            self._write(f"\r\x1b[K  {shown(text)[: width() - 3]}")
            self._is_there = True

    def clear(self) -> None:
        """Remove the line, before anything else is printed."""
        if self._is_there:
            self._write("\r\x1b[K")
            self._is_there = False

    def _write(self, text: str) -> None:
        with suppress(OSError, ValueError):
            sys.stderr.write(text)
            sys.stderr.flush()


def strong(text: str) -> str:
    """A heading."""
    return click.style(text, bold=True)


def faint(text: str) -> str:
    """A detail."""
    return click.style(text, dim=True)


def good(text: str) -> str:
    """Something that holds."""
    return click.style(text, fg="green")


def bad(text: str) -> str:
    """Something that does not hold."""
    return click.style(text, fg="red", bold=True)


def width() -> int:
    """Columns to fill: those of the terminal or of COLUMNS, and 100 where neither says."""
    return max(NARROWEST, min(WIDEST, shutil.get_terminal_size((100, 24)).columns))


def filled(items: Iterable[str], indent: str) -> list[str]:
    """Items one after the other with commas between, in lines of the terminal's width."""
    return lines.filled(items, indent, width())
