"""The errors that kinegen reports to a person.

Every one is a `KinegenError`; the command line prints it as one line, `file:line: message`, and exits with status 1.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

MAX_QUOTE = 40
MAX_MESSAGE = 500


def shown(text: object) -> str:
    """Return a name from outside as one line that is safe on a terminal: what does not print is escaped."""
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in str(text))


def printable(text: str) -> str:
    """Return text that is safe on a terminal: one line, of bounded length, other characters escaped."""
    safe = shown(text)
    return safe if len(safe) <= MAX_MESSAGE else safe[: MAX_MESSAGE - 3] + "..."


def quote(text: str) -> str:
    """Return a stranger's word in quotation marks, cut if it is long."""
    cut = text if len(text) <= MAX_QUOTE else text[: MAX_QUOTE - 3] + "..."
    return f"'{printable(cut)}'"


def nearest(word: str, known: Iterable[str]) -> str:
    """Return the known word that another one resembles; empty if none does."""
    import difflib  # only where there is an error

    return next(iter(difflib.get_close_matches(word, list(known), 1)), "")


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """Return `; did you mean b?` behind a list of known words; empty if none resembles this one."""
    near = nearest(word, known)
    return f"; did you mean {near}?" if near else ""


def listed(words: Sequence[str]) -> str:
    """Return `a`, `a and b`, `a, b and c`; empty for no words."""
    return " and ".join((", ".join(words[:-1]), words[-1]) if len(words) > 1 else words)


class KinegenError(Exception):
    """Something a user can mend: a robot file, a folder, a compiler.

    Args:
        message: What is wrong and what would be right, in one line.
        path: File in which it was found, as the user named it.
        line: Line in that file, counted from 1.

    Example:
        >>> import kinegen
        >>> try:
        ...     kinegen.load("robots/none.yaml")
        ... except kinegen.KinegenError as error:
        ...     print(error.path, error.line, error.message.split(" (")[0])
        robots/none.yaml None there is no such file
    """

    def __init__(self, message: str, path: str | None = None, line: int | None = None) -> None:
        super().__init__(message)
        self.message = message
        self.path = path
        self.line = line

    def __str__(self) -> str:
        place = ":".join(str(part) for part in (self.path, self.line) if part is not None)
        return f"{place}: {self.message}" if place else self.message


class RobotFileError(KinegenError):
    """A robot file cannot be read or does not describe a robot."""


class CompileError(KinegenError):
    """The C compiler is missing or refused the emitted code."""


class MissingToolError(CompileError):
    """Something that compiling needs is not installed; the NumPy kernels work without it."""


class WriteError(KinegenError):
    """An output could not be written; the earlier output is untouched."""


class OutputError(KinegenError):
    """What a command has to say cannot be printed."""


class ProofError(KinegenError):
    """A kernel differs from the reference by more than its tolerance."""
