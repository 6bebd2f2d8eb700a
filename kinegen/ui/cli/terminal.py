"""What a terminal gets, and Ctrl-C: colours and a line of progress where a person looks on, else plain text."""

from __future__ import annotations

import os
import re
import shutil
import signal
import sys
import threading
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from functools import cache
from types import FrameType
from typing import TextIO

import click

from kinegen.errors import OutputError, shown
from kinegen.support import text_layout

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


def with_references(text: str) -> str:
    """Return XML for stdout: what its encoding lacks becomes a reference to the character, which means the same."""
    encoding = getattr(sys.stdout, "encoding", None) or "utf-8"
    return text.encode(encoding, "xmlcharrefreplace").decode(encoding)


def mention(text: str = "") -> None:
    """Print lines as `say` does, where the work goes on even if nobody reads them any more, as behind `head`."""
    try:
        say(text)
    except BrokenPipeError:
        discard_output()


def discard_output() -> None:
    """Have stdout lead nowhere. Python flushes it once more at exit, and must not fail at it again."""
    with suppress(OSError, ValueError):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, sys.stdout.fileno())
        os.close(nowhere)


def complain(text: str) -> None:
    """Print one line on stderr; whatever would make it more than a line is escaped."""
    with suppress(OSError):  # there is nowhere left to say so
        click.echo(shown(text), err=True)


def _has_colours(stream: TextIO) -> bool:
    # https://no-color.org: any value but the empty one.
    return stream.isatty() and not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb"


class ProgressLine:
    """A line that says what is being done, and is gone when that is done; only if wanted, and seen by a person."""

    def __init__(self, *, wanted: bool = True) -> None:
        seen = sys.stderr.isatty() and os.environ.get("TERM") != "dumb"
        self._shows = wanted and seen
        self._is_there = False

    def show(self, text: str) -> None:
        """Put a line in place of the last one."""
        if self._shows:
            # Said beforehand: Ctrl-C may come as soon as the line is written.
            self._is_there = True
            self._write(f"\r\x1b[K  {shown(text)[: width() - 3]}")

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
    """Set off a heading."""
    return click.style(text, bold=True)


def faint(text: str) -> str:
    """Set back a detail."""
    return click.style(text, dim=True)


def good(text: str) -> str:
    """Mark something that holds."""
    return click.style(text, fg="green")


def bad(text: str) -> str:
    """Mark something that does not hold."""
    return click.style(text, fg="red", bold=True)


def width() -> int:
    """Return columns to fill: those of the terminal or of COLUMNS, and 100 where neither says."""
    return max(NARROWEST, min(WIDEST, shutil.get_terminal_size((100, 24)).columns))


def filled(items: Iterable[str], indent: str) -> list[str]:
    """Return items one after the other with commas between, in lines of the terminal's width."""
    return text_layout.filled(items, indent, width())


_pressed = threading.Event()


@contextmanager
def remembering() -> Iterator[None]:
    """Remember Ctrl-C while a command runs; it is raised as ever. Where signals go elsewhere, nothing is changed.

    Python raises it wherever the program happens to be. Some libraries catch every exception in places, and a build
    would go on as if nothing had been pressed; so it is looked at between stages.
    """
    _pressed.clear()
    ours = threading.current_thread() is threading.main_thread()
    if not ours or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield
        return
    signal.signal(signal.SIGINT, _press)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def raise_if_pressed() -> None:
    """Raise KeyboardInterrupt if Ctrl-C was pressed since the command began, and a library swallowed it."""
    if _pressed.is_set():
        raise KeyboardInterrupt


def _press(number: int, frame: FrameType | None) -> None:
    _pressed.set()
    signal.default_int_handler(number, frame)


@cache
def warn_of_cache() -> None:
    """Say once why the user's cache folder is not used, if it is not."""
    from kinegen.runtime.cache import Cache

    if refusal := Cache().refusal:
        complain(f"warning: {refusal}")
